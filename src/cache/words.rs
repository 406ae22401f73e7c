//! A word for each block: whether it is here, and when it was used.
//!
//! ```text
//!  31  30      24  23  22                                      0
//! +---+----------+---+-----------------------------------------+
//! | 1 | count    | 0 | tick of the last use                    |   here
//! | 1 | 0        | 1 | tick in which it came                   |   here, not used yet: it came ahead of need
//! | 0 | 0                                                      |   not here
//! +---+----------+---+-----------------------------------------+
//! ```
//!
//! To see that a block is here is one load. A use writes only if the block was not used in this tick before, or not at
//! all.

use super::policy::Use;
use super::sync::{AtomicBool, AtomicU32, AtomicU64, Mutex, Ordering, PoisonError};
use crossbeam::utils::CachePadded;

const HERE: u32 = 1 << 31;
const COUNT: u32 = 0x7f << 24;
const ONE: u32 = 1 << 24;
const UNUSED: u32 = 1 << 23;
const TICK: u32 = UNUSED - 1;

/// The words of all blocks.
#[derive(Debug)]
pub struct Words {
    words: Box<[AtomicU32]>,
    /// First uses in a tick, while they are noted down.
    trace: Mutex<Vec<u32>>,
    tracing: AtomicBool,
    /// First uses in a tick.
    uses: CachePadded<AtomicU64>,
    /// Blocks that came ahead of need: those that were used afterwards, and those that went unused.
    ahead: CachePadded<[AtomicU64; 2]>,
}

impl Words {
    /// No block is here.
    pub fn new(blocks: usize) -> Self {
        let words = (0..blocks).map(|_| AtomicU32::new(0)).collect();
        Self {
            words,
            trace: Mutex::default(),
            tracing: AtomicBool::new(false),
            uses: CachePadded::default(),
            ahead: CachePadded::default(),
        }
    }

    /// Memory of so many.
    pub const fn bytes(blocks: usize) -> usize {
        blocks * size_of::<AtomicU32>()
    }

    /// Uses a block in a tick, if it is here; whether it is.
    ///
    /// A true answer is good for as long as the reader stays in its [epoch](super::epoch).
    #[inline(always)]
    pub fn use_in(&self, block: usize, tick: u32) -> bool {
        // What the loader wrote before it said that the block is here is seen from now on.
        let word = self.words[block].load(Ordering::Acquire);
        // Of a block that nobody has used, this says no in every tick.
        word & !COUNT == HERE | (tick & TICK) || self.mark(block, word, tick)
    }

    /// Takes note of the first use in a tick.
    #[inline(never)]
    fn mark(&self, block: usize, mut word: u32, tick: u32) -> bool {
        // An exchange, so that a block that goes meanwhile is not called back.
        while word & HERE != 0 {
            let count = if word & COUNT == COUNT { COUNT } else { (word & COUNT) + ONE };
            let new = HERE | count | (tick & TICK);
            match self.words[block].compare_exchange_weak(word, new, Ordering::AcqRel, Ordering::Acquire) {
                Ok(_) => {
                    self.count_ahead(word, 0);
                    self.note(block);
                    return true;
                }
                Err(now) => word = now,
            }
        }
        false
    }

    fn note(&self, block: usize) {
        self.uses.fetch_add(1, Ordering::Relaxed);
        if self.tracing.load(Ordering::Relaxed) {
            self.trace.lock().unwrap_or_else(PoisonError::into_inner).push(block as u32);
        }
    }

    /// If a word is that of a block that nobody has used: counts it among those that were used now, or among those
    /// that went.
    fn count_ahead(&self, word: u32, gone: usize) {
        if word & UNUSED != 0 {
            self.ahead[gone].fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Uses a block that is pinned and came ahead of need, if nobody has used it yet.
    pub fn use_first(&self, block: usize, tick: u32) {
        if self.is_unused(block) {
            self.use_in(block, tick);
        }
    }

    /// First uses in a tick since the last call.
    pub fn take_uses(&self) -> u64 {
        self.uses.swap(0, Ordering::Relaxed)
    }

    /// Blocks that came ahead of need since the last call: those that were used, and those that went unused.
    pub fn take_ahead(&self) -> [u64; 2] {
        self.ahead.each_ref().map(|count| count.swap(0, Ordering::Relaxed))
    }

    /// Notes first uses in a tick down from now on, or no longer does.
    pub fn trace(&self, on: bool) {
        self.tracing.store(on, Ordering::Relaxed);
    }

    /// What was noted down since the last call, in about the order of use.
    pub fn take_trace(&self) -> Vec<u32> {
        std::mem::take(&mut *self.trace.lock().unwrap_or_else(PoisonError::into_inner))
    }

    /// Whether a block is here; no use.
    pub fn is_here(&self, block: usize) -> bool {
        self.words[block].load(Ordering::Acquire) & HERE != 0
    }

    /// Whether a block is here that came ahead of need and that nobody has used yet.
    pub fn is_unused(&self, block: usize) -> bool {
        self.words[block].load(Ordering::Acquire) & UNUSED != 0
    }

    /// How a block was used. That it came ahead of need counts as a use: policies are not to take it for one that
    /// nobody wants.
    pub fn uses(&self, block: usize) -> Use {
        let word = self.words[block].load(Ordering::Relaxed);
        Use { tick: word & TICK, count: ((word & COUNT) / ONE).max(word / HERE) }
    }

    /// Says that a block is here, used once; all that was written to it before is seen by who sees that.
    pub fn arrive(&self, block: usize, tick: u32) -> Use {
        self.words[block].store(HERE | ONE | (tick & TICK), Ordering::Release);
        self.note(block);
        Use { tick: tick & TICK, count: 1 }
    }

    /// Says that a block is here that somebody waits for, though it was to come ahead of need.
    pub fn arrive_used(&self, block: usize, tick: u32) -> Use {
        self.count_ahead(UNUSED, 0);
        self.arrive(block, tick)
    }

    /// Says that a block is here that nobody has used yet.
    pub fn arrive_ahead(&self, block: usize, tick: u32) -> Use {
        self.words[block].store(HERE | UNUSED | (tick & TICK), Ordering::Release);
        self.uses(block)
    }

    /// Says that a block is not here any more: its memory may go when all readers that are in an epoch now
    /// have left it.
    pub fn leave(&self, block: usize) {
        let word = self.words[block].swap(0, Ordering::SeqCst);
        self.count_ahead(word, 1);
    }

    /// The same of a block that came ahead of need, unless somebody has used it; whether it has left.
    pub fn leave_unused(&self, block: usize) -> bool {
        let word = self.words[block].load(Ordering::Acquire);
        // An exchange, so that a use at the same moment is either seen or finds nothing.
        let has_left = word & UNUSED != 0
            && self.words[block].compare_exchange(word, 0, Ordering::SeqCst, Ordering::Relaxed).is_ok();
        if has_left {
            self.count_ahead(word, 1);
        }
        has_left
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn uses_are_counted_by_tick() {
        let words = Words::new(2);
        assert!(!words.use_in(1, 7));
        words.arrive(1, 7);
        assert_eq!(words.uses(1), Use { tick: 7, count: 1 });
        assert!(words.use_in(1, 7) && words.use_in(1, 7));
        assert_eq!(words.uses(1), Use { tick: 7, count: 1 });
        assert!(words.use_in(1, 9));
        assert_eq!(words.uses(1), Use { tick: 9, count: 2 });
        (0..300).for_each(|tick| assert!(words.use_in(1, tick)));
        assert_eq!(words.uses(1), Use { tick: 299, count: 127 });
        assert!(!words.is_here(0) && words.is_here(1));
        words.trace(true);
        assert!(words.use_in(1, 300) && words.use_in(1, 300) && !words.use_in(0, 300));
        words.arrive(0, 301);
        words.trace(false);
        assert!(words.use_in(1, 301));
        assert_eq!((words.take_trace(), words.take_trace()), (vec![1, 0], vec![]));
        words.leave(1);
        assert!(!words.use_in(1, 299));
        assert_eq!(words.uses(1), Use::default());
    }

    #[test]
    fn what_came_ahead_of_need_is_used_or_not() {
        let words = Words::new(5);
        for block in 0..4 {
            assert_eq!(words.arrive_ahead(block, 0), Use { tick: 0, count: 1 });
            assert!(words.is_here(block));
        }
        assert_eq!((words.take_uses(), words.take_ahead()), (0, [0, 0]));
        // Used in the tick in which it came, once; used by who pins it; gone unused, in both ways; used at once.
        assert!(words.use_in(0, 0) && words.use_in(0, 0) && words.use_in(0, 1));
        words.use_first(1, 0);
        words.use_first(1, 1);
        assert!(!words.leave_unused(0) && !words.leave_unused(1) && words.leave_unused(2));
        assert!(!words.leave_unused(2) && !words.is_here(2));
        words.leave(3);
        words.arrive_used(4, 0);
        assert_eq!((words.take_uses(), words.take_ahead()), (4, [3, 2]));
        assert_eq!(words.uses(1), Use { tick: 0, count: 1 });
        (0..5).for_each(|block| words.leave(block));
        assert_eq!(words.take_ahead(), [0, 0]);
    }

    #[test]
    fn a_use_that_began_in_any_tick_is_the_first_one() {
        let words = Words::new(1);
        for tick in [0, 1, 6, 7, 8, TICK] {
            words.arrive_ahead(0, 7);
            assert!(words.use_in(0, tick) && !words.is_unused(0), "{tick}");
            words.leave(0);
        }
        assert_eq!((words.take_uses(), words.take_ahead()), (6, [6, 0]));
    }
}
