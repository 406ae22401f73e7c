//! What shading does for effects that cast no rays: counted always, timed for a few hits.
//!
//! A clock costs as much as most of what there is to time. So shading is compiled twice: once with a meter that
//! only counts, and once with one that reads the clock too. A short run of hits in each [`PERIOD`] goes to the second; the
//! others never see a clock, nor ask whether there is one. The time of a use that was timed stands for all others.

use super::cost::Uses;
use crate::scene::effects::Effect;
use std::time::{Duration, Instant};

/// Watches over shading.
pub trait Meter {
    /// What is noted from here on belongs to a pixel of the square.
    fn begin(&mut self, pixel: u16);

    /// An effect was used so many times.
    fn note(&mut self, effect: Effect, uses: u32);

    /// Does what an effect is for.
    fn time<T>(&mut self, effect: Effect, work: impl FnOnce() -> T) -> T;

    /// Does it and notes one use.
    #[inline]
    fn measure<T>(&mut self, effect: Effect, work: impl FnOnce() -> T) -> T {
        self.note(effect, 1);
        self.time(effect, work)
    }
}

/// Counts.
pub struct Counting<'a>(pub &'a mut Uses);

impl Meter for Counting<'_> {
    #[inline]
    fn begin(&mut self, _: u16) {}

    #[inline]
    fn note(&mut self, effect: Effect, uses: u32) {
        self.0[effect].uses += u64::from(uses);
    }

    #[inline]
    fn time<T>(&mut self, _: Effect, work: impl FnOnce() -> T) -> T {
        work()
    }
}

/// Counts and times, and lists the uses by pixel if they are wanted.
pub struct Timing<'a> {
    uses: &'a mut Uses,
    clock: Clock,
    list: Option<&'a mut Vec<(u16, Effect)>>,
    pixel: u16,
}

impl<'a> Timing<'a> {
    pub fn new(uses: &'a mut Uses, clock: Clock, list: Option<&'a mut Vec<(u16, Effect)>>) -> Self {
        Self { uses, clock, list, pixel: 0 }
    }
}

impl Meter for Timing<'_> {
    fn begin(&mut self, pixel: u16) {
        self.pixel = pixel;
    }

    fn note(&mut self, effect: Effect, uses: u32) {
        self.uses[effect].uses += u64::from(uses);
        self.uses[effect].timed += u64::from(uses);
        if let Some(list) = &mut self.list {
            list.extend((0..uses).map(|_| (self.pixel, effect)));
        }
    }

    fn time<T>(&mut self, effect: Effect, work: impl FnOnce() -> T) -> T {
        let (result, time) = self.clock.time(work);
        self.uses[effect].time += time;
        result
    }
}

/// A clock that knows what it costs to read it.
#[derive(Clone, Copy, Debug, Default)]
pub struct Clock {
    cost: Duration,
}

/// No use takes this long: whoever did that was interrupted.
const INTERRUPTED: Duration = Duration::from_micros(20);

impl Clock {
    /// Reads it some times with nothing in between.
    pub fn calibrated() -> Self {
        let mut costs = [(); 31].map(|()| Instant::now().elapsed());
        costs.sort_unstable();
        Self { cost: costs[costs.len() / 2] }
    }

    #[inline]
    fn time<T>(self, work: impl FnOnce() -> T) -> (T, Duration) {
        let start = Instant::now();
        let result = work();
        let time = start.elapsed().saturating_sub(self.cost);
        (result, time.min(INTERRUPTED))
    }
}

/// Hits that are timed one after the other: the first pays for code that has left the caches, the others do not.
const RUN: usize = 8;

/// One run in so many hits. A prime: whatever repeats in a picture, runs come by at all of its places.
const PERIOD: usize = 509;

/// Says which hits are timed, in the order in which a worker shades them.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pace {
    at: usize,
}

impl Pace {
    /// How many of the next hits, `most` at most, go together, and whether they are timed.
    pub fn next(&mut self, most: usize) -> (usize, bool) {
        let is_timed = self.at < RUN;
        let left = if is_timed { RUN - self.at } else { PERIOD - self.at };
        let count = most.min(left);
        self.at = (self.at + count) % PERIOD;
        (count, is_timed)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_hits_in_each_period_is_timed() {
        let mut pace = Pace::default();
        let mut timed = Vec::new();
        let mut hit = 0;
        // Lots of all sizes.
        for lot in (0..=256).cycle().take(600) {
            let mut left = lot;
            while left > 0 {
                let (count, is_timed) = pace.next(left);
                timed.extend((hit..hit + count).filter(|_| is_timed));
                (hit, left) = (hit + count, left - count);
            }
        }
        assert!(timed.iter().all(|hit| hit % PERIOD < RUN));
        assert!((hit / PERIOD * RUN..=hit.div_ceil(PERIOD) * RUN).contains(&timed.len()), "{hit}");
    }

    #[test]
    fn both_meters_count_alike_and_one_lists() {
        let (mut counted, mut timed, mut list) = (Uses::default(), Uses::default(), Vec::new());
        fn shade(meter: &mut impl Meter) -> u32 {
            meter.begin(7);
            meter.note(Effect::Textures, 2);
            meter.note(Effect::Bump, 0);
            meter.measure(Effect::Fresnel, || 5)
        }
        assert_eq!(shade(&mut Counting(&mut counted)), 5);
        assert_eq!(shade(&mut Timing::new(&mut timed, Clock::calibrated(), Some(&mut list))), 5);
        for &effect in Effect::ALL {
            assert_eq!(counted[effect].uses, timed[effect].uses);
            assert_eq!((counted[effect].timed, timed[effect].timed), (0, timed[effect].uses));
        }
        assert_eq!(list, [(7, Effect::Textures), (7, Effect::Textures), (7, Effect::Fresnel)]);
    }
}
