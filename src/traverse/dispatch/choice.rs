//! Which of some ways to trace is the quickest here, by trying.
//!
//! What was quickest nearby is done, and the others are tried now and then: seldom enough that it costs
//! some two per cent of the time, however slow they are.

use std::time::Duration;

/// A worker's knowledge of what each way costs in its part of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Choice<const WAYS: usize> {
    /// Nanoseconds a ray, averaged over the last few lots.
    cost: [f32; WAYS],
    /// Lots that each way was taken for, up to [`FIRST`].
    taken: [u32; WAYS],
    /// Lots since each way was tried.
    since: [u32; WAYS],
}

/// Lots that each way is tried with at the start: the first of them fetch the model's data for all.
const FIRST: u32 = 3;

/// How much a new figure counts, and how much one of a way that has not been taken for long.
const WEIGHT: f32 = 0.4;
const WEIGHT_OF_TRIAL: f32 = 0.7;

/// A figure that is so many times as high counts as no more: something else ran meanwhile.
const SPIKE: f32 = 4.0;

/// The least number of lots between two trials of a slower way.
const LEAST_WAIT: f32 = 12.0;

/// How many more for each time that it is slower.
const WAIT: f32 = 50.0;

impl<const WAYS: usize> Default for Choice<WAYS> {
    fn default() -> Self {
        Self { cost: [0.0; WAYS], taken: [0; WAYS], since: [0; WAYS] }
    }
}

impl<const WAYS: usize> Choice<WAYS> {
    /// The way for the next lot.
    pub fn next(&mut self) -> usize {
        if let Some(way) = self.taken.iter().position(|&taken| taken < FIRST) {
            return way;
        }
        let quickest = self.quickest();
        self.since.iter_mut().for_each(|since| *since += 1);
        let due = |way: usize| {
            let excess = self.cost[way] / self.cost[quickest] - 1.0;
            way != quickest && self.since[way] as f32 >= LEAST_WAIT + WAIT * excess
        };
        let way = (0..WAYS).find(|&way| due(way)).unwrap_or(quickest);
        self.since[way] = 0;
        way
    }

    /// The way that is thought to be quickest.
    pub fn quickest(&self) -> usize {
        (0..WAYS).min_by(|&a, &b| self.cost[a].total_cmp(&self.cost[b])).unwrap_or(0)
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
            let weight = if way == self.quickest() { WEIGHT } else { WEIGHT_OF_TRIAL };
            self.cost[way] = old + (new.min(old * SPIKE) - old) * weight;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Traces so many lots of 256 rays, one way taking `cost` nanoseconds a ray; how often each was
    /// taken, and the time that all took beside the least possible.
    fn run<const WAYS: usize>(choice: &mut Choice<WAYS>, lots: u32, cost: [u64; WAYS]) -> ([u32; WAYS], f64) {
        let (mut taken, mut total) = ([0; WAYS], 0);
        for _ in 0..lots {
            let way = choice.next();
            taken[way] += 1;
            total += 256 * cost[way];
            choice.record(way, 256, Duration::from_nanos(256 * cost[way]));
        }
        let least = u64::from(lots) * 256 * cost.iter().min().expect("a way");
        (taken, total as f64 / least as f64)
    }

    #[test]
    fn the_slower_way_costs_little_however_slow() {
        for cost in [[30, 36], [36, 30], [30, 90], [300, 30], [30, 30]] {
            let (taken, ratio) = run(&mut Choice::default(), 4000, cost);
            assert!(taken[0] > 0 && taken[1] > 0);
            assert!(ratio < 1.03, "{cost:?}: {ratio}");
        }
        for cost in [[30, 36, 33], [36, 30, 300], [90, 60, 30]] {
            let (taken, ratio) = run(&mut Choice::default(), 4000, cost);
            assert!(!taken.contains(&0));
            assert!(ratio < 1.05, "{cost:?}: {ratio}");
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
        let mut choice = Choice::<2>::default();
        choice.record(0, 0, Duration::from_secs(1));
        assert_eq!(choice.next(), 0);
    }
}
