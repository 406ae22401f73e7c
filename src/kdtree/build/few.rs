//! The exact sweep for a handful of references, without sorting: every end of a bound is a lane, and
//! counts by comparison what lies on its two sides.
//!
//! Comparisons grow with the square of the references, but eight are one instruction: up to some
//! forty references that beats a sort.

use super::reference::Reference;
use crate::kdtree::sah::{CellCost, LaneCost, Split};
use crate::simd::{Chosen, Lanes, Mask, Simd, Task};

/// The most references that it takes.
pub const MOST: usize = 64;

/// Candidates that are priced together.
const WIDTH: usize = 8;

/// Ends of bounds along one axis.
pub struct Few {
    low: [f32; MOST],
    high: [f32; MOST],
    /// Ends that may divide, each a candidate, and then copies of the last.
    planes: [f32; 2 * MOST + WIDTH],
}

impl Default for Few {
    fn default() -> Self {
        Self { low: [0.0; MOST], high: [0.0; MOST], planes: [0.0; 2 * MOST + WIDTH] }
    }
}

impl Few {
    /// The cheapest plane of a cell; `None` if none divides. At most [`MOST`] references.
    pub fn best_split(&mut self, isa: Chosen, references: &[Reference], costs: &CellCost) -> Option<Split> {
        let mut best: Option<Split> = None;
        for axis in (0..3).filter(|&axis| costs.has_extent(axis)) {
            let (planes, flat) = self.collect(references, axis, costs);
            if planes == 0 {
                continue;
            }
            let count = references.len();
            let sweep = Sweep {
                low: &self.low[..count],
                high: &self.high[..count],
                planes: &self.planes[..planes.next_multiple_of(WIDTH)],
                flat,
                cost: costs.axis(axis).lanes(),
            };
            if let Some(found) = isa.run(sweep)
                && best.is_none_or(|best| f64::from(found.cost) < best.cost)
            {
                let Found { position, planar_below, cost } = found;
                best = Some(Split { axis, position, planar_below, cost: cost.into() });
            }
        }
        best
    }

    /// Fills the arrays; the number of candidates, and whether any reference is flat.
    ///
    /// An end in a face of the cell divides nothing unless something lies flat in it.
    fn collect(&mut self, references: &[Reference], axis: usize, costs: &CellCost) -> (usize, bool) {
        let (least, greatest) = costs.range(axis);
        let mut planes = 0;
        let mut flat = false;
        for (i, reference) in references.iter().enumerate() {
            let (low, high) = (reference.min(axis), reference.max(axis));
            (self.low[i], self.high[i]) = (low, high);
            let is_flat = low == high;
            flat |= is_flat;
            self.planes[planes] = low;
            planes += usize::from(low > least || is_flat);
            self.planes[planes] = high;
            planes += usize::from(high < greatest && !is_flat);
        }
        if planes > 0 {
            let last = self.planes[planes - 1];
            self.planes[planes..planes.next_multiple_of(WIDTH)].fill(last);
        }
        (planes, flat)
    }
}

struct Sweep<'a> {
    low: &'a [f32],
    high: &'a [f32],
    /// A whole number of vectors.
    planes: &'a [f32],
    flat: bool,
    cost: LaneCost,
}

struct Found {
    position: f32,
    planar_below: bool,
    cost: f32,
}

impl Task for Sweep<'_> {
    type Output = Option<Found>;

    #[inline(always)]
    fn run<S: Simd>(self) -> Self::Output {
        if self.flat { self.sweep::<S::F8, true>() } else { self.sweep::<S::F8, false>() }
    }
}

impl Sweep<'_> {
    #[inline(always)]
    fn sweep<L: Lanes<WIDTH>, const FLAT: bool>(&self) -> Option<Found> {
        let (zero, one, count) = (L::splat(0.0), L::splat(1.0), L::splat(self.low.len() as f32));
        let mut best = L::splat(f32::INFINITY);
        let (mut position, mut planar_below) = (zero, zero);
        for planes in self.planes.as_chunks::<WIDTH>().0 {
            let plane = L::load(planes);
            let (mut below, mut above, mut both) = (zero, zero, zero);
            for (&low, &high) in self.low.iter().zip(self.high) {
                let begins = L::splat(low).lt(plane);
                let goes_on = plane.lt(L::splat(high));
                below = below + L::select(begins, one, zero);
                above = above + L::select(goes_on, one, zero);
                if FLAT {
                    both = both + L::select(begins & goes_on, one, zero);
                }
            }
            let mut cost = self.cost.of(plane, below, above);
            let mut side = one;
            if FLAT {
                // What neither begins below nor goes on above lies in the plane.
                let planar = count - (below + above - both);
                cost = self.cost.of(plane, below + planar, above);
                let with_above = self.cost.of(plane, below, above + planar);
                side = L::select(cost.le(with_above), one, zero);
                cost = cost.min(with_above);
            }
            let better = cost.lt(best);
            best = L::select(better, cost, best);
            position = L::select(better, plane, position);
            planar_below = L::select(better, side, planar_below);
        }

        let least = best.least();
        let lane = best.le(L::splat(least)).bits().trailing_zeros() as usize;
        (least < f32::INFINITY).then(|| Found {
            position: position.store()[lane],
            planar_below: planar_below.store()[lane] > 0.5,
            cost: least,
        })
    }
}
