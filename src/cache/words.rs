//! A word for each block: whether it is here, and when it was used.
//!
//! ```text
//!  31  30      24 23                                          0
//! +---+----------+---------------------------------------------+
//! | 1 | count    | tick of the last use                        |   here
//! | 0 | 0                                                      |   not here
//! +---+----------+---------------------------------------------+
//! ```
//!
//! To see that a block is here is one load. A use writes only if the block was not used in this tick before.

use super::policy::Use;
use super::sync::{AtomicBool, AtomicU32, AtomicU64, Mutex, Ordering, PoisonError};
use crossbeam::utils::CachePadded;

const HERE: u32 = 1 << 31;
const COUNT: u32 = 0x7f << 24;
const ONE: u32 = 1 << 24;
const TICK: u32 = ONE - 1;

/// The words of all blocks.
#[derive(Debug)]
pub struct Words {
    words: Box<[AtomicU32]>,
    /// First uses in a tick, while they are noted down.
    trace: Mutex<Vec<u32>>,
    tracing: AtomicBool,
    /// First uses in a tick.
    uses: CachePadded<AtomicU64>,
}

impl Words {
    /// No block is here.
    pub fn new(blocks: usize) -> Self {
        let words = (0..blocks).map(|_| AtomicU32::new(0)).collect();
        Self { words, trace: Mutex::default(), tracing: AtomicBool::new(false), uses: CachePadded::default() }
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

    /// First uses in a tick since the last call.
    pub fn take_uses(&self) -> u64 {
        self.uses.swap(0, Ordering::Relaxed)
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

    /// How a block was used.
    pub fn uses(&self, block: usize) -> Use {
        let word = self.words[block].load(Ordering::Relaxed);
        Use { tick: word & TICK, count: (word & COUNT) / ONE }
    }

    /// Says that a block is here, used once; all that was written to it before is seen by who sees that.
    pub fn arrive(&self, block: usize, tick: u32) -> Use {
        self.words[block].store(HERE | ONE | (tick & TICK), Ordering::Release);
        self.note(block);
        Use { tick: tick & TICK, count: 1 }
    }

    /// Says that a block is not here any more: its memory may go when all readers that are in an epoch now
    /// have left it.
    pub fn leave(&self, block: usize) {
        self.words[block].store(0, Ordering::SeqCst);
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
}
