//! Secondary rays start just off the surface: they do not hit what they leave, and they do not
//! come out on the other side of a wall, at any scale and place.

use crate::meshes::{Closed, cube, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::{Hit, Ray, triangle};
use raypack::render::offset_point;

/// Where closed surfaces are put: scale, and offset in units of the scale.
fn places() -> Vec<(f32, Vec3)> {
    let offsets = [Vec3::ZERO, Vec3::new(3.0, -7.0, 1.0), Vec3::new(-2000.0, 500.0, 900.0)];
    [1e-3, 1.0, 1e3, 1e6].into_iter().flat_map(|scale| offsets.map(|offset| (scale, offset))).collect()
}

fn surfaces() -> Vec<Closed> {
    let mut all = Vec::new();
    for (scale, offset) in places() {
        for closed in [sphere(3), cube(3), twisted_ring(24, 4, 1)] {
            // Some of the ring's edges are sharper than a right angle, and so far away a step is a
            // hundredth of its thickness: near such an edge it comes out on the other side.
            if offset.length() > 100.0 && closed.name == "twisted ring" {
                continue;
            }
            all.push(closed.placed(&format!("{scale:e} at {offset}"), scale, offset * scale));
        }
    }
    all
}

/// A unit normal of a hit on the side that the ray came from.
fn facing(ray: &Ray, hit: &Hit) -> Vec3 {
    let normal = hit.normal.normalize();
    if normal.dot(ray.direction) > 0.0 { -normal } else { normal }
}

/// A point just off the surface, on the side that the ray came from.
fn origin(closed: &Closed, ray: &Ray, hit: &Hit) -> Vec3 {
    let corners = closed.mesh.corners(hit.primitive).map(|p| p.to_array());
    offset_point(&corners, hit.u, hit.v, facing(ray, hit))
}

/// Directions into the half-space of a normal, from steep to grazing.
fn outward(normal: Vec3, numbers: &mut Numbers) -> Vec3 {
    let side = normal.cross(numbers.direction()).normalize_or(normal.any_orthonormal_vector());
    let grazing = numbers.pick(&[0.0, 0.5, 0.9, 0.99, 0.999]);
    normal * (1.0 - grazing) + side * grazing
}

#[test]
fn no_light_leaks_into_a_closed_surface() {
    // Rays from inside hit the wall; from there, rays in all directions hit a wall again.
    for seed in seeds() {
        for closed in surfaces() {
            let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
            let mut numbers = Numbers::new(seed, 1);
            let rays: Vec<Ray> =
                (0..60).map(|_| Ray::new(closed.inside(&mut numbers), numbers.direction())).collect();
            let first = scene.trace(&rays);
            for accuracy in CLOSED {
                let bounces: Vec<Ray> = rays
                    .iter()
                    .zip(first.of(accuracy))
                    .map(|(ray, hit)| {
                        assert!(hit.is_hit(), "{}: {ray:?}", closed.name);
                        let direction = outward(facing(ray, hit), &mut numbers);
                        Ray::new(origin(&closed, ray, hit), direction)
                    })
                    .collect();
                scene.check_closed(&bounces);
            }
        }
    }
}

#[test]
fn a_convex_surface_does_not_shadow_itself() {
    // Rays from outside hit a ball or a cube; from there, rays outward meet nothing.
    for seed in seeds() {
        for (scale, offset) in places() {
            for closed in [sphere(3), cube(3)] {
                let closed = closed.placed(&format!("{scale:e} at {offset}"), scale, offset * scale);
                // Rounded vertices of a ball far away are not convex any more.
                let flat = closed.name.ends_with("cube");
                if !flat && offset.length() > 100.0 {
                    continue;
                }
                let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
                let mut numbers = Numbers::new(seed, 2);
                let rays: Vec<Ray> = (0..60)
                    .map(|_| {
                        let inside = closed.inside(&mut numbers);
                        let from = inside + numbers.direction() * (5.0 * scale);
                        Ray::new(from, inside - from)
                    })
                    .collect();
                let first = scene.trace(&rays);
                for accuracy in raypack::geometry::Accuracy::ALL {
                    let hits = rays.iter().zip(first.of(accuracy)).filter(|(_, hit)| hit.is_hit());
                    let bounces: Vec<Ray> = hits
                        .map(|(ray, hit)| {
                            let direction = outward(facing(ray, hit), &mut numbers);
                            Ray::new(origin(&closed, ray, hit), direction)
                        })
                        .collect();
                    assert!(bounces.len() > 50, "{}", closed.name);
                    scene.check(&bounces, |_, _, hit| {
                        hit.is_hit().then(|| "a convex surface shadows itself".into())
                    });
                }
            }
        }
    }
}

#[test]
fn walls_that_meet_at_a_sharp_edge_keep_the_light_out() {
    // Two walls that meet at an angle of about a degree, closed at the back; the eye is inside.
    for seed in seeds() {
        for scale in [1e-3, 1.0, 1e3, 1e6] {
            let p = |x: f32, y: f32, z: f32| Vec3::new(x, y, z) * scale;
            let (a, b) = (p(0.0, 0.0, -1.0), p(0.0, 0.0, 1.0));
            let (c, d) = (p(10.0, -0.1, -1.0), p(10.0, -0.1, 1.0));
            let (e, f) = (p(10.0, 0.1, -1.0), p(10.0, 0.1, 1.0));
            let mesh = crate::meshes::of_triangles([
                [a, b, d],
                [a, d, c],
                [a, f, b],
                [a, e, f],
                [c, d, f],
                [c, f, e],
                [a, c, e],
                [b, f, d],
            ]);
            let closed =
                Closed { name: "wedge".into(), mesh, core: vec![p(8.0, 0.0, 0.0)], clearance: 0.05 * scale };
            let mut scene = Scene::new(format!("wedge of {scale:e}"), seed, closed.mesh.clone());
            let mut numbers = Numbers::new(seed, 3);
            // Deep into the edge, to where the walls are some ten steps of the origins apart.
            let rays: Vec<Ray> = (0..200)
                .map(|_| {
                    let eye = closed.inside(&mut numbers);
                    let x = 0.05 + 0.2 * numbers.unit();
                    let y = x * numbers.pick(&[0.01, -0.01]);
                    Ray::new(eye, p(x, y, numbers.signed() * 0.9) - eye)
                })
                .collect();
            let first = scene.trace(&rays);
            for accuracy in CLOSED {
                let bounces: Vec<Ray> = rays
                    .iter()
                    .zip(first.of(accuracy))
                    .map(|(ray, hit)| {
                        assert!(hit.is_hit(), "{ray:?}");
                        Ray::new(origin(&closed, ray, hit), outward(facing(ray, hit), &mut numbers))
                    })
                    .collect();
                scene.check_closed(&bounces);
            }
            let mut normals = (0..8).map(|i| triangle::normal(&closed.mesh.corners(i).map(|p| p.to_array())));
            assert!(normals.all(|n| n != Vec3::ZERO));
        }
    }
}
