//! What stands in a cell: a unit of the plant on a plot of [`PLOT`] metres square.

mod exchangers;
mod furnace;
mod structure;

use super::palette::{BLUE, CONCRETE, CREAM, GALVANISED, GREEN, ORANGE, RED, SILVER, STEEL, WHITE};
use super::piping::{Rack, flange, pipe, valve};
use super::steel::stairs;
use super::vessels::{column, drum, nozzle, sphere, storage_tank};
use crate::mesh::generate::rng::Rng;
use crate::mesh::generate::sketch::{Sketch, direction};
use glam::{Vec2, Vec3};

/// Edge of a plot.
pub(super) const PLOT: f32 = 24.0;

/// The kinds of unit.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Unit {
    LargeTank,
    SmallTanks,
    Columns,
    Spheres,
    Structure,
    Furnace,
    Exchangers,
    CoolingTower,
}

impl Unit {
    pub const ALL: [Self; 8] = [
        Self::Structure,
        Self::Columns,
        Self::LargeTank,
        Self::Exchangers,
        Self::Spheres,
        Self::SmallTanks,
        Self::Furnace,
        Self::CoolingTower,
    ];

    /// Draws the unit around the origin; its pipes join `rack`, which is at `rack_z`.
    pub fn draw(self, sketch: &mut Sketch, rng: &mut Rng, rack: &Rack, rack_z: f32) {
        let mut site = Site { sketch, rng, rack, rack_z };
        match self {
            Self::LargeTank => site.large_tank(),
            Self::SmallTanks => site.small_tanks(),
            Self::Columns => site.columns(),
            Self::Spheres => site.spheres(),
            Self::Structure => site.structure(),
            Self::Furnace => site.furnace(),
            Self::Exchangers => site.exchangers(),
            Self::CoolingTower => site.cooling_tower(),
        }
    }
}

struct Site<'a> {
    sketch: &'a mut Sketch,
    rng: &'a mut Rng,
    rack: &'a Rack,
    rack_z: f32,
}

impl Site<'_> {
    /// A pipe from a nozzle along `out`, down or up to the rack, across, and onto one of its pipes.
    fn connect(&mut self, from: Vec3, out: Vec3, x: f32) {
        let (joint, radius, paint) = self.rack.joint(self.rng, x);
        let joint = joint + Vec3::Z * self.rack_z;
        let radius = radius.min(0.2);
        self.sketch.paint = paint;
        let turn = from + out * 1.2;
        // Above the lower deck's pipes and below the upper deck.
        let over = joint.y + self.rng.range(0.7, 1.1);
        let corners =
            [from, turn, turn.with_y(over), Vec3::new(x, over, turn.z), Vec3::new(x, over, joint.z), joint];
        let apart = |w: &[Vec3]| w[0].distance(w[1]) > 4.0 * radius;
        let mut path = vec![corners[0]];
        for w in corners.windows(2) {
            if apart(&[path[path.len() - 1], w[1]]) {
                path.push(w[1]);
            }
        }
        pipe(self.sketch, &path, radius);
        flange(self.sketch, from, out, radius);
        if turn.y < over - 1.5 {
            valve(
                self.sketch,
                turn.with_y(turn.y.midpoint(over).min(2.0).max(turn.y + 0.7)),
                Vec3::Y,
                radius,
            );
        }
    }

    fn bund(&mut self, half: f32) {
        self.sketch.paint = CONCRETE;
        for (a, b) in [(-half, -half + 0.3), (half - 0.3, half)] {
            self.sketch.cuboid(Vec3::new(-half, 0.0, a), Vec3::new(half, 0.9, b));
            self.sketch.cuboid(Vec3::new(a, 0.0, -half + 0.3), Vec3::new(b, 0.9, half - 0.3));
        }
    }

    fn large_tank(&mut self) {
        self.bund(PLOT * 0.5);
        let (radius, height) = (self.rng.range(8.2, 9.8), self.rng.range(9.0, 13.0));
        self.sketch.paint = self.rng.pick(&[WHITE, CREAM, RED, WHITE, SILVER]);
        storage_tank(self.sketch, self.rng, Vec3::ZERO, radius, height);
        self.sketch.paint = STEEL;
        for x in [-2.0, 1.5] {
            let wall = Vec3::new(x, 1.2, (radius * radius - x * x).sqrt() - 0.2);
            let end = nozzle(self.sketch, wall, Vec3::Z, 0.8, 0.25);
            self.connect(end, Vec3::Z, x);
        }
        stairs(self.sketch, Vec3::new(6.0, 0.0, 14.2), Vec3::new(6.0, 1.0, 12.2), 1.0);
    }

    fn small_tanks(&mut self) {
        self.bund(PLOT * 0.5);
        let columns = 2 + self.rng.below(2);
        let pitch = PLOT / columns as f32;
        let height = self.rng.range(7.0, 11.0);
        for i in 0..columns {
            for k in 0..2 {
                let center = Vec3::new((i as f32 + 0.5) * pitch - 12.0, 0.0, k as f32 * 11.0 - 5.5);
                let radius = (pitch * 0.5 - 1.6).min(4.0) * self.rng.range(0.85, 1.0);
                self.sketch.paint = self.rng.pick(&[RED, WHITE, SILVER, BLUE, CREAM, WHITE]);
                let height = height * self.rng.range(0.85, 1.1);
                storage_tank(self.sketch, self.rng, center, radius, height);
                if k == 1 {
                    self.sketch.paint = STEEL;
                    let wall = center + Vec3::new(0.0, 1.2, radius - 0.2);
                    let end = nozzle(self.sketch, wall, Vec3::Z, 0.7, 0.16);
                    self.connect(end, Vec3::Z, center.x + 0.8);
                }
            }
        }
    }

    fn columns(&mut self) {
        let count = 3 + self.rng.below(2);
        for i in 0..count {
            let x = (i as f32 + 0.5) * PLOT / count as f32 - PLOT * 0.5;
            let radius = self.rng.range(0.9, 1.9);
            let height = self.rng.range(20.0, 40.0);
            let foot = Vec3::new(x, 0.15, self.rng.range(-7.0, -1.0));
            self.sketch.paint = self.rng.pick(&[SILVER, SILVER, WHITE, CREAM, GALVANISED]);
            let drop = foot + Vec3::new(0.0, 1.7, 6.5);
            column(self.sketch, self.rng, foot, radius, height, drop);
            self.sketch.paint = self.rng.pick(&[BLUE, SILVER, GREEN, ORANGE]);
            drum(self.sketch, drop + Vec3::new(0.0, 0.0, 1.4), Vec3::X, 0.8, 3.0);
            self.connect(drop + Vec3::new(0.6, 0.9, 1.4), Vec3::Y, x + 1.0);
        }
        for x in [-9.0, -3.0, 3.0, 9.0] {
            self.pump(Vec3::new(x, 0.15, -10.5));
        }
    }

    fn spheres(&mut self) {
        for x in [-6.1, 6.1] {
            let radius = self.rng.range(4.6, 5.3);
            let center = Vec3::new(x, 0.15, self.rng.range(-4.0, 0.0));
            self.sketch.paint = self.rng.pick(&[WHITE, WHITE, CREAM, SILVER]);
            sphere(self.sketch, center, radius);
            self.sketch.paint = STEEL;
            let end = nozzle(self.sketch, center + Vec3::Y * 2.3, Vec3::NEG_Y, 0.6, 0.2);
            let below = end.with_y(1.0);
            self.sketch.paint = BLUE;
            pipe(self.sketch, &[end, below, below + Vec3::Z * 7.0], 0.2);
            self.connect(below + Vec3::Z * 7.0, Vec3::Z, x);
        }
    }

    fn cooling_tower(&mut self) {
        let steps = 24;
        let height = self.rng.range(26.0, 32.0);
        let waist = self.rng.range(5.8, 6.6);
        // A hyperboloid whose waist lies at three quarters of the height.
        let shell = |i: usize, inset: f32| {
            let t = i as f32 / steps as f32;
            let x = (t - 0.75) * 1.55;
            Vec2::new(waist * (1.0 + x * x).sqrt() - inset, 3.0 + (height - 3.0) * t)
        };
        let outside = (0..=steps).map(|i| shell(i, 0.0));
        let inside = (0..=steps).rev().map(|i| shell(i, 0.35));
        self.sketch.paint = CONCRETE;
        let profile: Vec<Vec2> = outside.chain(inside).collect();
        self.sketch.revolve(Vec3::ZERO, Vec3::Y, &profile);
        let (foot, top) = (shell(0, 0.2).x + 0.9, shell(0, 0.2).x);
        let on = |turn: f64, radius: f32, y: f32| {
            let d = direction(turn) * radius;
            Vec3::new(d.x, y, d.y)
        };
        for i in 0..24 {
            let turn = f64::from(i) / 24.0;
            for side in [-1.0, 1.0] {
                self.sketch.tube(&[on(turn, foot, 0.0), on(turn + side / 48.0, top, 3.1)], 0.22);
            }
        }
        let basin =
            [(foot + 0.4, 0.0), (foot + 1.0, 0.0), (foot + 1.0, 1.2), (foot + 0.6, 1.2), (foot + 0.6, 0.2)];
        self.sketch.revolve(Vec3::ZERO, Vec3::Y, &basin.map(Vec2::from));
        for x in [-1.5, 1.5] {
            self.sketch.paint = BLUE;
            let low = Vec3::new(x, 0.9, foot - 0.5);
            pipe(self.sketch, &[low, low.with_z(foot + 1.6)], 0.35);
            self.connect(low.with_z(foot + 1.6), Vec3::Z, x);
        }
    }
}
