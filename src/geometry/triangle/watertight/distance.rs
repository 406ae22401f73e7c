//! Where along its ray a hit lies.
//!
//! The paper weights the corners' depths with the edge functions, whose errors grow with the
//! triangle: on the sides of a square of 900 m `t` was off by up to 5 mm two metres from the ray's
//! origin, and the weights of a sliver are mostly noise. Here `t` is where the ray meets the
//! triangle's plane, with a normal from double precision that the triangle's record keeps.
//!
//! **What is guaranteed.** The point `origin + t * direction` is within some 16 roundings (of the
//! greatest distance between origin and corner) of a point *of the triangle*, so it lies in a cell,
//! walls included, that lists the triangle: a walk that looks at cells in any order finds the same
//! closest hit. For a plane met squarely that follows from the rounding of `t`. A ray that grazes
//! the plane moves far along it while it comes nearer by one rounding, so `t` alone may lie far
//! outside of the triangle's edges, and is clipped to them there: a ray in the plane but for rounding
//! hits where it enters the triangle. Last, `t` is kept between the corners' depths.

use super::Shear;
use crate::geometry::triangle::{Corners, Lanes3, Triangle, normal_in_double};
use crate::simd::{Lanes, Mask};
use glam::DVec3;

/// A ray whose cosine with the normal is less than about this grazes the plane.
pub(super) const GRAZING: f32 = 0.25;

/// How far beyond an edge a ray may pass a triangle that it hits, relative to the farthest corner:
/// sheared coordinates are off by up to six roundings, and what is computed here by about as many.
const SLACK: f32 = 16.0 / (1 << 24) as f32;

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// `t` of the lanes in `inside`; `depths` are the corners' along the rays' greatest axes.
    #[inline(always)]
    pub(super) fn distance(&self, triangle: &Triangle, inside: L::Mask, depths: &Lanes3<L>) -> L {
        let Triangle { corners, plane } = triangle;
        let (t, speed) =
            if *plane == [0.0; 3] { self.meet_line(corners) } else { self.meet_plane(*plane, &corners[0]) };
        let t = self.clip_grazing(corners, inside, t, speed);

        let [az, bz, cz] = *depths;
        let scale = self.shear[2];
        let (az, bz, cz) = (scale * az, scale * bz, scale * cz);
        let (nearest, farthest) = (az.min(bz).min(cz), az.max(bz).max(cz));
        t.max(nearest).min(farthest)
    }

    /// Where the rays meet a plane, and their speed along its normal.
    #[inline(always)]
    fn meet_plane(&self, normal: [f32; 3], point: &[f32; 3]) -> (L, L) {
        let normal = self.splat_renamed(&normal);
        let ([nx, ny, nz], [px, py, pz]) = (normal, self.translated(point));
        self.meet(&normal, nx * px + ny * py + nz * pz)
    }

    /// The same for a plane at a height along its normal, renamed, from the origins.
    #[inline(always)]
    pub(super) fn meet(&self, [nx, ny, nz]: &Lanes3<L>, height: L) -> (L, L) {
        let [dx, dy, dz] = self.direction;
        let speed = *nx * dx + *ny * dy + *nz * dz;
        (height / speed, speed)
    }

    /// Clips `t` where rays graze the plane: where the speed along its normal is small beside that along
    /// the greatest axis, or is none (a NaN).
    #[inline(always)]
    pub(super) fn clip_grazing(&self, corners: &Corners, inside: L::Mask, t: L, speed: L) -> L {
        let least = L::splat(GRAZING) * self.direction[2].abs();
        let grazing = inside & !least.le(speed.abs());
        if grazing.any() { L::select(grazing, self.clip(corners, t), t) } else { t }
    }

    /// Where the rays pass a triangle that is no more than a line. (It has to be hit: neighbours on
    /// either side of it see its corners moved by roundings, and it fills what opens between them.)
    #[inline(always)]
    fn meet_line(&self, corners: &Corners) -> (L, L) {
        // Of two planes that hold the line, each lane takes the one it meets more steeply.
        let [p0, p1, p2] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
        let (e, f) = (p1 - p0, p2 - p0);
        let along = if e.length_squared() > f.length_squared() { e } else { f };
        let (one, other) = along.normalize_or(DVec3::X).any_orthonormal_pair();
        let (t, slow) = self.meet_plane(one.as_vec3().to_array(), &corners[0]);
        let (u, fast) = self.meet_plane(other.as_vec3().to_array(), &corners[0]);
        let better = slow.abs().lt(fast.abs());
        (L::select(better, u, t), L::select(better, fast, slow))
    }

    /// Moves `t` to where the rays are between the planes that stand on the triangle's edges.
    #[inline(always)]
    fn clip(&self, corners: &Corners, t: L) -> L {
        let normal = normal_in_double(corners);
        let points =
            [self.translated(&corners[0]), self.translated(&corners[1]), self.translated(&corners[2])];
        let mut far = L::splat(0.0);
        for [x, y, z] in points {
            far = far.max(x.abs()).max(y.abs()).max(z.abs());
        }
        let slack = far * L::splat(SLACK);

        let zero = L::splat(0.0);
        let (mut first, mut last) = (L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY));
        for i in 0..3 {
            let edge = DVec3::from_array(
                [0, 1, 2].map(|axis| f64::from(corners[(i + 1) % 3][axis]) - f64::from(corners[i][axis])),
            );
            let inward = normal.cross(edge);
            let size = inward.abs().max_element();
            if size == 0.0 {
                continue;
            }
            // Inside is where inward . (direction * t - point) >= -slack.
            let [mx, my, mz] = self.splat_renamed(&(inward / size).as_vec3().to_array());
            let ([px, py, pz], [dx, dy, dz]) = (points[i], self.direction);
            let width = slack * (mx.abs() + my.abs() + mz.abs());
            let speed = mx * dx + my * dy + mz * dz;
            let crossing = (mx * px + my * py + mz * pz - width) / speed;
            first = L::select(zero.lt(speed), crossing.max(first), first);
            last = L::select(speed.lt(zero), crossing.min(last), last);
        }
        t.max(first).min(last)
    }
}
