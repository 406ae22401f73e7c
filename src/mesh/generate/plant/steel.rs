//! Structural steel: beams, railings, stairs, ladders, platforms.

use super::grating;
use super::palette::{DARK_STEEL, GALVANISED, RAIL, STEEL};
use crate::mesh::generate::sketch::{Sketch, direction};
use glam::{Vec2, Vec3};

const HANDRAIL: f32 = 1.1;

/// A rolled I-section from `a` to `b`, so deep along `up` and almost as wide.
pub(super) fn i_beam(sketch: &mut Sketch, a: Vec3, b: Vec3, depth: f32, up: Vec3) {
    let along = (b - a).normalize();
    let up = (up - along * up.dot(along)).normalize();
    let (width, flange) = (depth * 0.8, depth * 0.08);
    let offset = up * ((depth - flange) * 0.5);
    sketch.bar(a + offset, b + offset, width, flange, up);
    sketch.bar(a - offset, b - offset, width, flange, up);
    sketch.bar(a, b, depth * 0.06, depth - 2.0 * flange, up);
}

/// Posts with a hand rail, a knee rail and a toe board along a path, in safety yellow.
pub(super) fn railing(sketch: &mut Sketch, path: &[Vec3]) {
    sketch.paint = RAIL;
    for w in path.windows(2) {
        let steps = (w[0].distance(w[1]) / 1.5).ceil().max(1.0) as usize;
        for i in 0..steps {
            let foot = w[0].lerp(w[1], i as f32 / steps as f32);
            sketch.tube(&[foot, foot + Vec3::Y * HANDRAIL], 0.03);
        }
    }
    for height in [HANDRAIL, HANDRAIL * 0.5] {
        let rail: Vec<Vec3> = path.iter().map(|&p| p + Vec3::Y * height).collect();
        sketch.tube(&rail, 0.03);
    }
    for w in path.windows(2).filter(|w| w[0].y == w[1].y) {
        sketch.bar(w[0] + Vec3::Y * 0.07, w[1] + Vec3::Y * 0.07, 0.012, 0.14, Vec3::Y);
    }
}

/// Points on a horizontal circle, from one fraction of a turn to another.
pub(super) fn arc(center: Vec3, radius: f32, from: f64, to: f64) -> Vec<Vec3> {
    let steps = ((to - from).abs() * f64::from(radius) * 5.0).ceil().max(4.0) as usize;
    (0..=steps)
        .map(|i| {
            let d = direction(from + (to - from) * i as f64 / steps as f64) * radius;
            center + Vec3::new(d.x, 0.0, -d.y)
        })
        .collect()
}

/// A straight flight of stairs with its railings.
pub(super) fn stairs(sketch: &mut Sketch, from: Vec3, to: Vec3, width: f32) {
    let across = Vec3::Y.cross(to - from).normalize() * (width * 0.5);
    let steps = ((to.y - from.y) / 0.2).round().max(1.0);
    sketch.paint = GALVANISED;
    for i in 1..=steps as usize {
        let tread = from.lerp(to, (i as f32 - 0.5) / steps);
        grating::tread(sketch, tread, across, 0.26, 0.04);
    }
    for side in [across, -across] {
        sketch.paint = STEEL;
        sketch.bar(from + side, to + side, 0.06, 0.24, Vec3::Y);
        railing(sketch, &[from + side, to + side]);
    }
}

/// An upright ladder against a wall that faces `out`, with a safety cage above head height.
pub(super) fn ladder(sketch: &mut Sketch, foot: Vec3, height: f32, out: Vec3) {
    let across = Vec3::Y.cross(out) * 0.24;
    let up = Vec3::Y * height;
    sketch.paint = RAIL;
    for side in [across, -across] {
        sketch.bar(foot + side, foot + side + up, 0.06, 0.02, out);
    }
    for i in 1..(height / 0.3) as usize {
        let rung = foot + Vec3::Y * (0.3 * i as f32);
        sketch.bar(rung - across, rung + across, 0.025, 0.025, Vec3::Y);
    }
    let hoops = ((height - 2.2) / 1.2) as usize;
    let hoop = |i: usize| {
        let center = foot + Vec3::Y * (2.2 + 1.2 * i as f32);
        [(-1.0, 0.0), (-1.4, 0.4), (-0.8, 0.75), (0.8, 0.75), (1.4, 0.4), (1.0, 0.0)]
            .map(|(a, o): (f32, f32)| center + across * a + out * o)
    };
    for i in 0..hoops {
        sketch.tube(&hoop(i), 0.02);
        if i > 0 {
            for (a, b) in hoop(i - 1).iter().zip(hoop(i)).skip(1).take(4) {
                sketch.bar(*a, b, 0.03, 0.01, out);
            }
        }
    }
}

/// A ring-shaped platform around something round, with railing and brackets.
pub(super) fn ring_platform(sketch: &mut Sketch, center: Vec3, inner: f32, width: f32) {
    let outer = inner + width;
    sketch.paint = GALVANISED;
    let section = [(inner, 0.0), (outer, 0.0), (outer, 0.06), (inner, 0.06)];
    sketch.revolve(center, Vec3::Y, &section.map(Vec2::from));
    sketch.paint = DARK_STEEL;
    for i in 0..8 {
        let d = direction(f64::from(i) / 8.0);
        let d = Vec3::new(d.x, 0.0, d.y);
        sketch.bar(center + d * inner - Vec3::Y * 0.8, center + d * outer, 0.08, 0.08, Vec3::Y);
    }
    railing(sketch, &arc(center + Vec3::Y * 0.06, outer - 0.04, 0.0, 1.0));
}

/// A rectangular floor of grating on edge beams.
pub(super) fn floor(sketch: &mut Sketch, min: Vec3, max: Vec3) {
    grating::floor(sketch, min, Vec3::new(max.x, min.y + 0.06, max.z));
    sketch.paint = STEEL;
    let at = |x: f32, z: f32| Vec3::new(x, min.y - 0.15, z);
    let joists = ((max.x - min.x) / 1.5) as usize;
    for i in 0..=joists {
        let x = min.x + (max.x - min.x) * i as f32 / joists as f32;
        i_beam(sketch, at(x, min.z), at(x, max.z), 0.22, Vec3::Y);
    }
    for z in [min.z, max.z] {
        i_beam(sketch, at(min.x, z), at(max.x, z), 0.3, Vec3::Y);
    }
}
