//! The fast ray-triangle test: meet the plane, then look where.
//!
//! After Wald ("Realtime Ray Tracing and Interactive Global Illumination", 2004, chapter 7) and
//! Baldwin & Weber ("Fast Ray-Triangle Intersections by Coordinate Transformation", JCGT 5(3),
//! 2016): everything that depends on the triangle alone is computed beforehand, and the test works
//! in the two coordinates that the plane is least steep in. Two things differ from both, because
//! they cost nothing and bound the error by some ulps of the *distance*, whatever the shape of the
//! triangle and wherever it lies:
//!
//! - positions are taken relative to a corner, not to the coordinates' origin;
//! - that corner is the one opposite the longest edge. Its weight is what is left over from the
//!   other two, so their errors add up in it; and its height is the least, so that they move the
//!   edge the least.
//!
//! What is given up is agreement between neighbours: each side of a shared edge is decided from its
//! own numbers, so a ray may slip between the two, or hit both.

use super::{Candidate, Corners, Lanes3, RENAMED, Test, normal_in_double};
use crate::simd::Lanes;
use glam::{DVec3, Vec3};

/// A triangle made ready: 40 bytes. "Renamed" coordinates are `RENAMED[axis]`.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Projected {
    /// The corner opposite the longest edge, renamed.
    corner: [f32; 3],
    /// The plane's normal in the first two renamed coordinates; in the third it is 1.
    plane: [f32; 2],
    /// The weight of the next corner, from the first two renamed coordinates relative to `corner`.
    u: [f32; 2],
    /// The weight of the corner after that.
    v: [f32; 2],
    /// The axis in which the normal is greatest.
    axis: u16,
    /// Which of the triangle's corners `corner` is.
    first: u16,
}

impl Projected {
    /// Prepares a triangle. One without area gets NaNs, so that it is never hit.
    pub fn new(corners: &Corners) -> Self {
        let points = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
        let opposite = |i: usize| (points[(i + 2) % 3] - points[(i + 1) % 3]).length_squared();
        let first = (1..3).fold(0, |best, i| if opposite(i) > opposite(best) { i } else { best });
        let [p0, p1, p2] = [0, 1, 2].map(|i| points[(first + i) % 3]);

        let normal = normal_in_double(corners);
        let size = normal.abs();
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        let [i, j, k] = RENAMED[axis];
        let n: DVec3 = normal / normal[k];
        let (e1, e2) = ((p1 - p0) / normal[k], (p2 - p0) / normal[k]);
        Self {
            corner: [i, j, k].map(|c| p0[c] as f32),
            plane: [n[i] as f32, n[j] as f32],
            u: [e2[j] as f32, -e2[i] as f32],
            v: [-e1[j] as f32, e1[i] as f32],
            axis: axis as u16,
            first: first as u16,
        }
    }
}

/// `W` rays as they came: there is nothing to prepare.
#[derive(Clone, Copy)]
pub struct Lines<const W: usize, L: Lanes<W>> {
    origin: Lanes3<L>,
    direction: Lanes3<L>,
}

impl<const W: usize, L: Lanes<W>> Test<W, L> for Lines<W, L> {
    type Record = Projected;

    #[inline(always)]
    fn new(origin: &Lanes3<L>, direction: &Lanes3<L>, _active: u32) -> Self {
        Self { origin: *origin, direction: *direction }
    }

    #[inline(always)]
    fn test(&self, triangle: &Projected, _lanes: L::Mask) -> Candidate<W, L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let [i, j, k] = RENAMED[usize::from(triangle.axis)];
        let [di, dj, dk] = [self.direction[i], self.direction[j], self.direction[k]];

        // The origin relative to the corner.
        let oi = self.origin[i] - L::splat(triangle.corner[0]);
        let oj = self.origin[j] - L::splat(triangle.corner[1]);
        let ok = self.origin[k] - L::splat(triangle.corner[2]);

        // Where the ray meets the plane. Parallel to it, t is infinite or NaN, and so no weight
        // comes out between 0 and 1.
        let [ni, nj] = [L::splat(triangle.plane[0]), L::splat(triangle.plane[1])];
        let height = ni * oi + nj * oj + ok;
        let speed = ni * di + nj * dj + dk;
        let t = (zero - height) / speed;

        // Where in the triangle that is.
        let (x, y) = (oi + t * di, oj + t * dj);
        let u = L::splat(triangle.u[0]) * x + L::splat(triangle.u[1]) * y;
        let v = L::splat(triangle.v[0]) * x + L::splat(triangle.v[1]) * y;
        let inside = zero.le(u) & zero.le(v) & (u + v).le(one);
        Candidate { inside, t, u, v }
    }

    #[inline(always)]
    fn weights(triangle: &Projected, u: f32, v: f32) -> [f32; 2] {
        // The record's corners are the triangle's from `first` on, in turn.
        let rest = 1.0 - (u + v);
        match triangle.first {
            0 => [u, v],
            1 => [rest, u],
            _ => [v, rest],
        }
    }
}
