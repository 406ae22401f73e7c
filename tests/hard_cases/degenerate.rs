//! Triangles without area, and triangles that lie in one another.

use crate::aim::at_seams;
use crate::meshes::{Closed, cube, joined, of_triangles, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::{Scene, bits};
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::mesh::{Colors, Mesh};

/// A triangle that is a point, or names one corner twice.
fn nothing(numbers: &mut Numbers) -> [Vec3; 3] {
    let (a, b) = (numbers.lattice(-4, 4) * 0.25, numbers.lattice(-4, 4) * 0.25);
    numbers.pick(&[[a, a, a], [a, a, b], [a, b, a], [b, a, a]])
}

/// Three points of a line, exactly.
fn line(numbers: &mut Numbers) -> [Vec3; 3] {
    let (a, b) = (numbers.lattice(-4, 4) * 0.25, numbers.lattice(-4, 4) * 0.25);
    numbers.pick(&[[a, (a + b) * 0.5, b], [a, b, (a + b) * 0.5], [b, a + a - b, a]])
}

#[test]
fn degenerate_triangles_are_not_hit_and_harm_nothing() {
    let ball = sphere(3);
    let good = ball.mesh.triangles.len() as u32;
    for (name, degenerate) in [
        ("points", nothing as fn(&mut Numbers) -> [Vec3; 3]),
        ("lines", line as fn(&mut Numbers) -> [Vec3; 3]),
    ] {
        for seed in seeds() {
            let mut numbers = Numbers::new(seed, 1);
            let strewn: Vec<[Vec3; 3]> = (0..150).map(|_| degenerate(&mut numbers)).collect();
            let mut clean = Scene::new("a ball", seed, ball.mesh.clone());
            let with = joined([&ball.mesh, &of_triangles(strewn.iter().copied())]);
            let mut mixed = Scene::new(format!("a ball and {name}"), seed, with);

            let mut rays: Vec<Ray> = (0..300).map(|_| at_seams(&ball, &mut numbers)).collect();
            // At the degenerate ones, and along them.
            rays.extend((0..300).map(|_| {
                let [a, b, c] = numbers.pick(&strewn);
                let target = numbers.pick(&[a, b, c, (a + b) * 0.5]);
                let corner = numbers.lattice(-8, 8) * 0.25;
                let origin = numbers.pick(&[corner, target, target - (c - a)]);
                let direction = target - origin;
                Ray::new(origin, if direction == Vec3::ZERO { numbers.direction() } else { direction })
            }));

            let expected = clean.trace(&rays);
            mixed.check(&rays, |accuracy, i, hit| {
                // The watertight test takes corners of a line for moved by roundings, on purpose.
                if hit.is_hit()
                    && hit.primitive >= good
                    && accuracy == Accuracy::Watertight
                    && name == "lines"
                {
                    let gap = distance(&rays[i], strewn[(hit.primitive - good) as usize]);
                    return (gap > 1e-5).then(|| format!("passes a line by {gap}"));
                }
                let expected = &expected.of(accuracy)[i];
                (bits(hit) != bits(expected)).then(|| format!("not {expected:?}"))
            });
        }
    }
}

/// How far the line of a ray passes the line of three points, none of them beyond its ends.
fn distance(ray: &Ray, [a, b, c]: [Vec3; 3]) -> f64 {
    let [o, d, a, b, c] = [ray.origin, ray.direction, a, b, c].map(Vec3::as_dvec3);
    let along = if (b - a).length() > (c - a).length() { b - a } else { c - a };
    let across = d.normalize().cross(along);
    if across.length() < 1e-6 * along.length() {
        return (a - o).reject_from(d).length();
    }
    (a - o).dot(across.normalize()).abs()
}

#[test]
fn lines_fill_the_joints_of_closed_surfaces() {
    // A cube whose edges are cut in two on one side and not on the other, as CAD programs leave it:
    // the triangle between is a line, but between rounded corners it is not.
    let cube = cube(2);
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 4);
        let mut mesh = Mesh { positions: cube.mesh.positions.clone(), ..Mesh::default() };
        for triangle in &cube.mesh.triangles {
            let [a, b, _] = triangle.map(|i| mesh.positions[i as usize]);
            let middle = mesh.positions.len() as u32;
            mesh.positions.push((a + b) * 0.5);
            let [i, j, k] = *triangle;
            if numbers.below(2) == 0 {
                mesh.triangles.extend([[i, middle, k], [middle, j, k], [i, j, middle]]);
            } else {
                mesh.triangles.push(*triangle);
            }
        }
        let closed = Closed { name: "cube with joints".into(), mesh, ..cube.clone() };
        let mut scene = Scene::new(&closed.name, seed, closed.mesh.clone());
        let rays: Vec<Ray> = (0..1500).map(|_| at_seams(&closed, &mut numbers)).collect();
        scene.check_closed(&rays);
    }
}

#[test]
fn of_coincident_triangles_the_lowest_id_wins() {
    for seed in seeds() {
        for copies in [2, 17, 300] {
            let mut numbers = Numbers::new(seed, 2);
            let corners = [numbers.vector(), numbers.vector(), numbers.vector()];
            let mesh = Mesh {
                positions: corners.into(),
                triangles: vec![[0, 1, 2]; copies],
                colors: Colors::default(),
                ..Mesh::default()
            };
            let rays: Vec<Ray> = (0..500)
                .map(|_| {
                    let (u, v) = (numbers.unit() * 0.5, numbers.unit() * 0.5);
                    let [a, b, c] = corners;
                    let origin = numbers.vector() * 3.0;
                    Ray::new(origin, a + (b - a) * u + (c - a) * v - origin)
                })
                .collect();
            Scene::new(format!("{copies} coincident"), seed, mesh).check(&rays, |accuracy, _, hit| {
                let wrong = if hit.is_hit() { hit.primitive != 0 } else { accuracy != Accuracy::Fast };
                wrong.then(|| "not the first copy".into())
            });
        }
    }
}

#[test]
fn in_a_surface_of_three_layers_the_lowest_id_wins() {
    let ball = sphere(3);
    let count = ball.mesh.triangles.len() as u32;
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 3);
        let mut scene = Scene::new("three balls in one", seed, joined([&ball.mesh; 3]));
        let rays: Vec<Ray> = (0..800).map(|_| at_seams(&ball, &mut numbers)).collect();
        scene.check(&rays, |_, _, hit| {
            (hit.is_hit() && hit.primitive >= count).then(|| "a copy, not the first".into())
        });
        scene.check_closed(&rays);
    }
}
