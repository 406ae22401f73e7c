//! One ray against eight triangles at once.
//!
//! Lanes hold triangles instead of rays. What is computed in a lane is what the test of one triangle computes,
//! operation by operation, so it has the same bits.

use super::{Shear, likely};
use crate::geometry::triangle::{Alone, Lanes3, RENAMED, Triangle};
use crate::simd::{Eight, Mask};

impl Shear<1, f32> {
    /// The corners of eight triangles sheared, with coordinates renamed: `[corner][coordinate]`.
    #[inline(always)]
    fn sheared_eight<L: Eight>(&self, triangles: &[&Triangle; 8]) -> [Lanes3<L>; 3] {
        let [i, j, k] = RENAMED[self.major.unwrap_or(2)].map(|axis| axis as i32);
        // A four holds one coordinate more than a corner has: of the next corner, or of the one before.
        let places = [
            L::ids_load(&[i, j, k, 3, i, j, k, 3]),
            L::ids_load(&[i + 1, j + 1, k + 1, 0, i + 1, j + 1, k + 1, 0]),
        ];
        let mut corners = [[L::splat(0.0); 3]; 3];
        for (corner, first) in [0, 3, 5].into_iter().enumerate() {
            let mut rows = [L::splat(0.0); 4];
            for (row, pair) in rows.iter_mut().enumerate() {
                *pair = L::of_fours([four(triangles[row], first), four(triangles[row + 4], first)])
                    .pick_in_fours(places[corner / 2]);
            }
            let [x, y, z, _] = L::transpose_fours(rows);
            let [ox, oy, oz] = self.origin;
            let [sx, sy, _] = self.shear;
            let (x, y, z) = (x - L::splat(ox), y - L::splat(oy), z - L::splat(oz));
            corners[corner] = [x - L::splat(sx) * z, y - L::splat(sy) * z, z];
        }
        corners
    }

    /// [`Shear::likely`] of eight triangles.
    #[inline(always)]
    pub(crate) fn likely_of_eight<L: Eight>(&self, triangles: &[&Triangle; 8]) -> u32 {
        likely(self.sheared_eight::<L>(triangles)).bits()
    }
}

/// Four coordinates of a triangle from `first` on.
#[inline(always)]
fn four(triangle: &Triangle, first: usize) -> &[f32; 4] {
    triangle.corners.as_flattened()[first..].first_chunk().expect("nine coordinates")
}

impl Alone for Shear<1, f32> {
    #[inline(always)]
    fn sift<L: Eight>(&self, triangles: &[&Triangle; 8], tnear: f32, tfar: f32) -> u32 {
        let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = self.sheared_eight::<L>(triangles);
        let a = cx * by - cy * bx;
        let b = ax * cy - ay * cx;
        let c = bx * ay - by * ax;
        let zero = L::splat(0.0);
        let outside = a.min(b).min(c).lt(zero) & zero.lt(a.max(b).max(c));

        // `t` is kept between these.
        let scale = L::splat(self.shear[2]);
        let (az, bz, cz) = (scale * az, scale * bz, scale * cz);
        let (nearest, farthest) = (az.min(bz).min(cz), az.max(bz).max(cz));
        (!outside & nearest.le(L::splat(tfar)) & L::splat(tnear).le(farthest)).bits()
    }
}
