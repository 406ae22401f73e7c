//! Which of some ways to trace is the quickest here, by trying.
//!
//! One lot's time says little about a way: the next lot may be twice as dear whichever way it is traced.
//! So times are taken *relative to the lot before*, as logarithms, and averaged; a way that is slow for
//! what it was given then looks slow, and not what happened to be in front of it.
//!
//! Which way is quickest changes within a picture, and goes with how dear the lots are: where one costs
//! many times the usual, triangles are smaller than what rays share. So there are averages for each of
//! some [`KINDS`] of place, told apart by what the lot before cost beside the usual.
//!
//! A study replayed the times of all lots of thirteen views' camera and shadow rays by three ways each, with
//! noise: this took 0.9 % longer than the best single way over three pictures on average (2.6 % over the first),
//! from 10 % less (a kitchen, where no way is best everywhere) to 7 % more (shadow rays among triangles smaller
//! than pixels). Averages of plain times took up to 27 % longer, relative ones that know no kinds up to 26 %,
//! and what believed the first two lots of each way once took 76 % longer for a whole picture.
//!
//! The quickest way is taken, and the others are tried now and then: the seldomer, the slower they are.
//!
//! **Places that were seen before** ([`places`](super::places)) have figures of their own. There the way is taken that was
//! quickest at that very place, as far as a few visits tell; one that was not tried there yet is expected to be to the others
//! as it is elsewhere in such a kind of place. What such lots cost teaches nothing about ways elsewhere: each was taken
//! where it is good.

use std::time::Duration;

/// A worker's knowledge of what each way costs in its part of the picture.
#[derive(Clone, Copy, Debug)]
pub struct Choice<const WAYS: usize> {
    kinds: [Kind<WAYS>; KINDS],
    /// The kind of place that the next lot is thought to be in.
    here: usize,
    /// Logarithm (base 2) of the nanoseconds a ray of the last lot took, and of what is usual.
    last: f32,
    usual: f32,
    /// Lots so far.
    lots: u32,
    /// Whether the next lot's way was chosen by what is known of its place.
    by_place: bool,
}

/// What is known of one kind of place.
#[derive(Clone, Copy, Debug)]
struct Kind<const WAYS: usize> {
    /// Logarithm of the time that lots took by each way beside the lot before, averaged.
    cost: [f32; WAYS],
    /// Lots that each way was taken for.
    taken: [u32; WAYS],
    /// Lots until each way is tried again.
    wait: [f32; WAYS],
}

/// Kinds of place, and the width of each, as a logarithm of times.
const KINDS: usize = 7;
const WIDTH: f32 = 0.5;

/// How often all ways are tried at the start, there and back (first, second, second, first), so that lots that
/// grow dearer meanwhile are not taken for a way that is slow.
const FIRST: u32 = 2;

/// The least that a new figure counts, how much one of a trial does, and one for what is usual.
const WEIGHT: f32 = 0.07;
const WEIGHT_OF_TRIAL: f32 = 0.15;
const WEIGHT_OF_USUAL: f32 = 0.02;

/// Logarithms are kept within this: beyond, something else ran meanwhile.
const SPIKE: f32 = 2.0;

/// The least number of lots between two trials of a slower way.
const LEAST_WAIT: f32 = 20.0;

/// How many more for each time that it is slower, squared, once it is known well: after so many lots.
const WAIT: f32 = 80.0;
const KNOWN_WELL: f32 = 16.0;

/// The greatest number: what was true of the places before may be false of those to come.
const MOST_WAIT: f32 = 800.0;

/// The number of lots after a trial that did better than the quickest way is known to.
const WAIT_AFTER_SURPRISE: f32 = 4.0;

/// At a place that is known: one in how many visits tries a way again that is as quick as the quickest, one that was never
/// tried there, and how many more visits it is for each time that a way is slower, squared.
const VISITS: f32 = 32.0;
const VISITS_UNTRIED: f32 = 8.0;
const VISITS_IF_SLOWER: f32 = 5.0;

/// One in how many visits takes no heed of the place, so that what is known of ways elsewhere does not grow old.
const VISITS_AS_ELSEWHERE: u32 = 16;

/// How much of what sets a way apart at a place is believed: the rest is what it is elsewhere. One figure of one visit may
/// be of a cold cache, or of a view that was a little different.
const BELIEF: f32 = 0.65;

impl<const WAYS: usize> Default for Choice<WAYS> {
    fn default() -> Self {
        let kind = Kind { cost: [0.0; WAYS], taken: [0; WAYS], wait: [0.0; WAYS] };
        Self { kinds: [kind; KINDS], here: KINDS / 2, last: 0.0, usual: 0.0, lots: 0, by_place: false }
    }
}

impl<const WAYS: usize> Choice<WAYS> {
    /// The way for the next lot.
    pub fn next(&mut self) -> usize {
        self.by_place = false;
        if self.is_beginning() {
            let place = self.lots as usize % (2 * WAYS);
            return if place < WAYS { place } else { 2 * WAYS - 1 - place };
        }
        self.meet(self.here);
        let kind = &mut self.kinds[self.here];
        kind.wait.iter_mut().for_each(|wait| *wait -= 1.0);
        let quickest = kind.quickest();
        (0..WAYS).find(|&way| way != quickest && kind.wait[way] <= 0.0).unwrap_or(quickest)
    }

    /// Whether all ways are being tried for the first time.
    pub fn is_beginning(&self) -> bool {
        self.lots < 2 * FIRST * WAYS as u32
    }

    /// The way for the next lot, of whose place is known what some ways cost there before: see [`Costs::known`].
    ///
    /// [`Costs::known`]: super::places::Costs::known
    pub fn next_at(&mut self, known: &[Option<f32>; WAYS]) -> usize {
        let Some(least) = known.iter().flatten().copied().reduce(f32::min) else { return self.next() };
        let dice = self.dice();
        if self.is_beginning() || dice.is_multiple_of(VISITS_AS_ELSEWHERE) {
            return self.next();
        }
        self.by_place = true;
        let kind = self.kind_at(least);
        self.meet(kind);
        let costs = expected(known, &self.kinds[kind].cost);
        let best = smallest(&costs);
        for way in (0..WAYS).filter(|&way| way != best) {
            let visits = if known[way].is_some() { VISITS } else { VISITS_UNTRIED };
            let slower = (2.0 * (costs[way] - costs[best])).exp2() - 1.0;
            let dice = dice.rotate_left(8 + 8 * way as u32).wrapping_mul(0x85eb_ca6b);
            if (dice >> 8) as f32 * (visits * (1.0 + VISITS_IF_SLOWER * slower)) < (1 << 24) as f32 {
                return way;
            }
        }
        best
    }

    /// A number that has nothing to do with the one for the lot before.
    fn dice(&self) -> u32 {
        let mixed = self.lots.wrapping_mul(0x9e37_79b9);
        (mixed ^ mixed >> 15).wrapping_mul(0x2c1b_3c6d) >> 3
    }

    /// The kind of place where a lot costs so much.
    fn kind_at(&self, cost: f32) -> usize {
        // What is usual is in the middle of the middle kind.
        let place = (cost - self.usual) / WIDTH + KINDS as f32 * 0.5;
        (place.max(0.0) as usize).min(KINDS - 1)
    }

    /// In a kind of place that is new, begins with what the nearest known one has taught.
    fn meet(&mut self, new: usize) {
        if self.kinds[new].taken != [0; WAYS] {
            return;
        }
        let known = |&kind: &usize| self.kinds[kind].taken != [0; WAYS];
        let Some(nearest) = (0..KINDS).filter(known).min_by_key(|kind| kind.abs_diff(new)) else {
            return;
        };
        let Kind { cost, .. } = self.kinds[nearest];
        let kind = &mut self.kinds[new];
        *kind = Kind { cost, taken: [1; WAYS], wait: [0.0; WAYS] };
        kind.wait = std::array::from_fn(|way| kind.wait_of(way));
    }

    /// The way that is thought to be quickest for the next lot.
    pub fn quickest(&self) -> usize {
        self.kinds[self.here].quickest()
    }

    /// Says what a lot's rays took, logarithm of nanoseconds each, that were traced some other way: the next lot is thought to
    /// be in such a place.
    pub fn pass(&mut self, cost: f32) {
        self.last = cost;
        if !self.is_beginning() {
            self.here = self.kind_at(cost);
        }
    }

    /// Logarithm (base 2) of the nanoseconds that a ray of the last lot took.
    pub const fn last(&self) -> f32 {
        self.last
    }

    /// Says what the lot cost for which `way` was taken. Gives the logarithm (base 2) of the nanoseconds a ray; nothing
    /// if there were no rays.
    pub fn record(&mut self, way: usize, rays: u64, time: Duration) -> Option<f32> {
        if rays == 0 {
            return None;
        }
        // Clocks may stand still over a short lot.
        let new = ((time.as_nanos() as f32).max(1.0) / rays as f32).log2();
        if !self.by_place {
            self.learn(way, new);
        }
        self.lots = self.lots.saturating_add(1);
        self.usual += WEIGHT_OF_USUAL.max(1.0 / self.lots as f32) * (new - self.usual);
        self.last = new;
        // All ways are tried in one kind of place, before others are told from it.
        if !self.is_beginning() {
            self.here = self.kind_at(new);
        }
        Some(new)
    }

    /// Learns from what a lot cost.
    fn learn(&mut self, way: usize, new: f32) {
        let before = if self.lots == 0 { new } else { self.last };
        let kind = &mut self.kinds[self.here];
        let quickest = kind.quickest();
        let cost = (new - before).clamp(-SPIKE, SPIKE);
        let surprise = way != quickest && cost < kind.cost[quickest];
        kind.taken[way] = kind.taken[way].saturating_add(1);
        let weight = if way == quickest { WEIGHT } else { WEIGHT_OF_TRIAL };
        kind.cost[way] += weight.max(1.0 / kind.taken[way] as f32) * (cost - kind.cost[way]);
        kind.wait[way] = if surprise { WAIT_AFTER_SURPRISE } else { kind.wait_of(way) };
    }
}

impl<const WAYS: usize> Kind<WAYS> {
    fn quickest(&self) -> usize {
        (0..WAYS).min_by(|&a, &b| self.cost[a].total_cmp(&self.cost[b])).unwrap_or(0)
    }

    /// Lots until a way is to be tried again.
    fn wait_of(&self, way: usize) -> f32 {
        let quickest = self.quickest();
        if way == quickest {
            // As what follows would give it. Nearly every lot is one of these, and is spared the power of two.
            return LEAST_WAIT;
        }
        let slower = (2.0 * (self.cost[way] - self.cost[quickest])).exp2() - 1.0;
        let known = (self.taken[way] as f32 / KNOWN_WELL).min(1.0);
        (LEAST_WAIT + WAIT * slower * known).min(MOST_WAIT)
    }
}

/// What each way is expected to cost at a place where some of them, at least one, are known to, if they cost `elsewhere`,
/// relative to one another, in such places.
fn expected<const WAYS: usize>(known: &[Option<f32>; WAYS], elsewhere: &[f32; WAYS]) -> [f32; WAYS] {
    // How dear the place is, whichever way is taken.
    let here = || known.iter().zip(elsewhere).filter_map(|(known, elsewhere)| Some((*known)? - elsewhere));
    let dear = here().sum::<f32>() / here().count() as f32;
    std::array::from_fn(|way| {
        let usual = dear + elsewhere[way];
        known[way].map_or(usual, |known| usual + BELIEF * (known - usual))
    })
}

/// The place of the smallest figure.
fn smallest<const WAYS: usize>(costs: &[f32; WAYS]) -> usize {
    (0..WAYS).min_by(|&a, &b| costs[a].total_cmp(&costs[b])).unwrap_or(0)
}

#[cfg(test)]
mod tests {
    use super::super::places::Places;
    use super::*;

    /// Traces lots of 256 rays, `cost(lot, way)` giving the nanoseconds a ray; how often each way was
    /// taken, and the time that all took beside the least that one way could.
    fn run<const WAYS: usize>(
        choice: &mut Choice<WAYS>,
        lots: u32,
        mut cost: impl FnMut(u32) -> [f64; WAYS],
    ) -> ([u32; WAYS], f64) {
        let (mut taken, mut total, mut each) = ([0; WAYS], 0.0, [0.0; WAYS]);
        for lot in 0..lots {
            let cost = cost(lot);
            let way = choice.next();
            taken[way] += 1;
            total += cost[way];
            (0..WAYS).for_each(|way| each[way] += cost[way]);
            choice.record(way, 256, Duration::from_nanos((256.0 * cost[way]) as u64));
        }
        (taken, total / each.into_iter().fold(f64::INFINITY, f64::min))
    }

    #[test]
    fn the_slower_way_costs_little_however_slow() {
        for cost in [[30.0, 36.0], [36.0, 30.0], [30.0, 90.0], [300.0, 30.0], [30.0, 30.0]] {
            let (taken, ratio) = run(&mut Choice::default(), 4000, |_| cost);
            assert!(taken[0] > 0 && taken[1] > 0);
            assert!(ratio < 1.03, "{cost:?}: {ratio}");
        }
        for cost in [[30.0, 36.0, 33.0], [36.0, 30.0, 300.0], [90.0, 60.0, 30.0]] {
            let (taken, ratio) = run(&mut Choice::default(), 4000, |_| cost);
            assert!(!taken.contains(&0));
            assert!(ratio < 1.05, "{cost:?}: {ratio}");
        }
    }

    #[test]
    fn what_lots_hold_is_not_taken_for_the_way() {
        // From lot to lot the work changes by four times; the second way is a sixth slower.
        let (_, ratio) = run(&mut Choice::default(), 8000, |lot| {
            let random = f64::from(lot.wrapping_mul(0x9e37_79b9) >> 8) / f64::from(1 << 24);
            let work = (3.0 + 2.0 * random).exp2();
            [work * 6.0, work * 7.0]
        });
        assert!(ratio < 1.04, "{ratio}");
    }

    #[test]
    fn dear_places_may_have_a_way_of_their_own() {
        // In every other run of 50 lots, packets' price is three times as high and a beam's eight.
        let dear = |lot: u32| lot / 50 % 2 == 1;
        let (_, ratio) =
            run(&mut Choice::default(), 8000, |lot| if dear(lot) { [240.0, 150.0] } else { [30.0, 50.0] });
        assert!(ratio < 0.96, "{ratio}: either way alone would take as long as 1");
    }

    #[test]
    fn a_rise_at_the_start_is_not_taken_for_the_way() {
        // Each lot is a half dearer than the one before, until all ways have been tried.
        let (_, ratio) = run(&mut Choice::default(), 4000, |lot| {
            let work = 1.5f64.powi(lot.min(12) as i32);
            [work * 30.0, work * 60.0, work * 63.0]
        });
        assert!(ratio < 1.03, "{ratio}");
    }

    #[test]
    fn a_change_is_noticed() {
        let mut choice = Choice::default();
        run(&mut choice, 500, |_| [30.0, 45.0]);
        let (taken, _) = run(&mut choice, 500, |_| [60.0, 45.0]);
        assert!(taken[1] > 400, "{taken:?}");
    }

    #[test]
    fn a_spike_is_forgotten() {
        let mut choice = Choice::default();
        run(&mut choice, 100, |_| [30.0, 45.0]);
        choice.record(0, 256, Duration::from_millis(100));
        let (taken, _) = run(&mut choice, 100, |_| [30.0, 45.0]);
        assert!(taken[0] > 60, "{taken:?}");
    }

    #[test]
    fn places_have_ways_of_their_own() {
        // Which of three ways is quickest hangs on the place, and on nothing that the lot before tells.
        let quickest = |place: u32| (place.wrapping_mul(0x9e37_79b9) >> 16) as usize % 3;
        let cost =
            |place: u32, way: usize| if way == quickest(place) { 30.0 } else { 50.0 + 30.0 * way as f64 };
        let (mut choice, places) = (Choice::<3>::default(), Places::<3>::new(400));
        let mut frame = |_| {
            let mut total = 0.0;
            for place in 0..400 {
                let costs = places.at(place).closest.expect("it is there");
                let way = choice.next_at(&costs.known());
                let cost = cost(place as u32, way);
                total += cost;
                let cost = choice.record(way, 256, Duration::from_nanos((256.0 * cost) as u64));
                costs.record(way, cost.expect("there were rays"));
            }
            total / 400.0
        };
        let first: f64 = frame(0);
        let last = (1..200).map(&mut frame).last().expect("there were frames");
        let best_single = (0..3)
            .map(|way| (0..400).map(|place| cost(place, way)).sum::<f64>() / 400.0)
            .fold(f64::INFINITY, f64::min);
        assert!(first > 45.0, "{first}: nothing tells beforehand");
        // All of the gain is a quarter and more; what trying costs is left over.
        assert!(last < 0.8 * best_single, "{last} beside {best_single}");
    }

    #[test]
    fn what_is_slow_at_a_place_is_hardly_ever_tried_there() {
        let mut choice = Choice::<2>::default();
        run(&mut choice, 100, |_| [30.0, 240.0]);
        let tried = (0..10_000).filter(|_| {
            let way = choice.next_at(&[Some(5.0), Some(8.0)]);
            choice.record(way, 256, Duration::from_nanos([256 * 32, 256 * 256][way]));
            way == 1
        });
        let tried = tried.count();
        assert!((1..40).contains(&tried), "{tried}");
    }

    #[test]
    fn what_was_traced_some_other_way_says_where_the_next_lot_is() {
        let mut choice = Choice::<2>::default();
        // Every other run of 20 lots is dear, and there the second way is quicker.
        run(&mut choice, 2000, |lot| if lot / 20 % 2 == 1 { [900.0, 300.0] } else { [8.0, 12.0] });
        for _ in 0..3 {
            choice.pass(300f32.log2());
            assert_eq!(choice.quickest(), 1);
            assert_eq!(choice.last(), 300f32.log2());
            choice.pass(8f32.log2());
            assert_eq!(choice.quickest(), 0);
        }
        let mut new = Choice::<2>::default();
        new.pass(10.0);
        assert!(new.is_beginning() && new.next() == 0, "and teaches nothing about ways");
    }

    #[test]
    fn nothing_is_learnt_from_no_rays() {
        let mut choice = Choice::<2>::default();
        assert_eq!(choice.record(0, 0, Duration::from_secs(1)), None);
        assert_eq!(choice.next(), 0);
    }
}
