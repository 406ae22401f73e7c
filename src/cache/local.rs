//! What each thread has of its own: its place among the readers.

use super::blocks::Blocks;
use super::epoch::Reader;
use super::stats::{add, nanos};
use std::cell::Cell;
use std::sync::Arc;
use std::time::Duration;

/// A thread's state, from one use of a scene to the next.
#[derive(Debug)]
pub struct Local {
    blocks: Arc<Blocks>,
    pub reader: Reader,
    /// Uses inside of one another: the outermost one is in an epoch.
    depth: u32,
    /// Whether the outermost use has a place at the gate.
    at_gate: bool,
    lookups: Cell<u64>,
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
                depth: 0,
                at_gate: false,
                lookups: Cell::new(0),
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
            self.reader.enter();
        }
    }

    /// Begins a use of a tile's length, which waits for its turn.
    pub fn begin_at_gate(&mut self) {
        if self.depth == 0
            && let Some(gate) = &self.blocks.gate
        {
            gate.begin();
            self.at_gate = true;
        }
        self.begin();
    }

    /// Ends it.
    #[inline(always)]
    pub fn end(&mut self) {
        self.depth -= 1;
        if self.depth == 0 {
            self.end_outermost();
        }
    }

    fn end_outermost(&mut self) {
        self.reader.leave();
        if self.at_gate {
            self.at_gate = false;
            self.blocks.gate.as_ref().expect("it was passed").leave();
        }
        add(&self.blocks.counters.lookups, self.lookups.take());
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

    /// Counts look-ups.
    #[inline(always)]
    pub fn looked_up(&self, count: u64) {
        self.lookups.set(self.lookups.get() + count);
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
