//! Rays that are none, and rays whose directions are hardly numbers.

use crate::meshes::sphere;
use crate::numbers::{Numbers, seeds};
use crate::scene::Scene;
use raypack::geometry::{Accuracy, Ray};
use raypack::mesh::generate::shapes;

const BAD: [f32; 3] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY];

#[test]
fn what_is_no_ray_hits_nothing_and_disturbs_no_other() {
    let ball = sphere(3);
    for seed in seeds() {
        let mut numbers = Numbers::new(seed, 1);
        let good: Vec<Ray> =
            (0..600).map(|_| Ray::new(ball.inside(&mut numbers), numbers.direction())).collect();
        let rays: Vec<Ray> = good
            .iter()
            .enumerate()
            .map(|(i, &ray)| {
                let mut ray = ray;
                let axis = numbers.below(3);
                // Every other ray is spoilt, so most packets hold both kinds.
                match if i % 2 == 0 { 9 } else { numbers.below(6) } {
                    0 => ray.origin[axis] = numbers.pick(&BAD),
                    1 => ray.direction[axis] = numbers.pick(&BAD),
                    2 => ray.tnear = f32::NAN,
                    3 => ray.tfar = f32::NAN,
                    4 => ray.direction *= 0.0,
                    5 => {
                        (ray.tnear, ray.tfar) = numbers.pick(&[(f32::INFINITY, 1.0), (2.0, 1.0), (0.0, -1.0)])
                    }
                    _ => {}
                }
                ray
            })
            .collect();
        let mut scene = Scene::new("rays that are none", seed, ball.mesh.clone());
        scene.check(&rays, |accuracy, i, hit| match i % 2 {
            0 => (accuracy != Accuracy::Fast && !hit.is_hit()).then(|| "a good ray misses".into()),
            _ => hit.is_hit().then(|| "this is no ray".into()),
        });
    }
}

#[test]
fn the_length_of_a_direction_scales_t_and_nothing_else() {
    for seed in seeds() {
        let mesh = shapes::soup(200, seed);
        let mut scene = Scene::new("directions of any length", seed, mesh);
        let mut numbers = Numbers::new(seed, 2);
        // Few enough bits that the shortest directions, which are denormal, keep them all.
        let unit: Vec<Ray> = (0..500)
            .map(|_| Ray::new(numbers.vector() + 0.5, numbers.lattice(-16, 16) + numbers.lattice(0, 1) + 0.5))
            .collect();
        let expected = scene.trace(&unit);
        for exponent in [-144, -130, -126, -60, -20, 20, 60, 100, 120] {
            let factor = f64::powi(2.0, exponent);
            let scaled: Vec<Ray> = unit
                .iter()
                .map(|ray| Ray { direction: (ray.direction.as_dvec3() * factor).as_vec3(), ..*ray })
                .collect();
            scene.check(&scaled, |accuracy, i, hit| {
                let unit = &expected.of(accuracy)[i];
                let t = (f64::from(unit.t) / factor) as f32;
                if unit.is_hit() && t == f32::INFINITY {
                    // No float says where.
                    return hit.is_hit().then(|| "beyond the floats".into());
                }
                let same = (hit.primitive, hit.u, hit.v) == (unit.primitive, unit.u, unit.v);
                let near = hit.t == t || t.is_subnormal();
                (!(same && near)).then(|| format!("2^{exponent} times as long, {unit:?} before"))
            });
        }
    }
}
