//! Fired heaters with their chimneys.

use super::Site;
use crate::mesh::generate::plant::grating::walkway;
use crate::mesh::generate::plant::palette::{BRICK, CREAM, DARK_STEEL, ORANGE, SILVER, STEEL};
use crate::mesh::generate::plant::piping::pipe;
use crate::mesh::generate::plant::steel::{i_beam, ladder, railing};
use crate::mesh::generate::plant::vessels::chimney;
use glam::{Vec2, Vec3};

impl Site<'_> {
    pub(super) fn furnace(&mut self) {
        let (min, max) = (Vec3::new(-8.0, 3.0, -8.0), Vec3::new(2.0, 13.0, 1.0));
        self.sketch.paint = CREAM;
        self.sketch.cuboid(min, max);
        self.sketch.paint = DARK_STEEL;
        for i in 0..=5 {
            let x = min.x + 2.0 * i as f32;
            for z in [min.z - 0.1, max.z + 0.1] {
                i_beam(self.sketch, Vec3::new(x, 0.0, z), Vec3::new(x, max.y, z), 0.3, Vec3::Z);
            }
        }
        for y in [3.0, 6.4, 9.7, 13.0] {
            for z in [min.z - 0.1, max.z + 0.1] {
                i_beam(self.sketch, Vec3::new(min.x, y, z), Vec3::new(max.x, y, z), 0.25, Vec3::Y);
            }
        }
        self.sketch.paint = STEEL;
        let hood = [(5.2, 0.0), (4.2, 1.0), (2.0, 3.2), (1.7, 3.2)];
        self.sketch.revolve(Vec3::new(-3.0, max.y, -3.5), Vec3::Y, &hood.map(Vec2::from));
        let stack = Vec3::new(7.5, 0.15, -4.0);
        self.sketch.paint = BRICK;
        let duct = Vec3::new(-3.0, 18.5, -3.5);
        pipe(self.sketch, &[duct.with_y(15.5), duct, stack.with_y(18.5), stack.with_y(14.5)], 1.3);
        let height = self.rng.range(38.0, 52.0);
        chimney(self.sketch, stack, 2.0, height);
        for y in [6.4, 9.7] {
            walkway(self.sketch, Vec3::new(min.x, y, max.z), Vec3::new(max.x, y + 0.06, max.z + 1.4));
            let at = |x: f32, dz: f32| Vec3::new(x, y + 0.06, max.z + dz);
            railing(self.sketch, &[at(min.x, 0.0), at(min.x, 1.4), at(max.x, 1.4), at(max.x, 0.0)]);
        }
        ladder(self.sketch, Vec3::new(max.x - 1.0, 0.0, max.z + 1.5), 9.8, Vec3::Z);
        for i in 0..8 {
            let x = min.x + 1.0 + 1.1 * i as f32;
            self.sketch.paint = ORANGE;
            let burner = Vec3::new(x, 2.2, -3.5);
            self.sketch.cylinder(burner, burner + Vec3::Y, 0.3);
            self.sketch.paint = SILVER;
            let coil = Vec3::new(x, 4.0, max.z + 0.1);
            pipe(
                self.sketch,
                &[
                    coil,
                    coil + Vec3::Z * 2.4,
                    (coil + Vec3::Z * 2.4).with_y(1.2),
                    (coil + Vec3::Z * 5.0).with_y(1.2),
                ],
                0.12,
            );
        }
        self.sketch.paint = SILVER;
        let header = Vec3::new(0.0, 1.2, max.z + 5.1);
        self.sketch.tube(&[header.with_x(min.x), header.with_x(max.x + 1.0)], 0.25);
        self.connect(header.with_x(max.x + 1.0), Vec3::Z, max.x + 1.0);
    }
}
