//! Blocks that come before they are needed.
//!
//! Nobody pins them, so they are held together here instead: of those that came last, a window's length
//! ([`Plan::ahead`](super::plan::Plan::ahead), a small part of what sets hold) may be here unused, and what falls out
//! of the window goes if nobody has used it by then. That one cannot be read ahead of need is no error: who needs it
//! asks again, and is told why.

use super::blocks::Blocks;
use super::directory::Asked;
use super::stats::add;
use super::sync::{AtomicBool, AtomicU32, Mutex, MutexGuard, Ordering, PoisonError};
use std::collections::VecDeque;

/// What has come ahead of need, and whether that is worth while.
#[derive(Debug)]
pub struct Ahead {
    /// Blocks that came last and were not needed when they came, each once, oldest first.
    recent: Mutex<VecDeque<u32>>,
    /// How many.
    most: usize,
    /// Reads that had to be waited for in this frame so far, and in the one before.
    slow: AtomicU32,
    slow_before: AtomicU32,
    /// Whether a read ahead of need failed in this frame: then there are no more.
    failed: AtomicBool,
}

impl Ahead {
    /// For up to `most` blocks, beside those that are being read.
    pub fn new(most: usize) -> Self {
        Self {
            recent: Mutex::default(),
            most,
            slow: AtomicU32::new(0),
            slow_before: AtomicU32::new(0),
            failed: AtomicBool::new(false),
        }
    }

    /// Begins a frame.
    pub fn begin_frame(&self) {
        self.slow_before.store(self.slow.swap(0, Ordering::Relaxed), Ordering::Relaxed);
        self.failed.store(false, Ordering::Relaxed);
    }

    /// Takes note of a read that the system did not have in its own memory.
    pub fn was_slow(&self) {
        self.slow.fetch_add(1, Ordering::Relaxed);
    }

    /// Whether blocks may come ahead of need, and reads had to be waited for, in this frame or in the one before. What
    /// the system has in its own memory is copied by who needs it as quickly as by anybody else.
    pub fn pays(&self) -> bool {
        /// Fewer than these are soon read.
        const FEW: u32 = 16;
        let slow = |count: &AtomicU32| count.load(Ordering::Relaxed) >= FEW;
        self.most > 0 && (slow(&self.slow) || slow(&self.slow_before))
    }

    fn recent(&self) -> MutexGuard<'_, VecDeque<u32>> {
        self.recent.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes note of a block that has come; which one is to go that came long ago, if nobody has used it.
    fn came(&self, block: u32) -> Option<u32> {
        let mut recent = self.recent();
        // Beside a read, to look through the window is nothing.
        if let Some(at) = recent.iter().position(|&other| other == block) {
            recent.remove(at);
        }
        recent.push_back(block);
        if recent.len() > self.most { recent.pop_front() } else { None }
    }

    /// Forgets what came: none of it is here any more.
    pub fn clear(&self) {
        self.recent().clear();
    }
}

impl Blocks {
    /// Reads a block that nobody has asked for yet but who looks ahead; or does not, if it is here or on its way, or
    /// there is no room at once, or it cannot be read.
    pub fn load_ahead(&self, block: u32) {
        if self.has_failed() || self.ahead.failed.load(Ordering::Relaxed) {
            return;
        }
        let gone = &mut |gone| {
            add(&self.counters_of(gone).evictions, 1);
            self.let_go(gone);
        };
        if self.directory(block).ask(block, &self.words, &self.pins, gone) != Asked::Absent {
            return;
        }
        // From now on somebody may wait for it: he is told that it has come, or that it has not and he has to
        // ask once more.
        let came = self.is_kept(block) || self.try_room() && self.read_ahead(block);
        if !came {
            self.directory(block).failed(block);
            return;
        }
        if self.came_unasked(block)
            && let Some(old) = self.ahead.came(block)
        {
            let gone = &mut |gone| self.let_go(gone);
            self.directory(old).give_up_unused(old, &self.words, &self.pins, gone);
        }
    }

    /// Says that a block has come that nobody had asked for; whether nobody needs it yet.
    pub fn came_unasked(&self, block: u32) -> bool {
        // Before it is here: at no time are more used, or gone unused, than have come.
        add(&self.counters.prefetched, 1);
        self.directory(block).arrived_ahead(block, &self.words, &self.pins, self.tick())
    }

    /// Reads a block to its place, for which there is room; whether it could be read. If not, the room is given
    /// back, and no more are read in this frame.
    fn read_ahead(&self, block: u32) -> bool {
        let read = match self.read(block..block + 1, true) {
            Ok(false) => {
                self.ahead.was_slow();
                self.read(block..block + 1, false)
            }
            at_once => at_once,
        };
        let is_read = matches!(read, Ok(true));
        if !is_read {
            self.ahead.failed.store(true, Ordering::Relaxed);
            self.give_room();
        }
        is_read
    }
}

#[cfg(test)]
mod tests {
    use super::super::layout::{Array, Layout};
    use super::super::loaders::Loaders;
    use super::super::plan::{CacheOptions, Loading, Plan};
    use super::super::source::Source;
    use super::super::sync::Arc;
    use super::*;
    use crate::error::{Error, Result};
    use std::io;
    use std::sync::mpsc::{Receiver, Sender, channel};
    use std::thread;

    const BLOCK: usize = 4096;

    /// Blocks of ones. Each read begins by telling, and waits for word whether it is to work.
    #[derive(Debug)]
    struct Told {
        begins: Mutex<Sender<()>>,
        works: Mutex<Receiver<bool>>,
    }

    impl Source for Told {
        fn read(&self, _: Array, _: usize, into: &mut [u8]) -> Result<()> {
            self.begins.lock().expect("whole").send(()).expect("the test listens");
            if !self.works.lock().expect("whole").recv().expect("the test says") {
                let source = io::Error::other("the disk is gone");
                return Err(Error::Read { path: "scene.rpk".into(), source });
            }
            into.fill(1);
            Ok(())
        }
    }

    /// Twenty blocks of which `ahead` may be here that nobody has used, and those who have a part in their coming.
    struct Small {
        blocks: Arc<Blocks>,
        /// None: the test reads by itself.
        none: Loaders,
        begins: Receiver<()>,
        works: Sender<bool>,
    }

    impl Small {
        fn new(ahead: usize) -> Self {
            let options = CacheOptions { loading: Loading::Synchronous, ..CacheOptions::default() };
            let layout = Layout::new([0, 0, 0, 20 * BLOCK, 0, 0], BLOCK);
            let plan = Plan::new(&options, 60, 2, 1, 1).expect("enough");
            let ((tell, begins), (works, word)) = (channel(), channel());
            let source = Told { begins: Mutex::new(tell), works: Mutex::new(word) };
            // One of these would be on its way.
            let plan = Plan { ahead: ahead + 1, ..plan };
            let (blocks, none) = Blocks::new(layout, Box::new(source), &options, &plan, 1).expect("begins");
            Self { blocks, none, begins, works }
        }

        /// How many reads have begun since this was last asked.
        fn reads(&self) -> usize {
            self.begins.try_iter().count()
        }

        /// The next reads work, or do not.
        fn next(&self, words: &[bool]) {
            words.iter().for_each(|&word| self.works.send(word).expect("it is read"));
        }

        /// Needs a block; whether it is here then, and the error if there is one.
        fn need(&self, block: u32, aside: impl FnOnce()) -> (bool, Option<String>) {
            let gathered = self.blocks.gather(&self.none, &[block], aside).expect("there is no deadline");
            let is_here = self.blocks.words.is_here(block as usize);
            drop(gathered);
            (is_here, self.blocks.take_failure().map(|error| error.to_string()))
        }

        fn is_nothing(&self) -> bool {
            !self.blocks.has_failed() && self.blocks.committed_bytes()[0] == 0
        }
    }

    const GONE: &str = "cannot read scene.rpk: the disk is gone";

    #[test]
    fn what_cannot_be_read_ahead_of_need_is_no_error_until_it_is_needed() {
        let small = Small::new(4);
        small.next(&[false]);
        small.blocks.load_ahead(3);
        assert!(small.is_nothing() && !small.blocks.words.is_here(3));
        assert_eq!((small.reads(), small.blocks.take_stats().prefetched), (1, 0));
        // No more in this frame; in the next one, it is tried again.
        small.blocks.load_ahead(4);
        assert_eq!(small.reads(), 0);
        small.blocks.ahead.begin_frame();
        small.next(&[false]);
        small.blocks.load_ahead(4);
        assert!(small.reads() == 1 && small.is_nothing());
        // Now they are needed: one can be read again, the other cannot.
        small.next(&[true, false]);
        assert_eq!(small.need(3, || ()), (true, None));
        assert_eq!(small.need(4, || ()), (false, Some(GONE.into())));
        assert_eq!(small.reads(), 2);
    }

    #[test]
    fn who_waits_for_what_fails_ahead_of_need_asks_again() {
        for (words, expected, reads) in [
            (&[true][..], (true, None), 1),
            (&[false, true], (true, None), 2),
            (&[false, false], (false, Some(GONE.to_string())), 2),
        ] {
            let small = Small::new(4);
            thread::scope(|scope| {
                let blocks = &small.blocks;
                scope.spawn(move || blocks.load_ahead(3));
                small.begins.recv().expect("it begins to read");
                // It goes on when somebody has pinned the block and is about to wait for it.
                assert_eq!(small.need(3, || small.next(words)), expected);
            });
            assert_eq!(1 + small.reads(), reads);
            let stats = small.blocks.take_stats();
            let came = u64::from(words[0]);
            assert_eq!((stats.misses, stats.prefetched, stats.prefetched_used), (1, came, came));
        }
    }

    #[test]
    fn few_are_here_that_nobody_has_used() {
        let small = Small::new(4);
        small.next(&[true; 11]);
        let unused =
            || (0..20).filter(|&block| small.blocks.words.is_unused(block as usize)).collect::<Vec<u32>>();
        (0..6).for_each(|block| small.blocks.load_ahead(block));
        assert_eq!(unused(), [2, 3, 4, 5]);
        // What is used stays when its time is over; what is here is not read again.
        assert_eq!(small.need(2, || ()), (true, None));
        (2..9).for_each(|block| small.blocks.load_ahead(block));
        assert!(unused() == [5, 6, 7, 8] && small.blocks.words.is_here(2));
        let stats = small.blocks.take_stats();
        assert_eq!((stats.prefetched, stats.prefetched_used, stats.prefetched_unused), (9, 1, 4));
        assert_eq!((stats.misses, stats.evictions, small.reads()), (0, 0, 9));
        small.blocks.clear();
        assert!(small.is_nothing());
        [1, 8].into_iter().for_each(|block| small.blocks.load_ahead(block));
        assert_eq!(unused(), [1, 8], "what was there before has no part in it");
    }

    #[test]
    fn the_oldest_goes_for_the_next() {
        let ahead = Ahead::new(2);
        assert_eq!([5, 6, 7, 8].map(|block| ahead.came(block)), [None, None, Some(5), Some(6)]);
        assert_eq!([7, 9, 7].map(|block| ahead.came(block)), [None, Some(8), None], "7 came again");
        assert_eq!(Ahead::new(0).came(5), Some(5));
    }

    #[test]
    fn it_pays_where_reads_are_waited_for() {
        let ahead = Ahead::new(2);
        assert!(!ahead.pays());
        (0..16).for_each(|_| ahead.was_slow());
        assert!(ahead.pays());
        ahead.begin_frame();
        assert!(ahead.pays(), "in the frame before");
        ahead.begin_frame();
        assert!(!ahead.pays());
        let none = Ahead::new(0);
        (0..16).for_each(|_| none.was_slow());
        assert!(!none.pays());
    }
}
