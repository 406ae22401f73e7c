//! The test of a beam's rays: what they can share of a triangle is worked out once.
//!
//! Rays from one point see a triangle's edges as three functions that are linear in their shears, so
//! that two operations tell on which side of an edge a ray passes, and an error bound whether that is
//! certain. Where it is for all rays, only `t` is left to do; the weights are asked for at the very end,
//! for the triangles that were hit in the end. Where a ray passes an edge too near to say, the test
//! proper decides. So the answers are that one's, bit for bit.

use super::distance::FLAT;
use crate::geometry::triangle::{Candidate, Lanes3, Placed};
use crate::simd::{Lanes, Mask};

/// The test without weights, of rays with these shears and directions (renamed), against the triangle `which` of
/// those placed. `None` where it is not certain for all.
#[inline(always)]
pub(super) fn test_beam<const W: usize, L: Lanes<W>>(
    [sx, sy, scale]: &Lanes3<L>,
    [dx, dy, dz]: &Lanes3<L>,
    placed: &Placed,
    which: usize,
    lanes: L::Mask,
) -> Option<Candidate<W, L>> {
    // On which sides of the edges the rays pass.
    let which = which & 15;
    let a = placed.side(which, 0, *sx, *sy);
    let b = placed.side(which, 1, *sx, *sy);
    let c = placed.side(which, 2, *sx, *sy);
    let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
    let slack = placed.slack[which];
    let (above, below) = (L::splat(slack), L::splat(-slack));
    let inside = lanes & !(least.lt(below) & above.lt(greatest));
    if !inside.any() {
        return Some(Candidate::none(inside));
    }
    let certain = above.lt(least) | greatest.lt(below);

    // Where they meet the plane, as the test proper finds it.
    let [nx, ny, nz] = &placed.normal;
    let speed = L::splat(nx[which]) * *dx + L::splat(ny[which]) * *dy + L::splat(nz[which]) * *dz;
    let steep = (L::splat(FLAT) * dz.abs()).le(speed.abs());
    if (inside & !(certain & steep)).any() {
        return None;
    }
    let t = L::splat(placed.height[which]) / speed;
    let [one, other] = &placed.depths;
    let [one, other] = [*scale * L::splat(one[which]), *scale * L::splat(other[which])];
    let t = t.max(one.min(other)).min(one.max(other));
    let zero = L::splat(0.0);
    Some(Candidate { inside, t, u: zero, v: zero })
}
