//! Blocks that come and go.
//!
//! This is where the parts meet: a thread that misses pins what it needs and asks the directory; what is
//! absent is read by itself or by a loader; what had to go is retired, and freed when nobody can be reading
//! it any more.

use super::ahead::Ahead;
use super::deadline::Deadline;
use super::directory::{Directory, Pins};
use super::epoch::Epochs;
use super::eras::is_before;
use super::gate::Gate;
use super::known::Known;
use super::layout::Layout;
use super::loaders::Loaders;
use super::pieces::{self, PIECE};
use super::plan::{CacheOptions, Loading, Plan, Prefetch};
use super::policy::Way;
use super::quota::Quota;
use super::retired::Retired;
use super::slots::Slots;
use super::source::Source;
use super::stats::{CacheStats, Counters, PARTS, PartCounters, PartStats, add, nanos};
use super::sync::{Arc, AtomicBool, AtomicU32, AtomicUsize, Mutex, Ordering, PoisonError};
use super::whole::Whole;
use super::words::Words;
use crate::error::Error;
use std::ops::Range;
use std::time::Instant;

/// The most threads that may read at a time.
const READERS: usize = 4096;

/// Squares of a picture that a tick is long where blocks have to go. Every block's first use in a tick is written down:
/// with a tick of one square, a view of which all was in memory ran at 0.58 to 0.67 of the resident scene's speed, with 16
/// at 0.83, with this at 0.87. With 1024, LRU read a third more blocks (power plant outside, 16 % in memory).
const SESSIONS_PER_TICK: u32 = 64;

/// What stands for the tick of the frame where there is none: then ticks go on with squares.
const BY_SQUARES: u32 = u32::MAX;

/// Ticks that an [era](super::eras) lasts at most: 1024 frames of 512 x 512. (With 64 frames, looking at lists anew took 2
/// to 3 % of them.)
const ERA: u32 = 1 << 14;

/// All blocks of a scene, and those of them that are here.
#[derive(Debug)]
pub struct Blocks {
    pub layout: Layout,
    pub slots: Slots,
    pub words: Words,
    pub epochs: Arc<Epochs>,
    /// For threads that are at work: none, if each waits at its own place.
    pub gate: Option<Gate>,
    /// Sessions so far: see [`tick`](Self::tick).
    pub sessions: AtomicU32,
    /// What threads knew that have ended, for the next ones, and how many more of these there may be.
    knowledge: Mutex<(Vec<Known>, usize)>,
    /// Lines that each of them has.
    lines: usize,
    /// Whether nothing ever has to go.
    holds_all: bool,
    pub counters: Counters,
    pub pins: Pins,
    /// What came ahead of need.
    pub ahead: Ahead,
    /// Whether blocks come with those that lie beside them.
    pub brings_others: bool,
    pub(super) quota: Quota,
    pub(super) directories: [Option<Directory>; 2],
    source: Box<dyn Source>,
    /// Blocks given up that still have their slots.
    pub(super) retired: Mutex<Retired>,
    /// Blocks that have memory, or are about to: at most `limit`.
    pub(super) committed: AtomicUsize,
    pub(super) limit: usize,
    pub(super) most_committed: AtomicUsize,
    /// Blocks that had to go in this frame.
    pub gone: AtomicU32,
    /// One tick for all of a frame, as long as [hardly anything](Self::is_calm) has to go in it and had to in the one before:
    /// nobody asks then in what order blocks were used, and to write it down is to take lines of the cache from other
    /// threads.
    frame_tick: AtomicU32,
    /// How often a thread has waited since this was last cleared.
    pub waits: AtomicU32,
    /// When threads stop waiting.
    pub deadline: Deadline,
    pub(super) whole: Whole,
    failure: Mutex<Option<Error>>,
    failed: AtomicBool,
}

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
            slots: Slots::new(count, plan.all, layout.shift())?,
            words: Words::new(count, layout.first_of_leaves()),
            epochs: Epochs::new(READERS),
            gate,
            sessions: AtomicU32::new(0),
            knowledge: Mutex::new((Vec::new(), threads)),
            lines: plan.lines,
            holds_all: plan.held() >= count,
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
            frame_tick: AtomicU32::new(0),
            waits: AtomicU32::new(0),
            deadline: Deadline::default(),
            whole: Whole::default(),
            failure: Mutex::default(),
            failed: AtomicBool::new(false),
            layout,
        });
        let loaders = Loaders::new(&blocks, loaders, ahead)?;
        Ok((blocks, loaders))
    }

    /// What tells uses apart: a use in the same tick is the same use.
    pub fn tick(&self) -> u32 {
        match self.frame_tick.load(Ordering::Relaxed) {
            BY_SQUARES => self.sessions.load(Ordering::Relaxed) / SESSIONS_PER_TICK,
            tick => tick,
        }
    }

    /// Begins a frame, and with it a tick; whether memory was [short](Self::is_short) in the one before.
    pub fn begin_frame(&self) -> bool {
        let was_short = self.is_short();
        // Ticks never go back: what is used in an earlier one is not marked.
        let next =
            |sessions: u32| Some(sessions.wrapping_add(SESSIONS_PER_TICK - 1) & !(SESSIONS_PER_TICK - 1));
        let _ = self.sessions.fetch_update(Ordering::Relaxed, Ordering::Relaxed, next);
        let tick = self.sessions.load(Ordering::Relaxed) / SESSIONS_PER_TICK;
        let is_calm = self.is_calm();
        self.gone.store(0, Ordering::Relaxed);
        self.frame_tick.store(if is_calm { tick } else { BY_SQUARES }, Ordering::Relaxed);
        if is_before(self.words.eras.now().1, tick.wrapping_sub(ERA)) {
            self.words.eras.begin(tick);
        }
        if was_short {
            self.move_in();
        }
        was_short
    }

    /// Whether nothing ever has to go.
    pub fn holds_all(&self) -> bool {
        self.holds_all
    }

    /// From now on, writes uses down, or no longer does. Where nothing ever has to go, it is enough to know which blocks
    /// were used at all.
    pub fn trace_uses(&self, on: bool) {
        // Of a scene that is whole, uses are not noticed.
        self.whole.end();
        self.words.trace_uses(on, !self.holds_all);
    }

    /// What a thread knew that has ended; nothing if there is none. As many threads as are at work at a time can keep
    /// something in mind; others, which go on while those wait, look at everything anew.
    pub fn knowledge(&self) -> Known {
        let (left, more) = &mut *self.knowledge.lock().unwrap_or_else(PoisonError::into_inner);
        left.pop().unwrap_or_else(|| {
            if *more == 0 {
                return Known::default();
            }
            *more -= 1;
            Known::new(self.lines)
        })
    }

    /// Keeps what a thread knew for another.
    pub fn pass_on(&self, known: Known) {
        if !known.is_none() {
            self.knowledge.lock().unwrap_or_else(PoisonError::into_inner).0.push(known);
        }
    }

    /// Memory that is taken for a block that is here beside its own: its way in a set, and what slots and the list of those
    /// that were given up have, each with room to grow.
    pub const OVERHEAD_HERE: usize = 2 * (size_of::<Way>() + 3 * size_of::<u64>());

    /// Memory that is taken for `count` blocks, wherever they are.
    pub fn overhead(count: usize) -> usize {
        Words::bytes(count) + Pins::bytes(count) + Slots::bytes(count) + READERS * 128
    }

    pub fn directory(&self, block: u32) -> &Directory {
        let second = self.layout.part(block) == 1;
        let [first, other] = &self.directories;
        other.as_ref().filter(|_| second).or(first.as_ref()).expect("there is a first directory")
    }

    /// The counts of the part that a block is of.
    pub fn counters_of(&self, block: u32) -> &PartCounters {
        &self.counters.parts[self.layout.part(block)]
    }

    /// Takes note of a block that has been declared gone. Its stripe is locked: nobody can have asked for it
    /// again, who would not find it here.
    pub(super) fn retire(&self, gone: u32) {
        add(&self.counters_of(gone).evictions, 1);
        self.gone.fetch_add(1, Ordering::Relaxed);
        if !self.is_calm() {
            self.frame_tick.store(BY_SQUARES, Ordering::Relaxed);
        }
        self.let_go(gone);
        // What was seen before is looked at anew, and marked, so that others go next.
        if self.words.eras.take_end() || self.frame_tick.load(Ordering::Relaxed) == BY_SQUARES {
            self.words.eras.begin(self.tick());
        }
    }

    /// Whether memory is short: more than a few blocks had to go. A few always have to, where a set is full before the
    /// others are.
    pub fn is_short(&self) -> bool {
        /// One in so many of all blocks that may be here is few. With one in 128, rays that wander a little (shadows,
        /// inside the power plant with 16 % in memory) found a fifth of the speed gone to frugal kernels for the sake
        /// of some hundred blocks.
        const FEW: usize = 32;
        self.gone.load(Ordering::Relaxed) as usize > self.limit / FEW
    }

    /// Whether hardly any blocks had to go in this frame: one in so many of all that may be here, at most.
    fn is_calm(&self) -> bool {
        /// To give a page back and to get one for each of so few blocks is less than what it costs to find all of them by
        /// a table.
        const HARDLY_ANY: usize = 256;
        self.gone.load(Ordering::Relaxed) as usize <= self.limit / HARDLY_ANY
    }

    /// The same of a block that went for nothing that is needed: memory is not short for that. It has been
    /// [declared gone](Words::leave).
    pub fn let_go(&self, gone: u32) {
        // Before the epoch ends: who enters a later one knows it.
        if !self.is_calm() {
            self.slots.leave_order(|| self.epochs.retire());
        }
        let mut retired = self.retired();
        self.whole.end();
        retired.push(self.epochs.retire(), gone);
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
                self.give_room();
                false
            }
            Err(error) => {
                self.failure.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
                self.failed.store(true, Ordering::Release);
                self.give_room();
                self.directory(block).failed(block);
                true
            }
        }
    }

    /// Whether a block that the directory has said is absent was given up just now: then it is still where it was,
    /// and is kept.
    pub fn is_kept(&self, block: u32) -> bool {
        // Whoever brought it or gave it up had its stripe's lock before this thread.
        self.slots.has(block) && self.retired().keep(block)
    }

    /// Reads blocks of one array that the directory has said are absent, for which there is room, and gives them slots.
    /// `at_once` as in [`load`](Self::load): `false` if something would have to be waited for.
    pub fn read(&self, blocks: Range<u32>, at_once: bool) -> crate::error::Result<bool> {
        let start = Instant::now();
        let (array, byte, bytes) = self.layout.locate(blocks.clone());
        // What is read is looked at before anybody else can see it: checksums are for whole pieces.
        let pieces = byte / PIECE..(byte + bytes).div_ceil(PIECE);
        let mut room = pieces::take(pieces.len());
        let into = room.bytes_mut();
        let is_read = if at_once {
            self.source.read_at_once(array, pieces.start * PIECE, into)?
        } else {
            self.source.read(array, pieces.start * PIECE, into)?;
            true
        };
        if is_read {
            let read = &into[byte - pieces.start * PIECE..][..bytes];
            for (block, bytes) in blocks.clone().zip(read.chunks(self.layout.block_bytes())) {
                // SAFETY: the directory tells one thread alone to load a block.
                unsafe { self.slots.put(block, bytes, || self.epochs.earliest()) };
            }
            let counters = self.counters_of(blocks.start);
            add(&counters.loads, blocks.len() as u64);
            let end = self.layout.column(array).bytes.min(pieces.end * PIECE);
            add(&counters.bytes_read, (end - pieces.start * PIECE) as u64);
            add(&self.counters.loading_ns, nanos(start.elapsed()));
        }
        pieces::put_back(room);
        Ok(is_read)
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
        self.take_stats_by_part().0
    }

    /// The same, and what of it was done for nodes and for what leaves need.
    pub fn take_stats_by_part(&self) -> (CacheStats, [PartStats; PARTS]) {
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
        self.whole.begin_anew();
        self.reclaim();
        let retired = self.retired();
        // A home whose block has moved is somebody's as long as it waits to be left.
        if !retired.has_homes() {
            self.slots.begin_anew();
        }
    }
}
