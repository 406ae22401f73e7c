//! Round steel: tanks, columns, spheres, drums, chimneys.

use super::palette::{CONCRETE, DARK_STEEL, GALVANISED, RAIL, RED, SILVER, STEEL, WHITE};
use super::piping::{flange, pipe};
use super::steel::{arc, ladder, railing, ring_platform};
use crate::mesh::generate::rng::Rng;
use crate::mesh::generate::sketch::{Sketch, direction};
use glam::{Vec2, Vec3};

/// A vessel's profile: a straight shell with domed heads, which are `bulge` of the radius high.
fn domed(radius: f32, length: f32, bulge: f32, sides: usize) -> Vec<Vec2> {
    let steps = (sides / 5).max(3);
    let quarter = |i: usize| direction(0.25 * i as f64 / steps as f64) * radius;
    let low = (0..=steps).map(&quarter).map(|d| Vec2::new(d.y, -d.x * bulge));
    let high = (0..=steps).map(quarter).map(|d| Vec2::new(d.x, length + d.y * bulge));
    // The ends of the arcs are exact: `direction` is exact at quarter turns.
    low.chain(high).collect()
}

/// A vessel with domed heads from `a` to `b`, where its shell is straight.
pub(super) fn vessel(sketch: &mut Sketch, a: Vec3, b: Vec3, radius: f32) {
    let length = a.distance(b);
    let profile = domed(radius, length, 0.5, sketch.sides(radius));
    sketch.revolve(a, (b - a) / length, &profile);
}

/// A short branch out of a vessel that ends in a flange; gives where it ends.
pub(super) fn nozzle(sketch: &mut Sketch, from: Vec3, out: Vec3, length: f32, radius: f32) -> Vec3 {
    let end = from + out * length;
    sketch.cylinder(from, end, radius);
    flange(sketch, end, out, radius);
    end
}

/// A lying vessel on two saddles.
pub(super) fn drum(sketch: &mut Sketch, center: Vec3, along: Vec3, radius: f32, length: f32) {
    let half = along * (length * 0.5);
    vessel(sketch, center - half, center + half, radius);
    for t in [-0.9, 0.9] {
        flange(sketch, center + half * t, along, radius * 0.66);
    }
    nozzle(sketch, center + half * 0.3 + Vec3::Y * radius * 0.9, Vec3::Y, radius * 0.5, radius * 0.2);
    nozzle(sketch, center - half * 0.5 + Vec3::Y * radius * 0.9, Vec3::Y, radius * 0.4, radius * 0.3);
    let paint = sketch.paint;
    sketch.paint = CONCRETE;
    for t in [-0.6, 0.6] {
        let foot = center + half * t - Vec3::Y * radius * 0.55;
        let across = along.cross(Vec3::Y) * radius * 0.8;
        sketch.bar(foot - across, foot + across, 0.3, radius * 1.1, Vec3::Y);
    }
    sketch.paint = paint;
}

/// A flat-bottomed storage tank with a cone roof, wind girders and a spiral stair.
pub(super) fn storage_tank(sketch: &mut Sketch, rng: &mut Rng, center: Vec3, radius: f32, height: f32) {
    let paint = sketch.paint;
    sketch.paint = CONCRETE;
    sketch.cylinder(center, center + Vec3::Y * 0.35, radius + 0.5);
    sketch.paint = paint;
    let base = center + Vec3::Y * 0.35;
    let rise = radius * rng.pick(&[0.12, 0.2, 0.35]);
    let mut profile = vec![Vec2::ZERO, Vec2::new(radius, 0.0)];
    let courses = (height / 2.4).round().max(2.0) as usize;
    for i in 1..=courses {
        // Each course of plates stands back a little behind the one below.
        let inset = 0.012 * i as f32;
        let y = height * i as f32 / courses as f32;
        profile.push(Vec2::new(radius - inset, y - 0.03));
        profile.push(Vec2::new(radius - inset - 0.012, y));
    }
    for i in 1..=6 {
        let d = direction(0.25 * f64::from(i) / 6.0);
        profile.push(Vec2::new((radius - 0.2) * d.x, height + rise * d.y));
    }
    sketch.revolve(base, Vec3::Y, &profile);
    sketch.paint = STEEL;
    for t in [0.55, 0.97] {
        sketch.hoop(base + Vec3::Y * height * t, Vec3::Y, radius + 0.04, 0.09);
    }
    let start = f64::from(rng.unit());
    spiral_stair(sketch, base, radius, height, start);
    railing(sketch, &arc(base + Vec3::Y * (height + 0.05), radius - 0.15, 0.0, 1.0));
    sketch.paint = STEEL;
    sketch.cylinder(base + Vec3::Y * (height + rise - 0.05), base + Vec3::Y * (height + rise + 0.8), 0.25);
    sketch.cylinder(base + Vec3::Y * (height + rise + 0.8), base + Vec3::Y * (height + rise + 0.95), 0.5);
}

fn spiral_stair(sketch: &mut Sketch, base: Vec3, radius: f32, height: f32, start: f64) {
    let steps = (height / 0.22) as usize;
    let turn = f64::from(height * 1.2 / (radius * std::f32::consts::TAU));
    let at = |i: usize| start + turn * i as f64 / steps as f64;
    sketch.paint = GALVANISED;
    for i in 0..steps {
        let d = direction(at(i));
        let out = Vec3::new(d.x, 0.0, -d.y);
        let tread = base + Vec3::Y * (0.22 * (i + 1) as f32);
        sketch.bar(tread + out * (radius - 0.05), tread + out * (radius + 0.9), 0.3, 0.04, Vec3::Y);
    }
    let path = |r: f32| -> Vec<Vec3> {
        (0..=steps / 4)
            .map(|k| {
                let i = 4 * k;
                let d = direction(at(i)) * r;
                base + Vec3::new(d.x, 0.22 * i as f32 + 0.1, -d.y)
            })
            .collect()
    };
    sketch.paint = STEEL;
    sketch.tube(&path(radius + 0.9), 0.07);
    railing(sketch, &path(radius + 0.9));
}

/// A distillation column with platforms, ladders and its overhead line, which ends at `drop`.
pub(super) fn column(sketch: &mut Sketch, rng: &mut Rng, foot: Vec3, radius: f32, height: f32, drop: Vec3) {
    let paint = sketch.paint;
    sketch.paint = CONCRETE;
    sketch.cylinder(foot, foot + Vec3::Y * 0.6, radius * 1.5);
    sketch.paint = DARK_STEEL;
    let skirt = [(0.0, 0.6), (radius * 1.2, 0.6), (radius, 3.0), (0.0, 3.0)];
    sketch.revolve(foot, Vec3::Y, &skirt.map(Vec2::from));
    sketch.paint = paint;
    vessel(sketch, foot + Vec3::Y * 3.0, foot + Vec3::Y * height, radius);
    sketch.paint = SILVER;
    let rings = (height / 3.0) as usize;
    for i in 1..rings {
        let y = 3.0 + (height - 3.0) * i as f32 / rings as f32;
        sketch.hoop(foot + Vec3::Y * y, Vec3::Y, radius + 0.01, 0.035);
    }
    let mut below = 0.0;
    let mut side = Vec3::X;
    let levels = (height / 7.5) as usize;
    for i in 1..=levels {
        let y = height * i as f32 / levels as f32 - 0.4;
        ring_platform(sketch, foot + Vec3::Y * y, radius + 0.02, rng.range(0.9, 1.3));
        ladder(sketch, foot + Vec3::Y * below + side * (radius + 0.25), y - below, side);
        sketch.paint = STEEL;
        let out = Vec3::Y.cross(side);
        nozzle(sketch, foot + Vec3::Y * (y - 1.2) + out * (radius - 0.1), out, 0.5, 0.3);
        (below, side) = (y, -side);
    }
    let top = foot + Vec3::Y * (height + radius * 0.45);
    sketch.paint = SILVER;
    let out = (drop - foot).with_y(0.0).normalize();
    let line = (radius * 0.22).max(0.12);
    let aside = foot + out * (radius + line + 1.6);
    let above = Vec3::Y * (height + radius * 0.5 + 1.2);
    pipe(sketch, &[top, foot + above, aside + above, aside.with_y(drop.y), drop], line);
    flange(sketch, foot + above - Vec3::Y * 0.7, Vec3::Y, line);
}

/// A pressure sphere on legs, with a platform on top and the stair to it.
pub(super) fn sphere(sketch: &mut Sketch, center: Vec3, radius: f32) {
    let middle = center + Vec3::Y * (radius + 2.2);
    let paint = sketch.paint;
    let steps = sketch.sides(radius) / 2;
    let profile: Vec<Vec2> = (0..=steps)
        .map(|i| direction(0.5 * i as f64 / steps as f64) * radius)
        .map(|d| Vec2::new(d.y, -d.x))
        .collect();
    sketch.revolve(middle, Vec3::Y, &profile);
    let legs = 10;
    let leg = |i: usize, y: f32| {
        let d = direction(i as f64 / f64::from(legs)) * radius;
        center + Vec3::new(d.x, y, d.y)
    };
    for i in 0..legs as usize {
        sketch.paint = WHITE;
        sketch.cylinder(leg(i, 0.4), leg(i, radius + 2.6), 0.32);
        sketch.paint = CONCRETE;
        sketch.cuboid(leg(i, 0.0) - Vec3::new(0.6, 0.0, 0.6), leg(i, 0.4) + Vec3::new(0.6, 0.0, 0.6));
        sketch.paint = STEEL;
        sketch.tube(&[leg(i, 0.8), leg(i + 1, radius + 1.0)], 0.05);
        sketch.tube(&[leg(i + 1, 0.8), leg(i, radius + 1.0)], 0.05);
    }
    sketch.paint = paint;
    sketch.hoop(middle, Vec3::Y, radius + 0.02, 0.1);
    let top = middle + Vec3::Y * (radius - 0.1);
    ring_platform(sketch, top, 0.6, 1.6);
    sketch.paint = STEEL;
    nozzle(sketch, top, Vec3::Y, 1.0, 0.3);
    // The stair winds up the sphere a metre off its skin.
    let path: Vec<Vec3> = (0..=24)
        .map(|i| {
            let t = f64::from(i) / 24.0;
            let up = direction(-0.12 + 0.35 * t);
            let d = direction(0.1 + 0.4 * t) * ((radius + 0.9) * up.x);
            middle + Vec3::new(d.x, (radius + 0.9) * up.y, d.y)
        })
        .collect();
    sketch.paint = GALVANISED;
    for w in path.windows(2) {
        sketch.bar(w[0], w[1], 0.8, 0.05, Vec3::Y);
    }
    railing(sketch, &path);
    sketch.paint = RAIL;
    ladder(sketch, path[0].with_y(0.0), path[0].y, Vec3::X);
}

/// A tapering chimney with warning bands and a platform.
pub(super) fn chimney(sketch: &mut Sketch, foot: Vec3, radius: f32, height: f32) {
    let bands = 9;
    let at = |i: usize| {
        let t = i as f32 / bands as f32;
        Vec2::new(radius * (1.0 - 0.45 * t), height * t)
    };
    for i in 0..bands {
        sketch.paint = match i {
            0..4 => CONCRETE,
            _ if i % 2 == 0 => RED,
            _ => WHITE,
        };
        sketch.revolve(foot, Vec3::Y, &[at(i), at(i + 1)]);
    }
    let tip = at(bands);
    sketch.paint = DARK_STEEL;
    let lip = [
        (tip.x, 0.0),
        (tip.x + 0.15, 0.0),
        (tip.x + 0.15, 0.5),
        (tip.x - 0.2, 0.5),
        (tip.x - 0.2, -2.0),
        (0.0, -2.0),
    ];
    sketch.revolve(foot + Vec3::Y * tip.y, Vec3::Y, &lip.map(Vec2::from));
    for i in [4, 8] {
        ring_platform(sketch, foot + Vec3::Y * at(i).y, at(i).x, 1.0);
    }
    ladder(sketch, foot + Vec3::X * (radius + 0.1), at(4).y, Vec3::X);
}
