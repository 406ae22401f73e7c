//! One ray against eight triangles at once.
//!
//! Most triangles that a ray meets in a leaf it does not hit, and that shows in their corners: so here eight are
//! sifted, and the test of one triangle is asked about the few that are left.
//!
//! A lane holds a *corner*. A triangle's row of coordinates of one axis is read as it lies in memory, four triangles'
//! rows side by side, and nothing is moved but for the three corners of each triangle, once, in turn:
//!
//! ```text
//!              lanes  0    1    2    3    4    5    6    7     ...
//!                   +----+----+----+----+----+----+----+----+
//! corners           | p0 | p1 | p2 |    | q0 | q1 | q2 |    |      lane 3 of each four is not looked at
//! the next corner   | p1 | p2 | p0 |    | q1 | q2 | q0 |    |
//! edge functions    | c  | a  | b  |    | c  | a  | b  |    |      each opposite to the third corner
//!                   +----+----+----+----+----+----+----+----+
//! ```
//!
//! What is computed in a lane is what the test of one triangle computes, operation by operation, so it has the same
//! bits, and no triangle is lost.

use super::{Shear, likely, pairs};
use crate::geometry::triangle::{Alone, Finds, Lanes3, RENAMED, Triangle};
use crate::simd::{Eight, Mask, Simd, Sixteen};

/// Bits of the corners of four triangles, four bits for each: those whose edge function is negative, and positive;
/// those that the ray may come to before its end, and after its beginning.
type Signs = [u32; 4];

impl Shear<1, f32> {
    /// The rows of renamed coordinates.
    #[inline(always)]
    pub(super) fn axes(&self) -> [usize; 3] {
        let [i, j, k] = RENAMED[self.major.unwrap_or(2)];
        // (For rows to be found without a check.)
        [i.min(2), j.min(2), k.min(2)]
    }

    /// What tells of four triangles whether they may be hit.
    #[inline(always)]
    fn signs<L: Sixteen>(&self, triangles: [&Triangle; 4], tnear: f32, tfar: f32) -> Signs {
        let [i, j, k] = self.axes();
        let [a, b, c, d] =
            [triangles[0].rows(), triangles[1].rows(), triangles[2].rows(), triangles[3].rows()];
        let x = L::side_by_side([&a[i], &b[i], &c[i], &d[i]]) - L::splat(self.origin[0]);
        let y = L::side_by_side([&a[j], &b[j], &c[j], &d[j]]) - L::splat(self.origin[1]);
        let z = L::side_by_side([&a[k], &b[k], &c[k], &d[k]]) - L::splat(self.origin[2]);
        let (x, y) = (x - L::splat(self.shear[0]) * z, y - L::splat(self.shear[1]) * z);

        // As in `edge_functions`.
        let edge = x.turn_threes() * y - y.turn_threes() * x;
        let zero = L::splat(0.0);
        // As in `distance`, where `t` is kept between these.
        let depth = L::splat(self.shear[2]) * z;
        [
            edge.lt(zero).bits(),
            zero.lt(edge).bits(),
            depth.le(L::splat(tfar)).bits(),
            L::splat(tnear).le(depth).bits(),
        ]
    }

    /// [`Shear::likely`] of eight triangles, a lane each.
    #[inline(always)]
    pub(crate) fn likely_of_eight<L: Eight>(&self, triangles: &[&Triangle; 8]) -> u32 {
        let mut corners = [[L::splat(0.0); 3]; 3];
        for (place, axis) in self.axes().into_iter().enumerate() {
            let mut rows = [L::splat(0.0); 4];
            for (row, pair) in rows.iter_mut().enumerate() {
                *pair = L::of_fours([&triangles[row].rows()[axis], &triangles[row + 4].rows()[axis]]);
            }
            let columns = L::transpose_fours(rows);
            for corner in 0..3 {
                corners[corner][place] = columns[corner] - L::splat(self.origin[place]);
            }
        }
        let [p0, p1, p2] = corners;
        likely([self.shear_eight(p0), self.shear_eight(p1), self.shear_eight(p2)]).bits()
    }

    /// Eight translated points with x and y sheared so that the ray runs along z.
    #[inline(always)]
    fn shear_eight<L: Eight>(&self, [x, y, z]: Lanes3<L>) -> Lanes3<L> {
        let [sx, sy, _] = self.shear;
        [x - L::splat(sx) * z, y - L::splat(sy) * z, z]
    }
}

impl Alone for Shear<1, f32> {
    #[inline(always)]
    fn sift<S: Simd>(&self, triangles: &[&Triangle; 8], tnear: f32, tfar: f32) -> u32 {
        let [a, b, c, d, e, f, g, h] = *triangles;
        let low = self.signs::<S::F16>([a, b, c, d], tnear, tfar);
        let high = self.signs::<S::F16>([e, f, g, h], tnear, tfar);
        let both = |i: usize| (low[i] & 0xffff) | high[i] << 16;
        first_of_fours(may_be_hit([both(0), both(1), both(2), both(3)]))
    }

    #[inline(always)]
    fn sift_four<S: Simd>(&self, triangles: &[&Triangle; 4], tnear: f32, tfar: f32) -> u32 {
        first_of_fours(may_be_hit(self.signs::<S::F16>(*triangles, tnear, tfar)) & 0xffff)
    }

    #[inline(always)]
    fn test_eight<L: Eight>(rays: &[&Self; 8], triangles: &[&Triangle; 8]) -> Finds {
        pairs::test::<L>(rays, triangles)
    }
}

/// In bit 0 of each four bits: whether that triangle may be hit. Zeros are of either sign, as the test may find them to
/// be.
#[inline(always)]
const fn may_be_hit([negative, positive, begun, left]: Signs) -> u32 {
    let is_outside = of_any_corner(negative) & of_any_corner(positive);
    of_any_corner(begun) & of_any_corner(left) & !is_outside
}

/// In bit 0 of each four bits: whether any of the first three is set.
#[inline(always)]
const fn of_any_corner(bits: u32) -> u32 {
    bits | bits >> 1 | bits >> 2
}

/// Bit 0 of each four bits.
#[inline(always)]
const fn first_of_fours(bits: u32) -> u32 {
    let bits = bits & 0x1111_1111;
    let bits = (bits | bits >> 3) & 0x0303_0303;
    let bits = (bits | bits >> 6) & 0x000f_000f;
    (bits | bits >> 12) & 0xff
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangle::{Corners, Test};
    use crate::simd::{Chosen, Isa, Task};
    use proptest::prelude::*;

    struct Sift<'a>(&'a Shear<1, f32>, &'a [&'a Triangle; 8], [f32; 2]);

    impl Task for Sift<'_> {
        type Output = [u32; 2];

        #[inline(always)]
        fn run<S: Simd>(self) -> [u32; 2] {
            let Self(ray, triangles, [tnear, tfar]) = self;
            let (first, last) = (triangles.first_chunk().unwrap(), triangles.last_chunk().unwrap());
            let fours = ray.sift_four::<S>(first, tnear, tfar) | ray.sift_four::<S>(last, tnear, tfar) << 4;
            assert_eq!(fours, ray.sift::<S>(triangles, tnear, tfar), "four by four");
            [ray.sift::<S>(triangles, tnear, tfar), ray.likely_of_eight::<S::F8>(triangles) & 0xff]
        }
    }

    /// Sifts on every instruction set; says which triangles are left, and which are hit.
    fn check(origin: [f32; 3], direction: [f32; 3], corners: &[Corners; 8], ends: [f32; 2]) -> [u32; 2] {
        let triangles = corners.map(Triangle::new);
        let triangles = triangles.each_ref();
        let ray = Shear::<1, f32>::new(&origin, &direction, 1);
        let mut hits = 0;
        // What one triangle alone says of its corners.
        let (mut wanted, mut likely) = (0, 0);
        for (lane, triangle) in triangles.iter().enumerate() {
            let one = ray.test(triangle, true);
            hits |= u32::from(one.inside && ends[0] <= one.t && one.t <= ends[1]) << lane;
            let corners @ [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = ray.sheared(triangle);
            let edges = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
            let is_outside = edges.iter().any(|&edge| edge < 0.0) && edges.iter().any(|&edge| edge > 0.0);
            let depths = [az, bz, cz].map(|z| ray.shear[2] * z);
            let is_between = depths.iter().any(|&t| t <= ends[1]) && depths.iter().any(|&t| ends[0] <= t);
            wanted |= u32::from(is_between && !is_outside) << lane;
            likely |= u32::from(super::likely(corners)) << lane;
        }
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            assert_eq!(chosen.run(Sift(&ray, &triangles, ends)), [wanted, likely], "{isa}, {corners:?}");
        }
        assert_eq!(hits & !wanted, 0, "a hit is lost: {corners:?}");
        [wanted, hits]
    }

    const FAR: [f32; 2] = [0.0, f32::MAX];

    #[test]
    fn what_may_be_hit_is_left() {
        let across = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]];
        let beside = across.map(|[x, y, z]| [x + 5.0, y, z]);
        let on_an_edge = across.map(|[x, y, z]| [x, y + 1.0, z]);
        let on_a_corner = across.map(|[x, y, z]| [x, y - 1.0, z]);
        let edge_on = [[0.0, -1.0, 1.0], [0.0, -1.0, 3.0], [0.0, 1.0, 2.0]];
        let line = [[-1.0, -1.0, 2.0], [0.0, 0.0, 2.0], [1.0, 1.0, 2.0]];
        let behind = across.map(|[x, y, z]| [x, y, -z]);
        let slanted = [[-1.0, -1.0, 1.0], [1.0, -1.0, 1.0], [0.0, 1.0, 9.0]];
        let eight = [across, beside, on_an_edge, on_a_corner, edge_on, line, behind, slanted];
        let up = [0.0, 0.0, 1.0];
        assert_eq!(check([0.0; 3], up, &eight, FAR), [0b1011_1101, 0b1000_1101]);
        // Between depths that the slanted one reaches, but not where the ray meets it.
        assert_eq!(check([0.0; 3], up, &eight, [0.0, 1.5]), [0b1001_0000, 0]);
        assert_eq!(check([0.0; 3], up, &eight, [2.5, 3.0]), [0b1001_0000, 0]);
        // A ray that is none hits nothing, whoever is asked.
        assert_eq!(check([0.0; 3], [f32::NAN, 0.0, 1.0], &eight, FAR)[1], 0);
    }

    #[test]
    fn bits_come_together() {
        for bits in 0..256 {
            let apart = (0..8).fold(0, |apart, i| apart | (bits >> i & 1) << (4 * i));
            assert_eq!(first_of_fours(apart | 0xeeee_eeee), bits);
            assert_eq!(of_any_corner(apart << 2) & 0x1111_1111, apart);
        }
        assert_eq!(of_any_corner(0x8888_8888) & 0x1111_1111, 0, "the fourth is no corner");
    }

    proptest! {
        #[test]
        fn no_hit_is_lost(
            numbers in proptest::array::uniform32(-1.0f32..1.0),
            more in proptest::array::uniform32(-1.0f32..1.0),
            last in proptest::array::uniform14(-1.0f32..1.0),
            round in 0u32..4,
        ) {
            // Coarse coordinates make for shared edges, triangles without area and zeros of both signs.
            let scale = [1e6, 64.0, 4.0, 2.0][round as usize];
            let all: Vec<f32> =
                numbers.iter().chain(&more).chain(&last).map(|x| (x * scale).round() / scale).collect();
            let point = |i: usize| [all[3 * i], all[3 * i + 1], all[3 * i + 2]];
            let corners = std::array::from_fn(|i| [point(3 * i), point(3 * i + 1), point(3 * i + 2)]);
            let (origin, toward) = (point(24), point(25));
            check(origin, toward, &corners, [0.0, f32::MAX]);
            check(origin, toward, &corners, [0.25, 0.75]);
        }
    }
}
