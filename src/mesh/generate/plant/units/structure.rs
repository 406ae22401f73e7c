//! Steel structures: floors full of equipment, with stairs beside them.

use super::Site;
use crate::mesh::generate::plant::grating::walkway;
use crate::mesh::generate::plant::palette::{
    BLUE, CONCRETE, CREAM, DARK_STEEL, GREEN, ORANGE, RED, SILVER, STEEL, WHITE,
};
use crate::mesh::generate::plant::piping::{pipe, valve};
use crate::mesh::generate::plant::steel::{floor, i_beam, ladder, railing, stairs};
use crate::mesh::generate::plant::vessels::{drum, nozzle, vessel};
use crate::mesh::generate::sketch::direction;
use glam::Vec3;

impl Site<'_> {
    pub(super) fn structure(&mut self) {
        let levels = 3 + self.rng.below(3);
        let storey = self.rng.range(4.2, 5.2);
        let (x0, x1, z0, z1) = (-9.0, 7.0, -9.0, 5.0);
        let top = storey * levels as f32;
        let lines = |a: f32, b: f32, n: usize| (0..=n).map(move |i| a + (b - a) * i as f32 / n as f32);
        for x in lines(x0, x1, 3) {
            for z in lines(z0, z1, 2) {
                self.sketch.paint = CONCRETE;
                self.sketch.cuboid(Vec3::new(x - 0.45, 0.0, z - 0.45), Vec3::new(x + 0.45, 0.4, z + 0.45));
                self.sketch.paint = DARK_STEEL;
                i_beam(self.sketch, Vec3::new(x, 0.4, z), Vec3::new(x, top + 1.2, z), 0.4, Vec3::X);
            }
        }
        for level in 1..=levels {
            let y = storey * level as f32;
            floor(self.sketch, Vec3::new(x0, y, z0), Vec3::new(x1, y, z1));
            let deck = y + 0.06;
            let corner = |x: f32, z: f32| Vec3::new(x, deck, z);
            railing(
                self.sketch,
                &[corner(x1, z1 - 1.4), corner(x1, z0), corner(x0, z0), corner(x0, z1), corner(x1, z1)],
            );
            self.flight(Vec3::new(x1, y - storey + 0.06, z1), storey, level % 2 == 0);
            if level < levels {
                self.equip(Vec3::new(x0, deck, z0), Vec3::new(x1, deck, z1), storey);
            } else {
                self.roof_vessels(deck);
            }
            self.sketch.paint = DARK_STEEL;
            for z in [z0, z1] {
                let (a, b) = (x0 + (x1 - x0) / 3.0 * (level % 3) as f32, (x1 - x0) / 3.0);
                let low = Vec3::new(a, y - storey + 0.5, z);
                self.sketch.bar(low, low + Vec3::new(b, storey - 0.8, 0.0), 0.16, 0.16, Vec3::Z);
            }
        }
        for i in 0..3 {
            let x = x0 + 2.0 + 4.5 * i as f32;
            self.sketch.paint = self.rng.pick(&[BLUE, GREEN, SILVER, RED]);
            let riser = Vec3::new(x, 0.8, z1 + 0.7);
            pipe(
                self.sketch,
                &[
                    riser.with_z(z1 - 3.0).with_y(top - 1.0),
                    riser.with_y(top - 1.0),
                    riser,
                    riser + Vec3::Z * 2.0,
                ],
                0.16,
            );
            self.connect(riser + Vec3::Z * 2.0, Vec3::Z, x);
        }
    }

    /// A flight of stairs beside a structure, one storey up, and the landing at its end.
    fn flight(&mut self, at: Vec3, storey: f32, back: bool) {
        let (low, high) = if back { (-1.6, -6.6) } else { (-6.6, -1.6) };
        let x = if back { 2.2 } else { 0.9 };
        stairs(self.sketch, at + Vec3::new(x, 0.0, low), at + Vec3::new(x, storey, high), 0.9);
        let (near, far) = if back { (-8.2, high) } else { (high, 0.0) };
        let landing = at + Vec3::Y * storey;
        walkway(
            self.sketch,
            landing + Vec3::new(0.2, -0.06, near.min(far)),
            landing + Vec3::new(2.8, 0.0, near.max(far)),
        );
        let z = |z: f32| landing + Vec3::new(2.8, 0.0, z);
        railing(self.sketch, &[z(near), z(far)]);
        self.sketch.paint = STEEL;
        i_beam(self.sketch, z(near).with_y(0.0), z(near), 0.2, Vec3::X);
    }

    /// Vessels, exchangers and pipes on a floor.
    fn equip(&mut self, min: Vec3, max: Vec3, storey: f32) {
        for i in 0..3 {
            let x = min.x + (i as f32 + 0.5) * (max.x - min.x) / 3.0;
            self.sketch.paint = self.rng.pick(&[SILVER, BLUE, ORANGE, CREAM, GREEN, WHITE]);
            let z = min.z + 3.5;
            match self.rng.below(3) {
                0 => {
                    let radius = self.rng.range(0.6, 0.95);
                    drum(self.sketch, Vec3::new(x, min.y + 1.4, z + 3.0), Vec3::Z, radius, 5.5);
                }
                1 => {
                    for dz in [0.0, 5.5] {
                        let foot = Vec3::new(x, min.y + 0.9, z + dz);
                        vessel(self.sketch, foot, foot + Vec3::Y * (storey - 2.4), 0.85);
                        for leg in 0..4 {
                            let d = direction(f64::from(leg) / 4.0 + 0.125) * 0.8;
                            let top = foot + Vec3::new(d.x, 0.6, d.y);
                            self.sketch.bar(top.with_y(min.y), top, 0.1, 0.1, Vec3::X);
                        }
                    }
                }
                _ => {
                    for dx in [-0.8, 0.8] {
                        drum(self.sketch, Vec3::new(x + dx, min.y + 0.9, z + 2.5), Vec3::Z, 0.4, 5.0);
                    }
                }
            }
            self.sketch.paint = self.rng.pick(&[BLUE, GREEN, SILVER, RED]);
            let run = Vec3::new(x + 1.6, min.y + storey - 0.9, min.z + 0.5);
            let end = run.with_z(max.z - 0.5);
            pipe(self.sketch, &[run.with_y(min.y + 0.4), run, end, end.with_y(min.y + 0.4)], 0.13);
            valve(self.sketch, run.with_y(min.y + 1.4), Vec3::Y, 0.13);
        }
    }

    fn roof_vessels(&mut self, deck: f32) {
        for i in 0..2 {
            let foot = Vec3::new(-5.5 + 7.0 * i as f32, deck + 1.0, -3.0);
            self.sketch.paint = self.rng.pick(&[SILVER, RED, WHITE, ORANGE]);
            let (radius, height) = (self.rng.range(1.2, 1.9), self.rng.range(3.0, 6.0));
            vessel(self.sketch, foot, foot + Vec3::Y * height, radius);
            self.sketch.paint = STEEL;
            self.sketch.cylinder(foot.with_y(deck), foot + Vec3::Y * 0.4, radius * 0.9);
            ladder(self.sketch, foot.with_y(deck) + Vec3::Z * (radius + 0.2), height + 1.5, Vec3::Z);
            nozzle(self.sketch, foot + Vec3::Y * (height + radius * 0.45), Vec3::Y, 0.7, 0.25);
        }
    }
}
