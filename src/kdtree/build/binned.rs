//! Large nodes: bins first, then an exact sweep around the best boundary.
//!
//! Counting begins and ends in bins (Shevtsov et al. 2007) prices the boundaries between bins in
//! linear time. The best plane of all is an end of some bound, and in all likelihood one next to the
//! best boundary: the bins on its two sides are swept exactly.

use super::exact::{Event, price};
use super::reference::Reference;
use crate::geometry::Aabb;
use crate::kdtree::params::MOST_BINS;
use crate::kdtree::sah::{AxisCost, CellCost, Split, cheaper};
use crate::simd::{Chosen, Lanes, Simd, Task};
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
    /// A bin's length.
    width: Vec4,
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
        Self {
            // Ids in the last lane are subnormal numbers, slow to multiply; less one they are not.
            low: extent.min.extend(1.0),
            scale: scale.extend(0.0),
            width: (extent.extent() / bins as f32).extend(0.0),
            last: bins as f32 - 1.0,
            bins,
            extent,
        }
    }

    /// The bins of four coordinates. They grow with the coordinate; which side a boundary's own
    /// coordinate falls on is a matter of rounding, but always the same.
    #[inline(always)]
    fn of(&self, at: Vec4) -> [u32; 4] {
        let bin = (at - self.low) * self.scale - Vec4::splat(0.5);
        let bin = bin.max(Vec4::ZERO).min(Vec4::splat(self.last)) + Vec4::splat(ROUND);
        bin.to_array().map(|bin| bin.to_bits() % MOST_BINS as u32)
    }

    /// Where a bin begins along each axis, but for rounding.
    #[inline(always)]
    fn boundaries(&self, bin: usize) -> Vec4 {
        self.low + self.width * bin as f32
    }
}

/// Begins and ends per bin: of x, y and z, and four lanes on of their ends.
#[derive(Clone)]
pub struct Table {
    counts: Box<[[u32; 8]; MOST_BINS]>,
}

impl Default for Table {
    fn default() -> Self {
        Self { counts: Box::new([[0; 8]; MOST_BINS]) }
    }
}

impl Table {
    /// Empties it.
    pub fn reset(&mut self, bins: usize) {
        self.counts[..bins].fill([0; 8]);
    }

    pub fn count(&mut self, isa: Chosen, references: &[Reference], frame: &Frame) {
        isa.run(Counting { references, frame, counts: &mut self.counts });
    }

    pub fn add(&mut self, other: &Self) {
        for (bin, others) in self.counts.iter_mut().zip(&*other.counts) {
            for lane in 0..8 {
                bin[lane] += others[lane];
            }
        }
    }

    /// The cheapest boundary of all; `None` if none divides. All axes are priced at once, in single
    /// precision: what is chosen is looked at more closely.
    pub fn best_boundary(&self, frame: &Frame, costs: &CellCost, count: usize) -> Option<Boundary> {
        let cost = costs.axes();
        let divides = frame.scale.cmpgt(Vec4::ZERO);
        let (mut below, mut above) = ([0; 4], [count as i32; 4]);
        let mut best = Vec4::INFINITY;
        let mut best_bin = Vec4::ZERO;
        for bin in 1..frame.bins {
            let before = &self.counts[bin - 1];
            for axis in 0..4 {
                below[axis] += before[axis] as i32;
                above[axis] -= before[4 + axis] as i32;
            }
            // Something begins in the first bin and ends in the last one: no side is empty.
            let [below, above] = [below, above].map(|counts| Vec4::from_array(counts.map(|n| n as f32)));
            let cost = cost.of(frame.boundaries(bin), below, above);
            let better = cost.cmplt(best) & divides;
            best = Vec4::select(better, cost, best);
            best_bin = Vec4::select(better, Vec4::splat(bin as f32), best_bin);
        }

        let best = best.xyz();
        let axis = best.min_position();
        if best[axis] == f32::INFINITY {
            return None;
        }
        let bin = best_bin[axis] as usize;
        let mut boundary = Boundary { axis, bin, below: 0, above: count };
        for counts in &self.counts[..bin - 1] {
            boundary.below += counts[axis] as usize;
            boundary.above -= counts[4 + axis] as usize;
        }
        Some(boundary)
    }

    /// The split at a boundary, or at an end of the references' extent if that is cheaper.
    pub fn coarse(
        &self,
        boundary: &Boundary,
        frame: &Frame,
        costs: &CellCost,
        count: usize,
    ) -> Option<Split> {
        cheaper(ends_of_extent(frame, costs, count), self.split(boundary, frame, costs))
    }

    /// The split at a boundary.
    fn split(&self, boundary: &Boundary, frame: &Frame, costs: &CellCost) -> Split {
        let Boundary { axis, bin, below, above } = *boundary;
        let between = &self.counts[bin - 1];
        let (below, above) = (below + between[axis] as usize, above - between[4 + axis] as usize);
        costs.axis(axis).split(frame.boundaries(bin)[axis], below, 0, above)
    }
}

/// A pass over references: begins and ends of each in one register.
struct Counting<'a> {
    references: &'a [Reference],
    frame: &'a Frame,
    counts: &'a mut [[u32; 8]; MOST_BINS],
}

impl Task for Counting<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let Self { references, frame, counts } = self;
        let twice = |four: Vec4| [four.x, four.y, four.z, four.w, four.x, four.y, four.z, four.w];
        let (low, scale) = (S::F8::load(&twice(frame.low)), S::F8::load(&twice(frame.scale)));
        let (half, zero, last) = (S::F8::splat(0.5), S::F8::splat(0.0), S::F8::splat(frame.last));
        for reference in references {
            // As in `Frame::of`, to the bit.
            let bin = (S::F8::load(reference.corners()) - low) * scale - half;
            let bins = (bin.max(zero).min(last) + S::F8::splat(ROUND)).store();
            for axis in 0..3 {
                let (start, end) = (bins[axis].to_bits() as usize, bins[4 + axis].to_bits() as usize);
                counts[start % MOST_BINS][axis] += 1;
                counts[end % MOST_BINS][4 + axis] += 1;
            }
        }
    }
}

/// A boundary between two bins, and what lies around these.
#[derive(Clone, Copy)]
pub struct Boundary {
    axis: usize,
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
        let (axis, bin) = (self.axis, self.bin as u32);
        let along =
            Frame { low: Vec4::splat(frame.low[axis]), scale: Vec4::splat(frame.scale[axis]), ..*frame };
        for reference in references {
            let (low, high) = (reference.min(axis), reference.max(axis));
            let [of_low, of_high, ..] = along.of(Vec4::new(low, high, low, high));
            let [with_low, with_high] = [of_low, of_high].map(|of| of == bin || of + 1 == bin);
            if with_low | with_high {
                Event::push(low, high, with_low, with_high, events);
            }
        }
    }

    /// The cheapest of the planes at `events`, which are sorted, at this boundary, and at the ends of the
    /// references' extent, where empty space may be cut off.
    pub fn refine(
        &self,
        events: &[Event],
        table: &Table,
        frame: &Frame,
        costs: &CellCost,
        count: usize,
    ) -> Option<Split> {
        let axis: AxisCost = costs.axis(self.axis);
        let fine = price(events, &axis, self.below, self.above, ends_of_extent(frame, costs, count));
        cheaper(fine, table.split(self, frame, costs))
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
