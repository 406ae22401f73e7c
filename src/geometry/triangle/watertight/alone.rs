//! One ray against eight triangles at once, and each ray against a triangle of its own.
//!
//! Lanes hold triangles instead of rays, or both. What is computed in a lane is what the test of one triangle computes,
//! operation by operation, so it has the same bits. What that test seldom does (signs in double precision,
//! clipping rays that graze the plane, triangles without area) is left to it.

use super::distance::are_clipped;
use super::{Shear, edges, likely, one_sign};
use crate::geometry::triangle::{Alone, Finds, Lanes3, Own, RENAMED, Triangle};
use crate::simd::{Eight, Lanes, Mask};

/// Eight triangles' coordinates, a row for each: three for each corner, then the plane's. The fourth row of each
/// three is there for an index of two bits to need no check.
type Columns = [[[f32; 8]; 4]; 4];

/// Brings eight triangles' coordinates together.
#[inline(always)]
fn columns<L: Eight>(triangles: &[&Triangle; 8]) -> Columns {
    let mut columns = [[[0.0; 8]; 4]; 4];
    for four in 0..3 {
        let mut rows = [L::splat(0.0); 4];
        for (row, pair) in rows.iter_mut().enumerate() {
            *pair = L::of_fours([&triangles[row].fours()[four], &triangles[row + 4].fours()[four]]);
        }
        for (i, column) in L::transpose_fours(rows).into_iter().enumerate() {
            let place = 4 * four + i;
            columns[place / 3][place % 3] = column.store();
        }
    }
    columns
}

impl Shear<1, f32> {
    /// Three coordinates of eight triangles, renamed.
    #[inline(always)]
    fn renamed_eight<L: Eight>(&self, columns: &[[f32; 8]; 4]) -> Lanes3<L> {
        // No `map`: its closure might stay out of line, and be compiled without the instruction set.
        let [i, j, k] = RENAMED[self.major.unwrap_or(2)];
        [L::load(&columns[i & 3]), L::load(&columns[j & 3]), L::load(&columns[k & 3])]
    }

    /// A corner of eight triangles relative to the origin, with its coordinates renamed.
    #[inline(always)]
    fn translated_eight<L: Eight>(&self, columns: &[[f32; 8]; 4]) -> Lanes3<L> {
        let ([x, y, z], [ox, oy, oz]) = (self.renamed_eight::<L>(columns), self.origin);
        [x - L::splat(ox), y - L::splat(oy), z - L::splat(oz)]
    }

    /// The same sheared.
    #[inline(always)]
    fn shear_eight<L: Eight>(&self, [x, y, z]: Lanes3<L>) -> Lanes3<L> {
        let [sx, sy, _] = self.shear;
        [x - L::splat(sx) * z, y - L::splat(sy) * z, z]
    }

    /// [`Shear::likely`] of eight triangles.
    #[inline(always)]
    pub(crate) fn likely_of_eight<L: Eight>(&self, triangles: &[&Triangle; 8]) -> u32 {
        let [a, b, c, _] = columns::<L>(triangles);
        let a = self.shear_eight(self.translated_eight::<L>(&a));
        let b = self.shear_eight(self.translated_eight::<L>(&b));
        let c = self.shear_eight(self.translated_eight::<L>(&c));
        likely([a, b, c]).bits()
    }
}

impl Alone for Shear<1, f32> {
    #[inline(always)]
    fn find<L: Eight>(&self, triangles: &[&Triangle; 8], tnear: f32, tfar: f32) -> Finds<L> {
        let [p0, p1, p2, plane] = columns::<L>(triangles);
        let corner = self.translated_eight::<L>(&p0);
        let [dx, dy, dz] = self.direction;
        let seen = Seen {
            corner,
            sheared: [
                self.shear_eight(corner),
                self.shear_eight(self.translated_eight::<L>(&p1)),
                self.shear_eight(self.translated_eight::<L>(&p2)),
            ],
            normal: self.renamed_eight::<L>(&plane),
            direction: [L::splat(dx), L::splat(dy), L::splat(dz)],
            scale: L::splat(self.shear[2]),
        };
        let Met { hits, open, t, .. } = seen.meet(L::splat(tnear), L::splat(tfar));
        Finds { hits, t, open: open.bits() }
    }
}

/// Rays and triangles, one of each in a lane, as the rays see them.
pub(super) struct Seen<L> {
    /// The first corner, translated.
    pub corner: Lanes3<L>,
    /// The corners, translated and sheared.
    pub sheared: [Lanes3<L>; 3],
    /// The plane's normal, and the ray's direction, renamed.
    pub normal: Lanes3<L>,
    pub direction: Lanes3<L>,
    /// `1 / dz`.
    pub scale: L,
}

/// What each lane's ray finds of its triangle.
pub(super) struct Met<const W: usize, L: Lanes<W>> {
    /// Where it is hit, at `t`.
    pub hits: L::Mask,
    /// Where the test of one triangle has yet to say whether it is.
    pub open: L::Mask,
    pub t: L,
    /// The edge functions opposite to the corners, and their sum.
    pub edges: Lanes3<L>,
    pub sum: L,
}

impl<L> Seen<L> {
    /// What is hit from `tnear` to `tfar`.
    #[inline(always)]
    pub fn meet<const W: usize>(self, tnear: L, tfar: L) -> Met<W, L>
    where
        L: Lanes<W>,
    {
        let Self { corner: [px, py, pz], sheared, normal: [nx, ny, nz], direction: [dx, dy, dz], scale } =
            self;
        // As in `edge_functions`.
        let edges = edges(&sheared);
        let inside = one_sign(&edges);

        // `t` is kept between these.
        let [[_, _, az], [_, _, bz], [_, _, cz]] = sheared;
        let (az, bz, cz) = (scale * az, scale * bz, scale * cz);
        let (nearest, farthest) = (az.min(bz).min(cz), az.max(bz).max(cz));
        let inside = inside & nearest.le(tfar) & tnear.le(farthest);

        // As in `meet_plane`.
        let height = nx * px + ny * py + nz * pz;
        let speed = nx * dx + ny * dy + nz * dz;
        let t = (height / speed).max(nearest).min(farthest);

        // A triangle without area has a plane of zeros, and so no speed.
        let clipped = are_clipped(inside, &sheared, &edges, speed, dz.abs());
        let zero = L::splat(0.0);
        let [a, b, c] = edges;
        let open = inside & (clipped | a.eq(zero) | b.eq(zero) | c.eq(zero));
        let sum = a + b + c;
        let hits = inside & !open & (sum.lt(zero) | zero.lt(sum));
        let hits = hits & tnear.le(t) & t.le(tfar);
        Met { hits, open, t, edges, sum }
    }
}

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// Each lane's ray against a triangle of its own.
    #[inline(always)]
    pub(crate) fn meet_own(&self, triangles: &[Lanes3<L>; 4], tnear: L, tfar: L) -> Own<W, L> {
        let [a, b, c, normal] = triangles;
        let (a, b, c) = (self.moved(a), self.moved(b), self.moved(c));
        let seen = Seen {
            corner: a,
            sheared: [self.shear(a), self.shear(b), self.shear(c)],
            normal: self.renamed(normal),
            direction: self.direction,
            scale: self.shear[2],
        };
        let Met { hits, open, t, edges: [_, b, c], sum } = seen.meet(tnear, tfar);
        Own { hits: hits.bits(), open: open.bits(), t, u: b / sum, v: c / sum }
    }

    /// Each lane's point relative to its origin, renamed.
    #[inline(always)]
    fn moved(&self, point: &Lanes3<L>) -> Lanes3<L> {
        let [x, y, z] = self.renamed(point);
        [x - self.origin[0], y - self.origin[1], z - self.origin[2]]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangle::{Corners, Test};
    use crate::simd::{Chosen, Isa, Simd, Task};
    use proptest::prelude::*;

    /// Whether each of eight triangles is hit between the ray's ends, and where: `t` and the weights.
    type Answers = [Option<[f32; 3]>; 8];

    struct Eights<'a>(&'a Shear<1, f32>, &'a [&'a Triangle; 8], [f32; 2]);

    impl Task for Eights<'_> {
        type Output = (Answers, u32);

        #[inline(always)]
        fn run<S: Simd>(self) -> (Answers, u32) {
            let Self(ray, triangles, [tnear, tfar]) = self;
            let finds = ray.find::<S::F8>(triangles, tnear, tfar);
            let (hits, t) = (finds.hits.bits() & 0xff, finds.t.store());
            let hit = |lane: usize| {
                let [u, v] = ray.weigh(triangles[lane], true);
                (hits >> lane & 1 == 1).then_some([t[lane], u, v])
            };
            (std::array::from_fn(hit), finds.open & 0xff)
        }
    }

    /// Asks both ways, on every instruction set; says which triangles were left open.
    fn check(origin: [f32; 3], direction: [f32; 3], corners: &[Corners; 8], ends: [f32; 2]) -> u32 {
        let triangles = corners.map(Triangle::new);
        let triangles = triangles.each_ref();
        let ray = Shear::<1, f32>::new(&origin, &direction, 1);
        let mut left = 0;
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            let (answers, open) = chosen.run(Eights(&ray, &triangles, ends));
            for lane in 0..8 {
                let one = ray.test(triangles[lane], true);
                assert!(ray.sift(triangles[lane], true) | !one.inside, "sifted away: {:?}", corners[lane]);
                assert!(!ray.sift(triangles[lane], false), "of a lane that is not asked for");
                let wanted =
                    (one.inside && ends[0] <= one.t && one.t <= ends[1]).then_some([one.t, one.u, one.v]);
                let bits = |answer: Option<[f32; 3]>| answer.map(|numbers| numbers.map(f32::to_bits));
                if open >> lane & 1 == 1 {
                    assert_eq!(answers[lane], None, "an open triangle is no hit");
                } else {
                    assert_eq!(bits(answers[lane]), bits(wanted), "{isa}, {:?}", corners[lane]);
                }
            }
            left |= open;
        }
        left
    }

    const FAR: [f32; 2] = [0.0, f32::MAX];

    #[test]
    fn what_is_in_doubt_is_left_open() {
        let across = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]];
        let beside = across.map(|[x, y, z]| [x + 5.0, y, z]);
        let on_an_edge = across.map(|[x, y, z]| [x, y + 1.0, z]);
        let on_a_corner = across.map(|[x, y, z]| [x, y - 1.0, z]);
        // One that is all but edge-on is in doubt if the ray passes near an edge.
        let grazed = [[-1.0, -0.01, 0.0], [1.0, -0.01, 0.0], [0.0, 0.01, 9.0]];
        let scraped = grazed.map(|[x, y, z]| [x, y / 8.0, z]);
        let line = [[-1.0, -1.0, 2.0], [0.0, 0.0, 2.0], [1.0, 1.0, 2.0]];
        let behind = across.map(|[x, y, z]| [x, y, -z]);
        let eight = [across, beside, on_an_edge, on_a_corner, grazed, line, behind, scraped];
        assert_eq!(check([0.0; 3], [0.0, 0.0, 1.0], &eight, FAR), 0b1010_1100);
        // A ray that is none hits nothing, whoever is asked.
        check([0.0; 3], [f32::NAN, 0.0, 1.0], &eight, FAR);
    }

    proptest! {
        #[test]
        fn eight_at_once_answer_as_one_by_one(
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
