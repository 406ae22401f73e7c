//! Heat exchangers, air coolers and pumps.

use super::{PLOT, Site};
use crate::mesh::generate::plant::palette::{
    BLUE, CONCRETE, CREAM, DARK_STEEL, GALVANISED, GREEN, ORANGE, SILVER, STEEL, WHITE,
};
use crate::mesh::generate::plant::piping::{pipe, valve};
use crate::mesh::generate::plant::steel::{i_beam, railing};
use crate::mesh::generate::plant::vessels::drum;
use crate::mesh::generate::sketch::direction;
use glam::{Vec2, Vec3};

impl Site<'_> {
    pub(super) fn exchangers(&mut self) {
        let count = 5 + self.rng.below(2);
        for i in 0..count {
            let x = (i as f32 + 0.5) * PLOT / count as f32 - PLOT * 0.5;
            self.sketch.paint = self.rng.pick(&[BLUE, SILVER, SILVER, ORANGE, GREEN, CREAM]);
            let radius = self.rng.range(0.6, 0.9);
            for level in 0..1 + self.rng.below(2) {
                let center = Vec3::new(x, 1.3 + 2.3 * level as f32, -4.5);
                drum(self.sketch, center, Vec3::Z, radius, 8.0);
                let end = center + Vec3::new(0.0, radius + 0.3, 3.0);
                self.connect(end, Vec3::Y, x + 0.7 - 1.4 * level as f32);
            }
            self.pump(Vec3::new(x, 0.15, 4.5));
        }
        self.air_cooler();
    }

    /// A bank of fans on a frame, as coolers with no water are built.
    fn air_cooler(&mut self) {
        let (y, z0, z1) = (8.5, -11.5, -3.5);
        self.sketch.paint = STEEL;
        for x in [-11.0, -3.7, 3.7, 11.0] {
            for z in [z0, z1] {
                i_beam(self.sketch, Vec3::new(x, 0.0, z), Vec3::new(x, y, z), 0.35, Vec3::X);
            }
            i_beam(self.sketch, Vec3::new(x, y - 0.2, z0), Vec3::new(x, y - 0.2, z1), 0.35, Vec3::Y);
        }
        self.sketch.paint = GALVANISED;
        self.sketch.cuboid(Vec3::new(-11.4, y, z0 - 0.4), Vec3::new(11.4, y + 1.1, z1 + 0.4));
        railing(
            self.sketch,
            &[(-11.3, z1 + 0.3), (-11.3, z0 - 0.3), (11.3, z0 - 0.3), (11.3, z1 + 0.3), (-11.3, z1 + 0.3)]
                .map(|(x, z)| Vec3::new(x, y + 1.1, z)),
        );
        for i in 0..3 {
            for z in [-9.4, -5.6] {
                let center = Vec3::new(-7.4 + 7.4 * i as f32, y + 1.1, z);
                self.sketch.paint = WHITE;
                let hood = [(1.75, 0.0), (1.55, 0.5), (1.7, 1.0), (1.6, 1.0), (1.45, 0.5), (1.5, 0.0)];
                self.sketch.revolve(center, Vec3::Y, &hood.map(Vec2::from));
                self.sketch.paint = DARK_STEEL;
                self.sketch.cylinder(center, center + Vec3::Y * 0.6, 0.3);
                let start = f64::from(self.rng.unit());
                for blade in 0..6 {
                    let d = direction(start + f64::from(blade) / 6.0) * 1.4;
                    let (hub, d) = (center + Vec3::Y * 0.45, Vec3::new(d.x, 0.0, d.y));
                    let tilt = (Vec3::Y + d.cross(Vec3::Y) * 0.4).normalize();
                    self.sketch.bar(hub + d * 0.15, hub + d, 0.3, 0.02, tilt);
                }
            }
        }
    }

    /// A pump with its motor on a plinth, and the pipes to and from it.
    pub(super) fn pump(&mut self, at: Vec3) {
        self.sketch.paint = CONCRETE;
        self.sketch.cuboid(at - Vec3::new(0.5, 0.15, 1.2), at + Vec3::new(0.5, 0.35, 1.2));
        let axle = at + Vec3::Y * 0.75;
        self.sketch.paint = self.rng.pick(&[BLUE, GREEN]);
        self.sketch.cylinder(axle - Vec3::Z * 1.1, axle - Vec3::Z * 0.1, 0.32);
        self.sketch.paint = ORANGE;
        self.sketch.cylinder(axle, axle + Vec3::Z * 0.35, 0.14);
        self.sketch.paint = STEEL;
        self.sketch.cylinder(axle + Vec3::Z * 0.35, axle + Vec3::Z * 0.85, 0.42);
        let out = axle + Vec3::Z * 0.6;
        self.sketch.paint = SILVER;
        pipe(
            self.sketch,
            &[out, out + Vec3::Y * 2.2, out + Vec3::new(1.6, 2.2, 0.0), out + Vec3::new(1.6, -0.7, 0.0)],
            0.1,
        );
        valve(self.sketch, out + Vec3::Y * 1.3, Vec3::Y, 0.1);
    }
}
