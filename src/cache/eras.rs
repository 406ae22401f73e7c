//! How long it holds that a thread has seen a list whole.
//!
//! To look at a list is to mark the words of all its blocks with a tick: see [`words`](super::words). What was seen so is
//! kept in mind ([`known`](super::known)) and holds for an *era*: as long as nothing went that might be part of it. Most of
//! what goes is not: nobody has used it for long, or it would not have been chosen. So an era has a first tick, in which or
//! after which all was marked that is known in it, and
//!
//! - a block that was last used before that tick is in nobody's mind, and goes without a word;
//! - one that was used since ends the era (1) before its epoch ends;
//! - to begin the era anew at a later tick (2) makes all of the first kind that was not used since that one.
//!
//! ```text
//! who looks                            who gives a block up
//!   enters an epoch                      word = gone; it said: last used in w
//!   which era, since when?    (3)        w before the era's first tick?  no: ends += 1    (1)
//!   marks words with its tick            ends the epoch, frees when nobody reads          (4)
//!   keeps in mind
//! ```
//!
//! **Why it holds.** Somebody enters an epoch after (4), where the memory may be another block's. He sees whatever the other
//! one had seen or done before that. Did that one end the era, it is another. Did he not, then the era that he saw began
//! after the block's last use. Ticks of words only go forward as long as a block is here, so whoever had seen the block
//! whole did so in an era that began no later than that use; and as eras' first ticks only go forward too, this one is
//! another.
//!
//! So who keeps something in mind must have marked it in a tick that is not before the first of his era.

use super::sync::{AtomicBool, AtomicU32, AtomicU64, Ordering};

/// Ticks come again after so many.
pub const TICKS: u32 = 1 << 23;

/// Whether a tick is before another: ticks that are further from one another than half of all are taken to be the other way
/// round.
#[inline(always)]
pub const fn is_before(tick: u32, other: u32) -> bool {
    tick.wrapping_sub(other) & (TICKS - 1) >= TICKS / 2
}

/// An era: how many blocks have ended one so far, and its first tick.
pub type Era = (u64, u32);

/// The era of now.
#[derive(Debug, Default)]
pub struct Eras {
    ends: AtomicU64,
    since: AtomicU32,
    /// Whether one has ended since somebody last asked.
    has_ended: AtomicBool,
}

impl Eras {
    /// The era of now, for who has entered an [epoch](super::epoch).
    #[inline(always)]
    pub fn now(&self) -> Era {
        (self.ends.load(Ordering::Acquire), self.since.load(Ordering::Acquire))
    }

    /// A block has been declared gone that was last used in this tick.
    pub fn gone(&self, last_use: u32) {
        if !is_before(last_use, self.since.load(Ordering::Acquire)) {
            self.ends.fetch_add(1, Ordering::AcqRel);
            self.has_ended.store(true, Ordering::Relaxed);
        }
    }

    /// Whether one has ended since the last call.
    pub fn take_end(&self) -> bool {
        self.has_ended.load(Ordering::Relaxed) && self.has_ended.swap(false, Ordering::Relaxed)
    }

    /// Begins an era anew with this tick, unless it has begun since.
    pub fn begin(&self, tick: u32) {
        let later = |since| is_before(since, tick).then_some(tick);
        let _ = self.since.fetch_update(Ordering::AcqRel, Ordering::Acquire, later);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ticks_go_round() {
        for (tick, other) in [(0, 1), (7, 9), (TICKS - 1, 0), (TICKS - 5, 5), (0, TICKS / 2), (TICKS + 1, 2)]
        {
            assert!(is_before(tick, other), "{tick} {other}");
            assert!(!is_before(tick, tick));
        }
        for (tick, other) in [(1, 0), (0, TICKS - 1), (5, TICKS - 5), (3, 2 + TICKS)] {
            assert!(!is_before(tick, other), "{tick} {other}");
        }
    }

    #[test]
    fn what_was_used_before_an_era_does_not_end_it() {
        let eras = Eras::default();
        let first = eras.now();
        eras.gone(0);
        let second = eras.now();
        assert!(first != second && eras.take_end() && !eras.take_end());
        eras.begin(7);
        let third = eras.now();
        assert!(second != third && !eras.take_end());
        eras.gone(6);
        assert_eq!(eras.now(), third);
        eras.begin(5);
        assert_eq!(eras.now(), third, "it has begun since");
        for last_use in [7, 8] {
            let before = eras.now();
            eras.gone(last_use);
            assert!(eras.now() != before && eras.take_end(), "{last_use}");
        }
    }
}
