//! Where things stand: cells in a spiral, and yards that make up the number.

use super::palette::{ASPHALT, BLUE, CONCRETE, EARTH, GALVANISED, MARKING, ORANGE, RED, SILVER, STEEL};
use super::piping::Rack;
use super::units::{PLOT, Unit};
use super::{PlantParams, cables, quality};
use crate::mesh::generate::part::Part;
use crate::mesh::generate::rng::Rng;
use crate::mesh::generate::sketch::Sketch;
use glam::Vec3;

/// A cell's size along x, which is also the length of its stretch of rack.
pub(super) const CELL_X: f32 = 28.0;
/// A cell's size along z: the plot, the rack, the road.
const CELL_Z: f32 = 42.0;
/// Where the plot's middle, the rack and the road lie in a cell.
const PLOT_Z: f32 = -7.5;
const RACK_Z: f32 = 9.0;
const ROAD_Z: f32 = 17.0;
/// How far the earth goes beyond the plant.
const HORIZON: f32 = 400.0;
/// Triangles of the ground.
const RESERVE: usize = 24;
/// The most triangles that a stack in a yard takes.
const STACKS: usize = 81;

/// Draws the plant part by part: cells until the number of triangles is reached, then yards, then the
/// ground. No more than one part is in memory at a time; `each` is lent it before the next is drawn.
pub(super) fn parts<E>(
    params: PlantParams,
    mut each: impl FnMut(Part<'_>) -> Result<(), E>,
) -> Result<(), E> {
    let target = params.triangles as usize;
    let mut sketch = Sketch::new(quality(params.triangles));
    let mut done = 0;
    let mut reach = 0;
    let mut yards = Vec::new();
    for (number, (i, k)) in spiral().enumerate() {
        if done + RESERVE >= target {
            break;
        }
        sketch.clear();
        sketch.origin = Vec3::new(i as f32 * CELL_X, 0.0, k as f32 * CELL_Z);
        draw_cell(&mut sketch, params.seed, number, (i, k), None);
        reach = i.abs().max(k.abs());
        // The smallest plants have one unit, which is not of any kind: the first that there is room for.
        let mut others = Unit::ALL.iter().take(if number == 0 { Unit::ALL.len() } else { 0 });
        while done + sketch.len() + RESERVE > target
            && let Some(unit) = others.next()
        {
            sketch.clear();
            draw_cell(&mut sketch, params.seed, number, (i, k), Some(*unit));
        }
        if done + sketch.len() + RESERVE <= target {
            done += sketch.len();
            each(sketch.part())?;
            continue;
        }
        // The cell is too much: it becomes a yard, as do those after it.
        yards.push((i, k));
        if yards.len() > usize::from(number > 0) * 4 {
            break;
        }
    }
    for (n, &(i, k)) in yards.iter().enumerate() {
        let share = (target - done.min(target)).saturating_sub(RESERVE) / (yards.len() - n);
        sketch.clear();
        sketch.origin = Vec3::new(i as f32 * CELL_X, 0.0, k as f32 * CELL_Z + PLOT_Z);
        let mut rng = Rng::new(params.seed, cell_key(i, k));
        yard(&mut sketch, &mut rng, share);
        done += sketch.len();
        each(sketch.part())?;
    }
    sketch.clear();
    ground(&mut sketch, reach);
    each(sketch.part())
}

/// Cells in the order of their distance from the middle one, ring by ring.
fn spiral() -> impl Iterator<Item = (i32, i32)> {
    let ring = |r: i32| {
        let side = move |n: i32| -r + 1 + n;
        let edges =
            (0..2 * r).flat_map(move |n| [(r, -side(n)), (-r, side(n)), (side(n), r), (-side(n), -r)]);
        std::iter::repeat_n((0, 0), usize::from(r == 0)).chain(edges)
    };
    (0..).flat_map(ring)
}

fn cell_key(i: i32, k: i32) -> u64 {
    ((i as u32 as u64) << 32 | k as u32 as u64).wrapping_add(1 << 16)
}

/// Draws the cell that comes `number`th: its stretch of rack and road, and `unit`, or else the one whose
/// turn it is.
fn draw_cell(sketch: &mut Sketch, seed: u64, number: usize, (i, k): (i32, i32), unit: Option<Unit>) {
    let mut rng = Rng::new(seed, cell_key(i, k));
    let rack = Rack::new(&mut Rng::new(seed, cell_key(i32::MIN, k)));
    let corner = sketch.origin;
    sketch.paint = MARKING;
    for n in 0..4 {
        let x = -CELL_X * 0.5 + 1.5 + CELL_X * 0.25 * n as f32;
        sketch.cuboid(Vec3::new(x, 0.0, ROAD_Z - 0.08), Vec3::new(x + 3.0, 0.012, ROAD_Z + 0.08));
    }
    sketch.paint = CONCRETE;
    let half = PLOT * 0.5 + 0.5;
    sketch.cuboid(Vec3::new(-half, -0.2, PLOT_Z - half), Vec3::new(half, 0.15, PLOT_Z + half));
    sketch.origin = corner + Vec3::Z * RACK_Z;
    rack.draw(sketch, &mut rng);
    let mut of_cables = Rng::new(seed, !cell_key(i, k));
    for x in Rack::columns() {
        if of_cables.chance(0.5) {
            cables::drop(sketch, &mut of_cables, x);
        }
    }
    sketch.origin = corner;
    cables::lamp_post(sketch, ROAD_Z + 3.6);
    sketch.origin = corner + Vec3::Z * PLOT_Z;
    // Neighbours differ: a walk through the list in steps that the seed chooses, with exceptions.
    let step = 1 + 2 * Rng::new(seed, 7).below(4);
    let next = Unit::ALL[number.wrapping_mul(step) % Unit::ALL.len()];
    let turn = if rng.chance(0.2) { rng.pick(&Unit::ALL) } else { next };
    unit.unwrap_or(turn).draw(sketch, &mut rng, &rack, RACK_Z - PLOT_Z);
}

/// A storage yard of not more than `triangles`: drums, pipes and crates in rows.
fn yard(sketch: &mut Sketch, rng: &mut Rng, triangles: usize) {
    let mut place = 0;
    // Rows of heaps, one upon the other when the plot is full.
    while sketch.len() + STACKS.max(8 * sketch.sides(0.3)) <= triangles {
        let (column, row, layer) = (place % 20, place / 20 % 20, place / 400);
        let spread = 1.15;
        let at = Vec3::new((column as f32 - 9.5) * spread, 0.95 * layer as f32, (row as f32 - 9.5) * spread);
        match (row / 4) % 3 {
            0 => {
                sketch.paint = rng.pick(&[BLUE, RED, BLUE, ORANGE]);
                sketch.cylinder(at, at + Vec3::Y * 0.88, 0.29);
            }
            1 => {
                sketch.paint = rng.pick(&[GALVANISED, CONCRETE, STEEL]);
                let half = Vec3::new(rng.range(0.35, 0.5), 0.0, rng.range(0.35, 0.5));
                sketch.cuboid(at - half, at + half + Vec3::Y * 0.9);
            }
            _ => {
                sketch.paint = rng.pick(&[SILVER, STEEL]);
                sketch.cylinder(at + Vec3::new(-0.55, 0.3, 0.0), at + Vec3::new(0.55, 0.3, 0.0), 0.28);
            }
        }
        place += 1;
    }
}

/// Asphalt under the cells and earth around, out to where the eye takes it for the horizon.
fn ground(sketch: &mut Sketch, reach: i32) {
    let x = (reach as f32 + 0.5) * CELL_X + 8.0;
    let z = (reach as f32 + 0.5) * CELL_Z + 8.0;
    sketch.origin = Vec3::ZERO;
    sketch.paint = ASPHALT;
    sketch.cuboid(Vec3::new(-x, -0.5, -z), Vec3::new(x, 0.0, z));
    sketch.paint = EARTH;
    sketch.cuboid(Vec3::new(-x - HORIZON, -1.0, -z - HORIZON), Vec3::new(x + HORIZON, -0.1, z + HORIZON));
}
