//! Large nodes: bins first, then an exact sweep around the best boundary.
//!
//! Counting begins and ends in bins (Shevtsov et al. 2007) prices the boundaries between bins
//! exactly, in linear time. The best plane of all is an end of some bound, and in all likelihood
//! one next to the best boundary: the bins on its two sides are swept exactly.

use super::Reference;
use super::exact::{Scratch, Window, sweep};
use crate::geometry::Aabb;
use crate::kdtree::sah::{CellCost, Split, cheaper};

/// Begins and ends per bin; flat bounds count as both.
struct Bins {
    starts: Vec<u32>,
    ends: Vec<u32>,
    /// Where bins begin, and where the last one ends.
    boundaries: Vec<f32>,
    inverse_width: f64,
    /// Least and greatest coordinate of all references.
    extent: (f32, f32),
}

impl Bins {
    fn new(references: &[Reference], cell: &Aabb, axis: usize, bins: usize) -> Self {
        let (low, high) = (f64::from(cell.min[axis]), f64::from(cell.max[axis]));
        let width = (high - low) / bins as f64;
        let mut counted = Self {
            starts: vec![0; bins],
            ends: vec![0; bins],
            boundaries: (0..=bins).map(|bin| (low + width * bin as f64) as f32).collect(),
            inverse_width: 1.0 / width,
            extent: (f32::INFINITY, f32::NEG_INFINITY),
        };
        for reference in references {
            let (min, max) = (reference.min[axis], reference.max[axis]);
            let (start, end) = (counted.bin(min), counted.bin(max));
            counted.starts[start] += 1;
            counted.ends[end] += 1;
            counted.extent = (counted.extent.0.min(min), counted.extent.1.max(max));
        }
        counted
    }

    /// The bin of a coordinate: the one whose boundaries hold it, exactly, so that counts and
    /// windows agree. A coordinate on a boundary belongs to the bin below it.
    fn bin(&self, x: f32) -> usize {
        let last = self.starts.len() - 1;
        let guess = (f64::from(x - self.boundaries[0]) * self.inverse_width) as usize;
        let mut bin = guess.min(last);
        while bin > 0 && x <= self.boundaries[bin] {
            bin -= 1;
        }
        while bin < last && x > self.boundaries[bin + 1] {
            bin += 1;
        }
        bin
    }
}

/// The cheapest plane found; `None` if none divides.
pub(super) fn best_split(
    references: &[Reference],
    cell: &Aabb,
    costs: &CellCost,
    bins: usize,
    scratch: &mut Scratch,
) -> Option<Split> {
    // Price every boundary of every axis.
    let mut best: Option<(Split, usize)> = None;
    let mut counted = [const { None }; 3];
    for axis in 0..3 {
        if cell.min[axis] >= cell.max[axis] {
            continue;
        }
        let table = counted[axis].insert(Bins::new(references, cell, axis, bins));
        let cost = costs.axis(axis);
        let (mut below, mut above) = (0, references.len());
        for boundary in 1..bins {
            below += table.starts[boundary - 1] as usize;
            above -= table.ends[boundary - 1] as usize;
            let split = cost.split(table.boundaries[boundary], below, 0, above);
            if split.cost.is_finite() && best.is_none_or(|(b, _)| split.cost < b.cost) {
                best = Some((split, boundary));
            }
        }
    }

    // Look closer around the best one: its two bins hold the ends that may do better still.
    let (coarse, boundary) = best?;
    let (axis, table) = (coarse.axis, counted[coarse.axis].as_ref()?);
    let (from, to) = (boundary - 1, boundary + 1);
    let window = Window {
        low: if from == 0 { f32::NEG_INFINITY } else { table.boundaries[from] },
        high: if to == bins { f32::INFINITY } else { table.boundaries[to] },
        below: table.starts[..from].iter().sum::<u32>() as usize,
        above: references.len() - table.ends[..from].iter().sum::<u32>() as usize,
    };
    let mut fine = sweep(references, axis, &costs.axis(axis), window, None, scratch);

    // And at the cell's ends, where planes may cut off empty space.
    for (axis, table) in counted.iter().enumerate() {
        let Some(table) = table else { continue };
        let (cost, count) = (costs.axis(axis), references.len());
        let ends = [(table.extent.0, 0, count, false), (table.extent.1, count, 0, true)];
        for (position, below, above, planar_below) in ends {
            let cost = cost.cost(position, below, above);
            fine = cheaper(fine, Split { axis, position, planar_below, cost });
        }
    }
    match fine {
        Some(fine) => cheaper(Some(fine), coarse),
        None => Some(coarse),
    }
}
