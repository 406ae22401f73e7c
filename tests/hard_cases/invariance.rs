//! The same scene larger, smaller and elsewhere: there is no length that the engine has in mind.

use crate::meshes::{Closed, cube, joined, mapped, of_triangles, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::mesh::Mesh;
use raypack::mesh::generate::shapes;

/// Scenes whose vertices are multiples of `1 / 256`: they can be moved far without being rounded.
fn on_a_lattice() -> Vec<(&'static str, Mesh)> {
    let rounded = |mesh: &Mesh| mapped(mesh, |p| (p * 256.0).round() / 256.0);
    let of = |closed: Closed| rounded(&closed.mesh);
    vec![
        ("sphere", of(sphere(3))),
        ("cube", of(cube(6))),
        ("twisted ring", of(twisted_ring(24, 4, 1))),
        ("soup", rounded(&shapes::soup(400, 1))),
        ("walls", rounded(&joined(&[shapes::boxes(100, 2), of_triangles(crossing_walls())]))),
    ]
}

fn crossing_walls() -> Vec<[Vec3; 3]> {
    (0..20)
        .map(|i| {
            let x = i as f32 * 0.1 - 1.0;
            [Vec3::new(x, -1.0, -1.0), Vec3::new(x + 0.05, 1.0, -1.0), Vec3::new(x, 0.0, 1.0)]
        })
        .collect()
}

/// Rays with origins on the lattice, and directions that are aimed at points of it.
fn rays(mesh: &Mesh, numbers: &mut Numbers, count: usize) -> Vec<Ray> {
    let lattice = |p: Vec3| (p * 256.0).round() / 256.0;
    (0..count)
        .map(|_| {
            let origin = lattice(numbers.vector() * 3.0);
            let aim = match numbers.below(3) {
                0 => mesh.positions[numbers.below(mesh.positions.len())],
                _ => lattice(numbers.vector()),
            };
            let direction = aim - origin;
            Ray::new(origin, if direction == Vec3::ZERO { Vec3::X } else { direction })
        })
        .collect()
}

#[test]
fn powers_of_two_change_no_bit_but_exponents() {
    for seed in seeds() {
        for (name, mesh) in on_a_lattice() {
            let mut numbers = Numbers::new(seed, 1);
            let rays = rays(&mesh, &mut numbers, 150);
            let plain = Scene::new(name, seed, mesh.clone()).trace(&rays);
            for exponent in [-40, -20, -1, 1, 20, 50] {
                let factor = f32::powi(2.0, exponent);
                let name = format!("{name} times 2^{exponent}");
                let mut scene = Scene::new(name, seed, mapped(&mesh, |p| p * factor));
                let scaled: Vec<Ray> =
                    rays.iter().map(|ray| Ray::new(ray.origin * factor, ray.direction * factor)).collect();
                scene.check(&scaled, |accuracy, i, hit| {
                    let expected = plain.of(accuracy)[i];
                    let same = (hit.primitive, hit.t, hit.u, hit.v)
                        == (expected.primitive, expected.t, expected.u, expected.v);
                    (!same).then(|| format!("instead of {expected:?}"))
                });
            }
        }
    }
}

#[test]
fn powers_of_ten_change_no_hit() {
    for seed in seeds() {
        for (name, mesh) in on_a_lattice() {
            let mut numbers = Numbers::new(seed, 2);
            for scale in [1e-6, 1e-3, 1e3, 1e6] {
                let scaled = mapped(&mesh, |p| p * scale);
                // Vertices are rounded, so rays are aimed at insides: where those are is known to
                // within roundings.
                let rays: Vec<Ray> = (0..150).map(|_| inward(&scaled, &mut numbers, scale)).collect();
                let truth = |ray: &Ray| exact_ids(&scaled, ray);
                let expected: Vec<Option<u32>> = rays.iter().map(truth).collect();
                let mut scene = Scene::new(format!("{name} times {scale:e}"), seed, scaled.clone());
                scene.check(&rays, |accuracy, i, hit| {
                    let id = expected[i]?;
                    (CLOSED.contains(&accuracy) && hit.primitive != id).then(|| format!("instead of {id}"))
                });
                let sure = expected.iter().flatten().count();
                assert!(sure * 2 > rays.len(), "{name}: only {sure} rays are clear");
            }
        }
    }
}

#[test]
fn a_move_changes_no_hit() {
    for seed in seeds() {
        for (name, mesh) in on_a_lattice() {
            let mut numbers = Numbers::new(seed, 3);
            let rays = rays(&mesh, &mut numbers, 150);
            let plain = Scene::new(name, seed, mesh.clone()).trace(&rays);
            // 2^15 on a lattice of 2^-8 leaves every vertex as it is: 24 bits.
            for offset in [Vec3::new(1000.0, -30.0, 7.0), Vec3::new(-32_000.0, 32_000.0, 16_000.0)] {
                let mut scene =
                    Scene::new(format!("{name} at {offset}"), seed, mapped(&mesh, |p| p + offset));
                let moved: Vec<Ray> =
                    rays.iter().map(|ray| Ray::new(ray.origin + offset, ray.direction)).collect();
                assert!((0..rays.len()).all(|i| moved[i].origin - offset == rays[i].origin));
                scene.check(&moved, |accuracy, i, hit| {
                    // Differences of coordinates are exact: nothing is left of the place.
                    let expected = plain.of(accuracy)[i];
                    let same = (hit.primitive, hit.t, hit.u, hit.v)
                        == (expected.primitive, expected.t, expected.u, expected.v);
                    (!same).then(|| format!("instead of {expected:?}"))
                });
            }
        }
    }
}

#[test]
fn far_from_the_origin_the_same_triangles_are_hit() {
    // A hundred thousand times its size away: vertices are rounded to some 100th of the size.
    for seed in seeds() {
        let closed = sphere(2).placed("far", 1.0, Vec3::new(1e5, -7e4, 3e4));
        let mut numbers = Numbers::new(seed, 4);
        let rays: Vec<Ray> = (0..300)
            .map(|_| {
                let inside = closed.inside(&mut numbers);
                Ray::new(inside, numbers.direction())
            })
            .collect();
        let expected: Vec<Option<u32>> = rays.iter().map(|ray| exact_ids(&closed.mesh, ray)).collect();
        let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
        scene.check(&rays, |accuracy, i, hit| {
            let id = expected[i]?;
            (CLOSED.contains(&accuracy) && hit.primitive != id).then(|| format!("instead of {id}"))
        });
        assert!(expected.iter().flatten().count() > 200);
    }
}

/// A ray from outside at the inside of some triangle.
fn inward(mesh: &Mesh, numbers: &mut Numbers, scale: f32) -> Ray {
    let [a, b, c] = mesh.corners(numbers.below(mesh.triangles.len()) as u32);
    let (u, v) = (0.2 + 0.3 * numbers.unit(), 0.2 + 0.3 * numbers.unit());
    let origin = numbers.direction() * (4.0 * scale);
    Ray::new(origin, a * (1.0 - u - v) + b * u + c * v - origin)
}

/// The triangle that double precision says is nearest; `None` where a ray passes an edge, or two
/// triangles at nearly the same distance, within the rounding of single precision.
fn exact_ids(mesh: &Mesh, ray: &Ray) -> Option<u32> {
    use glam::DVec3;
    let (o, d) = (ray.origin.as_dvec3(), ray.direction.as_dvec3());
    let reach = mesh.bounds().extent().as_dvec3().length() + (mesh.bounds().center().as_dvec3() - o).length();
    // Some 60 roundings of the greatest distance.
    let margin = reach * 4e-6;
    let mut nearest: Option<(f64, u32)> = None;
    let mut second = f64::INFINITY;
    for id in 0..mesh.triangles.len() as u32 {
        let p: [DVec3; 3] = mesh.corners(id).map(Vec3::as_dvec3);
        let n = (p[1] - p[0]).cross(p[2] - p[0]);
        if n == DVec3::ZERO {
            continue;
        }
        let steep = n.dot(d).abs() / (n.length() * d.length());
        let t = n.dot(p[0] - o) / n.dot(d);
        let x = o + d * t;
        // How far inside, across the edges.
        let inside = (0..3)
            .map(|i| {
                let edge = p[(i + 1) % 3] - p[i];
                n.cross(edge).normalize().dot(x - p[i])
            })
            .fold(f64::INFINITY, f64::min);
        if steep < 1e-2 {
            // A grazed plane: clear only if the ray stays away from it.
            if inside > -margin * 200.0 || !inside.is_finite() {
                return None;
            }
        } else if inside > margin / steep {
            if t > 0.0 {
                let before = nearest.map_or(f64::INFINITY, |(t, _)| t);
                if t < before {
                    second = before;
                    nearest = Some((t, id));
                } else {
                    second = second.min(t);
                }
            }
        } else if inside > -margin / steep {
            return None;
        }
    }
    let (t, id) = nearest?;
    let apart = (second - t) * d.length() > margin * 100.0 && t * d.length() > margin * 100.0;
    apart.then_some(id)
}

/// The modes are three; the rules above hold for fast as well, but for rays at edges.
const _: () = assert!(Accuracy::ALL.len() == 3);
