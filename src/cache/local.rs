//! What each thread has of its own: its place among the readers.

use super::blocks::Blocks;
use super::epoch::Reader;
use super::known::Known;
use super::scraps::Scraps;
use super::stats::{add, nanos};
use super::words::Notes;
use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

/// A thread's state, from one use of a scene to the next.
#[derive(Debug)]
pub struct Local {
    blocks: Arc<Blocks>,
    reader: Reader,
    /// What it has seen, and threads before it that have ended; nothing before its first square.
    known: Known,
    /// What it has used since it began.
    pub notes: Notes,
    /// What lies across the borders of blocks, as long as it is looked at.
    pub scraps: Scraps,
    /// Uses inside of one another: the outermost one is in an epoch.
    depth: u32,
    /// Whether the thread has a place at the gate, which it keeps until it ends.
    at_gate: bool,
    stalled: Cell<Duration>,
}

thread_local! {
    /// Taken out by who uses it, so that no closure stands between a kernel and its instruction set.
    static LOCAL: Cell<Option<Box<Local>>> = const { Cell::new(None) };
}

impl Local {
    /// The thread's state for these blocks; a new one if it worked on others before.
    ///
    /// Panics if thousands of threads use them already.
    pub fn take(blocks: &Arc<Blocks>) -> Box<Self> {
        match LOCAL.take() {
            Some(local) if Arc::ptr_eq(&local.blocks, blocks) => local,
            _ => Box::new(Self {
                blocks: Arc::clone(blocks),
                reader: blocks.epochs.reader().expect("fewer than 4096 threads use a scene"),
                known: Known::default(),
                notes: Notes::default(),
                scraps: Scraps::default(),
                depth: 0,
                at_gate: false,
                stalled: Cell::new(Duration::ZERO),
            }),
        }
    }

    /// Puts it back for the next use.
    pub fn put(self: Box<Self>) {
        LOCAL.set(Some(self));
    }

    /// Begins a use.
    #[inline(always)]
    pub fn begin(&mut self) {
        self.depth += 1;
        if self.depth == 1 {
            self.enter();
        }
    }

    /// Begins a use of a square's length, which waits for its turn.
    ///
    /// The place at the gate is kept from one to the next, unless somebody wants to go on who has waited for a
    /// block: with another thread for each square, a scene of which all was in memory ran at 0.44 to 0.65 of the
    /// resident one's speed, and so at 0.59 to 0.75.
    pub fn begin_at_gate(&mut self) {
        if self.depth == 0
            && let Some(gate) = &self.blocks.gate
        {
            if self.at_gate && gate.is_wanted() {
                gate.leave();
                self.at_gate = false;
            }
            if !self.at_gate {
                gate.begin();
                self.at_gate = true;
            }
        }
        if self.depth == 0 && self.known.is_none() {
            self.known = self.blocks.knowledge();
        }
        self.begin();
    }

    /// Ends it.
    #[inline(always)]
    pub fn end(&mut self) {
        self.depth -= 1;
        if self.depth == 0 {
            self.reader.leave();
            self.blocks.words.hand_over(&self.notes, self.known.take_uses(), self.reader.number());
        }
    }

    /// Goes on with a use that was [left](Self::leave).
    #[inline(always)]
    pub fn enter(&self) {
        self.reader.enter();
        self.known.begin(self.blocks.words.eras.now());
    }

    /// Leaves the epoch in the middle of a use, to wait for something.
    pub fn leave(&self) {
        self.reader.leave();
    }

    /// The lists that were seen whole when this use began, or went on.
    #[inline(always)]
    pub fn known(&self) -> &Known {
        &self.known
    }

    /// Lets another thread go on while this one waits.
    pub fn step_aside(&self) {
        if self.at_gate {
            self.blocks.gate.as_ref().expect("it was passed").leave();
        }
    }

    /// Goes on, when it is this thread's turn.
    pub fn step_back(&self) {
        if self.at_gate {
            self.blocks.gate.as_ref().expect("it was passed").resume();
        }
    }

    /// Counts time that was spent waiting.
    pub fn stalled(&self, time: Duration) {
        self.stalled.set(self.stalled.get() + time);
        add(&self.blocks.counters.stalled_ns, nanos(time));
    }

    /// All that this thread has waited so far.
    pub fn stalled_so_far(&self) -> Duration {
        self.stalled.get()
    }
}

impl Drop for Local {
    fn drop(&mut self) {
        self.step_aside();
        self.blocks.pass_on(std::mem::take(&mut self.known));
    }
}
