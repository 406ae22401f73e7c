//! The test of a beam's rays: what they can share of a triangle is worked out once.
//!
//! Rays from one point see a triangle's edges as three functions that are linear in their shears, so
//! that two operations tell on which side of an edge a ray passes, and an error bound whether that is
//! certain. Where it is for all rays, only `t` is left to do; the weights are asked for at the very end,
//! for the triangles that were hit in the end. Where a ray passes an edge too near to say, the test
//! proper decides. So the answers are that one's, bit for bit.

use super::Shear;
use crate::geometry::triangle::{Candidate, Corners, RENAMED, Triangle};
use crate::simd::{Lanes, Mask};

/// A triangle as seen from a beam's apex. Coordinates are `RENAMED[axis]` but for the corners.
#[derive(Clone, Copy, Default)]
pub struct Placed {
    /// Relative to the apex.
    pub(super) corners: Corners,
    /// Coefficients of the edges' functions of `(sx, sy, 1)`.
    edges: [[f32; 3]; 3],
    /// What the functions may be off by: infinite for a triangle without area.
    slack: f32,
    normal: [f32; 3],
    /// `normal . corner`, of any corner.
    height: f32,
    /// Least and greatest z of the corners.
    depths: [f32; 2],
}

impl Placed {
    /// Prepares a triangle. `edges` are the edges' functions over the slopes of rays that run along
    /// `axis`, up if `sign` is 1 and down if it is -1, and their slacks.
    #[inline(always)]
    pub fn new(triangle: &Triangle, apex: &[f32; 3], axis: usize, sign: f32, edges: &[[f32; 4]; 3]) -> Self {
        let mut corners = triangle.corners;
        for corner in &mut corners {
            for axis in 0..3 {
                corner[axis] -= apex[axis];
            }
        }
        let [i, j, k] = RENAMED[axis];
        let normal = [triangle.plane[i], triangle.plane[j], triangle.plane[k]];
        let flat = normal == [0.0; 3];
        let [p, q, r] = &corners;
        let (least, greatest) = (p[k].min(q[k]).min(r[k]), p[k].max(q[k]).max(r[k]));
        Self {
            // A slope is the shear times the sign.
            edges: edges.map(|[x, y, z, _]| [x * sign, y * sign, z]),
            slack: if flat { f32::INFINITY } else { edges[0][3].max(edges[1][3]).max(edges[2][3]) },
            normal,
            // In the order of `meet_plane`.
            height: normal[0] * p[i] + normal[1] * p[j] + normal[2] * p[k],
            depths: [least, greatest],
            corners,
        }
    }
}

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// The test without weights.
    #[inline(always)]
    pub(super) fn test_beam(&self, triangle: &Triangle, placed: &Placed, lanes: L::Mask) -> Candidate<W, L> {
        // On which sides of the edges the rays pass.
        let [sx, sy, scale] = self.shear;
        let (mut least, mut greatest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for [x, y, z] in &placed.edges {
            let edge = L::splat(*x).mul_add(sx, L::splat(*y).mul_add(sy, L::splat(*z)));
            least = least.min(edge);
            greatest = greatest.max(edge);
        }
        let (above, below) = (L::splat(placed.slack), L::splat(-placed.slack));
        let inside = lanes & !(least.lt(below) & above.lt(greatest));
        if !inside.any() {
            return Candidate::none(inside);
        }
        let certain = above.lt(least) | greatest.lt(below);
        if (inside & !certain).any() {
            let [a, b, c] = &placed.corners;
            let [a, b, c] = [self.splat_renamed(a), self.splat_renamed(b), self.splat_renamed(c)];
            return self.decide(triangle, [self.shear(a), self.shear(b), self.shear(c)], lanes);
        }

        let (t, speed) = self.meet(&placed.normal.map(L::splat), L::splat(placed.height));
        let t = self.clip_grazing(&triangle.corners, inside, t, speed);
        let [one, other] = [scale * L::splat(placed.depths[0]), scale * L::splat(placed.depths[1])];
        let t = t.max(one.min(other)).min(one.max(other));
        let zero = L::splat(0.0);
        Candidate { inside, t, u: zero, v: zero }
    }
}
