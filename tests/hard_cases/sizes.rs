//! The enormous beside the tiny, and boxes with hardly a thickness.

use crate::aim::at_seams;
use crate::meshes::{Closed, cube, joined, of_triangles, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};

#[test]
fn a_teapot_in_a_stadium() {
    // A ring as small as a teapot somewhere in a hall of two hundred metres.
    let stadium = cube(6).placed("stadium", 100.0, Vec3::ZERO);
    let teapot = twisted_ring(24, 4, 1).placed("teapot", 0.1, Vec3::new(31.7, -99.0, 12.3));
    let teapot_first = stadium.mesh.triangles.len() as u32;
    for seed in seeds() {
        let mesh = joined([&stadium.mesh, &teapot.mesh]);
        let mut scene = Scene::new("a teapot in a stadium", seed, mesh);
        let mut numbers = Numbers::new(seed, 1);
        let from_seats: Vec<Ray> = (0..600)
            .map(|_| {
                let origin = numbers.vector() * 95.0;
                Ray::new(origin, teapot.inside(&mut numbers) - origin)
            })
            .collect();
        let of_teapot: Vec<Ray> = (0..600).map(|_| at_seams(&teapot, &mut numbers)).collect();
        for rays in [from_seats, of_teapot] {
            scene.check(&rays, |accuracy, _, hit| {
                let missed = !hit.is_hit() || hit.primitive < teapot_first;
                (CLOSED.contains(&accuracy) && missed).then(|| "the teapot is missed".into())
            });
        }
        let of_stadium: Vec<Ray> = (0..600).map(|_| at_seams(&stadium, &mut numbers)).collect();
        scene.check_closed(&of_stadium);
    }
}

#[test]
fn one_triangle_a_billion_times_the_others() {
    let ball = sphere(2);
    let far = 2e8;
    let floor = of_triangles([[
        Vec3::new(-far, -4.0, -far),
        Vec3::new(far, -4.0, -far),
        Vec3::new(0.0, -4.0, 2.0 * far),
    ]]);
    let floor_id = ball.mesh.triangles.len() as u32;
    for seed in seeds() {
        let mut scene = Scene::new("a ball over an endless floor", seed, joined([&ball.mesh, &floor]));
        let mut numbers = Numbers::new(seed, 2);
        let at_ball: Vec<Ray> = (0..300).map(|_| at_seams(&ball, &mut numbers)).collect();
        scene.check(&at_ball, |accuracy, _, hit| {
            // From below, the floor may come first.
            (CLOSED.contains(&accuracy) && !hit.is_hit()).then(|| "the ball is missed".into())
        });
        let at_floor: Vec<Ray> = (0..300)
            .map(|_| {
                let origin = Vec3::new(numbers.signed() * 9.0, -2.0, 1.5 + 9.0 * numbers.unit());
                Ray::new(origin, Vec3::new(numbers.signed(), -1.0, numbers.signed()))
            })
            .collect();
        scene.check(&at_floor, |accuracy, _, hit| {
            let wrong = hit.primitive != floor_id || (hit.t - 2.0).abs() > 1e-5;
            (accuracy != Accuracy::Fast && wrong).then(|| "the floor is two below".into())
        });
    }
}

#[test]
fn thin_boxes() {
    for thickness in [1e-3, 1e-6, 1e-12, 1e-30, f32::MIN_POSITIVE, 1e-42, 0.0] {
        for axis in 0..3 {
            let mut by = Vec3::ONE;
            by[axis] = thickness;
            let slab = cube(3);
            let slab = Closed {
                mesh: crate::meshes::mapped(&slab.mesh, |p| p * by),
                core: vec![Vec3::ZERO],
                clearance: 0.0,
                ..slab
            };
            for seed in seeds() {
                let mut scene = Scene::new(format!("a box {thickness} thin"), seed, slab.mesh.clone());
                let mut numbers = Numbers::new(seed, 3);
                // Through it from either side, at points of the whole grid of its seams.
                let rays: Vec<Ray> = (0..150)
                    .map(|_| {
                        let mut target = numbers.lattice(-2, 2) / 3.0;
                        target[axis] = 0.0;
                        let mut origin = numbers.vector() * 0.9;
                        origin[axis] = numbers.pick(&[-2.0, 2.0, 0.1, -0.1]);
                        let straight = numbers.below(3) == 0;
                        if straight {
                            (origin[(axis + 1) % 3], origin[(axis + 2) % 3]) =
                                (target[(axis + 1) % 3], target[(axis + 2) % 3]);
                        }
                        Ray::new(origin, target - origin)
                    })
                    .collect();
                scene.check_closed(&rays);
            }
        }
    }
}
