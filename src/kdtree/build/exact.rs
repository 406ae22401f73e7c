//! The exact sweep: every end of a clipped bound is tried as a split plane (Wald & Havran 2006).

use super::reference::Reference;
use crate::kdtree::sah::{AxisCost, CellCost, Split, cheaper};

/// Where a triangle's part begins, ends, or lies flat along the swept axis.
///
/// One integer, ordered by position first (sign and magnitude mapped to unsigned order) and then
/// ends before flat ones before beginnings, so that a plane's counts are complete when it is priced.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub struct Event(u64);

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

    /// Adds the events of a part from `low` to `high`, those that are asked for. A flat part's one event
    /// is asked for with `low`.
    #[inline(always)]
    pub fn push(low: f32, high: f32, with_low: bool, with_high: bool, events: &mut Vec<Self>) {
        if low == high {
            if with_low {
                events.push(Self::new(low, PLANAR));
            }
            return;
        }
        if with_low {
            events.push(Self::new(low, START));
        }
        if with_high {
            events.push(Self::new(high, END));
        }
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

/// The cheapest plane of a cell, all axes and all ends of bounds tried; `None` if none divides.
pub fn best_split(references: &[Reference], costs: &CellCost, events: &mut Vec<Event>) -> Option<Split> {
    let mut best = None;
    for axis in (0..3).filter(|&axis| costs.has_extent(axis)) {
        events.clear();
        for reference in references {
            Event::push(reference.min(axis), reference.max(axis), true, true, events);
        }
        events.sort_unstable();
        best = price(events, &costs.axis(axis), 0, references.len(), best);
    }
    best
}

/// The cheapest of the planes at some sorted events, or `best`. Before the first event, `below`
/// references have begun or lain flat, and `above` have not ended.
pub fn price(
    events: &[Event],
    cost: &AxisCost,
    mut below: usize,
    mut above: usize,
    mut best: Option<Split>,
) -> Option<Split> {
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
