//! What each way to trace has cost at each square of a picture.
//!
//! A frame shows much of what the one before has shown, and mostly at nearly the same place. Which way is quickest changes
//! from square to square: one that knew it beforehand for each would take 0.7 to 0.8 of the time of the best single way
//! where triangles are as small as pixels (`docs/coherent.md`). So squares are remembered from frame to frame, and from
//! sample to sample.

use std::sync::atomic::{AtomicU16, Ordering};

/// What squares have cost, by their numbers. Workers share it: who reads what another one is writing just now finds one
/// figure or the other, and only time hangs on it.
#[derive(Debug, Default)]
pub struct Places<const WAYS: usize> {
    closest: Box<[Costs<WAYS>]>,
    any: Box<[Costs<WAYS>]>,
}

/// One square's figures for one kind of ray.
#[derive(Debug)]
pub struct Costs<const WAYS: usize>([AtomicU16; WAYS]);

/// A square; perhaps one of which nothing is ever known.
#[derive(Clone, Copy, Debug)]
pub struct Place<'a, const WAYS: usize> {
    pub(super) closest: Option<&'a Costs<WAYS>>,
    pub(super) any: Option<&'a Costs<WAYS>>,
}

/// Steps of a figure to a doubling, and what stands for none of it: a 256th of a nanosecond a ray.
const STEPS: f32 = 1024.0;
const LEAST: f32 = -8.0;

/// How much a new figure counts, and within what it is kept of the old one, as logarithms: beyond, something else ran
/// meanwhile, or the square shows something else.
const WEIGHT: f32 = 0.5;
const RISE: f32 = 1.0;
const FALL: f32 = 4.0;

impl<const WAYS: usize> Places<WAYS> {
    /// So many squares, of which nothing is known yet.
    pub fn new(count: usize) -> Self {
        let unknown = || (0..count).map(|_| Costs::unknown()).collect();
        Self { closest: unknown(), any: unknown() }
    }

    /// A square; none if there are not so many.
    pub fn at(&self, square: usize) -> Place<'_, WAYS> {
        Place { closest: self.closest.get(square), any: self.any.get(square) }
    }
}

impl<const WAYS: usize> Place<'_, WAYS> {
    /// No square.
    pub const NONE: Self = Self { closest: None, any: None };
}

impl<const WAYS: usize> Costs<WAYS> {
    fn unknown() -> Self {
        Self(std::array::from_fn(|_| AtomicU16::new(0)))
    }

    /// Logarithms (base 2) of the nanoseconds a ray that each way has taken, where it is known.
    pub fn known(&self) -> [Option<f32>; WAYS] {
        std::array::from_fn(|way| match self.0[way].load(Ordering::Relaxed) {
            0 => None,
            cost => Some(f32::from(cost) / STEPS + LEAST),
        })
    }

    /// Whether a way is known to be slower than another one.
    pub fn is_slower(&self, way: usize) -> bool {
        let known = self.known();
        known[way].is_some_and(|cost| known.iter().flatten().any(|&other| other < cost))
    }

    /// Takes note of what a way has taken now.
    pub fn record(&self, way: usize, cost: f32) {
        let cost = match self.known()[way] {
            None => cost,
            Some(before) => before + WEIGHT * (cost - before).clamp(-FALL, RISE),
        };
        // Out of range becomes the nearest one that is in it.
        let steps = ((cost - LEAST) * STEPS) as u16;
        self.0[way].store(steps.max(1), Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn figures_are_kept_by_square_and_kind_of_ray() {
        let places = Places::<2>::new(3);
        assert!(places.at(3).closest.is_none() && places.at(3).any.is_none(), "there are three");
        let [one, other] = [places.at(1), places.at(2)].map(|place| place.closest.expect("it is there"));
        one.record(1, 5.25);
        assert_eq!(one.known(), [None, Some(5.25)]);
        assert_eq!(other.known(), [None; 2]);
        assert_eq!(places.at(1).any.expect("it is there").known(), [None; 2]);
    }

    #[test]
    fn a_way_is_slower_if_that_is_known() {
        let costs = Costs::<3>::unknown();
        assert!(!costs.is_slower(0));
        costs.record(0, 5.0);
        assert!(!costs.is_slower(0) && !costs.is_slower(1));
        costs.record(2, 4.5);
        assert!(costs.is_slower(0) && !costs.is_slower(1) && !costs.is_slower(2));
    }

    #[test]
    fn new_figures_replace_old_ones_by_halves_and_spikes_count_little() {
        let costs = Costs::<1>::unknown();
        costs.record(0, 5.0);
        costs.record(0, 4.0);
        assert_eq!(costs.known(), [Some(4.5)]);
        costs.record(0, 20.0);
        assert_eq!(costs.known(), [Some(5.0)]);
        costs.record(0, f32::NEG_INFINITY);
        assert_eq!(costs.known(), [Some(3.0)]);
    }

    #[test]
    fn what_is_out_of_range_is_the_nearest_that_is_not() {
        for (cost, kept) in [(-100.0, LEAST + 1.0 / STEPS), (100.0, 65535.0 / STEPS + LEAST)] {
            let costs = Costs::<1>::unknown();
            costs.record(0, cost);
            assert_eq!(costs.known(), [Some(kept)]);
        }
    }
}
