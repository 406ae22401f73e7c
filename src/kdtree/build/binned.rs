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
    low: f32,
    width: f64,
}

impl Bins {
    fn new(references: &[Reference], cell: &Aabb, axis: usize, bins: usize) -> Self {
        let (low, high) = (cell.min[axis], cell.max[axis]);
        let width = (f64::from(high) - f64::from(low)) / bins as f64;
        let mut counted = Self { starts: vec![0; bins], ends: vec![0; bins], low, width };
        for reference in references {
            let (start, end) = (counted.bin(reference.min[axis]), counted.bin(reference.max[axis]));
            counted.starts[start] += 1;
            counted.ends[end] += 1;
        }
        counted
    }

    /// The lower boundary of a bin.
    fn boundary(&self, bin: usize) -> f32 {
        (f64::from(self.low) + self.width * bin as f64) as f32
    }

    /// The bin of a coordinate: the one whose boundaries hold it, exactly, so that counts and
    /// windows agree. A coordinate on a boundary belongs to the bin below it.
    fn bin(&self, x: f32) -> usize {
        let last = self.starts.len() - 1;
        let guess = ((f64::from(x) - f64::from(self.low)) / self.width) as usize;
        let mut bin = guess.min(last);
        while bin > 0 && x <= self.boundary(bin) {
            bin -= 1;
        }
        while bin < last && x > self.boundary(bin + 1) {
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
            let split = cost.split(table.boundary(boundary), below, 0, above);
            if split.cost.is_finite() && best.is_none_or(|(b, _)| split.cost < b.cost) {
                best = Some((split, boundary));
            }
        }
    }

    // Look closer around the best one, and at the cell's ends, where cutting off empty space pays.
    let (coarse, boundary) = best?;
    let mut fine = None;
    for axis in 0..3 {
        let Some(table) = &counted[axis] else { continue };
        let mut windows = vec![(0, 1), (bins - 1, bins)];
        if axis == coarse.axis {
            windows.push((boundary - 1, (boundary + 1).min(bins)));
        }
        for (from, to) in windows {
            let low = if from == 0 { f32::NEG_INFINITY } else { table.boundary(from) };
            let high = if to == bins { f32::INFINITY } else { table.boundary(to) };
            let window = Window {
                low,
                high,
                below: table.starts[..from].iter().sum::<u32>() as usize,
                above: references.len() - table.ends[..from].iter().sum::<u32>() as usize,
            };
            fine = sweep(references, axis, &costs.axis(axis), window, fine, scratch);
        }
    }
    match fine {
        Some(fine) => cheaper(Some(fine), coarse),
        None => Some(coarse),
    }
}
