//! Which of some ways to trace is the quickest here, by trying.
//!
//! One lot's time says little about a way: the next lot may be twice as dear whichever way it is traced.
//! So times are taken *relative to the lot before*, as logarithms, and averaged; a way that is slow for
//! what it was given then looks slow, and not what happened to be in front of it.
//!
//! Which way is quickest changes within a picture, and goes with how dear the lots are: where one costs
//! many times what others do, triangles are smaller than what rays share. So there are averages for each of
//! some [`KINDS`] of place, told apart by what the lot before cost. (Beside what is usual, kinds once were told apart. But in
//! pictures of much sky and a little of something dear that changes by a factor of twenty, and what was known of kinds with it:
//! the power plant from outside took 1.09 to 1.11 times as long as by the best way, and since then 1.02 to 1.05.)
//!
//! A study replayed the times of all lots of thirteen views' camera and shadow rays by three ways each, with
//! noise, when kinds still were told apart like that: this took 0.9 % longer than the best single way over three pictures on average
//! (2.6 % over the first),
//! from 10 % less (a kitchen, where no way is best everywhere) to 7 % more (shadow rays among triangles smaller
//! than pixels). Averages of plain times took up to 27 % longer, relative ones that know no kinds up to 26 %,
//! and what believed the first two lots of each way once took 76 % longer for a whole picture.
//!
//! The quickest way is taken, and the others are tried now and then: the seldomer, the slower they are.
//!
//! What a lot takes beside the one before it has a standard deviation of 0.5 to 1.2, as a logarithm: so some hundred of them are
//! remembered, not more, as places change. Two ways that are to one another much as they are everywhere are compared by
//! going both ([`duel`](super::duel)). Later replays, which the figures here were chosen by, are in `docs/coherent.md`.
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
    /// Ways that are left out.
    out: [bool; WAYS],
    /// The kind of place that the next lot is thought to be in.
    here: usize,
    /// Logarithm (base 2) of the nanoseconds a ray of the last lot took.
    last: f32,
    /// Lots so far.
    lots: u32,
    /// Whether the next lot's way was chosen by what is known of its place, and whether it is tried though another one is thought to be
    /// quicker.
    by_place: bool,
    is_trial: bool,
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

/// Kinds of place, and the width of each, as a logarithm of times: from 6 ns a ray to 900.
const KINDS: usize = 13;
const WIDTH: f32 = 0.6;
/// Logarithm of the nanoseconds a ray where the first one ends.
const FIRST_KIND: f32 = 2.6;

/// The last kind of place that there is next to nothing in: up to 9 ns a ray.
const NOTHING: usize = 1;

/// How often all ways are tried at the start, there and back (first, second, second, first), so that lots that
/// grow dearer meanwhile are not taken for a way that is slow.
const FIRST: u32 = 2;

/// Where a kind of place is new, half of the lots count that taught about the nearest one, but no more than these.
const ELSEWHERE: u32 = 8;

/// The least that a new figure counts, and one of a trial. What a lot costs beside the one before differs by a factor of two in the
/// middle, so that it takes a hundred of them to tell a tenth.
const WEIGHT: f32 = 0.02;
const WEIGHT_OF_TRIAL: f32 = 0.03;

/// Logarithms are kept within this: beyond, something else ran meanwhile.
const SPIKE: f32 = 2.0;

/// The least number of lots between two trials of a slower way.
const LEAST_WAIT: f32 = 10.0;

/// How many more for each time that it is slower, squared, once it is known well: after so many lots.
const WAIT: f32 = 80.0;
const KNOWN_WELL: f32 = 12.0;

/// The greatest number: what was true of the places before may be false of those to come.
const MOST_WAIT: f32 = 800.0;

/// The part of it that is waited where a kind of place is new: what was true elsewhere may be false there.
const WAIT_WHERE_NEW: f32 = 0.25;

/// The number of lots after a trial that did better than the quickest way is known to.
const WAIT_AFTER_SURPRISE: f32 = 4.0;

/// At a place that is known: one in how many visits tries a way again that is as quick as the quickest, one that was never
/// tried there, and how many more visits it is for each time that a way is slower, squared.
const VISITS: f32 = 32.0;
const VISITS_UNTRIED: f32 = 8.0;
const VISITS_IF_SLOWER: f32 = 5.0;

/// One in how many visits takes no heed of the place, so that what is known of ways elsewhere does not grow old.
const VISITS_AS_ELSEWHERE: u32 = 16;

/// One in how many visits asks the places of some lots one by one, where the same way is known to be quickest at all.
const VISITS_BY_ITSELF: u32 = 8;

/// How much of what sets a way apart at a place is believed: the rest is what it is elsewhere. One figure of one visit may
/// be of a cold cache, or of a view that was a little different.
const BELIEF: f32 = 0.65;

impl<const WAYS: usize> Default for Choice<WAYS> {
    fn default() -> Self {
        let kind = Kind { cost: [0.0; WAYS], taken: [0; WAYS], wait: [0.0; WAYS] };
        Self {
            kinds: [kind; KINDS],
            out: [false; WAYS],
            here: KINDS / 2,
            last: 0.0,
            lots: 0,
            by_place: false,
            is_trial: false,
        }
    }
}

impl<const WAYS: usize> Choice<WAYS> {
    /// Never takes a way from now on.
    pub fn leave_out(&mut self, way: usize) {
        if self.out[way] {
            return;
        }
        self.out[way] = true;
        for kind in &mut self.kinds {
            (kind.cost[way], kind.wait[way]) = (f32::INFINITY, f32::INFINITY);
        }
    }

    /// Those that are not left out.
    fn ways(&self) -> impl Iterator<Item = usize> {
        (0..WAYS).filter(|&way| !self.out[way])
    }

    /// The way for the next lot.
    pub fn next(&mut self) -> usize {
        (self.by_place, self.is_trial) = (false, true);
        if self.is_beginning() {
            let ways = self.ways().count();
            let place = self.lots as usize % (2 * ways);
            let place = if place < ways { place } else { 2 * ways - 1 - place };
            return self.ways().nth(place).unwrap_or(0);
        }
        self.meet(self.here);
        let quickest = self.quickest();
        let kind = &mut self.kinds[self.here];
        kind.wait.iter_mut().for_each(|wait| *wait -= 1.0);
        let due = (0..WAYS).find(|&way| way != quickest && kind.wait[way] <= 0.0);
        self.is_trial = due.is_some();
        due.unwrap_or(quickest)
    }

    /// Whether a way is thought to be no more than `behind` the quickest for so many lots to come, as a logarithm (base 2), with no other one
    /// to be tried meanwhile. Then they are taken to be one.
    pub fn settles_on(&mut self, way: usize, lots: usize, behind: f32) -> bool {
        if self.is_beginning() {
            return false;
        }
        self.meet(self.here);
        let is_behind = self.behind(way) > behind;
        let kind = &mut self.kinds[self.here];
        let is_due = |other: usize| other != way && kind.wait[other] <= lots as f32;
        if is_behind || (0..WAYS).any(is_due) {
            return false;
        }
        kind.wait.iter_mut().for_each(|wait| *wait -= lots as f32);
        (self.by_place, self.is_trial) = (false, false);
        true
    }

    /// Whether next to nothing is here: where lots cost least.
    pub const fn is_cheapest(&self) -> bool {
        self.here <= NOTHING
    }

    /// The same where the way is known to be quickest at the places of all of them, but for one in how many visits that asks
    /// each place by itself.
    pub fn settles_there(&mut self) -> bool {
        (self.by_place, self.is_trial) = (true, false);
        !self.is_beginning() && !self.dice().is_multiple_of(VISITS_BY_ITSELF)
    }

    /// Whether all ways are being tried for the first time.
    pub fn is_beginning(&self) -> bool {
        self.lots < 2 * FIRST * self.ways().count() as u32
    }

    /// Whether so many lots were traced.
    pub const fn has_seen(&self, lots: u32) -> bool {
        self.lots >= lots
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
        (self.by_place, self.is_trial) = (true, false);
        let kind = Self::kind_at(least);
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
    fn kind_at(cost: f32) -> usize {
        let place = (cost - FIRST_KIND) / WIDTH + 1.0;
        (place.max(0.0) as usize).min(KINDS - 1)
    }

    /// The kind of place most like a given one of those that something is known of: that one itself if it can be.
    fn nearest_known(&self, kind: usize) -> Option<usize> {
        let is_known = |kind: &usize| self.kinds[*kind].taken != [0; WAYS];
        if is_known(&kind) {
            return Some(kind);
        }
        (0..KINDS).filter(is_known).min_by_key(|known| known.abs_diff(kind))
    }

    /// In a kind of place that is new, begins with what the nearest known one has taught, if any is.
    fn meet(&mut self, new: usize) {
        let Some(nearest) = self.nearest_known(new).filter(|&nearest| nearest != new) else { return };
        let Kind { cost, taken, .. } = self.kinds[nearest];
        let kind = &mut self.kinds[new];
        *kind = Kind { cost, taken: taken.map(|taken| (taken / 2).min(ELSEWHERE)), wait: [0.0; WAYS] };
        kind.wait = std::array::from_fn(|way| kind.wait_of(way) * WAIT_WHERE_NEW);
    }

    /// The way that is thought to be quickest for the next lot.
    pub fn quickest(&self) -> usize {
        self.kind_here().quickest()
    }

    /// How much longer than by the quickest way it takes by a given one, in the kind of place that the next lot is in, as a logarithm (base 2).
    pub fn behind(&self, way: usize) -> f32 {
        let Kind { cost, .. } = self.kind_here();
        cost[way] - cost[smallest(cost)]
    }

    /// How much longer than by the way that is quickest in the kind of place that the next lot is in it takes by the next best, as a
    /// logarithm (base 2).
    pub fn lead(&self) -> f32 {
        let Kind { cost, .. } = self.kind_here();
        let best = smallest(cost);
        let others = (0..WAYS).filter(|&way| way != best).map(|way| cost[way]);
        others.fold(f32::INFINITY, f32::min) - cost[best]
    }

    /// The kind of place that the next lot is in, as far as it is known.
    fn kind_here(&self) -> &Kind<WAYS> {
        &self.kinds[self.nearest_known(self.here).unwrap_or(self.here)]
    }

    /// Says what a lot's rays took, logarithm of nanoseconds each, that were traced some other way: the next lot is thought to
    /// be in such a place.
    pub fn pass(&mut self, cost: f32) {
        self.last = cost;
        if !self.is_beginning() {
            self.here = Self::kind_at(cost);
        }
    }

    /// Logarithm (base 2) of the nanoseconds that a ray of the last lot took.
    pub const fn last(&self) -> f32 {
        self.last
    }

    /// Says what the lot cost for which `way` was taken. Gives the logarithm (base 2) of the nanoseconds a ray; nothing
    /// if there were no rays.
    pub fn record(&mut self, way: usize, rays: usize, time: Duration) -> Option<f32> {
        if rays == 0 {
            return None;
        }
        let new = cost_of(rays, time);
        if !self.by_place {
            self.learn(way, new);
        }
        self.lots = self.lots.saturating_add(1);
        self.last = new;
        // All ways are tried in one kind of place at first, before others are told from it. And which kind it is, only what the
        // quickest way takes tells: what is tried may be many times slower.
        if !self.is_trial && !self.is_beginning() {
            self.here = Self::kind_at(new);
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
        smallest(&self.cost)
    }

    /// Lots until a way is to be tried again.
    fn wait_of(&self, way: usize) -> f32 {
        let quickest = self.quickest();
        if way == quickest {
            // As what follows would give it. Nearly every lot is one of these, and is spared the power of two.
            return LEAST_WAIT;
        }
        if self.cost[way] == f32::INFINITY {
            return f32::INFINITY;
        }
        let slower = (2.0 * (self.cost[way] - self.cost[quickest])).exp2() - 1.0;
        let known = (self.taken[way] as f32 / KNOWN_WELL).min(1.0);
        (LEAST_WAIT + WAIT * slower * known).min(MOST_WAIT)
    }
}

/// Logarithm (base 2) of the nanoseconds that each of some rays took.
pub fn cost_of(rays: usize, time: Duration) -> f32 {
    // Clocks may stand still over a short lot.
    ((time.as_nanos() as f32).max(1.0) / rays as f32).log2()
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
mod tests;
