//! Blocks that come and go.
//!
//! This is where the parts meet: a thread that misses pins what it needs and asks the directory; what is
//! absent is read by itself or by a loader; what had to go is retired, and freed when nobody can be reading
//! it any more.

use super::ahead::Ahead;
use super::arena::Arena;
use super::deadline::Deadline;
use super::directory::{Asked, Directory, Pins};
use super::epoch::Epochs;
use super::gate::Gate;
use super::layout::Layout;
use super::loaders::Loaders;
use super::plan::{CacheOptions, Loading, Plan, Prefetch};
use super::quota::Quota;
use super::source::Source;
use super::stats::{CacheStats, Counters, add, nanos};
use super::sync::thread;
use super::sync::{Arc, AtomicBool, AtomicU32, AtomicUsize, Mutex, MutexGuard, Ordering, PoisonError};
use super::words::Words;
use crate::error::Error;
use std::collections::VecDeque;
use std::ops::Range;
use std::time::{Duration, Instant};

/// The most threads that may read at a time.
const READERS: usize = 4096;

/// What lengths of reads are multiples of: what checksums are for.
const READ: usize = 4096;

/// Squares of a picture that a tick is long. Every block's first use in a tick is written down, and lists are looked at
/// anew ([`known`](super::known)): with a tick of one square, a view of which all was in memory ran at 0.58 to 0.67 of the
/// resident scene's speed, with 16 at 0.83, with this at 0.87; where blocks had to go, it made no difference.
const SESSIONS_PER_TICK: u32 = 64;

/// All blocks of a scene, and those of them that are here.
#[derive(Debug)]
pub struct Blocks {
    pub layout: Layout,
    pub arena: Arena,
    pub words: Words,
    pub epochs: Arc<Epochs>,
    /// For threads that are at work: none, if each waits at its own place.
    pub gate: Option<Gate>,
    /// Sessions so far: see [`tick`](Self::tick).
    pub sessions: AtomicU32,
    pub counters: Counters,
    pub pins: Pins,
    /// What came ahead of need.
    pub ahead: Ahead,
    /// Whether blocks come with those that lie beside them.
    pub brings_others: bool,
    quota: Quota,
    directories: [Option<Directory>; 2],
    source: Box<dyn Source>,
    /// Blocks given up, with the epoch that they are retired at, oldest first.
    retired: Mutex<VecDeque<(u64, u32)>>,
    /// Blocks that have memory, or are about to: at most `limit`.
    committed: AtomicUsize,
    limit: usize,
    most_committed: AtomicUsize,
    /// Blocks that had to go since this was last cleared.
    pub gone: AtomicU32,
    /// How often a thread has waited since this was last cleared.
    pub waits: AtomicU32,
    /// When threads stop waiting.
    pub deadline: Deadline,
    failure: Mutex<Option<Error>>,
    failed: AtomicBool,
}

/// Blocks were not here when the time was over.
#[derive(Debug)]
pub struct Late;

impl Blocks {
    /// No block is here.
    ///
    /// # Errors
    /// The system has no address space or starts no threads.
    pub fn new(
        layout: Layout,
        source: Box<dyn Source>,
        options: &CacheOptions,
        plan: &Plan,
        threads: usize,
    ) -> std::io::Result<(Arc<Self>, Loaders)> {
        let count = layout.blocks();
        // Some loaders stay free for what is needed, and no more is read at a time than may be here.
        let loaders = options.loading.loaders();
        let ahead = (loaders / 2).max(1).min(plan.ahead / 2);
        let gate = matches!(options.loading, Loading::Asynchronous { .. }).then(|| Gate::new(threads));
        let blocks = Arc::new(Self {
            arena: Arena::new(count << layout.shift())?,
            words: Words::new(count),
            epochs: Epochs::new(READERS),
            gate,
            sessions: AtomicU32::new(0),
            counters: Counters::default(),
            pins: Pins::new(count),
            ahead: Ahead::new(plan.ahead - ahead),
            brings_others: options.prefetch == Prefetch::Beside,
            quota: Quota::new(plan.pinned),
            directories: plan.shapes.map(|shape| shape.map(Directory::new)),
            source,
            retired: Mutex::default(),
            committed: AtomicUsize::new(0),
            limit: plan.all,
            most_committed: AtomicUsize::new(0),
            gone: AtomicU32::new(0),
            waits: AtomicU32::new(0),
            deadline: Deadline::default(),
            failure: Mutex::default(),
            failed: AtomicBool::new(false),
            layout,
        });
        let loaders = Loaders::new(&blocks, loaders, ahead)?;
        Ok((blocks, loaders))
    }

    /// What tells uses apart: a use in the same tick is the same use.
    pub fn tick(&self) -> u32 {
        self.sessions.load(Ordering::Relaxed) / SESSIONS_PER_TICK
    }

    /// Memory that is taken for `count` blocks beside their own.
    pub fn overhead(count: usize) -> usize {
        // Sets, their policies and hash tables come to some 64 bytes for a block that is here; few are.
        Words::bytes(count) + Pins::bytes(count) + READERS * 128
    }

    pub fn directory(&self, block: u32) -> &Directory {
        let second = block as usize >= self.layout.first_of_leaves();
        let [first, other] = &self.directories;
        other.as_ref().filter(|_| second).or(first.as_ref()).expect("there is a first directory")
    }

    /// Pins blocks and has all of them come. The caller must be in no epoch.
    ///
    /// `aside` is called before anything is waited for that another thread may have to have a place at the
    /// gate for: the caller must have none then.
    ///
    /// # Errors
    /// The deadline has passed. What was asked for still comes.
    pub fn gather(
        &self,
        loaders: &Loaders,
        wanted: &[u32],
        aside: impl FnOnce(),
    ) -> Result<Gathered<'_>, Late> {
        if self.deadline.has_passed() {
            return Err(Late);
        }
        let mut aside = Some(aside);
        let mut step_aside = || {
            if let Some(aside) = aside.take() {
                self.waits.fetch_add(1, Ordering::Relaxed);
                aside();
            }
        };
        let taken = self.quota.try_take(wanted.len()).unwrap_or_else(|| {
            step_aside();
            self.quota.take(wanted.len())
        });
        let mut gathered = Gathered { blocks: self, pinned: Vec::with_capacity(wanted.len()), taken };
        let (mut absent, mut missed) = (Vec::new(), 0);
        for &block in wanted {
            let gone = &mut |gone| self.retire(gone);
            let asked = self.directory(block).pin(block, &self.words, &self.pins, gone);
            gathered.pinned.push(block);
            missed += u64::from(asked != Asked::Here);
            match asked {
                // It may have come ahead of need since it was looked for.
                Asked::Here => self.words.use_first(block as usize, self.tick()),
                Asked::Coming => (),
                Asked::Absent => absent.push(block),
            }
        }
        if loaders.are_there() {
            // What the system has in memory is copied sooner than it is asked for.
            absent.retain(|&block| !self.load(block, true));
        }
        for &block in &absent {
            if loaders.are_there() {
                step_aside();
                self.ahead.was_slow();
            }
            self.need(loaders, block);
        }
        add(&self.counters.misses, missed);
        for &block in wanted {
            while !self.words.is_here(block as usize) {
                step_aside();
                if !self.directory(block).wait(block, &self.deadline) {
                    return Err(Late);
                }
                if self.words.is_here(block as usize) || self.has_failed() {
                    break;
                }
                // It was to come ahead of need, and did not. Now it is needed.
                let gone = &mut |gone| self.retire(gone);
                if self.directory(block).ask(block, &self.words, &self.pins, gone) == Asked::Absent {
                    self.need(loaders, block);
                }
            }
        }
        Ok(gathered)
    }

    /// Has a block come that the directory has said is absent: asks a loader for it, or reads it here if there is none.
    fn need(&self, loaders: &Loaders, block: u32) {
        if !loaders.need(block) {
            self.load(block, false);
        }
    }

    /// Takes note of a block that has been declared gone. Its stripe is locked: nobody can have asked for it
    /// again, who would not find it here.
    fn retire(&self, gone: u32) {
        add(&self.counters.evictions, 1);
        self.gone.fetch_add(1, Ordering::Relaxed);
        self.let_go(gone);
    }

    /// Whether memory is short: more than a few blocks had to go. A few always have to, where a set is full before the
    /// others are.
    pub fn is_short(&self) -> bool {
        /// One in so many of all blocks that may be here is few.
        const FEW: usize = 128;
        self.gone.load(Ordering::Relaxed) as usize > self.limit / FEW
    }

    /// The same of a block that went for nothing that is needed: memory is not short for that.
    pub fn let_go(&self, gone: u32) {
        let mut retired = self.retired();
        retired.push_back((self.epochs.retire(), gone));
    }

    fn retired(&self) -> MutexGuard<'_, VecDeque<(u64, u32)>> {
        self.retired.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Frees what nobody reads any more; whether that was anything.
    fn reclaim(&self) -> bool {
        let mut retired = self.retired();
        let earliest = self.epochs.earliest();
        let mut freed = 0;
        while retired.front().is_some_and(|&(epoch, _)| epoch < earliest) {
            let Some((_, block)) = retired.pop_front() else { break };
            // SAFETY: it was declared gone before all epochs that a reader may be in, and it can only come
            // back by being taken out of the list, whose lock is held.
            unsafe { self.release(block) };
            freed += 1;
        }
        self.committed.fetch_sub(freed, Ordering::AcqRel);
        freed > 0
    }

    /// # Safety
    /// Nobody may have a reference into the block.
    unsafe fn release(&self, block: u32) {
        let bytes = self.layout.block_bytes();
        // SAFETY: as promised.
        unsafe { self.arena.release(block as usize * bytes, bytes) };
    }

    /// Waits until there is memory for one more block, and takes it.
    pub fn make_room(&self) {
        let mut tries = 0;
        while !self.try_room() {
            // Readers leave their epochs within a tile.
            tries += 1;
            if tries < 16 {
                thread::yield_now()
            } else {
                thread::sleep(Duration::from_micros(50))
            }
            if tries % 16 == 0 {
                self.shrink();
            }
        }
    }

    /// Takes memory for one more block, if there is some or nobody reads any more what has some.
    pub fn try_room(&self) -> bool {
        loop {
            let take = |committed| (committed < self.limit).then_some(committed + 1);
            if let Ok(before) = self.committed.fetch_update(Ordering::AcqRel, Ordering::Acquire, take) {
                self.most_committed.fetch_max(before + 1, Ordering::Relaxed);
                return true;
            }
            if !self.reclaim() {
                return false;
            }
        }
    }

    /// Gives up what sets hold beyond their ways, because it was pinned when it came.
    fn shrink(&self) {
        for directory in self.directories.iter().flatten() {
            directory.shrink(&self.words, &self.pins, &mut |gone| self.retire(gone));
        }
    }

    /// Brings a block that the directory has said is absent; with `at_once` only if nothing has to be waited
    /// for. Whether it is done, with success or without.
    pub fn load(&self, block: u32, at_once: bool) -> bool {
        self.is_settled(block) || {
            self.make_room();
            self.load_into_room(block, at_once)
        }
    }

    /// Whether there is nothing to read for a block that the directory has said is absent: it was given up just now
    /// and is kept, or everybody gives up.
    pub fn is_settled(&self, block: u32) -> bool {
        let is_kept = self.is_kept(block);
        if is_kept {
            self.directory(block).arrived(block, &self.words, self.tick());
        } else if self.has_failed() {
            self.directory(block).failed(block);
            return true;
        }
        is_kept
    }

    /// As [`load`](Self::load), where there is room for the block already.
    pub fn load_into_room(&self, block: u32, at_once: bool) -> bool {
        let tick = self.tick();
        match self.read(block..block + 1, at_once) {
            Ok(true) => {
                self.directory(block).arrived(block, &self.words, tick);
                true
            }
            Ok(false) => {
                // A loader will come back to it, and find the room again.
                self.give_room(block);
                false
            }
            Err(error) => {
                self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                self.failed.store(true, Ordering::Release);
                self.give_room(block);
                self.directory(block).failed(block);
                true
            }
        }
    }

    /// Whether a block that the directory has said is absent was given up just now: then it is still where it was,
    /// and is kept.
    pub fn is_kept(&self, block: u32) -> bool {
        let mut retired = self.retired();
        let at = retired.iter().position(|&(_, gone)| gone == block);
        at.and_then(|at| retired.remove(at)).is_some()
    }

    /// Reads blocks of one array that the directory has said are absent to their places, for which there is room.
    /// `at_once` as in [`load`](Self::load): `false` if something would have to be waited for.
    pub fn read(&self, blocks: Range<u32>, at_once: bool) -> crate::error::Result<bool> {
        let start = Instant::now();
        let (array, byte, bytes) = self.layout.locate(blocks.clone());
        let place = (blocks.start as usize) << self.layout.shift();
        // SAFETY: readers look only at what is here; the blocks are not, their last memory has been freed, and
        // the directory tells one thread alone to load them.
        let into = unsafe { self.arena.fill(place, bytes.next_multiple_of(READ)) };
        let is_read = if at_once {
            self.source.read_at_once(array, byte, into)?
        } else {
            self.source.read(array, byte, into)?;
            true
        };
        if is_read {
            add(&self.counters.loads, blocks.len() as u64);
            add(&self.counters.bytes_read, bytes as u64);
            add(&self.counters.loading_ns, nanos(start.elapsed()));
        }
        Ok(is_read)
    }

    /// Gives back the memory of a block that has not come.
    pub fn give_room(&self, block: u32) {
        // SAFETY: it never was here.
        unsafe { self.release(block) };
        self.committed.fetch_sub(1, Ordering::AcqRel);
    }

    /// Whether a block could not be read: from then on none is.
    pub fn has_failed(&self) -> bool {
        self.failed.load(Ordering::Acquire)
    }

    /// Why, for the first who asks; blocks are read again afterwards.
    pub fn take_failure(&self) -> Option<Error> {
        let failure = self.failure.lock().unwrap_or_else(PoisonError::into_inner).take();
        self.failed.store(false, Ordering::Release);
        failure
    }

    /// What was done since the last call.
    pub fn take_stats(&self) -> CacheStats {
        self.counters.take(self.words.take_uses(), self.words.take_ahead())
    }

    /// Bytes of blocks that have memory, and the most that ever had.
    pub fn committed_bytes(&self) -> [usize; 2] {
        [&self.committed, &self.most_committed].map(|n| n.load(Ordering::Relaxed) << self.layout.shift())
    }

    /// Gives up everything that is not in use, as if nothing had been read yet.
    pub fn clear(&self) {
        for directory in self.directories.iter().flatten() {
            directory.clear(&self.words, &self.pins, &mut |gone| self.retire(gone));
        }
        self.ahead.clear();
        self.reclaim();
    }
}

/// Blocks that are here and will be as long as this is.
#[must_use]
pub struct Gathered<'a> {
    blocks: &'a Blocks,
    pinned: Vec<u32>,
    taken: usize,
}

impl Drop for Gathered<'_> {
    fn drop(&mut self) {
        self.pinned.iter().for_each(|&block| self.blocks.pins.unpin(block));
        self.blocks.quota.give(self.taken);
    }
}
