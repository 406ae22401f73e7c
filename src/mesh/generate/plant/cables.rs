//! Cables: lying in trays, let down from them, slung from column to column and from pole to pole.

use super::layout::CELL_X;
use super::palette::{CABLE, CREAM, DARK_STEEL, GALVANISED, WHITE};
use super::piping::{HALF_WIDTH, RACK_TOP};
use crate::mesh::generate::rng::Rng;
use crate::mesh::generate::sketch::{Sketch, rounded};
use glam::Vec3;

/// A cable's radius in metres.
const RADIUS: f32 = 0.035;
/// Where trays lie on a rack: their height and the sides that face to negative z.
const TRAY: f32 = RACK_TOP + 0.15;
const TRAYS: [f32; 2] = [-1.9, 1.4];
const TRAY_WIDTH: f32 = 0.6;
/// The quality from which a tray's bottom is rungs and cables bend smoothly; below it is a plate.
const FINE_FROM: f32 = 1.2;

/// A cable along x through a cell around the origin, which hangs in spans of `pitch` metres from what
/// stands in the middle of each. Cells end where it hangs lowest, so it goes on in the next.
pub(super) fn slung(sketch: &mut Sketch, pitch: f32, top: f32, z: f32, sag: f32) {
    let spans = (CELL_X / pitch).round() as usize;
    // Even, so that one of the points is at the post.
    let steps = 2 * ((pitch.sqrt() * sketch.quality) as usize).clamp(2, 12);
    let at = |i: usize| {
        // 0 where it is lowest, 1 at the post: a parabola, as near a catenary as makes no odds.
        let from_post = (i % steps) as f32 / steps as f32;
        let d = 2.0 * from_post.min(1.0 - from_post);
        let x = CELL_X * (i as f32 / (steps * spans) as f32 - 0.5);
        Vec3::new(x, top - sag * (1.0 - d * d), z)
    };
    sketch.paint = CABLE;
    let path: Vec<Vec3> = (0..=steps * spans).map(at).collect();
    sketch.tube(&path, RADIUS);
}

/// The trays on top of a cell's stretch of rack, along x around the origin.
pub(super) fn trays(sketch: &mut Sketch) {
    let half = CELL_X * 0.5;
    for z in TRAYS {
        sketch.paint = GALVANISED;
        let plate = |s: &mut Sketch, z0: f32, z1: f32, y1: f32| {
            s.cuboid(Vec3::new(-half, TRAY, z0), Vec3::new(half, y1, z1));
        };
        plate(sketch, z - 0.02, z, TRAY + 0.14);
        plate(sketch, z + TRAY_WIDTH, z + TRAY_WIDTH + 0.02, TRAY + 0.14);
        if sketch.quality < FINE_FROM {
            plate(sketch, z, z + TRAY_WIDTH, TRAY + 0.02);
        } else {
            let rungs = (CELL_X / 0.3) as usize;
            for i in 0..rungs {
                let x = CELL_X * ((i as f32 + 0.5) / rungs as f32 - 0.5);
                let (low, high) = (Vec3::new(x - 0.02, TRAY, z), Vec3::new(x + 0.02, TRAY + 0.02, z + 0.6));
                sketch.cuboid(low, high);
            }
        }
        sketch.paint = CABLE;
        for i in 0..6 {
            let at = |x: f32| Vec3::new(x, TRAY + 0.06, z + 0.08 + 0.09 * i as f32);
            sketch.tube(&[at(-half), at(half)], RADIUS);
        }
    }
}

/// Cables that leave the tray at `x`, over the rack's edge and down to a box on the column there.
pub(super) fn drop(sketch: &mut Sketch, rng: &mut Rng, x: f32) {
    let face = -HALF_WIDTH - 0.2;
    let foot = Vec3::new(x, 1.3, face);
    sketch.paint = CREAM;
    sketch.cuboid(foot - Vec3::new(0.3, 0.0, 0.25), foot + Vec3::new(0.3, 0.8, 0.0));
    sketch.paint = CABLE;
    let cables = 1 + rng.below(3);
    for i in 0..cables {
        let x = x + 0.11 * (i as f32 - 0.5 * (cables - 1) as f32);
        // Each has some slack of its own: it hangs out from the column half way down.
        let slack = rng.range(0.1, 0.5);
        let at = |y: f32, z: f32| Vec3::new(x, y, z);
        let path = [
            at(TRAY + 0.1, TRAYS[0] + 0.1),
            at(TRAY + 0.3, TRAYS[0] - 0.3),
            at(TRAY + 0.1, face - 0.2),
            at(3.6, face - 0.2 - slack),
            at(2.5, face - 0.12),
            at(2.1, face - 0.12),
        ];
        let steps = if sketch.quality < FINE_FROM { 2 } else { 5 };
        sketch.tube(&rounded(&path, 0.6, steps), RADIUS);
    }
}

/// A lamp post at the middle of a cell, `z` away, with the line that runs from post to post.
pub(super) fn lamp_post(sketch: &mut Sketch, z: f32) {
    let (height, arm) = (9.0, 0.9);
    let foot = Vec3::new(0.0, 0.0, z);
    let top = foot + Vec3::Y * height;
    sketch.paint = GALVANISED;
    sketch.cylinder(foot, top, 0.1);
    sketch.bar(top - Vec3::Z * arm, top + Vec3::Z * arm, 0.1, 0.1, Vec3::Y);
    let lamp = top - Vec3::Z * (arm + 0.3);
    sketch.paint = WHITE;
    sketch.cuboid(lamp - Vec3::new(0.15, 0.1, 0.35), lamp + Vec3::new(0.15, 0.05, 0.35));
    for off in [-0.6, 0.6] {
        sketch.paint = DARK_STEEL;
        let insulator = top + Vec3::Z * off;
        sketch.cylinder(insulator + Vec3::Y * 0.05, insulator + Vec3::Y * 0.25, 0.05);
        slung(sketch, CELL_X, height + 0.27, z + off, 1.5);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slung_cable_is_highest_at_its_posts_and_goes_on_in_the_next_cell() {
        let mut sketch = Sketch::new(1.0);
        slung(&mut sketch, 7.0, 5.0, 2.0, 0.8);
        let part = sketch.part();
        let ends: Vec<_> = part.positions.iter().filter(|p| p.x.abs() == CELL_X * 0.5).collect();
        assert!(ends.len() == 2 && ends.iter().all(|p| (p.y - 4.2).abs() < 0.1), "{ends:?}");
        for post in [-10.5_f32, -3.5, 3.5, 10.5] {
            let near = part.positions.iter().filter(|p| (p.x - post).abs() < 0.05);
            let highest = near.map(|p| p.y).fold(f32::MIN, f32::max);
            assert!((highest - 5.0).abs() < 0.05, "{highest} at {post}");
        }
    }
}
