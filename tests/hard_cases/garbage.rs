//! Meshes that nobody meant: random bit patterns for floats, indices from anywhere, thousands of
//! copies. Either a clean error or a correct tree.

use crate::meshes::{joined, of_triangles};
use crate::numbers::{Numbers, seeds};
use crate::scene::Scene;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::kdtree::{BuildParams, MAX_DEPTH};
use raypack::mesh::Mesh;
use raypack::mesh::generate::shapes;
use raypack::traverse::Accel;

/// A float of any bits whatever.
fn any_float(numbers: &mut Numbers) -> f32 {
    f32::from_bits(numbers.bits() as u32)
}

/// A finite float of any magnitude, half of them from a few that are known for trouble.
fn finite(numbers: &mut Numbers) -> f32 {
    const TROUBLE: [f32; 10] =
        [0.0, -0.0, 1.0, -1.0, f32::MAX, f32::MIN, f32::MIN_POSITIVE, f32::EPSILON, 1e-45, -1e-45];
    if numbers.below(2) == 0 {
        return numbers.pick(&TROUBLE);
    }
    loop {
        let x = any_float(numbers);
        if x.is_finite() {
            return x;
        }
    }
}

fn point(numbers: &mut Numbers, number: fn(&mut Numbers) -> f32) -> Vec3 {
    Vec3::new(number(numbers), number(numbers), number(numbers))
}

fn ray(numbers: &mut Numbers, number: fn(&mut Numbers) -> f32) -> Ray {
    let (tnear, tfar) =
        if numbers.below(2) == 0 { (0.0, f32::INFINITY) } else { (number(numbers), number(numbers)) };
    Ray::segment(point(numbers, number), point(numbers, number), tnear, tfar)
}

#[test]
fn any_bits_are_refused_or_built() {
    let (mut built, mut refused) = (0, 0);
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 1);
        for _ in 0..300 {
            let count = 1 + numbers.below(12);
            // One in three meshes has only finite floats.
            let number = if numbers.below(3) == 0 { finite } else { any_float };
            let positions: Vec<Vec3> =
                (0..3 + numbers.below(9)).map(|_| point(&mut numbers, number)).collect();
            // One in three meshes has indices from anywhere.
            let bound = if numbers.below(3) == 0 { u32::MAX as usize } else { positions.len() };
            let triangles = (0..count).map(|_| [0; 3].map(|_: u32| numbers.below(bound) as u32)).collect();
            let mesh = Mesh { positions, triangles, ..Mesh::default() };
            match Accel::build(&mesh, &BuildParams::default()) {
                Err(error) => {
                    refused += 1;
                    let message = error.to_string();
                    assert!(message.starts_with("unusable mesh: ") && !message.contains('\n'), "{message}");
                }
                Ok(accel) => {
                    built += 1;
                    let used = mesh.triangles.iter().flatten();
                    assert!(used.clone().all(|&i| mesh.positions[i as usize].is_finite()), "seed {seed}");
                    assert_eq!(accel.tree().validate(), Ok(()), "seed {seed}");
                }
            }
        }
    }
    assert!(built > 100 && refused > 100, "{built} built, {refused} refused");
}

#[test]
fn kernels_agree_about_finite_garbage() {
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 2);
        for _ in 0..40 {
            let count = 1 + numbers.below(20);
            let mesh = of_triangles((0..count).map(|_| [0; 3].map(|_: u32| point(&mut numbers, finite))));
            let number = if numbers.below(2) == 0 { finite } else { any_float };
            let mut rays: Vec<Ray> = (0..120).map(|_| ray(&mut numbers, number)).collect();
            // And some that have a chance to hit.
            for _ in 0..40 {
                let [a, b, c] = mesh.corners(numbers.below(count) as u32);
                let aim = a * 0.25 + b * 0.25 + c * 0.5;
                let origin = point(&mut numbers, finite) * 0.5;
                rays.push(Ray::new(origin, aim * 0.5 - origin * 0.5));
            }
            // What a mode answers may be poor at such scales; it must be the same everywhere.
            Scene::new("finite garbage", seed, mesh).trace(&rays);
        }
    }
}

#[test]
fn trees_of_hopeless_meshes_stay_small() {
    let mut numbers = Numbers::new(1, 3);
    let needles = (0..2000).map(|_| {
        let a = numbers.vector();
        [a, a + numbers.vector() * 2.0, a + Vec3::splat(1e-7)]
    });
    let meshes: [(&str, Mesh); 5] = [
        ("copies of one triangle", shapes::coincident(5000)),
        ("points", of_triangles((0..5000).map(|i| [Vec3::splat((i % 7) as f32); 3]))),
        ("needles through one place", of_triangles(needles)),
        (
            "fans about a corner",
            of_triangles((0..3000).map(|i| {
                let angle = i as f32 * 0.002;
                [
                    Vec3::ZERO,
                    Vec3::new(angle.cos(), angle.sin(), 1.0),
                    Vec3::new(-angle.sin(), angle.cos(), 1.0),
                ]
            })),
        ),
        ("copies in many places", joined(&[shapes::coincident(2000), shapes::coincident(2000)])),
    ];
    for (name, mesh) in meshes {
        for traversal_cost in [0.01, 5.0] {
            let params = BuildParams { traversal_cost, min_leaf: 1, ..Default::default() };
            let accel = Accel::build(&mesh, &params).expect(name);
            let stats = accel.stats();
            assert!(stats.depth <= MAX_DEPTH, "{name}: {} deep", stats.depth);
            let bound = f64::from(params.max_duplication) * 1.01;
            assert!(stats.references_per_triangle <= bound, "{name}: {}", stats.references_per_triangle);
            assert_eq!(accel.tree().validate(), Ok(()), "{name}");
        }
    }
}

#[test]
fn of_many_copies_the_first_is_hit() {
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 4);
        let ball = shapes::soup(60, seed);
        let corners: Vec<[Vec3; 3]> = (0..60).map(|i| ball.corners(i)).collect();
        let mut scene = Scene::new("copies", seed, joined(&vec![of_triangles(corners); 20]));
        let rays: Vec<Ray> = (0..400)
            .map(|_| {
                let [a, b, c] = ball.corners(numbers.below(60) as u32);
                let origin = numbers.direction() * 3.0;
                Ray::new(origin, a * 0.25 + b * 0.25 + c * 0.5 - origin)
            })
            .collect();
        let mut hits = 0;
        scene.check(&rays, |_, _, hit| {
            (hit.is_hit() && hit.primitive >= 60).then(|| "not the lowest id".into())
        });
        for accuracy in Accuracy::ALL {
            hits += scene.trace(&rays).of(accuracy).iter().filter(|hit| hit.is_hit()).count();
        }
        assert!(hits > 100, "{hits} hits");
    }
}

/// Three triangles whose coordinates span sixty decades: clipped edges run nearly along planes.
#[test]
fn coordinates_of_sixty_decades_make_a_whole_tree() {
    let mesh = of_triangles(
        [
            [
                [1.17364434e-32, 9304.287, -8.8621675e17],
                [-3.890362e-6, -2.2713898e26, -5.2122404e-17],
                [1.8539609e-7, 94231170.0, 7.1314965e35],
            ],
            [
                [1.8539609e-7, 94231170.0, 7.1314965e35],
                [4.7468106e-8, 9.906747e29, 1.3934823e-36],
                [9.249948e-17, 290805.28, -9.449688e-33],
            ],
            [
                [-1.5773913e-26, -1.7329934e-35, -1.3738769e34],
                [4.899812e22, 1.0598657e34, -1.6023515e-9],
                [2.7760792e-26, -89.54573, 4.2571238e32],
            ],
        ]
        .map(|corners| corners.map(Vec3::from_array)),
    );
    let params = BuildParams { traversal_cost: 0.2, min_leaf: 1, ..Default::default() };
    let accel = Accel::build(&mesh, &params).expect("builds");
    assert_eq!(accel.tree().validate(), Ok(()));

    let mut numbers = Numbers::new(1, 5);
    for _ in 0..2000 {
        let count = 1 + numbers.below(12);
        let mesh = of_triangles((0..count).map(|_| [0; 3].map(|_: u32| point(&mut numbers, finite))));
        let accel = Accel::build(&mesh, &params).expect("builds");
        assert_eq!(accel.tree().validate(), Ok(()), "{mesh:?}");
    }
}
