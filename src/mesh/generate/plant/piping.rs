//! Pipes with what sits on them, and the racks that carry them.

use super::grating::walkway;
use super::palette::{CONCRETE, DARK_STEEL, RED, STEEL};
use super::plates::{shared_plate, touching_discs};
use super::steel::{i_beam, railing};
use super::{cables, layout::CELL_X, palette};
use crate::mesh::generate::rng::Rng;
use crate::mesh::generate::sketch::{Sketch, direction, rounded};
use glam::{Vec2, Vec3};

/// A pipe through `corners`, with elbows of one and a half diameters, as pipe fitters make them.
pub(super) fn pipe(sketch: &mut Sketch, corners: &[Vec3], radius: f32) {
    let steps = (sketch.sides(radius) / 2).clamp(2, 8);
    sketch.tube(&rounded(corners, radius * 3.0, steps), radius);
}

/// The quality from which flanges have bolts.
const BOLTS_FROM: f32 = 1.2;

/// A pair of flanges, in fine models with their bolts, across `axis`.
pub(super) fn flange(sketch: &mut Sketch, at: Vec3, axis: Vec3, radius: f32) {
    let height = radius * 0.22 + 0.015;
    let half = axis * height;
    let fine = sketch.quality >= BOLTS_FROM;
    touching_discs(sketch, at, axis, radius * 1.6, height, fine);
    if !fine {
        return;
    }
    let u = axis.any_orthonormal_vector();
    let v = axis.cross(u);
    for i in 0..8 {
        let d = direction(f64::from(i) / 8.0) * (radius * 1.4);
        let bolt = at + u * d.x + v * d.y;
        sketch.bar(bolt - half * 1.4, bolt + half * 1.4, radius * 0.16, radius * 0.16, u);
    }
}

/// A gate valve with its hand wheel, on a pipe along `axis`.
pub(super) fn valve(sketch: &mut Sketch, at: Vec3, axis: Vec3, radius: f32) {
    let paint = sketch.paint;
    sketch.paint = palette::GREEN;
    let body = [(0.0, -1.4), (1.1, -1.4), (1.5, -0.7), (1.5, 0.7), (1.1, 1.4), (0.0, 1.4)];
    sketch.revolve(at, axis, &body.map(|p| Vec2::from(p) * radius));
    flange(sketch, at - axis * radius * 1.5, axis, radius);
    flange(sketch, at + axis * radius * 1.5, axis, radius);
    let stem = if axis.y.abs() < 0.5 { Vec3::Y } else { Vec3::Z };
    sketch.paint = DARK_STEEL;
    sketch.cylinder(at, at + stem * radius * 3.0, radius * 0.8);
    sketch.cylinder(at + stem * radius * 3.0, at + stem * radius * 5.0, radius * 0.15);
    sketch.paint = RED;
    let wheel = at + stem * radius * 4.8;
    sketch.hoop(wheel, stem, radius * 1.7, radius * 0.16);
    let u = stem.any_orthonormal_vector();
    for spoke in [u, stem.cross(u)] {
        sketch.bar(
            wheel - spoke * radius * 1.7,
            wheel + spoke * radius * 1.7,
            radius * 0.2,
            radius * 0.2,
            stem,
        );
    }
    sketch.paint = paint;
}

/// A row's rack runs on through all its cells: its pipes are the same in each.
#[derive(Clone, Debug)]
pub(super) struct Rack {
    pipes: Vec<RackPipe>,
    /// How far down, in metres, the cables hang that are slung along its side.
    slack: Vec<f32>,
}

#[derive(Clone, Copy, Debug)]
struct RackPipe {
    z: f32,
    y: f32,
    radius: f32,
    paint: u32,
}

/// Heights of the rack's decks and of its top beams, half its width, and the distance of its columns.
const DECKS: [f32; 2] = [4.6, 6.8];
pub(super) const RACK_TOP: f32 = DECKS[1] + 1.6;
pub(super) const HALF_WIDTH: f32 = 3.2;
const BAY: f32 = CELL_X / 4.0;

impl Rack {
    /// The rack of a row of cells.
    pub fn new(rng: &mut Rng) -> Self {
        let mut pipes = Vec::new();
        for deck in DECKS {
            let mut z = -HALF_WIDTH + 0.5;
            while z < HALF_WIDTH - 0.5 {
                let radius = rng.pick(&[0.08, 0.1, 0.13, 0.16, 0.2, 0.25, 0.32]);
                let paint = rng.pick(&[
                    palette::SILVER,
                    palette::SILVER,
                    palette::BLUE,
                    palette::GREEN,
                    palette::WHITE,
                    palette::RED,
                    palette::CREAM,
                    palette::STEEL,
                ]);
                pipes.push(RackPipe { z: z + radius, y: deck + 0.15 + radius, radius, paint });
                z += 2.0 * radius + rng.range(0.12, 0.4);
            }
        }
        let slack = (0..2 + rng.below(2)).map(|_| rng.range(0.25, 1.0)).collect();
        Self { pipes, slack }
    }

    /// Draws a cell's stretch, along x around the origin. Pipes that end in a cell at the edge of
    /// the plant are the neighbours that never came.
    pub fn draw(&self, sketch: &mut Sketch, rng: &mut Rng) {
        self.frame(sketch);
        let half = CELL_X * 0.5;
        for pipe_run in &self.pipes {
            let RackPipe { z, y, radius, paint } = *pipe_run;
            sketch.paint = paint;
            let at = |x: f32, up: f32| Vec3::new(x, y + up, z);
            if y > DECKS[1] && radius > 0.12 && rng.chance(0.15) {
                // An expansion loop takes up the heat's lengthening.
                let (x, up) = (rng.range(-6.0, 2.0), 1.3 + radius * 3.0);
                let bends = [(-half, 0.0), (x, 0.0), (x, up), (x + 4.0, up), (x + 4.0, 0.0), (half, 0.0)];
                pipe(sketch, &bends.map(|(x, up)| at(x, up)), radius);
            } else {
                pipe(sketch, &[at(-half, 0.0), at(half, 0.0)], radius);
            }
            for _ in 0..2 {
                let x = rng.range(-half + 1.0, half - 1.0);
                if rng.chance(0.2) && y > DECKS[1] {
                    valve(sketch, at(x, 0.0), Vec3::X, radius);
                } else {
                    flange(sketch, at(x, 0.0), Vec3::X, radius);
                }
            }
        }
        cables::trays(sketch);
        for (i, sag) in self.slack.iter().enumerate() {
            cables::slung(sketch, BAY, DECKS[1] - 0.8, -HALF_WIDTH - 0.25 - 0.09 * i as f32, *sag);
        }
        self.walkway(sketch);
    }

    /// Where the columns of a cell's stretch stand.
    pub fn columns() -> [f32; 4] {
        std::array::from_fn(|bay| BAY * (bay as f32 + 0.5) - CELL_X * 0.5)
    }

    /// Where a pipe from a unit may join: a pipe of the lower deck and its radius.
    pub fn joint(&self, rng: &mut Rng, x: f32) -> (Vec3, f32, u32) {
        let lower: Vec<_> = self.pipes.iter().filter(|p| p.y < DECKS[1]).collect();
        let p = rng.pick(&lower);
        (Vec3::new(x, p.y, p.z), p.radius, p.paint)
    }

    fn frame(&self, sketch: &mut Sketch) {
        let half = CELL_X * 0.5;
        let top = RACK_TOP;
        for x in Self::columns() {
            for z in [-HALF_WIDTH, HALF_WIDTH] {
                sketch.paint = CONCRETE;
                sketch.cuboid(Vec3::new(x - 0.35, 0.0, z - 0.35), Vec3::new(x + 0.35, 0.3, z + 0.35));
                sketch.paint = STEEL;
                i_beam(sketch, Vec3::new(x, 0.3, z), Vec3::new(x, top, z), 0.3, Vec3::X);
                // Where the girders of both bays meet at the column, each brings the plate.
                let joint = Vec3::new(x, DECKS[0] - 0.6, z + 0.16 * z.signum());
                let half = Vec3::new(0.2, 0.2, 0.01);
                shared_plate(sketch, joint - half, joint + half);
            }
            for y in [DECKS[0], DECKS[1], top] {
                let end = |z: f32| Vec3::new(x, y - 0.05, z);
                i_beam(sketch, end(-HALF_WIDTH), end(HALF_WIDTH), 0.28, Vec3::Y);
            }
        }
        for z in [-HALF_WIDTH, HALF_WIDTH] {
            for y in [DECKS[0] - 0.6, DECKS[1] - 0.6, top] {
                i_beam(sketch, Vec3::new(-half, y, z), Vec3::new(half, y, z), 0.24, Vec3::Y);
            }
            let x = BAY * 0.5;
            let brace = |a: f32, b: f32| (Vec3::new(a, 0.4, z), Vec3::new(b, DECKS[0] - 0.6, z));
            for (a, b) in [brace(-x, BAY - x), brace(BAY - x, -x)] {
                sketch.bar(a, b, 0.12, 0.12, Vec3::Z);
            }
        }
    }

    /// A walkway on brackets, on the side where no pipes leave the rack.
    fn walkway(&self, sketch: &mut Sketch) {
        let (y, inner, outer) = (DECKS[1] - 0.1, HALF_WIDTH + 0.2, HALF_WIDTH + 1.1);
        let end = |x: f32, z: f32| Vec3::new(x, y, z);
        let half = CELL_X * 0.5;
        walkway(sketch, end(-half, inner) - Vec3::Y * 0.04, end(half, outer));
        sketch.paint = STEEL;
        for x in Self::columns() {
            let under = -Vec3::Y * 0.14;
            i_beam(sketch, end(x, HALF_WIDTH) + under, end(x, outer) + under, 0.2, Vec3::Y);
        }
        railing(sketch, &[end(-half, outer - 0.03), end(half, outer - 0.03)]);
    }
}
