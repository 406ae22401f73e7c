//! Large nodes: bins first, then an exact sweep around the best boundary.
//!
//! Counting begins and ends in bins (Shevtsov et al. 2007) prices the boundaries between bins in
//! linear time. The best plane of all is an end of some bound, and in all likelihood one next to the
//! best boundary: the bins on its two sides are swept exactly.

use super::exact::{Event, price};
use super::reference::Reference;
use crate::geometry::Aabb;
use crate::kdtree::sah::{AxisCost, CellCost, Split, cheaper};
use glam::{Vec3, Vec4, Vec4Swizzles};

/// The least box around all references; grows as they are shown.
#[derive(Clone, Copy)]
pub struct Extent {
    low: Vec4,
    high: Vec4,
}

impl Extent {
    pub const NONE: Self = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    pub fn grow(&mut self, references: &[Reference]) {
        for reference in references {
            self.low = reference.low().min(self.low);
            self.high = reference.high().max(self.high);
        }
    }

    pub fn union(self, other: Self) -> Self {
        Self { low: self.low.min(other.low), high: self.high.max(other.high) }
    }

    fn bounds(&self) -> Aabb {
        Aabb { min: self.low.xyz(), max: self.high.xyz() }
    }
}

/// Where bins lie: as many along each axis, over the extent of the references.
#[derive(Clone, Copy)]
pub struct Frame {
    low: Vec4,
    /// Bins per unit of length; 0 along an axis without extent.
    scale: Vec4,
    last: f32,
    bins: usize,
    extent: Aabb,
}

/// Adding it to a small number leaves that number, rounded, in the lowest bits.
const ROUND: f32 = 8_388_608.0;

impl Frame {
    pub fn new(extent: &Extent, bins: usize) -> Self {
        let extent = extent.bounds();
        let scale = bins as f32 / extent.extent();
        // No length, or one that overflows: then one bin has it all, and the ends are tried all the same.
        let scale = Vec3::select(scale.is_finite_mask(), scale, Vec3::ZERO);
        Self { low: extent.min.extend(0.0), scale: scale.extend(0.0), last: bins as f32 - 1.0, bins, extent }
    }

    /// The bins of four coordinates. They grow with the coordinate; which side a boundary's own
    /// coordinate falls on is a matter of rounding, but always the same.
    #[inline(always)]
    fn of(&self, at: Vec4) -> [u32; 4] {
        let bin = (at - self.low) * self.scale - Vec4::splat(0.5);
        let bin = bin.max(Vec4::ZERO).min(Vec4::splat(self.last)) + Vec4::splat(ROUND);
        bin.to_array().map(|bin| bin.to_bits() & 0x3ff)
    }

    /// Where a bin begins, but for rounding.
    fn boundary(&self, axis: usize, bin: usize) -> f32 {
        let (low, high) = (f64::from(self.extent.min[axis]), f64::from(self.extent.max[axis]));
        (low + (high - low) * (bin as f64 / self.bins as f64)) as f32
    }
}

/// Begins and ends per bin: of x, y and z, and four lanes on of their ends.
#[derive(Clone, Default)]
pub struct Table {
    counts: Vec<[u32; 8]>,
}

impl Table {
    /// Empties it.
    pub fn reset(&mut self, bins: usize) {
        self.counts.clear();
        self.counts.resize(bins, [0; 8]);
    }

    pub fn count(&mut self, references: &[Reference], frame: &Frame) {
        for reference in references {
            let (starts, ends) = (frame.of(reference.low()), frame.of(reference.high()));
            for axis in 0..3 {
                self.counts[starts[axis] as usize][axis] += 1;
                self.counts[ends[axis] as usize][4 + axis] += 1;
            }
        }
    }

    pub fn add(&mut self, other: &Self) {
        for (bin, others) in self.counts.iter_mut().zip(&other.counts) {
            for lane in 0..8 {
                bin[lane] += others[lane];
            }
        }
    }

    /// The cheapest boundary of all; `None` if none divides.
    pub fn best_boundary(&self, frame: &Frame, costs: &CellCost, count: usize) -> Option<Boundary> {
        let mut best: Option<Boundary> = None;
        for axis in 0..3 {
            if frame.scale[axis] == 0.0 {
                continue;
            }
            let cost = costs.axis(axis);
            let (mut below, mut above) = (0, count);
            for bin in 1..frame.bins {
                let (starts, ends) = (self.counts[bin - 1][axis], self.counts[bin - 1][4 + axis]);
                below += starts as usize;
                above -= ends as usize;
                if starts + ends + self.counts[bin][axis] + self.counts[bin][4 + axis] == 0 {
                    continue; // Nothing begins or ends nearby: its neighbours do as well.
                }
                let split = cost.split(frame.boundary(axis, bin), below, 0, above);
                if split.cost.is_finite() && best.is_none_or(|best| split.cost < best.split.cost) {
                    let below = below - starts as usize;
                    let above = above + ends as usize;
                    best = Some(Boundary { split, bin, below, above });
                }
            }
        }
        best
    }
}

/// A boundary between two bins, and what lies around these.
#[derive(Clone, Copy)]
pub struct Boundary {
    split: Split,
    /// The bin above it.
    bin: usize,
    /// References that begin below both bins.
    below: usize,
    /// References that do not end below both bins.
    above: usize,
}

impl Boundary {
    /// Collects what begins or ends in its two bins.
    pub fn gather(&self, references: &[Reference], frame: &Frame, events: &mut Vec<Event>) {
        let axis = self.split.axis;
        let (low, scale, bin) = (frame.low[axis], frame.scale[axis], self.bin as u32);
        let inside = |x: f32| {
            let [of_x, ..] =
                Frame { low: Vec4::splat(low), scale: Vec4::splat(scale), ..*frame }.of(Vec4::splat(x));
            of_x == bin || of_x + 1 == bin
        };
        for reference in references {
            let (low, high) = (reference.min(axis), reference.max(axis));
            Event::push(low, high, inside(low), inside(high), events);
        }
    }

    /// The cheapest of the planes at `events`, which are sorted, at this boundary, and at the ends of the
    /// references' extent, where empty space may be cut off.
    pub fn refine(self, events: &[Event], frame: &Frame, costs: &CellCost, count: usize) -> Option<Split> {
        let axis: AxisCost = costs.axis(self.split.axis);
        let fine = price(events, &axis, self.below, self.above, ends_of_extent(frame, costs, count));
        match fine {
            Some(fine) => cheaper(Some(fine), self.split),
            None => Some(self.split),
        }
    }
}

/// The cheapest plane at an end of the references' extent.
pub fn ends_of_extent(frame: &Frame, costs: &CellCost, count: usize) -> Option<Split> {
    let mut best = None;
    for axis in 0..3 {
        if !costs.has_extent(axis) {
            continue;
        }
        let cost = costs.axis(axis);
        let (low, high) = (frame.extent.min[axis], frame.extent.max[axis]);
        for (position, below, above, planar_below) in [(low, 0, count, false), (high, count, 0, true)] {
            let cost = cost.cost(position, below, above);
            best = cheaper(best, Split { axis, position, planar_below, cost });
        }
    }
    best
}
