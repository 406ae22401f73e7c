//! Which of two ways to trace is the quicker, by going both.
//!
//! What a lot takes beside the one before it differs by a factor of two in the middle, so that ways that lie a tenth apart are told apart by
//! hundreds of lots only ([`choice`](super::choice)): processes settled on either, and the slower one was tried every thirty lots or so for it. So
//! now and then *the same rays* are traced both ways. What differs then is what the ways make of them, and the clock: a few lots tell. Answers
//! are the same either way, to the bit.
//!
//! Which goes first changes from pair to pair, as the second finds in the caches what the first has fetched. Where more time
//! goes, the ways matter more: pairs are weighted by how long they took, the quicker of both, as something else may have run meanwhile.
//!
//! The way that is thought to be slower has not been gone for a hundred lots and more by then, so that its code is in no near cache: that took
//! camera rays inside a power plant 7 % more than it should have, and about half of the processes stayed with the slower way for it. So the lot
//! before a pair goes that way alone.
//!
//! That is for two ways that are to one another much as they are everywhere, and neither of which is many times slower: going both costs what
//! the slower one takes.

use std::time::Duration;

/// A worker's knowledge of two ways.
#[derive(Clone, Copy, Debug, Default)]
pub struct Duel {
    /// How much longer the first way takes, as a logarithm (base 2), times the weights of the pairs; and those weights.
    apart: f32,
    weight: f32,
    /// Pairs so far.
    pairs: u32,
    /// Lots until the next one, of which the last goes the slower way.
    wait: f32,
}

/// What the next lot does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Turn {
    /// It goes a way.
    One(usize),
    /// It goes both, in this order.
    Both([usize; 2]),
}

/// Pairs that are needed for a word to be believed.
const FIRST: u32 = 4;

/// About as many are remembered, as places change.
const REMEMBERED: u32 = 24;

/// The logarithm of what one pair may say: beyond, something else ran meanwhile.
const SPIKE: f32 = 1.0;

/// Lots from pair to pair: so many more after each, up to the most. So a picture of a thousand lots has some twenty at first, and
/// later six.
const MORE_WAIT: f32 = 4.0;
const MOST_WAIT: f32 = 160.0;

impl Duel {
    /// The way that is thought to be quicker.
    pub fn quicker(&self) -> usize {
        usize::from(self.apart > 0.0)
    }

    /// Whether next to nothing is known yet.
    pub const fn is_beginning(&self) -> bool {
        self.pairs < FIRST
    }

    /// What the next lot does.
    pub fn next(&mut self) -> Turn {
        if self.wait > 0.0 {
            self.wait -= 1.0;
            let is_last = self.wait <= 0.0;
            return Turn::One(if is_last { 1 - self.quicker() } else { self.quicker() });
        }
        let first = self.pairs as usize % 2;
        Turn::Both([first, 1 - first])
    }

    /// Says how long a lot took either way.
    pub fn record(&mut self, spent: [Duration; 2]) {
        // Clocks may stand still over a short lot.
        let [first, second] = spent.map(|spent| (spent.as_nanos() as f32).max(1.0));
        let weight = first.min(second);
        if self.pairs >= REMEMBERED {
            let kept = 1.0 - 1.0 / REMEMBERED as f32;
            (self.apart, self.weight) = (kept * self.apart, kept * self.weight);
        }
        self.apart += weight * (first / second).log2().clamp(-SPIKE, SPIKE);
        self.weight += weight;
        self.pairs = self.pairs.saturating_add(1);
        // The slower the other way is, the dearer is a pair.
        let dear = (self.apart.abs() / self.weight).exp2();
        self.wait = dear * (MORE_WAIT * self.pairs as f32).min(MOST_WAIT);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weyl::uniform;

    /// Traces lots of such work by the ways that a duel takes, each way taking so many nanoseconds for a unit of it, the second one of a pair a tenth
    /// less. Gives the time beside that of the quicker way alone.
    fn run(duel: &mut Duel, lots: usize, cost: [f64; 2], mut work: impl FnMut() -> f64) -> f64 {
        let (mut total, mut least) = (0.0, 0.0);
        for _ in 0..lots {
            let work = work();
            let took = cost.map(|cost| cost * work);
            least += took[0].min(took[1]);
            match duel.next() {
                Turn::One(way) => total += took[way],
                Turn::Both([first, second]) => {
                    let mut spent = took;
                    spent[second] *= 0.9;
                    total += spent[first] + spent[second];
                    duel.record(spent.map(|nanoseconds| Duration::from_nanos(nanoseconds as u64)));
                }
            }
        }
        total / least
    }

    #[test]
    fn a_small_difference_is_found_at_once_where_work_changes_much() {
        for cost in [[10.0, 10.4], [10.4, 10.0], [10.0, 13.0], [13.0, 10.0]] {
            let mut duel = Duel::default();
            // From lot to lot by up to 32 times.
            let mut number = uniform(0.0, 5.0);
            let mut work = || 1000.0 * f64::from(number()).exp2();
            assert!(duel.is_beginning());
            let first = run(&mut duel, 1000, cost, &mut work);
            assert!(!duel.is_beginning() && duel.quicker() == usize::from(cost[1] < cost[0]), "{cost:?}");
            let later = run(&mut duel, 4000, cost, &mut work);
            assert!(first < 1.05 && later < 1.015, "{cost:?}: {first}, {later}");
        }
    }

    #[test]
    fn a_way_whose_code_has_left_the_caches_is_not_thought_to_be_slower_for_it() {
        for cost in [[10.0, 10.7], [10.7, 10.0]] {
            let (mut duel, mut last_gone) = (Duel::default(), [0; 2]);
            // The one that is slower is thought to be quicker at first.
            let slower = usize::from(cost[0] < cost[1]);
            for _ in 0..8 {
                duel.record(std::array::from_fn(|way| {
                    Duration::from_micros(if way == slower { 10 } else { 11 })
                }));
            }
            assert_eq!(duel.quicker(), slower);
            for lot in 1..4000 {
                let mut go = |way: usize| {
                    let cold = if lot - std::mem::replace(&mut last_gone[way], lot) > 4 { 1.3 } else { 1.0 };
                    Duration::from_nanos((1000.0 * cost[way] * cold) as u64)
                };
                match duel.next() {
                    Turn::One(way) => _ = go(way),
                    Turn::Both([first, second]) => {
                        let mut spent = [Duration::ZERO; 2];
                        spent[first] = go(first);
                        spent[second] = go(second);
                        duel.record(spent);
                    }
                }
            }
            assert_eq!(duel.quicker(), 1 - slower, "{cost:?}");
        }
    }

    #[test]
    fn what_runs_meanwhile_turns_nothing_round() {
        let mut duel = Duel::default();
        run(&mut duel, 1000, [10.0, 11.0], || 1000.0);
        duel.record([Duration::from_secs(1), Duration::from_micros(11)]);
        assert_eq!(duel.quicker(), 0);
    }

    #[test]
    fn a_way_that_becomes_the_slower_one_is_left() {
        let mut duel = Duel::default();
        run(&mut duel, 2000, [10.0, 11.0], || 1000.0);
        run(&mut duel, 6000, [11.0, 10.0], || 1000.0);
        assert_eq!(duel.quicker(), 1);
    }

    #[test]
    fn the_first_one_changes_from_pair_to_pair_and_a_clock_may_stand_still() {
        let mut duel = Duel::default();
        let mut orders = Vec::new();
        while orders.len() < 6 {
            if let Turn::Both(order) = duel.next() {
                orders.push(order);
                duel.record([Duration::ZERO; 2]);
            }
        }
        assert_eq!(orders, [[0, 1], [1, 0], [0, 1], [1, 0], [0, 1], [1, 0]]);
    }
}
