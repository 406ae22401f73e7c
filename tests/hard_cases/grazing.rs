//! Rays that meet surfaces at next to no angle, or run in their planes. There an error across the
//! ray is many times larger along it: `t` may leave the cells that list the triangle, cells may be
//! met in another order than hits.

use crate::meshes::{joined, of_triangles, patches, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::Ray;
use raypack::mesh::Mesh;

/// Half a degree, and two that are hardly angles.
const ANGLES: [f32; 3] = [0.5 * std::f32::consts::PI / 180.0, 1e-4, 1e-6];

/// A closed hall of half-width 1 and height 1, its floor in `n` x `n` squares, turned so that no wall is
/// aligned with an axis if `tilted`; and its axes.
fn hall(n: usize, tilted: bool) -> (Mesh, [Vec3; 3]) {
    let axes = match tilted {
        false => [Vec3::X, Vec3::Y, Vec3::Z],
        true => {
            let up = Vec3::new(0.31, 0.87, -0.22).normalize();
            let across = up.any_orthonormal_vector();
            [across, up, across.cross(up)]
        }
    };
    let at = |x: f32, y: f32, z: f32| axes[0] * x + axes[1] * y + axes[2] * z;
    let side = |i: usize| 2.0 * i as f32 / n as f32 - 1.0;
    let floor = patches(n, n, |i, j| at(side(i), 0.0, side(j)));
    let ceiling = patches(n, n, |i, j| at(side(i), 1.0, side(j)));
    let wall = |point: &dyn Fn(f32, f32) -> Vec3| patches(n, 1, |i, j| point(side(i), j as f32));
    let walls = [
        wall(&|s, y| at(s, y, -1.0)),
        wall(&|s, y| at(s, y, 1.0)),
        wall(&|s, y| at(-1.0, y, s)),
        wall(&|s, y| at(1.0, y, s)),
    ];
    (joined([&floor, &ceiling].into_iter().chain(&walls)), axes)
}

#[test]
fn floors_of_one_and_many_triangles_hold() {
    for seed in seeds() {
        for (n, tilted) in [(1, false), (1, true), (24, false), (24, true)] {
            let (mesh, [x, up, z]) = hall(n, tilted);
            let mut scene = Scene::new(format!("hall of {n}, tilted: {tilted}"), seed, mesh);
            let mut numbers = Numbers::new(seed, 1);
            for angle in ANGLES {
                let rays: Vec<Ray> = (0..600)
                    .map(|_| {
                        // Toward a point of the floor, or beyond it: then the wall must stop it.
                        let target = (x * numbers.signed() + z * numbers.signed()) * 0.95;
                        let turn = numbers.unit() * std::f32::consts::TAU;
                        let way = x * turn.cos() + z * turn.sin();
                        let from = (target - way * numbers.unit()).clamp_length_max(0.98);
                        let origin = from + up * (angle * numbers.unit()).max(1e-6);
                        Ray::new(origin, (way - up * angle) * numbers.pick(&[0.01, 1.0, 300.0]))
                    })
                    .collect();
                scene.check_closed(&rays);
            }
        }
    }
}

#[test]
fn the_plane_of_a_floor_is_not_its_surface() {
    // Edge-on triangles are never hit; what stands behind them is.
    for seed in seeds() {
        for n in [1, 16] {
            let floor = crate::meshes::floor(n);
            let wall = of_triangles([[
                Vec3::new(2.0, -4.0, -4.0),
                Vec3::new(2.0, 4.0, -4.0),
                Vec3::new(2.0, 0.0, 8.0),
            ]]);
            let wall_id = floor.triangles.len() as u32;
            let mut scene = Scene::new(format!("in the plane of {n}"), seed, joined([&floor, &wall]));
            let mut numbers = Numbers::new(seed, 2);
            let rays: Vec<Ray> = (0..1000)
                .map(|_| {
                    let along = Vec3::new(1.0, 0.0, numbers.pick(&[0.0, -0.0, 0.3, -0.3, 1e-7]));
                    let z = numbers.pick(&[0.0, 0.5, numbers.clone().signed()]);
                    let x = numbers.pick(&[-2.0, -1.0, 0.0, 0.5, -0.37]);
                    Ray::new(Vec3::new(x, numbers.pick(&[0.0, -0.0]), z), along)
                })
                .collect();
            scene.check(&rays, |accuracy, i, hit| {
                let expected = 2.0 - rays[i].origin.x;
                let wrong = hit.primitive != wall_id || hit.t != expected;
                (CLOSED.contains(&accuracy) && wrong).then(|| format!("not the wall at {expected}"))
            });
        }
    }
}

/// Some large triangles of one plane, rays that graze it, and small triangles strewn along the
/// rays, before and behind where they meet the plane.
fn strewn(numbers: &mut Numbers, angle: f32) -> (Mesh, Vec<Ray>) {
    let up = numbers.direction();
    let across = up.any_orthonormal_vector();
    let along = up.cross(across);
    let center = numbers.vector() * numbers.pick(&[0.3, 0.3, 10.0]);
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    for _ in 0..1 + numbers.below(3) {
        let mut corner = || center + across * numbers.signed() + along * numbers.signed();
        triangles.push([corner(), corner(), corner()]);
    }
    let floors = triangles.len();
    let rays: Vec<Ray> = (0..48)
        .map(|_| {
            let [a, b, c] = triangles[numbers.below(floors)];
            // Inside of the triangle, or next to an edge.
            let (mut u, mut v) = (numbers.unit(), numbers.unit());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            if numbers.below(3) == 0 {
                v = 1.0 - u;
            }
            let target = a + (b - a) * u + (c - a) * v;
            let turn = numbers.unit() * std::f32::consts::TAU;
            let way = across * turn.cos() + along * turn.sin();
            let height = up * (angle * numbers.pick(&[-1.0, 1.0]));
            let origin = target - (way + height) * (0.2 + 2.0 * numbers.unit());
            Ray::new(origin, (target - origin) * (0.2 + numbers.unit()))
        })
        .collect();
    for ray in &rays {
        for _ in 0..1 + numbers.below(3) {
            let (at, size) = (ray.at(3.0 * numbers.unit()), 0.02 * numbers.unit());
            triangles.push([0; 3].map(|_| at + numbers.vector() * size));
        }
    }
    (of_triangles(triangles), rays)
}

#[test]
fn order_does_not_decide_what_is_nearer() {
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 3);
        for round in 0..160 {
            let angle = 10f32.powi(-(round % 8)) * (0.3 + 0.7 * numbers.unit());
            let (mesh, rays) = strewn(&mut numbers, angle);
            Scene::new(format!("strewn, {angle} rad, round {round}"), seed, mesh).trace(&rays);
        }
    }
}

#[test]
fn silhouettes_of_a_ball() {
    // Tangents: hit or miss, but alike everywhere.
    let ball = sphere(4);
    for seed in seeds() {
        let mut scene = Scene::new("tangents", seed, ball.mesh.clone());
        let mut numbers = Numbers::new(seed, 4);
        let rays: Vec<Ray> = (0..1500)
            .map(|_| {
                let corner = numbers.pick(&ball.mesh.positions);
                let other = numbers.pick(&ball.mesh.positions);
                let tangent = corner.cross(other + numbers.vector() * 0.1).normalize_or(Vec3::X);
                Ray::new(corner - tangent * (3.0 * numbers.unit()), tangent)
            })
            .collect();
        scene.trace(&rays);
    }
}
