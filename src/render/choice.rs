//! Which of two ways to trace is the quicker one here, by trying.
//!
//! Where triangles are larger than pixels, a square's rays go best together; where they are smaller,
//! packet by packet. Pictures hold both, so what was quicker nearby is done, and the other way tried now
//! and then: seldom enough that it costs some two per cent of the time, however slow it is. Only time
//! hangs on the choice: hits are the same, bit for bit.

use std::time::Duration;

/// The ways.
pub(super) const WAYS: usize = 2;

/// A worker's knowledge of what each way costs in its part of the picture.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Choice {
    /// Nanoseconds a ray, averaged over the last few lots.
    cost: [f32; WAYS],
    /// Lots that each way was taken for, up to [`FIRST`].
    taken: [u32; WAYS],
    /// Lots since the slower way was tried.
    since: u32,
}

/// Lots that each way is tried with at the start: the first of them fetch the model's data for all.
const FIRST: u32 = 3;

/// How much a new figure counts.
const WEIGHT: f32 = 0.4;

/// A figure that is so many times as high counts as no more: something else ran meanwhile.
const SPIKE: f32 = 4.0;

/// The least number of lots between two trials of the slower way.
const LEAST_WAIT: f32 = 12.0;

/// How many more for each time that it is slower.
const WAIT: f32 = 50.0;

impl Choice {
    /// The way for the next lot.
    pub fn next(&mut self) -> usize {
        if let Some(way) = self.taken.iter().position(|&taken| taken < FIRST) {
            return way;
        }
        let [first, second] = self.cost;
        let quicker = usize::from(second < first);
        let excess = first.max(second) / first.min(second) - 1.0;
        self.since += 1;
        if self.since as f32 >= LEAST_WAIT + WAIT * excess {
            self.since = 0;
            1 - quicker
        } else {
            quicker
        }
    }

    /// Says what a lot cost.
    pub fn record(&mut self, way: usize, rays: u64, time: Duration) {
        if rays == 0 {
            return;
        }
        // Clocks may stand still over a short lot.
        let new = (time.as_nanos() as f32).max(1.0) / rays as f32;
        let old = self.cost[way];
        if self.taken[way] < FIRST {
            self.taken[way] += 1;
            self.cost[way] = new;
        } else {
            self.cost[way] = old + (new.min(old * SPIKE) - old) * WEIGHT;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Traces so many lots of 256 rays, one way taking `cost` nanoseconds a ray; how often each was
    /// taken, and the time that all took beside the least possible.
    fn run(choice: &mut Choice, lots: u32, cost: [u64; WAYS]) -> ([u32; WAYS], f64) {
        let (mut taken, mut total) = ([0; WAYS], 0);
        for _ in 0..lots {
            let way = choice.next();
            taken[way] += 1;
            total += 256 * cost[way];
            choice.record(way, 256, Duration::from_nanos(256 * cost[way]));
        }
        let least = u64::from(lots) * 256 * cost[0].min(cost[1]);
        (taken, total as f64 / least as f64)
    }

    #[test]
    fn the_slower_way_costs_little_however_slow() {
        for cost in [[30, 36], [36, 30], [30, 90], [300, 30], [30, 30]] {
            let (taken, ratio) = run(&mut Choice::default(), 4000, cost);
            assert!(taken[0] > 0 && taken[1] > 0);
            assert!(ratio < 1.03, "{cost:?}: {ratio}");
        }
    }

    #[test]
    fn a_change_is_noticed() {
        let mut choice = Choice::default();
        run(&mut choice, 500, [30, 45]);
        let (taken, _) = run(&mut choice, 500, [60, 45]);
        assert!(taken[1] > 400, "{taken:?}");
    }

    #[test]
    fn a_spike_is_forgotten() {
        let mut choice = Choice::default();
        run(&mut choice, 100, [30, 45]);
        choice.record(0, 256, Duration::from_millis(100));
        let (taken, _) = run(&mut choice, 100, [30, 45]);
        assert!(taken[0] > 60, "{taken:?}");
    }

    #[test]
    fn nothing_is_learnt_from_no_rays() {
        let mut choice = Choice::default();
        choice.record(0, 0, Duration::from_secs(1));
        assert_eq!(choice.next(), 0);
    }
}
