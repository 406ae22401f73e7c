//! What stands in a cell: a unit of the plant on a plot of [`PLOT`] metres square.

use super::palette::{
    BLUE, BRICK, CONCRETE, CREAM, DARK_STEEL, GALVANISED, GREEN, ORANGE, RED, SILVER, STEEL, WHITE,
};
use super::piping::{Rack, flange, pipe, valve};
use super::steel::{floor, i_beam, ladder, railing, stairs};
use super::vessels::{chimney, column, drum, nozzle, sphere, storage_tank, vessel};
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

    fn structure(&mut self) {
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
        self.sketch.paint = GALVANISED;
        let (near, far) = if back { (-8.2, high) } else { (high, 0.0) };
        let landing = at + Vec3::Y * storey;
        self.sketch.cuboid(
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

    fn furnace(&mut self) {
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
            self.sketch.paint = GALVANISED;
            self.sketch.cuboid(Vec3::new(min.x, y, max.z), Vec3::new(max.x, y + 0.06, max.z + 1.4));
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

    fn exchangers(&mut self) {
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

    /// A pump with its motor on a plinth, and the pipes to and from it.
    fn pump(&mut self, at: Vec3) {
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
