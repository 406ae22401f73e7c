use super::*;
use crate::geometry::triangle::exact::Filter;
use crate::geometry::triangle::{Candidate, Corners, Triangle};
use crate::simd::{Chosen, Isa, Mask, Simd, Task};
use crate::weyl::uniform;
use proptest::prelude::*;
use std::array::from_fn;

struct Ask<'a, const SIGNS: bool>(&'a Pooled, &'a Sixteens<'a>, [f32; 2]);

/// So many triangles are asked together.
const ASKED: usize = 13;

impl<const SIGNS: bool> Task for Ask<'_, SIGNS> {
    /// Bits of what is possible and of what is certain, and the bounds.
    type Output = (u32, u32, [f32; 16], [f32; 16]);

    #[inline(always)]
    fn run<S: Simd>(self) -> Self::Output {
        let Self(ray, triangles, [tnear, tfar]) = self;
        let vertices = ray.see::<S::F16>(triangles);
        let Prospects { possible, certain, first, last } =
            ray.prospects::<S::F16, SIGNS, false>(&vertices, triangles, tnear, tfar);
        let all = (possible.bits(), certain.bits(), first.store(), last.store());
        let early = ray.prospects::<S::F16, SIGNS, true>(&vertices, triangles, tnear, tfar);
        assert_eq!((early.possible.bits(), early.certain.bits()), (all.0, all.1));
        for lane in (0..16).filter(|lane| all.0 >> lane & 1 == 1) {
            assert_eq!([early.first.store()[lane], early.last.store()[lane]], [all.2[lane], all.3[lane]]);
        }
        for half in 0..2 {
            let Prospects { possible, certain, first, last } = ray
                .prospects_of_half::<FromSixteen, S::F16, SIGNS, false>(
                    &vertices, triangles, half, tnear, tfar,
                );
            let of_all = |bits: u32| bits >> (8 * half) & 0xff;
            assert_eq!((possible.bits(), certain.bits()), (of_all(all.0), of_all(all.1)));
            for lane in (0..8).filter(|lane| possible.bits() >> lane & 1 == 1) {
                let (first, last) = (first.store()[lane], last.store()[lane]);
                assert_eq!([first, last], [all.2[8 * half + lane], all.3[8 * half + lane]]);
            }
        }
        // The first two triangles have six vertices.
        let two = Sixteens { count: 2, ..*triangles };
        let few = ray.see_eight::<S::F8>(&two);
        let Prospects { possible, certain, first, last } =
            ray.prospects_of_half::<FromEight, S::F8, SIGNS, false>(&few, &two, 0, tnear, tfar);
        assert_eq!((possible.bits(), certain.bits()), (all.0 & 3, all.1 & 3));
        for lane in (0..2).filter(|lane| all.0 >> lane & 1 == 1) {
            assert_eq!([first.store()[lane], last.store()[lane]], [all.2[lane], all.3[lane]]);
        }
        let ([possible, certain], [first, last]) = ([all.0, all.1], [all.2, all.3]);
        for bits in [possible, certain] {
            (5..16).for_each(|i| assert_eq!(bits >> i & 1, if i < ASKED { bits >> (i % 5) & 1 } else { 0 }));
        }
        (possible & 31, certain & 31, first, last)
    }
}

/// A ray in some lanes against one triangle after the other: in the last lane of those, and in one where it has another greatest axis.
struct AskListed<'a, const SIGNS: bool>(&'a [[f32; 3]; 2], &'a [Corners; 5], [f32; 2]);

impl<const SIGNS: bool> AskListed<'_, SIGNS> {
    /// As for [`Ask`].
    #[inline(always)]
    fn ask<const W: usize, L: Lanes<W>>(&self) -> (u32, u32, [f32; 16], [f32; 16]) {
        let Self([origin, direction], triangles, [tnear, tfar]) = *self;
        // The others' coordinates are renamed otherwise.
        let turned = |v: &[f32; 3], axis: usize| L::load(&from_fn(|lane| v[(axis + lane + 1) % 3]));
        let lanes = |v: &[f32; 3]| [turned(v, 0), turned(v, 1), turned(v, 2)];
        let (origins, directions) = (lanes(origin), lanes(direction));
        let (shear, axes) = shears::<W, L>(&origins, &directions);
        let listed = Listed::<W, L>::new(&origins, shear, axes);
        let (mut all, lane) = ((0, 0, [0.0; 16], [0.0; 16]), W / 3 * 3 - 1);
        for (i, corners) in triangles.iter().enumerate() {
            let corners = [listed.see(&corners[0]), listed.see(&corners[1]), listed.see(&corners[2])];
            let found = listed.prospects::<SIGNS>(&corners, L::splat(tnear), L::splat(tfar));
            let sifted = listed.sift::<SIGNS>(&corners).bits();
            assert_eq!(found.possible.bits() & !sifted, 0, "what is possible is not sifted out");
            all.0 |= (found.possible.bits() >> lane & 1) << i;
            all.1 |= (found.certain.bits() >> lane & 1) << i;
            (all.2[i], all.3[i]) = (found.first.store()[lane], found.last.store()[lane]);
        }
        all
    }
}

impl<const SIGNS: bool> Task for AskListed<'_, SIGNS> {
    /// By eights, and by sixteens.
    type Output = [(u32, u32, [f32; 16], [f32; 16]); 2];

    #[inline(always)]
    fn run<S: Simd>(self) -> Self::Output {
        [self.ask::<8, S::F8>(), self.ask::<16, S::F16>()]
    }
}

/// A ray by itself, as every instruction set prepares it, beside what the mode's test makes of it.
fn prepared(origin: [f32; 3], direction: [f32; 3]) -> Pooled {
    let test = Shear::<1, f32>::new(&origin, &direction, 1);
    let axis = test.major.expect("one ray has one greatest axis");
    for isa in Isa::available() {
        let fours = [origin, direction].map(|[x, y, z]| [x, y, z, f32::INFINITY]);
        let of_one = Chosen::new(isa).expect("it is available").run(Prepare(fours, axis));
        assert_eq!(of_one.renamed(), RENAMED[axis]);
        assert_eq!(
            (of_one.origin, of_one.shear),
            (test.origin, test.shear),
            "{isa}, {origin:?} {direction:?}"
        );
        assert!((of_one.speed / speed(test.shear[2]) - 1.0).abs() < 1e-6, "{isa}, {direction:?}");
    }
    Pooled::of_shear(&origin, test.shear, axis)
}

struct Prepare([[f32; 4]; 2], usize);

impl Task for Prepare {
    type Output = Pooled;

    #[inline(always)]
    fn run<S: Simd>(self) -> Pooled {
        let Self([origin, direction], axis) = self;
        Pooled::of_one::<S::F8>(&origin, &direction, axis)
    }
}

/// Five triangles that share no vertex, asked together and one by one: nothing that is hit is impossible, all that is
/// certain is hit, and `t` lies between its bounds. How many are hit, and how many of those are certain.
fn check(origin: [f32; 3], direction: [f32; 3], corners: &[Corners; 5], ends: [f32; 2]) -> [usize; 2] {
    let vertices = corners.as_flattened();
    let mut rows = [[0.0; 16]; 3];
    for (number, vertex) in vertices.iter().enumerate() {
        for axis in 0..3 {
            rows[axis][number] = vertex[axis];
        }
    }
    let pooled = prepared(origin, direction);
    // Again and again, so that there are some in both halves.
    let numbers: [u16; 16] = from_fn(|i| {
        let first = 3 * (i as u16 % 5);
        first | (first + 1) << 4 | (first + 2) << 8
    });
    let sixteens =
        Sixteens { rows: pooled.renamed().map(|axis| &rows[axis]), corners: &numbers, count: ASKED };
    let test = Shear::<1, f32>::new(&origin, &direction, 1);
    let exact = Filter::<1, f32>::new(&origin, &direction, 1);
    let mut counts = [0; 2];
    for isa in Isa::available() {
        let chosen = Chosen::new(isa).expect("it is available");
        let by_signs = chosen.run(Ask::<true>(&pooled, &sixteens, ends));
        let by_bounds = chosen.run(Ask::<false>(&pooled, &sixteens, ends));
        let ray = [origin, direction];
        for (of_one, of_lists) in [
            (by_signs, chosen.run(AskListed::<true>(&ray, corners, ends))),
            (by_bounds, chosen.run(AskListed::<false>(&ray, corners, ends))),
        ] {
            for (possible, certain, first, last) in of_lists {
                assert_eq!((possible, certain), (of_one.0, of_one.1), "{isa}, {ray:?}, {corners:?}");
                for i in (0..5).filter(|i| possible >> i & 1 == 1) {
                    assert_eq!((first[i], last[i]), (of_one.2[i], of_one.3[i]), "{isa}, {ray:?}");
                }
            }
        }
        for (lane, corners) in corners.iter().enumerate() {
            let triangle = Triangle::new(*corners);
            let answers = [test.test(&triangle, true), exact.test(&triangle, true)];
            for (Candidate { inside, t, .. }, (possible, certain, first, last)) in
                answers.into_iter().zip([by_signs, by_bounds])
            {
                let hit = inside && ends[0] <= t && t <= ends[1];
                let [possible, certain] = [possible, certain].map(|bits| bits >> lane & 1 == 1);
                let (first, last) = (first[lane], last[lane]);
                let about = format!("{isa}, {origin:?} {direction:?} {corners:?}, t {t}, {first} to {last}");
                assert!(possible || !hit, "a hit is impossible: {about}");
                assert!(hit || !certain, "what is certain is no hit: {about}");
                assert!(!hit || first <= t && t <= last, "t is out of bounds: {about}");
                counts[0] += usize::from(hit);
                counts[1] += usize::from(certain);
            }
        }
    }
    counts
}

/// Five triangles of a size, flattened by a factor, that a ray meets near their middles up to so far away.
fn met(
    number: &mut impl FnMut() -> f32,
    [origin, direction]: [[f32; 3]; 2],
    [size, thin, away]: [f32; 3],
) -> [Corners; 5] {
    from_fn(|_| {
        let on_ray = number().abs() * away;
        let center: [f32; 3] = from_fn(|i| origin[i] + direction[i] * on_ray);
        let [e, f]: [[f32; 3]; 2] = from_fn(|_| from_fn(|_| number() * size));
        let corner =
            |by_e: f32, by_f: f32| from_fn(|i| center[i] + e[i] * by_e + (f[i] * thin + e[i] * 0.1) * by_f);
        [corner(-1.0, -1.0), corner(1.0, -1.0), corner(0.0, 1.0)]
    })
}

#[test]
fn hits_are_never_out_of_bounds_and_mostly_certain() {
    let mut number = uniform(-1.0, 1.0);
    let mut counts = [0; 2];
    for round in 0..4000 {
        // Of many sizes and shapes, far away or near, met squarely or grazed, inside or near an edge.
        let size = 10f32.powi(round % 7 - 3);
        let away = 10f32.powi(round / 7 % 6 - 2);
        let thin = 10f32.powi(-(round / 42 % 4));
        let direction = from_fn(|_| number());
        let origin = from_fn(|_| number() * away);
        let corners = met(&mut number, [origin, direction], [size, thin, away]);
        let found = check(origin, direction, &corners, [0.0, f32::MAX]);
        counts = [counts[0] + found[0], counts[1] + found[1]];
    }
    let [hits, certain] = counts;
    assert!(hits > 10_000 && 3 * certain > 2 * hits, "{certain} of {hits} hits are certain");
}

#[test]
fn no_bound_is_in_proportion_to_what_underflows() {
    let mut number = uniform(-1.0, 1.0);
    let mut hits = 0;
    for round in 0..6000 {
        // Down to the smallest floats, with origins as small or zero, and directions of all ordinary lengths.
        let size = 10f32.powi(-(round % 43));
        let away = size * 10f32.powi(round / 43 % 5 - 2);
        let thin = 10f32.powi(-(round / 215 % 4));
        let long = 8f32.powi(round / 7 % 21 - 10);
        let direction: [f32; 3] = from_fn(|_| number() * long);
        let origin = if round % 3 == 0 { [0.0; 3] } else { from_fn(|_| number() * away) };
        let corners = met(&mut number, [origin, direction], [size, thin, away / long]);
        hits += check(origin, direction, &corners, [0.0, f32::MAX])[0];
    }
    assert!(hits > 10_000, "{hits} hits");
}

proptest! {
    #[test]
    fn coarse_triangles_are_in_bounds(
        first in proptest::array::uniform32(-1.0f32..1.0),
        second in proptest::array::uniform20(-1.0f32..1.0),
        round in 0u32..4,
    ) {
        // Coarse coordinates make for shared edges, triangles without area and zeros of both signs.
        let scale = [1e6, 64.0, 4.0, 2.0][round as usize];
        let all: Vec<f32> = first.iter().chain(&second).map(|x| (x * scale).round() / scale).collect();
        let point = |i: usize| [all[3 * i], all[3 * i + 1], all[3 * i + 2]];
        let corners = std::array::from_fn(|i| [point(3 * i), point(3 * i + 1), point(3 * i + 2)]);
        let (origin, toward) = (point(15), point(16));
        prop_assume!(toward != [0.0; 3]);
        check(origin, toward, &corners, [0.0, f32::MAX]);
        check(origin, toward, &corners, [0.25, 0.75]);
    }
}
