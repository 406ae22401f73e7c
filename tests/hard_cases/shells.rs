//! Nested shells: a ray outward meets each in its turn, no matter how.

use crate::meshes::{joined, mapped, sphere};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene};
use raypack::Vec3;
use raypack::geometry::Ray;
use raypack::mesh::Mesh;

const SHELLS: usize = 12;

#[test]
fn every_shell_is_met_in_its_turn() {
    let ball = sphere(2).mesh;
    // From a hundredth apart to twice as large.
    for (name, growth) in [("onion", 1.01f32), ("shells", 1.3), ("matryoshka", 2.0)] {
        let shells: Vec<Mesh> = (0..SHELLS).map(|i| mapped(&ball, |p| p * growth.powi(i as i32))).collect();
        for seed in seeds() {
            let mut scene = Scene::new(name, seed, joined(&shells));
            let mut numbers = Numbers::new(seed, 1);
            let rays: Vec<Ray> = (0..60)
                .map(|i| match i % 2 {
                    0 => Ray::new(numbers.vector() * 0.3, numbers.direction()),
                    // Through corners of every shell.
                    _ => Ray::new(Vec3::ZERO, numbers.pick(&ball.positions)),
                })
                .collect();

            for accuracy in CLOSED {
                let mut walks: Vec<Ray> = rays.clone();
                let mut reached = vec![0; rays.len()];
                // A seam may be met more than once, a rounding apart: then the shell is the same.
                while !walks.is_empty() {
                    let answers = scene.trace(&walks);
                    let mut onward = Vec::new();
                    let mut onward_reached = Vec::new();
                    for ((ray, hit), shell) in walks.iter().zip(answers.of(accuracy)).zip(reached) {
                        if !hit.is_hit() {
                            if shell != SHELLS {
                                scene.blame(accuracy, ray, &format!("shell {shell} is missed"));
                            }
                            continue;
                        }
                        let next = hit.primitive as usize / ball.triangles.len();
                        if next != shell && next + 1 != shell {
                            scene.blame(accuracy, ray, &format!("shell {next} instead of {shell}"));
                        }
                        onward.push(Ray { tnear: hit.t.next_up(), ..*ray });
                        onward_reached.push(next + 1);
                    }
                    (walks, reached) = (onward, onward_reached);
                }
            }
        }
    }
}
