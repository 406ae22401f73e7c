//! Flat cells, planar meshes, and origins exactly on planes and corners.

use crate::meshes::{floor, mapped, of_triangles, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::mesh::Mesh;

/// The floor in the plane `axis = height`.
fn across(axis: usize, height: f32, n: usize) -> Mesh {
    mapped(&floor(n), |p| {
        let mut q = Vec3::splat(height);
        (q[(axis + 1) % 3], q[(axis + 2) % 3]) = (p.x, p.z);
        q
    })
}

#[test]
fn a_mesh_in_one_plane() {
    for seed in seeds() {
        for axis in 0..3 {
            for height in [0.0, 0.25, -7.0] {
                let mut scene = Scene::new("a mesh in one plane", seed, across(axis, height, 8));
                let mut numbers = Numbers::new(seed, 1);
                let rays: Vec<Ray> = (0..400)
                    .map(|_| {
                        // At corners, edges and faces; straight or slanted; from on the plane, too.
                        let mut target = numbers.lattice(-8, 8) * 0.125;
                        target[axis] = height;
                        let mut origin = target;
                        if numbers.below(2) == 0 {
                            origin += numbers.lattice(-2, 2) * 0.5;
                        }
                        origin[axis] = height + numbers.pick(&[-2.0, -0.5, 0.0, 0.5, 2.0]);
                        let mut way = target - origin;
                        if way[axis] == 0.0 {
                            way[axis] = 1.0;
                        }
                        Ray::new(origin, way)
                    })
                    .collect();
                scene.check(&rays, |accuracy, i, hit| {
                    let from = rays[i].origin;
                    let inside = (0..3).all(|k| k == axis || from[k].abs() < 1.0);
                    let starts_on_it = from[axis] == height;
                    let due = CLOSED.contains(&accuracy) && (!starts_on_it || inside);
                    let t = if starts_on_it { 0.0 } else { 1.0 };
                    let near =
                        if accuracy == Accuracy::Exact { hit.t == t } else { (hit.t - t).abs() < 1e-5 };
                    (due && !(hit.is_hit() && near)).then(|| format!("t should be {t}"))
                });
            }
        }
    }
}

#[test]
fn a_stack_of_planes_is_met_in_order() {
    // Sheets a step apart; the tree's planes lie in them, cells between are empty or flat.
    let sheets: Vec<Mesh> = (0..12).map(|i| across(1, i as f32, 2)).collect();
    let each = sheets[0].triangles.len() as u32;
    for seed in seeds() {
        let mut scene = Scene::new("a stack of sheets", seed, crate::meshes::joined(&sheets));
        let mut numbers = Numbers::new(seed, 2);
        let rays: Vec<Ray> = (0..800)
            .map(|_| {
                // From a sheet or between two, down or up, through corners, edges and faces.
                let origin = Vec3::new(0.0, numbers.below(25) as f32 * 0.5 - 0.5, 0.0)
                    + Vec3::new(numbers.pick(&[0.0, 0.5, 0.3]), 0.0, numbers.pick(&[0.0, -0.5, 0.3]));
                let ray = Ray::new(origin, numbers.pick(&[Vec3::Y, Vec3::NEG_Y]));
                // An end exactly on a sheet counts, on either side.
                let (a, b) = (numbers.below(9) as f32 * 0.5, numbers.below(9) as f32 * 0.5);
                Ray { tnear: a, tfar: a + b, ..ray }
            })
            .collect();
        scene.check(&rays, |accuracy, i, hit| {
            let ray = &rays[i];
            let (y, way) = (ray.origin.y, ray.direction.y);
            let met = |sheet: &u32| {
                let t = (*sheet as f32 - y) * way;
                ray.tnear <= t && t <= ray.tfar
            };
            let first = (0..12).filter(met).min_by_key(|&sheet| ((sheet as f32 - y) * way * 2.0) as i32);
            let got = hit.is_hit().then_some(hit.primitive / each);
            (CLOSED.contains(&accuracy) && got != first).then(|| format!("sheet {first:?} comes first"))
        });
    }
}

#[test]
fn rays_that_start_at_a_corner_hit_it_there() {
    // Exactly: for the other modes the corner may lie a rounding behind the origin.
    let ball = sphere(2).mesh;
    for seed in seeds() {
        let mut scene = Scene::new("from corners", seed, ball.clone());
        let mut numbers = Numbers::new(seed, 3);
        let rays: Vec<Ray> =
            (0..800).map(|_| Ray::new(numbers.pick(&ball.positions), numbers.direction())).collect();
        scene.check(&rays, |accuracy, _, hit| {
            (accuracy == Accuracy::Exact && hit.t != 0.0).then(|| "t should be 0".into())
        });
    }
}

#[test]
fn rays_in_the_planes_that_split() {
    // Many small triangles whose sides lie on a lattice; rays along its planes and lines.
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 4);
        let triangles: Vec<[Vec3; 3]> = (0..250)
            .map(|_| {
                let a = numbers.lattice(0, 8);
                [a, a + numbers.lattice(-1, 1), a + numbers.lattice(-1, 1)]
            })
            .collect();
        let rays: Vec<Ray> = (0..1200)
            .map(|_| {
                let mut direction = numbers.vector();
                direction[numbers.below(3)] = numbers.pick(&[0.0, -0.0, 1e-30, -1e-30, 1e-8]);
                if numbers.below(3) == 0 {
                    direction[numbers.below(3)] = numbers.pick(&[0.0, -0.0, 1e-20]);
                }
                if direction.abs().max_element() < 1e-6 {
                    direction = Vec3::NEG_Z;
                }
                Ray::new(numbers.lattice(-1, 9), direction)
            })
            .collect();
        Scene::new("in the splits' planes", seed, of_triangles(triangles)).trace(&rays);
    }
}
