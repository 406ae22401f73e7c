//! Lights against what is known of them in closed form.

use super::*;
use std::f64::consts::PI;

/// A square around `center` in a plane at right angles to Y, of two triangles.
fn square(first: u32, center: Vec3, side: f32, radiance: [Vec3; 2]) -> [(u32, [Vec3; 3], Vec3); 2] {
    let at = |x: f32, z: f32| center + Vec3::new(x, 0.0, z) * side;
    let [a, b, c, d] = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
    [(first, [a, b, c], radiance[0]), (first + 1, [a, c, d], radiance[1])]
}

/// The mean of `f` over `count` samples.
fn mean(emitters: &Emitters, count: u32, f: impl Fn(&EmitterSample) -> f64) -> f64 {
    mean_of(count, |pick, uv| f(&emitters.sample(pick, uv)))
}

/// The mean over `count` pairs of pairs of numbers.
fn mean_of(count: u32, mut f: impl FnMut([f32; 2], [f32; 2]) -> f64) -> f64 {
    // An additive recurrence in four dimensions.
    let fraction = |i: u32, step: f64| (f64::from(i) * step).fract() as f32 * 0.999_999_9;
    let of = |i: u32| {
        let pick = [fraction(i, 0.856_674_883_854_502_9), fraction(i, 0.733_891_856_627_126)];
        f(pick, [fraction(i, 0.628_706_721_307_471_9), fraction(i, 0.538_597_257_252_359_5)])
    };
    (0..count).map(of).sum::<f64>() / f64::from(count)
}

/// The green light on a surface at the origin that faces +Y.
fn irradiance(emitters: &Emitters, count: u32) -> f64 {
    mean(emitters, count, green)
}

/// The same, with lights chosen for that point.
fn irradiance_for(emitters: &Emitters, count: u32) -> f64 {
    mean_of(count, |pick, uv| green(&emitters.sample_for(Vec3::ZERO, pick, uv)))
}

/// What one sample says of that light.
fn green(s: &EmitterSample) -> f64 {
    let way = s.position.as_dvec3();
    let toward = way.normalize();
    let cosines = toward.y.max(0.0) * toward.dot(s.normal.as_dvec3()).abs();
    f64::from(s.radiance.y) * cosines / way.length_squared() / f64::from(s.pdf_area)
}

#[test]
fn below_a_square_light() {
    // The form factor from a small surface to a parallel rectangle with a corner over it (Howell, "A catalog of
    // radiation heat transfer configuration factors", B-4), of which there are four.
    let form = |a: f64| {
        let slope = (1.0 + a * a).sqrt();
        4.0 / (2.0 * PI) * 2.0 * (a / slope * (a / slope).atan())
    };
    for (height, side) in [(1.0, 1.0), (2.0, 1.0), (0.5, 2.0)] {
        let light = square(4, Vec3::Y * height, side, [Vec3::splat(3.0); 2]);
        let emitters = Emitters::new(light).expect("a light");
        let expected = PI * 3.0 * form(f64::from(side / 2.0 / height));
        let found = irradiance(&emitters, 20_000);
        assert!((found / expected - 1.0).abs() < 5e-3, "{height} {side}: {found} {expected}");
    }
}

#[test]
fn lights_of_different_strength_and_size_add_up() {
    let near = square(0, Vec3::Y, 1.0, [Vec3::ONE; 2]);
    let far = square(9, Vec3::new(1.0, 4.0, 0.5), 1.5, [Vec3::new(40.0, 20.0, 10.0); 2]);
    let apart = [near, far].map(|light| irradiance(&Emitters::new(light).expect("a light"), 20_000));
    let together = Emitters::new(near.into_iter().chain(far)).expect("lights");
    assert_eq!((together.count(), together.bytes()), (4, 4 * 68 + 2 * 28));
    let found = irradiance(&together, 50_000);
    assert!((found / (apart[0] + apart[1]) - 1.0).abs() < 1e-2, "{found} {apart:?}");
    let found = irradiance_for(&together, 50_000);
    assert!((found / (apart[0] + apart[1]) - 1.0).abs() < 1e-2, "{found} {apart:?}");
}

#[test]
fn far_away_it_is_a_point() {
    for distance in [20.0f32, 40.0] {
        let light = square(0, Vec3::new(0.6, 0.8, 0.0) * distance, 0.5, [Vec3::splat(7.0); 2]);
        let emitters = Emitters::new(light).expect("a light");
        // Intensity is radiance by area by cosine; the surface's own cosine is the same.
        let expected = 7.0 * 0.25 * 0.8 * 0.8 / f64::from(distance * distance);
        let found = irradiance(&emitters, 2000);
        assert!((found / expected - 1.0).abs() < 1e-2, "{distance}: {found} {expected}");
    }
}

#[test]
fn densities_are_of_all_points_of_all_lights() {
    let dim = square(10, Vec3::ZERO, 2.0, [Vec3::splat(0.5), Vec3::new(0.0, 0.0, 1.0)]);
    let bright = square(3, Vec3::X * 4.0, 0.125, [Vec3::splat(900.0), Vec3::splat(100.0)]);
    let emitters = Emitters::new(dim.into_iter().chain(bright)).expect("lights");
    // Over all areas they add up to 1.
    let areas = [(10, 2.0), (11, 2.0), (3, 0.007_812_5), (4, 0.007_812_5)];
    let sum: f32 = areas.iter().map(|&(primitive, area)| emitters.pdf_area(primitive) * area).sum();
    assert!((sum - 1.0).abs() < 1e-6, "{sum}");
    for (primitive, area) in areas {
        let often = mean(&emitters, 50_000, |s| f64::from(u8::from(s.primitive == primitive)));
        let expected = f64::from(emitters.pdf_area(primitive) * area);
        assert!((often - expected).abs() < 1e-3, "{primitive}: {often} {expected}");
        mean(&emitters, 100, |s| {
            assert_eq!(s.pdf_area, emitters.pdf_area(s.primitive));
            0.0
        });
    }
    assert_eq!((emitters.pdf_area(0), emitters.pdf_area(5), emitters.pdf_area(u32::MAX)), (0.0, 0.0, 0.0));
    let power = (0.5 * 2.0 + 0.0722 * 2.0 + 1000.0 * 0.007_812_5) * 2.0 * PI;
    assert!((emitters.power() / power - 1.0).abs() < 1e-6, "{}", emitters.power());
    let bounds = emitters.bounds();
    assert_eq!((bounds.min, bounds.max), (Vec3::new(-1.0, 0.0, -1.0), Vec3::new(4.0625, 0.0, 1.0)));
}

#[test]
fn what_gives_off_nothing_is_no_light() {
    let [(_, corners, _), _] = square(0, Vec3::ZERO, 1.0, [Vec3::ONE; 2]);
    let [a, b, _] = corners;
    let nothing = [
        (0, corners, Vec3::ZERO),
        (1, [a, b, a], Vec3::ONE),
        (2, [a, a.lerp(b, 0.5), b], Vec3::ONE),
        (3, [a, b, Vec3::NAN], Vec3::ONE),
        (4, [a, b, Vec3::INFINITY], Vec3::ONE),
        (5, corners, Vec3::NAN),
        (6, corners, Vec3::INFINITY),
        (7, corners, Vec3::NEG_ONE),
    ];
    assert!(Emitters::new(nothing).is_none());
    assert!(Emitters::new([]).is_none());
    let twice = [(9, corners, Vec3::ONE), (9, corners, Vec3::splat(2.0))];
    let emitters = Emitters::new(nothing.into_iter().chain(twice)).expect("a light");
    assert_eq!(emitters.count(), 1);
    assert_eq!(emitters.sample([0.0; 2], [0.5; 2]).radiance, Vec3::ONE);
    assert_eq!(emitters.pdf_area(3), 0.0);
}

#[test]
fn lights_of_any_scale() {
    for scale in [1e-15f32, 1.0, 1e15] {
        let light = square(0, Vec3::Y * scale, scale, [Vec3::ONE; 2]);
        let emitters = Emitters::new(light).expect("a light");
        let s = emitters.sample([0.9, 0.1], [0.2, 0.7]);
        assert_eq!((s.primitive, s.normal), (1, Vec3::NEG_Y), "{scale}");
        assert!((s.pdf_area * scale * scale - 1.0).abs() < 1e-5, "{scale}: {}", s.pdf_area);
    }
}

#[test]
fn a_hundred_thousand_lights() {
    let lights = (0..50_000u32).flat_map(|i| {
        let radiance = Vec3::splat((i % 100) as f32 + 1.0);
        square(2 * i, Vec3::new((i % 250) as f32, 5.0, (i / 250) as f32), 0.5, [radiance; 2])
    });
    let emitters = Emitters::new(lights).expect("lights");
    assert_eq!(emitters.count(), 100_000);
    assert!((82..=96).contains(&(emitters.bytes() / 100_000)));
    // A light of strength s is chosen as often as s: the mean strength is that of squares by that of firsts, 67.
    let strength = mean(&emitters, 100_000, |s| f64::from(s.radiance.x));
    assert!((strength - 67.0).abs() < 0.3, "{strength}");
}

/// A street of lamps of different strength, the first over the origin.
fn street(lamps: u32) -> Emitters {
    let lamp = |i: u32| {
        let place = Vec3::new(i as f32 * 3.0, 2.0 + (i % 3) as f32, (i % 7) as f32);
        square(2 * i, place, 0.5, [Vec3::splat(1.0 + (i % 5) as f32), Vec3::ONE])
    };
    Emitters::new((0..lamps).rev().flat_map(lamp)).expect("lights")
}

#[test]
fn for_any_point_all_lights_are_chosen_from() {
    // Numbers of lights that fill a tree's leaves in different ways.
    for lamps in [1, 2, 3, 5, 8, 33, 100] {
        let emitters = street(lamps);
        for point in [Vec3::ZERO, Vec3::new(40.0, 2.0, 1.0), Vec3::splat(1e6), Vec3::splat(f32::MAX)] {
            // Each has an area of an eighth, so their densities add up to eight.
            let sum: f32 = (0..2 * lamps).map(|primitive| emitters.pdf_area_for(point, primitive)).sum();
            assert!((sum - 8.0).abs() < 1e-4, "{lamps} {point}: {sum}");
            assert_eq!(emitters.pdf_area_for(point, 2 * lamps), 0.0);
            let mut seen = std::collections::HashMap::<u32, u32>::new();
            mean_of(4000, |pick, uv| {
                let s = emitters.sample_for(point, pick, uv);
                assert_eq!(s.pdf_area, emitters.pdf_area_for(point, s.primitive), "{lamps} {point}");
                *seen.entry(s.primitive).or_default() += 1;
                0.0
            });
            for (primitive, count) in seen {
                let expected = f64::from(emitters.pdf_area_for(point, primitive)) / 8.0 * 4000.0;
                assert!((f64::from(count) - expected).abs() < 25.0, "{lamps} {point}: {count} {expected}");
            }
        }
    }
}

#[test]
fn near_lights_count_for_more() {
    let emitters = street(2000);
    // Light by light, each on a grid.
    let grid = (0..36).map(|i| [i % 6, i / 6].map(|k| (k as f32 + 0.5) / 6.0));
    let one = |light: &Emitter| {
        let pdf_area = (1.0 / light.area()) as f32;
        grid.clone().map(|uv| green(&light.point(uv, pdf_area))).sum::<f64>() / 36.0
    };
    let exact: f64 = emitters.lights.iter().map(one).sum();
    let found = irradiance_for(&emitters, 50_000);
    assert!((found / exact - 1.0).abs() < 1e-2, "{found} {exact}");
    // The mean square of how far off one sample is.
    let spread = |green: &dyn Fn([f32; 2], [f32; 2]) -> f64| {
        mean_of(20_000, |pick, uv| (green(pick, uv) / exact - 1.0).powi(2))
    };
    let by_power = spread(&|pick, uv| green(&emitters.sample(pick, uv)));
    let by_distance = spread(&|pick, uv| green(&emitters.sample_for(Vec3::ZERO, pick, uv)));
    assert!(by_distance * 100.0 < by_power, "{by_distance} {by_power}");
}

#[test]
fn triangles_are_filled_evenly() {
    const N: u32 = 128;
    let points = (0..N * N).map(|i| uniform_triangle([i % N, i / N].map(|k| (k as f32 + 0.5) / N as f32)));
    let (mut first, mut squares, mut quarters) = (0.0, 0.0, [0; 4]);
    for [u, v] in points {
        let w = 1.0 - u - v;
        assert!(u >= 0.0 && v >= 0.0 && w >= -1e-6);
        first += f64::from(u);
        squares += f64::from(u * v);
        quarters[[u, v, w].iter().position(|&x| x > 0.5).unwrap_or(3)] += 1;
    }
    let count = f64::from(N * N);
    assert!((first / count - 1.0 / 3.0).abs() < 1e-3 && (squares / count - 1.0 / 12.0).abs() < 1e-3);
    // The triangles that the middles of the sides make of it are of the same size.
    assert!(quarters.iter().all(|&n| (f64::from(n) / count - 0.25).abs() < 0.01), "{quarters:?}");
    for corner in [[0.0, 0.0], [0.999_999_94, 0.0], [0.0, 0.999_999_94], [0.999_999_94; 2]] {
        let [u, v] = uniform_triangle(corner);
        assert!(u + v <= 1.0, "{corner:?}");
    }
}
