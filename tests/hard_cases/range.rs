//! Coordinates near both ends of the floats' range: nothing overflows, nothing vanishes.

use crate::aim::at_seams;
use crate::meshes::{Closed, cube, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::Scene;
use raypack::Vec3;
use raypack::geometry::Ray;

/// A closed surface of a magnitude, in the middle of the coordinates.
fn of_size(closed: &Closed, scale: f32) -> Closed {
    closed.placed(&format!("{scale:e}"), scale, Vec3::ZERO)
}

#[test]
fn surfaces_of_any_magnitude_are_closed() {
    // The least is one whose vertices are some 10,000 of the least floats apart.
    for scale in [1e-40, 1e-38, 1e-30, 1e-20, 1e-10, 1e10, 1e20, 1e30, 1e37] {
        for closed in [sphere(3), cube(4), twisted_ring(24, 4, 1)] {
            let closed = of_size(&closed, scale);
            for seed in seeds() {
                let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
                let mut numbers = Numbers::new(seed, 1);
                let rays: Vec<Ray> = (0..300).map(|_| at_seams(&closed, &mut numbers)).collect();
                scene.check_closed(&rays);
            }
        }
    }
}

#[test]
fn a_box_from_end_to_end_of_the_range() {
    let closed = of_size(&cube(3), f32::MAX);
    for seed in seeds() {
        let mut scene = Scene::new("all there is", seed, closed.mesh.clone());
        let mut numbers = Numbers::new(seed, 2);
        let rays: Vec<Ray> =
            (0..500).map(|_| Ray::new(numbers.vector() * 1e38, numbers.direction() * 1e38)).collect();
        scene.check_closed(&rays);
    }
}

#[test]
fn directions_of_any_length_meet_the_same() {
    let closed = sphere(3);
    for seed in seeds() {
        let mut scene = Scene::new("directions of any length", seed, closed.mesh.clone());
        let mut numbers = Numbers::new(seed, 3);
        let rays: Vec<Ray> = (0..300).map(|_| at_seams(&closed, &mut numbers)).collect();
        let plain = scene.trace(&rays);
        // Powers of two, so that directions stay the same to the bit (the least ones' distances would
        // be beyond the floats).
        for exponent in [-100, -60, -31, -1, 1, 31, 60, 100] {
            let factor = f32::powi(2.0, exponent);
            let stretched: Vec<Ray> =
                rays.iter().map(|ray| Ray { direction: ray.direction * factor, ..*ray }).collect();
            scene.check(&stretched, |accuracy, i, hit| {
                let expected = plain.of(accuracy)[i];
                let same = hit.primitive == expected.primitive
                    && (hit.u, hit.v) == (expected.u, expected.v)
                    && hit.t == expected.t / factor;
                (!same).then(|| format!("instead of {expected:?} in directions {factor:e} as long"))
            });
        }
    }
}
