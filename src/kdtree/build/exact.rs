//! The exact sweep: every end of a clipped bound is tried as a split plane (Wald & Havran 2006).

use super::Reference;
use crate::geometry::Aabb;
use crate::kdtree::sah::{AxisCost, CellCost, Split, cheaper};

/// Where a triangle's part begins, ends, or lies flat along the swept axis.
///
/// One integer, ordered by position first (sign and magnitude mapped to unsigned order) and then
/// ends before flat ones before beginnings, so that a plane's counts are complete when it is priced.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Event(u64);

const END: u64 = 0;
const PLANAR: u64 = 1;
const START: u64 = 2;

impl Event {
    fn new(position: f32, kind: u64) -> Self {
        // -0 and +0 are one plane.
        let bits = (position + 0.0).to_bits();
        let ordered = if bits >> 31 == 1 { !bits } else { bits | 1 << 31 };
        Self(u64::from(ordered) << 2 | kind)
    }

    fn kind(self) -> usize {
        (self.0 & 3) as usize
    }

    /// Equal for events in one plane.
    fn plane(self) -> u64 {
        self.0 >> 2
    }

    fn position(self) -> f32 {
        let ordered = self.plane() as u32;
        f32::from_bits(if ordered >> 31 == 1 { ordered & !(1 << 31) } else { !ordered })
    }
}

/// Memory that sweeps reuse.
#[derive(Default)]
pub(super) struct Scratch {
    events: Vec<Event>,
}

/// The cheapest plane of a cell, all axes and all ends of bounds tried; `None` if none divides.
pub(super) fn best_split(
    references: &[Reference],
    cell: &Aabb,
    costs: &CellCost,
    scratch: &mut Scratch,
) -> Option<Split> {
    let mut best = None;
    for axis in 0..3 {
        if cell.min[axis] < cell.max[axis] {
            let everything =
                Window { low: f32::NEG_INFINITY, high: f32::INFINITY, below: 0, above: references.len() };
            best = sweep(references, axis, &costs.axis(axis), everything, best, scratch);
        }
    }
    best
}

/// A stretch of an axis, and what lies beyond it on both sides.
#[derive(Clone, Copy)]
pub(super) struct Window {
    /// Planes at or below this are not tried.
    pub low: f32,
    /// Planes above this are not tried.
    pub high: f32,
    /// References that begin, or lie flat, at or below `low`.
    pub below: usize,
    /// References that end, or lie flat, above `low`.
    pub above: usize,
}

/// Tries the ends that fall into a window of one axis; gives the cheapest split found, or `best`.
pub(super) fn sweep(
    references: &[Reference],
    axis: usize,
    cost: &AxisCost,
    window: Window,
    mut best: Option<Split>,
    scratch: &mut Scratch,
) -> Option<Split> {
    let inside = |x: f32| window.low < x && x <= window.high;
    let events = &mut scratch.events;
    events.clear();
    for reference in references {
        let (low, high) = (reference.min[axis], reference.max[axis]);
        if low == high {
            if inside(low) {
                events.push(Event::new(low, PLANAR));
            }
        } else {
            if inside(low) {
                events.push(Event::new(low, START));
            }
            if inside(high) {
                events.push(Event::new(high, END));
            }
        }
    }
    events.sort_unstable();

    let (mut below, mut above) = (window.below, window.above);
    let mut next = 0;
    while let Some(&first) = events.get(next) {
        // Count what ends, lies flat and begins in this plane.
        let mut counts = [0; 3];
        while let Some(event) = events.get(next).filter(|event| event.plane() == first.plane()) {
            counts[event.kind()] += 1;
            next += 1;
        }
        let [ends, planar, starts] = counts;
        above -= ends + planar;
        best = cheaper(best, cost.split(first.position(), below, planar, above));
        below += starts + planar;
    }
    best
}
