//! Triangles up to a million times longer than wide, in closed surfaces and loose.

use crate::aim::at_seams;
use crate::meshes::{Closed, cube, globe, mapped, of_triangles, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::Scene;
use raypack::Vec3;
use raypack::geometry::Ray;

/// Closed surfaces all of whose triangles, or many, are slivers.
fn closed() -> Vec<Closed> {
    let stretched = |closed: &Closed, by: Vec3| Closed {
        name: format!("{} stretched by {by}", closed.name),
        mesh: mapped(&closed.mesh, |p| p * by),
        core: closed.core.clone(),
        clearance: closed.clearance * by.min_element(),
    };
    vec![
        stretched(&sphere(3), Vec3::new(1.0, 1e6, 1.0)),
        stretched(&sphere(3), Vec3::new(1e-3, 1.0, 1e3)),
        stretched(&cube(4), Vec3::new(1e6, 1.0, 1.0)),
        stretched(&cube(4), Vec3::new(1.0, 1e-6, 1.0)),
        stretched(&globe(2, 500), Vec3::new(1.0, 1e3, 1.0)),
    ]
}

#[test]
fn closed_surfaces_of_slivers_stay_closed() {
    for closed in closed() {
        for seed in seeds() {
            let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
            let mut numbers = Numbers::new(seed, 1);
            let rays: Vec<Ray> = (0..200)
                .map(|_| match numbers.below(2) {
                    // From outside, rays would pass the core by: it is thinner than the distance's rounding.
                    0 => Ray::new(closed.inside(&mut numbers), numbers.direction()),
                    _ => {
                        let origin = closed.inside(&mut numbers);
                        let target = at_seams(&closed, &mut numbers);
                        Ray::new(origin, target.at(1.0) - origin)
                    }
                })
                .collect();
            scene.check_closed(&rays);
        }
    }
}

#[test]
fn loose_slivers_are_hit_alike_by_all() {
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 2);
        let slivers: Vec<[Vec3; 3]> = (0..150)
            .map(|_| {
                let (a, b) = (numbers.vector(), numbers.vector());
                let width = numbers.pick(&[1e-3, 1e-5, 1e-6, 1e-7]);
                let c = a + (b - a) * numbers.unit() + numbers.vector() * width;
                [a, b, c]
            })
            .collect();
        let rays: Vec<Ray> = (0..1500)
            .map(|_| {
                let [a, b, c] = numbers.pick(&slivers);
                let target = a + (b - a) * numbers.unit() + (c - a) * (numbers.unit() * 0.5);
                let origin = match numbers.below(3) {
                    // Next to edge-on.
                    0 => target + (b - a) * (1.0 + numbers.unit()) + numbers.vector() * 1e-6,
                    _ => numbers.vector() * 3.0,
                };
                Ray::new(origin, target - origin)
            })
            .collect();
        Scene::new("loose slivers", seed, of_triangles(slivers)).trace(&rays);
    }
}
