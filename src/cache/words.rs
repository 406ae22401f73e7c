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

use super::eras::{Eras, TICKS, is_before};
use super::policy::Use;
use super::stats::PARTS;
use super::sync::{AtomicBool, AtomicU32, AtomicU64, Mutex, MutexGuard, Ordering, PoisonError};
use crossbeam::utils::CachePadded;
use std::cell::{Cell, RefCell};

const HERE: u32 = 1 << 31;
const COUNT: u32 = 0x7f << 24;
const ONE: u32 = 1 << 24;
const UNUSED: u32 = 1 << 23;
const TICK: u32 = UNUSED - 1;
const _: () = assert!(TICK == TICKS - 1);

/// Counters of uses.
const COUNTERS: usize = 16;

/// The words of all blocks.
#[derive(Debug)]
pub struct Words {
    words: Box<[AtomicU32]>,
    /// First uses in a tick, while they are noted down.
    trace: Mutex<Vec<u32>>,
    tracing: AtomicBool,
    /// Whether that is all of them, and not only each block's first one since it came.
    tracing_all: AtomicBool,
    /// First uses in a tick of nodes and of what leaves need, by threads and loaders: those that count at the same time do
    /// not wait for one another.
    uses: [CachePadded<[AtomicU64; PARTS]>; COUNTERS],
    /// The first block of what leaves need.
    first_of_leaves: usize,
    /// Blocks that came ahead of need: those that were used afterwards, and those that went unused.
    ahead: CachePadded<[AtomicU64; 2]>,
    /// How long it holds that a thread has seen something.
    pub eras: CachePadded<Eras>,
}

/// First uses in a tick that one thread has made and not yet [handed over](Words::hand_over): a square's, or a query's. To
/// count and to write down each at once would have threads wait for one another.
#[derive(Debug, Default)]
pub struct Notes {
    uses: [Cell<u64>; PARTS],
    trace: RefCell<Vec<u32>>,
}

/// Whether a word says that its block is here and was used in a tick.
#[inline(always)]
const fn was_used(word: u32, tick: u32) -> bool {
    word & !COUNT == HERE | (tick & TICK)
}

impl Words {
    /// No block is here. From `first_of_leaves` on, they are of what leaves need.
    pub fn new(blocks: usize, first_of_leaves: usize) -> Self {
        let words = (0..blocks).map(|_| AtomicU32::new(0)).collect();
        Self {
            words,
            trace: Mutex::default(),
            tracing: AtomicBool::new(false),
            tracing_all: AtomicBool::new(false),
            uses: Default::default(),
            first_of_leaves,
            ahead: CachePadded::default(),
            eras: CachePadded::default(),
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
    pub fn use_in(&self, block: usize, tick: u32, notes: &Notes) -> bool {
        // What the loader wrote before it said that the block is here is seen from now on.
        let word = self.words[block].load(Ordering::Acquire);
        // Of a block that nobody has used, this says no in every tick.
        was_used(word, tick) || self.mark(block, word, tick, notes)
    }

    /// Whether a block is here that was used in a tick before: as [`use_in`](Self::use_in), without a first use.
    #[inline(always)]
    pub fn was_used_in(&self, block: usize, tick: u32) -> bool {
        was_used(self.words[block].load(Ordering::Acquire), tick)
    }

    /// Takes note of the first use in a tick. A use in an earlier tick than the last one was is the same use.
    #[inline(never)]
    fn mark(&self, block: usize, mut word: u32, tick: u32, notes: &Notes) -> bool {
        // An exchange, so that a block that goes meanwhile is not called back.
        while word & HERE != 0 {
            let is_past = is_before(tick, word);
            if is_past && word & UNUSED == 0 {
                return true;
            }
            let count = if word & COUNT == COUNT { COUNT } else { (word & COUNT) + ONE };
            // Ticks only go forward: eras rely on it.
            let new = HERE | count | (if is_past { word } else { tick } & TICK);
            match self.words[block].compare_exchange_weak(word, new, Ordering::AcqRel, Ordering::Acquire) {
                Ok(_) => {
                    self.count_ahead(word, 0);
                    let uses = &notes.uses[self.part(block)];
                    uses.set(uses.get() + 1);
                    if self.is_traced(word & UNUSED != 0) {
                        notes.trace.borrow_mut().push(block as u32);
                    }
                    return true;
                }
                Err(now) => word = now,
            }
        }
        false
    }

    /// Which part a block is of: see [`Layout::part`](super::layout::Layout::part).
    fn part(&self, block: usize) -> usize {
        usize::from(block >= self.first_of_leaves)
    }

    /// Whether a use is written down, which may be a block's first one since it came.
    fn is_traced(&self, is_first: bool) -> bool {
        self.is_tracing_all() || is_first && self.is_tracing()
    }

    /// Takes over what a thread has noted, with so many first uses more, which were of lists that are known to be here.
    /// Threads with other numbers do not wait for this one.
    pub fn hand_over(&self, notes: &Notes, more: u64, thread: usize) {
        let [nodes, leaves] = notes.uses.each_ref().map(Cell::take);
        // Lists are what leaves need.
        for (count, uses) in self.uses[thread % COUNTERS].iter().zip([nodes, leaves + more]) {
            if uses > 0 {
                count.fetch_add(uses, Ordering::Relaxed);
            }
        }
        let mut trace = notes.trace.borrow_mut();
        if !trace.is_empty() {
            self.trace().append(&mut trace);
        }
    }

    fn trace(&self) -> MutexGuard<'_, Vec<u32>> {
        self.trace.lock().unwrap_or_else(PoisonError::into_inner)
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
            let notes = Notes::default();
            self.use_in(block, tick, &notes);
            self.hand_over(&notes, 0, block);
        }
    }

    /// Whether all first uses in a tick are being noted down.
    fn is_tracing_all(&self) -> bool {
        self.tracing_all.load(Ordering::Relaxed)
    }

    /// Whether any uses are being noted down.
    pub fn is_tracing(&self) -> bool {
        self.tracing.load(Ordering::Relaxed)
    }

    /// First uses in a tick since the last call, of nodes and of what leaves need.
    pub fn take_uses(&self) -> [u64; PARTS] {
        let mut sums = [0; PARTS];
        for uses in &self.uses {
            sums.iter_mut().zip(uses.iter()).for_each(|(sum, uses)| *sum += uses.swap(0, Ordering::Relaxed));
        }
        sums
    }

    /// Blocks that came ahead of need since the last call: those that were used, and those that went unused.
    pub fn take_ahead(&self) -> [u64; 2] {
        self.ahead.each_ref().map(|count| count.swap(0, Ordering::Relaxed))
    }

    /// Notes first uses in a tick down from now on, or no longer does; unless `all`, only each block's first one since
    /// it came.
    pub fn trace_uses(&self, on: bool, all: bool) {
        self.tracing.store(on, Ordering::Relaxed);
        self.tracing_all.store(on && all, Ordering::Relaxed);
    }

    /// What was noted down since the last call, in about the order of use.
    pub fn take_trace(&self) -> Vec<u32> {
        std::mem::take(&mut *self.trace())
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
        self.uses[block % COUNTERS][self.part(block)].fetch_add(1, Ordering::Relaxed);
        if self.is_traced(true) {
            self.trace().push(block as u32);
        }
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
        if word & UNUSED == 0 {
            self.eras.gone(word & TICK);
        }
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

    /// Words of blocks that are all of what leaves need but for the first.
    fn words(blocks: usize) -> Words {
        Words::new(blocks, 1)
    }

    /// First uses since the last call.
    fn take_uses(words: &Words) -> u64 {
        words.take_uses().iter().sum()
    }

    /// A use that is handed over at once.
    fn use_in(words: &Words, block: usize, tick: u32) -> bool {
        let notes = Notes::default();
        let is_here = words.use_in(block, tick, &notes);
        words.hand_over(&notes, 0, 0);
        is_here
    }

    #[test]
    fn uses_are_counted_by_tick() {
        let words = words(2);
        assert!(!use_in(&words, 1, 7));
        words.arrive(1, 7);
        assert_eq!(words.uses(1), Use { tick: 7, count: 1 });
        assert!(use_in(&words, 1, 7) && use_in(&words, 1, 7));
        assert_eq!(words.uses(1), Use { tick: 7, count: 1 });
        assert!(use_in(&words, 1, 9));
        assert_eq!(words.uses(1), Use { tick: 9, count: 2 });
        (0..300).for_each(|tick| assert!(use_in(&words, 1, tick)));
        assert_eq!(words.uses(1), Use { tick: 299, count: 127 });
        assert!(!words.is_here(0) && words.is_here(1));
        words.trace_uses(true, true);
        assert!(use_in(&words, 1, 300) && use_in(&words, 1, 300) && !use_in(&words, 0, 300));
        words.arrive(0, 301);
        words.trace_uses(false, false);
        assert!(use_in(&words, 1, 301));
        assert_eq!((words.take_trace(), words.take_trace()), (vec![1, 0], vec![]));
        words.leave(1);
        assert!(!use_in(&words, 1, 299));
        assert_eq!(words.uses(1), Use::default());
    }

    #[test]
    fn first_uses_alone_are_written_down_where_that_will_do() {
        let words = words(2);
        words.trace_uses(true, false);
        assert!(!words.is_tracing_all());
        words.arrive(0, 1);
        words.arrive_ahead(1, 1);
        assert!((2..5).all(|tick| use_in(&words, 0, tick) && use_in(&words, 1, tick)));
        assert_eq!((words.take_trace(), take_uses(&words)), (vec![0, 1], 7));
        words.trace_uses(true, true);
        assert!(words.is_tracing_all() && use_in(&words, 1, 5));
        words.trace_uses(false, true);
        assert!(!words.is_tracing_all() && use_in(&words, 1, 6));
        assert_eq!(words.take_trace(), [1]);
    }

    #[test]
    fn a_thread_s_notes_are_its_own_until_it_hands_them_over() {
        let (words, notes) = (words(3), [(); 2].map(|()| Notes::default()));
        words.trace_uses(true, true);
        for block in 0..3 {
            words.arrive(block, 0);
        }
        assert_eq!((words.take_trace(), take_uses(&words)), (vec![0, 1, 2], 3));
        assert!(
            words.use_in(2, 1, &notes[0]) && words.use_in(1, 1, &notes[1]) && words.use_in(0, 1, &notes[0])
        );
        assert_eq!((words.take_trace(), take_uses(&words)), (vec![], 0));
        words.hand_over(&notes[0], 7, 1);
        assert_eq!((words.take_trace(), take_uses(&words)), (vec![2, 0], 9));
        words.hand_over(&notes[0], 0, 1);
        words.hand_over(&notes[1], 0, 0);
        assert_eq!((words.take_trace(), take_uses(&words)), (vec![1], 1));
    }

    #[test]
    fn uses_of_nodes_and_of_what_leaves_need_are_counted_apart() {
        let (words, notes) = (words(3), Notes::default());
        words.arrive(0, 0);
        words.arrive_ahead(1, 0);
        words.arrive(2, 0);
        assert_eq!(words.take_uses(), [1, 1]);
        assert!(words.use_in(0, 1, &notes) && words.use_in(0, 2, &notes) && words.use_in(1, 2, &notes));
        words.hand_over(&notes, 5, 0);
        assert_eq!((words.take_uses(), words.take_uses()), ([2, 6], [0, 0]));
    }

    #[test]
    fn what_came_ahead_of_need_is_used_or_not() {
        let words = words(5);
        for block in 0..4 {
            assert_eq!(words.arrive_ahead(block, 0), Use { tick: 0, count: 1 });
            assert!(words.is_here(block));
        }
        assert_eq!((take_uses(&words), words.take_ahead()), (0, [0, 0]));
        // Used in the tick in which it came, once; used by who pins it; gone unused, in both ways; used at once.
        assert!(use_in(&words, 0, 0) && use_in(&words, 0, 0) && use_in(&words, 0, 1));
        words.use_first(1, 0);
        words.use_first(1, 1);
        assert!(!words.leave_unused(0) && !words.leave_unused(1) && words.leave_unused(2));
        assert!(!words.leave_unused(2) && !words.is_here(2));
        words.leave(3);
        words.arrive_used(4, 0);
        assert_eq!((take_uses(&words), words.take_ahead()), (4, [3, 2]));
        assert_eq!(words.uses(1), Use { tick: 0, count: 1 });
        (0..5).for_each(|block| words.leave(block));
        assert_eq!(words.take_ahead(), [0, 0]);
    }

    #[test]
    fn ticks_go_forward_as_long_as_a_block_is_here() {
        let words = words(1);
        words.arrive(0, 7);
        for (tick, last) in [(6, 7), (7, 7), (9, 9), (8, 9), (TICK, 9), (9, 9)] {
            assert!(use_in(&words, 0, tick));
            assert_eq!(words.uses(0).tick, last, "{tick}");
        }
        assert_eq!((words.uses(0).count, take_uses(&words)), (2, 2));
    }

    #[test]
    fn what_goes_ends_what_was_seen_of_it() {
        let words = words(3);
        words.eras.begin(5);
        words.arrive(0, 4);
        words.arrive(1, 4);
        words.arrive_ahead(2, 6);
        let era = words.eras.now();
        words.leave(0);
        assert_eq!(words.eras.now(), era, "not since the era began");
        words.leave(2);
        words.arrive_ahead(2, 6);
        assert!(words.leave_unused(2));
        assert_eq!(words.eras.now(), era, "never");
        assert!(use_in(&words, 1, 5));
        words.leave(1);
        assert_ne!(words.eras.now(), era);
    }

    #[test]
    fn a_use_that_began_in_any_tick_is_the_first_one() {
        let words = words(1);
        for tick in [0, 1, 6, 7, 8, TICK] {
            words.arrive_ahead(0, 7);
            assert!(use_in(&words, 0, tick) && !words.is_unused(0), "{tick}");
            words.leave(0);
        }
        assert_eq!((take_uses(&words), words.take_ahead()), (6, [6, 0]));
    }
}
