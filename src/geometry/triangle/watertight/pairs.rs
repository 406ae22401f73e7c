//! Eight rays at once, each against a triangle of its own.
//!
//! Lanes hold pairs of a ray and a triangle that it may hit. What is computed in a lane is what the test of one
//! triangle computes, operation by operation, so it has the same bits. What that test seldom does (signs in double
//! precision, clipping rays that graze the plane, triangles without area) is left to it.

use super::Shear;
use super::distance::are_clipped;
use crate::geometry::triangle::record::NORMAL;
use crate::geometry::triangle::{Finds, Lanes3, Triangle};
use crate::simd::{Eight, Mask};

/// Corners and normals, relative to nothing, with coordinates renamed for the ray of each lane: `[column][axis]`.
type Columns<L> = [Lanes3<L>; 4];

type Rays<'a> = [&'a Shear<1, f32>; 8];

/// Brings eight triangles' numbers together.
#[inline(always)]
fn columns<L: Eight>(rays: &Rays<'_>, triangles: &[&Triangle; 8]) -> Columns<L> {
    let mut places = [[0; 3]; 8];
    for lane in 0..8 {
        places[lane] = rays[lane].axes();
    }
    let mut columns = [[L::splat(0.0); 3]; 4];
    for axis in 0..3 {
        let row = |lane: usize| &triangles[lane].rows()[places[lane][axis]];
        let rows = [
            L::of_fours([row(0), row(4)]),
            L::of_fours([row(1), row(5)]),
            L::of_fours([row(2), row(6)]),
            L::of_fours([row(3), row(7)]),
        ];
        let of_axis = L::transpose_fours(rows);
        for column in 0..4 {
            columns[column][axis] = of_axis[column];
        }
    }
    columns
}

/// Three numbers of eight rays.
#[inline(always)]
fn of_rays<L: Eight>(numbers: [&[f32; 3]; 8]) -> Lanes3<L> {
    let [a, b, c, d, e, f, g, h] = numbers;
    let axis = |i: usize| L::load(&[a[i], b[i], c[i], d[i], e[i], f[i], g[i], h[i]]);
    [axis(0), axis(1), axis(2)]
}

/// Where eight rays hit a triangle each.
#[inline(always)]
pub(super) fn test<L: Eight>(rays: &Rays<'_>, triangles: &[&Triangle; 8]) -> Finds {
    let [a, b, c, d, e, f, g, h] = *rays;
    let origin = of_rays::<L>([
        &a.origin, &b.origin, &c.origin, &d.origin, &e.origin, &f.origin, &g.origin, &h.origin,
    ]);
    let [sx, sy, scale] =
        of_rays::<L>([&a.shear, &b.shear, &c.shear, &d.shear, &e.shear, &f.shear, &g.shear, &h.shear]);
    let columns = columns::<L>(rays, triangles);
    let translated = |column: usize| -> Lanes3<L> {
        let [x, y, z] = columns[column];
        [x - origin[0], y - origin[1], z - origin[2]]
    };
    let sheared = |[x, y, z]: Lanes3<L>| -> Lanes3<L> { [x - sx * z, y - sy * z, z] };
    let corner = translated(0);
    let corners = [sheared(corner), sheared(translated(1)), sheared(translated(2))];
    let [[ax, ay, az], [bx, by, bz], [cx, cy, cz]] = corners;

    // As in `edge_functions`.
    let edges @ [ea, eb, ec] = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
    let zero = L::splat(0.0);
    let inside = !(ea.min(eb).min(ec).lt(zero) & zero.lt(ea.max(eb).max(ec)));

    // As in `distance`.
    let (da, db, dc) = (scale * az, scale * bz, scale * cz);
    let (nearest, farthest) = (da.min(db).min(dc), da.max(db).max(dc));
    let [dx, dy, dz] = of_rays::<L>([
        &a.direction,
        &b.direction,
        &c.direction,
        &d.direction,
        &e.direction,
        &f.direction,
        &g.direction,
        &h.direction,
    ]);
    let ([nx, ny, nz], [px, py, pz]) = (columns[NORMAL], corner);
    let height = nx * px + ny * py + nz * pz;
    let speed = nx * dx + ny * dy + nz * dz;
    let t = (height / speed).max(nearest).min(farthest);

    // A triangle without area has a plane of zeros, and so no speed.
    let clipped = are_clipped(inside, &corners, &edges, speed, dz.abs());
    let open = inside & (clipped | ea.eq(zero) | eb.eq(zero) | ec.eq(zero));
    let sum = ea + eb + ec;
    let hits = inside & !open & (sum.lt(zero) | zero.lt(sum));
    Finds { hits: hits.bits() & 0xff, open: open.bits() & 0xff, t: t.store() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangle::{Corners, Test};
    use crate::simd::{Chosen, Isa, Simd, Task};
    use proptest::prelude::*;

    struct Pairs<'a>(&'a Rays<'a>, &'a [&'a Triangle; 8]);

    impl Task for Pairs<'_> {
        type Output = Finds;

        #[inline(always)]
        fn run<S: Simd>(self) -> Finds {
            test::<S::F8>(self.0, self.1)
        }
    }

    /// Asks about pairs together and one by one, on every instruction set; says which were left open.
    fn check(rays: &[Shear<1, f32>; 8], corners: &[Corners; 8]) -> u32 {
        let triangles = corners.map(Triangle::new);
        let (rays, triangles) = (rays.each_ref(), triangles.each_ref());
        let mut left = 0;
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            let Finds { hits, open, t } = chosen.run(Pairs(&rays, &triangles));
            assert_eq!(hits & open, 0, "an open pair is no hit");
            for lane in (0..8).filter(|lane| open >> lane & 1 == 0) {
                let one = rays[lane].test(triangles[lane], true);
                let wanted = one.inside.then(|| one.t.to_bits());
                let found = (hits >> lane & 1 == 1).then(|| t[lane].to_bits());
                assert_eq!(found, wanted, "{isa}, {:?}", corners[lane]);
            }
            left |= open;
        }
        left
    }

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> Shear<1, f32> {
        Shear::new(&origin, &direction, 1)
    }

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
        let up = ray([0.0; 3], [0.0, 0.0, 1.0]);
        assert_eq!(check(&[up; 8], &eight), 0b1010_1100);
        // A ray that is none hits nothing, whoever is asked.
        check(&[ray([0.0; 3], [f32::NAN, 0.0, 1.0]); 8], &eight);
    }

    proptest! {
        #[test]
        fn pairs_answer_as_one_by_one(
            numbers in proptest::collection::vec(-1.0f32..1.0, 120),
            round in 0u32..4,
        ) {
            // Coarse coordinates make for shared edges, triangles without area and zeros of both signs.
            let scale = [1e6, 64.0, 4.0, 2.0][round as usize];
            let all: Vec<f32> = numbers.iter().map(|x| (x * scale).round() / scale).collect();
            let point = |i: usize| [all[3 * i], all[3 * i + 1], all[3 * i + 2]];
            // Rays that run fastest along each of the axes, side by side.
            let rays = std::array::from_fn(|i| ray(point(24 + i), point(32 + i)));
            let corners = std::array::from_fn(|i| [point(3 * i), point(3 * i + 1), point(3 * i + 2)]);
            check(&rays, &corners);
        }
    }
}
