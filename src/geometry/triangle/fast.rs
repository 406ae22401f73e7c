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
//! - that corner is an end of the longest edge, and the second weight follows from the place along
//!   that edge, which is well defined in a sliver too, where the weights themselves are noise. So a
//!   point that is taken for inside is never far beyond an end.
//!
//! What is given up is agreement between neighbours: each side of a shared edge is decided from its
//! own numbers, so a ray may slip between the two, or hit both.

use super::{Alone, Candidate, Corners, Finds, Lanes3, RENAMED, Test, normal_in_double};
use crate::simd::{Eight, Lanes};
use bytemuck::{Pod, Zeroable};
use glam::{DVec3, Vec3};

/// A triangle made ready: 44 bytes. "Renamed" coordinates are `RENAMED[axis]`, and its corners here
/// begin with the ends of the longest edge.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C)]
pub struct Projected {
    /// The first corner, renamed.
    corner: [f32; 3],
    /// The plane's normal in the first two renamed coordinates; in the third it is 1.
    plane: [f32; 2],
    /// The place along the longest edge, 0 to 1, from the first two renamed coordinates relative to
    /// `corner`.
    along: [f32; 2],
    /// The weight of the third corner, likewise.
    across: [f32; 2],
    /// The place of the third corner along the longest edge.
    apex: f32,
    /// Bits 0 and 1: the axis in which the normal is greatest. Bits 2 and 3: which of the triangle's corners
    /// `corner` is.
    names: u32,
}

/// The bits of the axis.
const AXIS: u32 = 3;

impl Projected {
    /// Prepares a triangle. One without area gets NaNs, so that it is never hit.
    pub fn new(corners: &Corners) -> Self {
        let points = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
        let edge = |i: usize| (points[(i + 1) % 3] - points[i]).length_squared();
        let first = (1..3).fold(0, |best, i| if edge(i) > edge(best) { i } else { best });
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
        let (e1, e2) = (p1 - p0, p2 - p0);
        let base = e1 / e1.length_squared();
        Self {
            corner: [i, j, k].map(|c| p0[c] as f32),
            plane: [n[i] as f32, n[j] as f32],
            // In the plane the third coordinate is -(n[i] x + n[j] y).
            along: [(base[i] - base[k] * n[i]) as f32, (base[j] - base[k] * n[j]) as f32],
            across: [(-e1[j] / normal[k]) as f32, (e1[i] / normal[k]) as f32],
            apex: base.dot(e2) as f32,
            names: (axis | first << 2) as u32,
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
    type Kept = ();
    type Weights = [L; 2];

    #[inline(always)]
    fn keep(_along: L) {}

    #[inline(always)]
    fn revive(_kept: &(), _slopes: [L; 2], apex: &[f32; 3], direction: &Lanes3<L>, _axis: usize) -> Self {
        Self { origin: [L::splat(apex[0]), L::splat(apex[1]), L::splat(apex[2])], direction: *direction }
    }

    #[inline(always)]
    fn new(origin: &Lanes3<L>, direction: &Lanes3<L>, _active: u32) -> Self {
        Self { origin: *origin, direction: *direction }
    }

    #[inline(always)]
    fn sift(&self, triangle: &Projected, lanes: L::Mask) -> L::Mask {
        self.test(triangle, lanes).inside & lanes
    }

    #[inline(always)]
    fn test(&self, triangle: &Projected, _lanes: L::Mask) -> Candidate<W, L> {
        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let [i, j, k] = RENAMED[(triangle.names & AXIS) as usize];
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
        let along = L::splat(triangle.along[0]) * x + L::splat(triangle.along[1]) * y;
        let v = L::splat(triangle.across[0]) * x + L::splat(triangle.across[1]) * y;
        let u = along - v * L::splat(triangle.apex);
        let inside = zero.le(u) & zero.le(v) & (u + v).le(one);
        Candidate { inside, t, u, v }
    }

    #[inline(always)]
    fn weights(triangle: &Projected, u: L, v: L) -> [L; 2] {
        // The record's corners are the triangle's from `first` on, in turn.
        let rest = L::splat(1.0) - (u + v);
        match triangle.names >> 2 {
            0 => [u, v],
            1 => [rest, u],
            _ => [v, rest],
        }
    }
}

/// Brings eight triangles' numbers together, the first of all in front.
#[inline(always)]
fn columns<L: Eight>(triangles: &[&Projected; 8]) -> [L; 11] {
    let mut columns = [L::splat(0.0); 11];
    // Four numbers at a time, one of them twice.
    for from in [0, 4, 7] {
        let mut rows = [L::splat(0.0); 4];
        for (row, pair) in rows.iter_mut().enumerate() {
            *pair = L::of_fours([triangles[row].four(from), triangles[row + 4].four(from)]);
        }
        for (i, column) in L::transpose_fours(rows).into_iter().enumerate() {
            columns[from + i] = column;
        }
    }
    columns
}

impl Projected {
    /// Four of its eleven numbers.
    #[inline(always)]
    fn four(&self, from: usize) -> &[f32; 4] {
        let numbers: &[f32; 11] = bytemuck::cast_ref(self);
        numbers[from..].first_chunk().expect("there are so many")
    }
}

/// A point or direction in each lane, renamed for that lane's axis: x, y, or else z.
#[inline(always)]
fn renamed<L: Eight>([x, y, z]: [f32; 3], is_x: L::Mask, is_y: L::Mask) -> Lanes3<L> {
    let [x, y, z] = [L::splat(x), L::splat(y), L::splat(z)];
    [
        L::select(is_x, y, L::select(is_y, z, x)),
        L::select(is_x, z, L::select(is_y, x, y)),
        L::select(is_x, x, L::select(is_y, y, z)),
    ]
}

impl Alone for Lines<1, f32> {
    /// As in [`test`](Test::test), operation by operation, with coordinates renamed lane by lane.
    #[inline(always)]
    fn find<L: Eight>(&self, triangles: &[&Projected; 8], tnear: f32, tfar: f32) -> Finds<L> {
        let [ci, cj, ck, ni, nj, along_i, along_j, across_i, across_j, apex, names] = columns::<L>(triangles);
        let axis = L::ids_and(L::ids_load(&bytemuck::cast(names.store())), L::ids(AXIS as i32));
        let is_x = L::ids_less(axis, L::ids(1));
        let is_y = L::ids_less(axis, L::ids(2)) & !is_x;
        let [oi, oj, ok] = renamed::<L>(self.origin, is_x, is_y);
        let [di, dj, dk] = renamed::<L>(self.direction, is_x, is_y);

        let (zero, one) = (L::splat(0.0), L::splat(1.0));
        let (oi, oj, ok) = (oi - ci, oj - cj, ok - ck);
        let height = ni * oi + nj * oj + ok;
        let speed = ni * di + nj * dj + dk;
        let t = (zero - height) / speed;
        let (x, y) = (oi + t * di, oj + t * dj);
        let along = along_i * x + along_j * y;
        let v = across_i * x + across_j * y;
        let u = along - v * apex;
        let inside = zero.le(u) & zero.le(v) & (u + v).le(one);
        let hits = inside & L::splat(tnear).le(t) & t.le(L::splat(tfar));
        Finds { hits, t, open: 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Mask, Simd, Task};
    use proptest::prelude::*;

    struct Eights<'a>(&'a Lines<1, f32>, &'a [&'a Projected; 8], [f32; 2]);

    impl Task for Eights<'_> {
        type Output = [Option<u32>; 8];

        /// The bits of `t` where a triangle is hit.
        #[inline(always)]
        fn run<S: Simd>(self) -> [Option<u32>; 8] {
            let Self(ray, triangles, [tnear, tfar]) = self;
            let finds = ray.find::<S::F8>(triangles, tnear, tfar);
            assert_eq!(finds.open, 0);
            let (hits, t) = (finds.hits.bits(), finds.t.store());
            std::array::from_fn(|lane| (hits >> lane & 1 == 1).then(|| t[lane].to_bits()))
        }
    }

    proptest! {
        #[test]
        fn eight_at_once_answer_as_one_by_one(
            numbers in proptest::collection::vec(-1.0f32..1.0, 78),
            round in 0u32..4,
        ) {
            // Coarse coordinates make for shared edges, planes along axes and triangles without area.
            let scale = [1e6, 64.0, 4.0, 2.0][round as usize];
            let all: Vec<f32> = numbers.iter().map(|x| (x * scale).round() / scale).collect();
            let point = |i: usize| [all[3 * i], all[3 * i + 1], all[3 * i + 2]];
            let triangles: [Projected; 8] =
                std::array::from_fn(|i| Projected::new(&[point(3 * i), point(3 * i + 1), point(3 * i + 2)]));
            let triangles = triangles.each_ref();
            let ray = Lines::<1, f32>::new(&point(24), &point(25), 1);
            for ends in [[0.0, f32::MAX], [0.25, 0.75]] {
                let wanted = triangles.map(|triangle| {
                    let one = ray.test(triangle, true);
                    (one.inside && ends[0] <= one.t && one.t <= ends[1]).then(|| one.t.to_bits())
                });
                for isa in Isa::available() {
                    let chosen = Chosen::new(isa).expect("it is available");
                    assert_eq!(chosen.run(Eights(&ray, &triangles, ends)), wanted, "{isa}");
                }
            }
        }
    }
}
