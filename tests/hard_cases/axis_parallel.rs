//! Rays along the axes over meshes whose faces, edges and corners lie on whole numbers, as do the rays
//! and the tree's planes: everything coincides. And rays with components of zero of either sign.

use crate::meshes::{cube, mapped, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use glam::swizzles::Vec3Swizzles;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::mesh::generate::shapes;

const AXES: [Vec3; 6] = [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z];

#[test]
fn a_cube_of_whole_numbers_is_hit_where_it_is() {
    // From -4 to 4. Rays at every crossing of the grid, its border and one step beyond included.
    let mesh = mapped(&cube(8).mesh, |p| p * 4.0);
    let mut rays = Vec::new();
    let mut expected = Vec::new();
    for way in AXES {
        let (side, up) = (way.yzx(), way.zxy());
        for i in -10..=10 {
            for j in -10..=10 {
                // Half steps fall between the corners, on edges, diagonals and faces.
                let (a, b) = (i as f32 * 0.5, j as f32 * 0.5);
                let over = a.abs() <= 4.0 && b.abs() <= 4.0;
                for start in [-7.0, -4.0, 0.5] {
                    rays.push(Ray::new(way * start + side * a + up * b, way * 0.5));
                    // The border's rays run in the plane of a side, but meet the side across.
                    expected.push(over.then_some(if start < -3.0 { (-4.0 - start) * 2.0 } else { 7.0 }));
                }
            }
        }
    }
    let mut scene = Scene::new("a cube of whole numbers", 0, mesh);
    scene.check(&rays, |accuracy, i, hit| {
        let t = hit.is_hit().then_some(hit.t);
        let wrong =
            if CLOSED.contains(&accuracy) { t != expected[i] } else { t.is_some() && t != expected[i] };
        wrong.then(|| format!("t should be {:?}", expected[i]))
    });
}

#[test]
fn towers_and_lattices() {
    for seed in seeds() {
        for (name, mesh) in [("towers", shapes::boxes(700, seed)), ("lattice", shapes::lattice(700, seed))] {
            let bounds = mesh.bounds();
            let mut scene = Scene::new(name, seed, mesh);
            let mut numbers = Numbers::new(seed, 2);
            let rays: Vec<Ray> = (0..1500)
                .map(|_| {
                    let origin = (bounds.center() + numbers.vector() * bounds.extent() * 0.7).round()
                        + numbers.lattice(0, 1) * 0.5;
                    // Along an axis, a diagonal of the lattice, or a knight's move.
                    let direction = match numbers.below(3) {
                        0 => numbers.pick(&AXES),
                        1 => numbers.lattice(-1, 1),
                        _ => numbers.lattice(-2, 2),
                    };
                    Ray::new(origin, if direction == Vec3::ZERO { Vec3::Y } else { direction })
                })
                .collect();
            scene.trace(&rays);
        }
    }
}

#[test]
fn a_ball_of_whole_numbers_stays_closed() {
    for seed in seeds() {
        for steps in [4.0, 16.0, 64.0] {
            let mesh = mapped(&sphere(4).mesh, |p| (p * steps).round());
            let mut scene = Scene::new(format!("a ball of {steps} steps"), seed, mesh);
            let mut numbers = Numbers::new(seed, 3);
            let rays: Vec<Ray> = (0..700)
                .map(|_| {
                    let origin = numbers.lattice(-1, 1);
                    match numbers.below(3) {
                        0 => Ray::new(origin, numbers.pick(&AXES)),
                        1 => Ray::new(origin, numbers.lattice(-2, 2) + Vec3::splat(0.25)),
                        _ => Ray::new(origin * 1000.0 * steps, origin * -7.0 + Vec3::new(0.0, 0.0, 1e-9)),
                    }
                })
                .collect();
            let crossing: Vec<Ray> = rays.into_iter().filter(|ray| ray.origin.length() <= 2.0).collect();
            scene.check_closed(&crossing);
        }
    }
}

#[test]
fn the_sign_of_zero_says_nothing() {
    for seed in seeds() {
        let mesh = shapes::lattice(400, seed);
        let extent = mesh.bounds().max.max_element() as i32;
        let mut scene = Scene::new("signs of zero", seed, mesh);
        let mut numbers = Numbers::new(seed, 4);
        let (plus, minus): (Vec<Ray>, Vec<Ray>) = (0..800)
            .map(|_| {
                let ray = Ray::new(numbers.lattice(0, extent), numbers.pick(&AXES) + numbers.pick(&AXES));
                let ray = if ray.direction == Vec3::ZERO { Ray::new(ray.origin, Vec3::X) } else { ray };
                let with = |zero| Ray {
                    origin: with_zero(ray.origin, zero),
                    direction: with_zero(ray.direction, zero),
                    ..ray
                };
                (with(0.0), with(-0.0))
            })
            .unzip();
        let (plus, minus) = (scene.trace(&plus), scene.trace(&minus));
        for accuracy in Accuracy::ALL {
            // `==` takes zeros of either sign for equal.
            assert_eq!(plus.of(accuracy), minus.of(accuracy), "{accuracy}, RAYPACK_SEED={seed}");
        }
    }
}

/// The same with zeros of this sign.
fn with_zero(v: Vec3, zero: f32) -> Vec3 {
    Vec3::from_array(v.to_array().map(|x| if x == 0.0 { zero } else { x }))
}
