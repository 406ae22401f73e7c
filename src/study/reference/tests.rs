//! The reference against itself without its hierarchy, and its filter and its whole numbers against
//! plain fractions.

use super::filter::{Probe, Verdict};
use super::*;
use crate::mesh::Colors;
use crate::mesh::generate::shapes;
use dashu_ratio::RBig;
use proptest::prelude::*;

/// Everything that the ray meets, by plain fractions and another formula (Möller & Trumbore, "Fast,
/// Minimum Storage Ray/Triangle Intersection", 1997): `(t, u, v)`.
fn by_fractions(ray: &Ray, corners: &[Vec3; 3]) -> Option<[RBig; 3]> {
    let fraction = |x: f32| RBig::try_from(x).expect("finite");
    let vector = |v: Vec3| v.to_array().map(fraction);
    let minus = |p: &[RBig; 3], q: &[RBig; 3]| [0, 1, 2].map(|i| &p[i] - &q[i]);
    let cross =
        |p: &[RBig; 3], q: &[RBig; 3]| [[1, 2], [2, 0], [0, 1]].map(|[j, k]| &p[j] * &q[k] - &p[k] * &q[j]);
    let dot = |p: &[RBig; 3], q: &[RBig; 3]| &p[0] * &q[0] + &p[1] * &q[1] + &p[2] * &q[2];

    let [p0, p1, p2] = corners.map(vector);
    let (origin, direction) = (vector(ray.origin), vector(ray.direction));
    let (e1, e2) = (minus(&p1, &p0), minus(&p2, &p0));
    let p = cross(&direction, &e2);
    let determinant = dot(&e1, &p);
    if determinant == RBig::ZERO {
        return None;
    }
    let from_p0 = minus(&origin, &p0);
    let q = cross(&from_p0, &e1);
    let [u, v, t] =
        [dot(&from_p0, &p), dot(&direction, &q), dot(&e2, &q)].map(|numerator| numerator / &determinant);
    let in_triangle = u >= RBig::ZERO && v >= RBig::ZERO && &u + &v <= RBig::ONE;
    let ends =
        if ray.tfar == f32::INFINITY { t.to_f32().value() < f32::INFINITY } else { t <= fraction(ray.tfar) };
    (in_triangle && ends && t >= fraction(ray.tnear)).then_some([t, u, v])
}

/// Whole numbers say what fractions say, and double precision nothing else. Whether it was sure.
fn check(ray: &Ray, corners: &[Vec3; 3]) -> bool {
    let probe = Probe::new(ray).expect("a sound ray");
    let expected = by_fractions(ray, corners);
    let met = exact::meet(ray, corners);
    match (&expected, &met) {
        (None, None) => {}
        (Some([t, u, v]), Some(met)) => {
            assert_eq!(met.t_f64(), t.to_f64().value(), "{ray:?} {corners:?}");
            assert_eq!([met.u(), met.v()], [u.to_f64().value(), v.to_f64().value()]);
            assert!(nearest_float(met.t(), t), "{} is not the nearest to {t}", met.t());
        }
        _ => panic!("{ray:?} {corners:?}: {met:?}, not {expected:?}"),
    }
    match probe.meets(corners) {
        Verdict::Unsure => return false,
        Verdict::Miss => assert!(expected.is_none(), "{ray:?} {corners:?}: a miss, not {expected:?}"),
        Verdict::Hit(low, high) => {
            let [t, ..] = expected.unwrap_or_else(|| panic!("{ray:?} {corners:?}: a hit, not a miss"));
            let [low, high] = [low, high].map(|x| RBig::try_from(x).expect("finite"));
            assert!(low <= t && t <= high, "{ray:?} {corners:?}: {t} not in {low} to {high}");
        }
    }
    // The boxes around it, and around it alone in a direction, let pass what is met.
    if let Some(met) = &met {
        let entry = probe.enters(&Aabb::of_points(*corners), f64::INFINITY);
        let entry = RBig::try_from(entry.expect("the box is entered")).expect("finite");
        assert!(entry <= by_fractions(ray, corners).expect("met")[0], "{ray:?} {corners:?} {met:?}");
    }
    true
}

/// Whether no float lies nearer.
fn nearest_float(x: f32, t: &RBig) -> bool {
    let apart = |x: f32| {
        let d = RBig::try_from(x).expect("finite") - t;
        if d < RBig::ZERO { -d } else { d }
    };
    [x.next_up(), x.next_down()].iter().all(|other| !other.is_finite() || apart(x) <= apart(*other))
}

/// Coordinates: any between -4 and 4, small integers, or of any magnitude.
#[derive(Clone, Copy, Debug)]
enum Kind {
    Plain,
    Grid,
    Wild,
}

fn number(kind: Kind) -> BoxedStrategy<f32> {
    match kind {
        Kind::Plain => (-4.0f32..4.0).boxed(),
        Kind::Grid => (-4i8..=4).prop_map(f32::from).boxed(),
        Kind::Wild => prop_oneof![
            prop::num::f32::NORMAL | prop::num::f32::SUBNORMAL | prop::num::f32::ZERO,
            (-4i8..=4).prop_map(f32::from),
        ]
        .boxed(),
    }
}

fn point(kind: Kind) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(number(kind)).prop_map(Vec3::from_array)
}

fn triangle(kind: Kind) -> impl Strategy<Value = [Vec3; 3]> {
    [point(kind), point(kind), point(kind)]
}

/// A triangle, and a ray that goes anywhere or at a point of it, as far as its direction can say.
fn ray_and_triangle(kind: Kind) -> impl Strategy<Value = (Ray, [Vec3; 3])> {
    let ends = (number(kind), prop_oneof![3 => Just(f32::INFINITY), 1 => number(kind).prop_map(f32::abs)]);
    let aim = prop::option::weighted(
        0.7,
        (0u8..=4, 0u8..=4).prop_map(|(i, j)| [i.max(j), j].map(|i| f32::from(i) / 4.0)),
    );
    (triangle(kind), point(kind), point(kind), ends, aim)
        .prop_map(|(corners, origin, anywhere, (tnear, tfar), aim)| {
            let [a, b, c] = corners;
            let direction = match aim {
                Some([s, t]) => a + (b - a) * s + (c - b) * t - origin,
                None => anywhere,
            };
            let tnear = if tfar.is_finite() { tnear.abs() } else { 0.0 };
            (Ray::segment(origin, direction, tnear, tfar), corners)
        })
        .prop_filter("sound", |(ray, _)| Probe::new(ray).is_some())
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..Default::default() })]

    #[test]
    fn plain_numbers((ray, corners) in ray_and_triangle(Kind::Plain)) {
        check(&ray, &corners);
    }

    #[test]
    fn numbers_on_a_grid((ray, corners) in ray_and_triangle(Kind::Grid)) {
        check(&ray, &corners);
    }

    #[test]
    fn numbers_of_any_magnitude((ray, corners) in ray_and_triangle(Kind::Wild)) {
        check(&ray, &corners);
    }

    /// Rays whose determinants are next to zero: aimed at a point of an edge, or along the plane.
    #[test]
    fn rays_past_edges(
        corners in triangle(Kind::Plain), origin in point(Kind::Plain), s in 0.0f32..1.0, in_plane in any::<bool>(),
        nudge in prop::array::uniform3(-2i32..=2), tnear in 0.0f32..1.0,
    ) {
        let [a, b, c] = corners;
        let origin = if in_plane { a + (b - a) * s + (c - a) * (1.0 - 3.0 * s) } else { origin };
        let aim = a + (b - a) * s;
        let nudged = |x: f32, by: i32| f32::from_bits(x.to_bits().wrapping_add_signed(by));
        let direction = aim - origin;
        let direction =
            Vec3::new(nudged(direction.x, nudge[0]), nudged(direction.y, nudge[1]), nudged(direction.z, nudge[2]));
        let ray = Ray::segment(origin, direction, tnear, f32::INFINITY);
        prop_assume!(Probe::new(&ray).is_some());
        check(&ray, &corners);
    }
}

#[test]
fn double_precision_is_nearly_always_sure() {
    let mesh = shapes::soup(1000, 1);
    let rays = rays_through(&mesh, 100);
    let unsure = rays
        .iter()
        .map(|ray| {
            let probe = Probe::new(ray).expect("sound");
            let unsure = |id: &u32| probe.meets(&mesh.corners(*id)) == Verdict::Unsure;
            (0..1000).filter(unsure).count()
        })
        .sum::<usize>();
    assert!(unsure < 10, "{unsure} of 100,000");
}

const TRIANGLE: [Vec3; 3] = [Vec3::ZERO, Vec3::X, Vec3::Y];

fn met(ray: &Ray) -> Option<[f64; 3]> {
    check(ray, &TRIANGLE);
    exact::meet(ray, &TRIANGLE).map(|met| [met.t_f64(), met.u(), met.v()])
}

#[test]
fn edges_and_corners_belong_to_the_triangle() {
    let down = |x, y| Ray::new(Vec3::new(x, y, 2.0), Vec3::NEG_Z);
    let tiny = f32::from_bits(1);
    for (x, y) in [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0), (0.5, 0.5), (0.5, 0.0), (0.0, 0.25), (tiny, 0.5)] {
        assert_eq!(met(&down(x, y)), Some([2.0, f64::from(x), f64::from(y)]), "{x} {y}");
    }
    for (x, y) in [(-tiny, 0.5), (0.5, -tiny), (0.5f32.next_up(), 0.5), (1.0f32.next_up(), 0.0)] {
        assert_eq!(met(&down(x, y)), None, "{x} {y}");
    }
}

#[test]
fn what_is_seen_edge_on_or_has_no_area_is_not_hit() {
    let along = Ray::new(Vec3::new(-1.0, 0.25, 0.0), Vec3::X);
    assert_eq!(met(&along), None);
    // The least tilt that floats know makes it a hit.
    let tilted = Ray::new(Vec3::new(-1.0, 0.25, -f32::from_bits(1)), Vec3::new(1.0, 0.0, f32::from_bits(1)));
    assert_eq!(met(&tilted), Some([1.0, 0.0, 0.25]));
    let ray = Ray::new(Vec3::new(0.5, 0.5, 1.0), Vec3::NEG_Z);
    for corners in [[Vec3::ZERO, Vec3::ONE, Vec3::ONE * 3.0], [Vec3::ONE; 3]] {
        assert_eq!(exact::meet(&ray, &corners), None);
        assert!(!matches!(Probe::new(&ray).expect("sound").meets(&corners), Verdict::Hit(..)));
    }
}

#[test]
fn both_ends_of_the_interval_belong_to_it() {
    // A third is no float: the exact t is 1/3 on both sides of which floats lie.
    let third = |tnear, tfar| Ray::segment(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z * 3.0, tnear, tfar);
    let (below, above) = ((1f32 / 3.0).next_down(), 1f32 / 3.0);
    assert!(f64::from(above) > 1.0 / 3.0 && f64::from(below) < 1.0 / 3.0);
    assert!(met(&third(below, above)).is_some());
    assert_eq!(met(&third(above, f32::INFINITY)), None);
    assert_eq!(met(&third(0.0, below)), None);
    let one = |tnear, tfar| Ray::segment(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z, tnear, tfar);
    assert_eq!(met(&one(1.0, 1.0)), Some([1.0, 0.25, 0.25]));
    assert_eq!(met(&one(1f32.next_up(), 2.0)), None);
    assert_eq!(met(&one(0.0, 1f32.next_down())), None);
}

#[test]
fn a_t_beyond_all_floats_is_no_hit() {
    let slow = |z: f32| Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::new(0.0, 0.0, -z));
    assert_eq!(met(&slow(f32::from_bits(1))), None); // 2^149
    assert_eq!(met(&slow(127f32.exp2().recip())), Some([127f64.exp2(), 0.25, 0.25]));
    // 2^128 has no float; a hair less has one.
    let hair = 128f64.exp2().recip() as f32;
    assert_eq!(met(&slow(hair)), None);
    assert!(met(&slow(hair.next_up())).is_some());
}

#[test]
fn rays_that_make_no_sense_hit_nothing() {
    let mesh = Mesh {
        positions: TRIANGLE.into(),
        triangles: vec![[0, 1, 2]],
        colors: Colors::default(),
        ..Mesh::default()
    };
    let reference = Reference::new(&mesh);
    let good = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
    assert!(reference.any(&good) && reference.closest(&good).is_hit() && reference.meets(&good, 0).is_some());
    let nan = f32::NAN;
    let bad = [
        Ray { direction: Vec3::ZERO, ..good },
        Ray { direction: Vec3::new(0.0, -0.0, nan), ..good },
        Ray { direction: Vec3::new(0.0, 0.0, f32::NEG_INFINITY), ..good },
        Ray { origin: Vec3::new(0.25, nan, 1.0), ..good },
        Ray { origin: Vec3::new(0.25, 0.25, f32::INFINITY), ..good },
        Ray { tnear: nan, ..good },
        Ray { tfar: nan, ..good },
        Ray { tnear: 2.0, tfar: 0.5, ..good },
        Ray { tnear: f32::INFINITY, ..good },
    ];
    for ray in bad {
        assert!(!reference.any(&ray), "{ray:?}");
        assert_eq!(reference.closest(&ray), Truth::MISS, "{ray:?}");
        assert_eq!(reference.meets(&ray, 0), None, "{ray:?}");
    }
}

#[test]
fn the_lowest_of_equals_wins_and_the_others_are_ties() {
    // Numbers 0, 2 and 3 coincide in the place that is hit; 1 lies a rounding behind, 4 a float.
    let level = |z: f32| TRIANGLE.map(|p| p + Vec3::Z * z);
    let shifted = TRIANGLE.map(|p| p - Vec3::X * 0.125);
    let tilted = [Vec3::ZERO, Vec3::new(1.0, 0.0, -1e-8), Vec3::new(0.0, 1.0, 0.0)];
    let triangles = [TRIANGLE, tilted, shifted, TRIANGLE, level(-2f32.powi(-23))];
    let mesh = Mesh {
        positions: triangles.into_iter().flatten().collect(),
        triangles: (0..5).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        colors: Colors::default(),
        ..Mesh::default()
    };
    let truth = Reference::new(&mesh).closest(&Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z));
    assert_eq!((truth.primitive, truth.t, truth.t_f64), (0, 1.0, 1.0));
    assert_eq!((truth.u, truth.v), (0.25, 0.25));
    assert_eq!((truth.ties.as_slice(), truth.lowest()), ([1, 2, 3].as_slice(), 0));
    assert!([0, 1, 2, 3].iter().all(|&id| truth.names(id)) && !truth.names(4));
}

#[test]
fn triangles_at_infinity_are_not_there() {
    let mut positions: Vec<Vec3> = TRIANGLE.into();
    positions.push(Vec3::new(f32::NAN, 0.0, 0.0));
    positions.push(Vec3::new(0.0, f32::INFINITY, 0.0));
    let triangles = vec![[0, 1, 3], [0, 1, 4], [0, 1, 2]];
    let mesh = Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() };
    let reference = Reference::new(&mesh);
    let ray = Ray::new(Vec3::new(0.25, 0.25, 1.0), Vec3::NEG_Z);
    assert_eq!(reference.closest(&ray).primitive, 2);
    assert_eq!((reference.meets(&ray, 0), reference.meets(&ray, 1)), (None, None));
    assert!(!Reference::new(&Mesh::default()).any(&ray));
}

/// Scenes that are hard on a hierarchy: triangles of all sizes, on a grid, coincident, flat, far away.
fn scenes() -> Vec<(&'static str, Mesh)> {
    let moved = |mut mesh: Mesh, to: Vec3, scale: f32| {
        mesh.positions.iter_mut().for_each(|p| *p = *p * scale + to);
        mesh
    };
    let far = Vec3::new(148_376.0, 1234.0, -223_423.0);
    vec![
        ("soup", shapes::soup(500, 1)),
        ("slivers", shapes::slivers(300, 2)),
        ("boxes", shapes::boxes(500, 3)),
        ("lattice", shapes::lattice(500, 4)),
        ("grid", shapes::grid(12)),
        ("coincident", shapes::coincident(40)),
        ("sphere", shapes::sphere(3)),
        ("far sphere", moved(shapes::sphere(2), far, 100.0)),
        ("tiny boxes", moved(shapes::boxes(200, 5), Vec3::ZERO, 1e-38)),
        ("huge boxes", moved(shapes::boxes(200, 6), Vec3::ZERO, 1e37)),
        ("three", shapes::soup(3, 7)),
    ]
}

/// Rays inward, along axes, at corners, and of bounded length.
fn rays_through(mesh: &Mesh, count: u32) -> Vec<Ray> {
    let bounds = mesh.bounds();
    let mut state = 0.0f64;
    let mut number = || {
        state = (state + 0.618_033_988_749_895).fract();
        state as f32
    };
    (0..count)
        .map(|i| {
            let mut inside = || bounds.min + bounds.extent() * Vec3::new(number(), number(), number());
            let (from, to) = (inside(), inside());
            let corner = mesh.corners(i * 7919 % mesh.triangles.len() as u32)[i as usize % 3];
            match i % 5 {
                0 => Ray::new(from, to - from),
                1 => Ray::new(from.round(), Vec3::AXES[i as usize % 3] * if i % 2 == 0 { 1.0 } else { -1.0 }),
                2 => Ray::new(from, corner - from),
                3 => Ray::new(Vec3::new(corner.x, from.y, corner.z), Vec3::new(0.0, corner.y - from.y, 0.0)),
                _ => Ray::segment(from, to - from, 0.25, 0.75),
            }
        })
        .filter(|ray| Probe::new(ray).is_some())
        .collect()
}

#[test]
fn the_hierarchy_loses_nothing() {
    for (name, mesh) in scenes() {
        let reference = Reference::new(&mesh);
        let rays = rays_through(&mesh, 600);
        let (mut hits, mut ties) = (0, 0);
        for ray in &rays {
            let brute = reference.nearest(ray, 0..mesh.triangles.len() as u32);
            assert_eq!(reference.closest(ray), brute, "{name}, {ray:?}");
            assert_eq!(reference.any(ray), brute.is_hit(), "{name}, {ray:?}");
            hits += usize::from(brute.is_hit());
            ties += usize::from(!brute.ties.is_empty());
        }
        assert!(hits * 20 > rays.len() && rays.len() > 500, "{name}: {hits} of {} rays hit", rays.len());
        let tied = ["boxes", "lattice", "grid", "coincident"].contains(&name);
        assert!(!tied || ties > 20, "{name}: only {ties} rays are tied");
    }
}
