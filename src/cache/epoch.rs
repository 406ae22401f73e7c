//! Who still reads (epochs: Fraser, "Practical lock-freedom", 2004).
//!
//! A reader that is about to look at blocks enters an epoch and leaves it when it is done. A block that is
//! given up is first declared gone and then *retired* with the epoch of that moment; its memory is freed
//! when every reader has left the epochs up to that one. Nobody who entered later can have found it.
//!
//! A thread that waits for anything must not be in an epoch: it would hold up all memory.
//!
//! ```text
//! reader                              who gives a block up
//!   slot = epoch        (1)             word = gone             (3)
//!   fence                               fence
//!   word says here?     (2)             retired at epoch++      (4)
//!   ... reads ...                       all slots later?        (5)   then the memory goes
//!   slot = idle
//! ```
//!
//! The fences forbid that (2) still sees the block and (5) does not yet see the reader.

use super::sync::{Arc, AtomicU64, AtomicUsize, Mutex, Ordering, PoisonError, fence};
use crossbeam::utils::CachePadded;

/// A slot's value while its reader is in no epoch: later than all.
const IDLE: u64 = u64::MAX;

/// The epochs of all readers.
#[derive(Debug)]
pub struct Epochs {
    now: CachePadded<AtomicU64>,
    slots: Box<[CachePadded<AtomicU64>]>,
    /// Slots that have ever been a reader's: no others need be looked at.
    used: AtomicUsize,
    free: Mutex<Vec<usize>>,
}

impl Epochs {
    /// For so many readers at most.
    pub fn new(readers: usize) -> Arc<Self> {
        Arc::new(Self {
            now: CachePadded::new(AtomicU64::new(0)),
            slots: (0..readers).map(|_| CachePadded::new(AtomicU64::new(IDLE))).collect(),
            used: AtomicUsize::new(0),
            free: Mutex::new((0..readers).rev().collect()),
        })
    }

    /// A new reader, in no epoch; `None` if there are as many as there may be.
    pub fn reader(self: &Arc<Self>) -> Option<Reader> {
        let slot = self.free.lock().unwrap_or_else(PoisonError::into_inner).pop()?;
        // Before it enters an epoch: who sees that sees this.
        self.used.fetch_max(slot + 1, Ordering::SeqCst);
        Some(Reader { epochs: Arc::clone(self), slot })
    }

    /// The epoch that something is retired at which has been declared gone: readers that come from now on
    /// are in later ones.
    pub fn retire(&self) -> u64 {
        fence(Ordering::SeqCst);
        self.now.fetch_add(1, Ordering::SeqCst)
    }

    /// The earliest epoch that a reader may be in: what was retired before it can go.
    pub fn earliest(&self) -> u64 {
        fence(Ordering::SeqCst);
        let now = self.now.load(Ordering::SeqCst);
        let slots = &self.slots[..self.used.load(Ordering::SeqCst)];
        slots.iter().map(|slot| slot.load(Ordering::SeqCst)).fold(now, u64::min)
    }
}

/// One thread's place among the readers.
#[derive(Debug)]
pub struct Reader {
    epochs: Arc<Epochs>,
    slot: usize,
}

impl Reader {
    /// Enters the epoch of now: nothing that is retired from now on is freed before the reader leaves.
    #[inline]
    pub fn enter(&self) {
        let now = self.epochs.now.load(Ordering::SeqCst);
        self.epochs.slots[self.slot].store(now, Ordering::SeqCst);
        fence(Ordering::SeqCst);
    }

    /// Its number: no other reader that is there has the same.
    pub fn number(&self) -> usize {
        self.slot
    }

    /// Leaves it: everything that was found in it may be gone.
    #[inline]
    pub fn leave(&self) {
        self.epochs.slots[self.slot].store(IDLE, Ordering::Release);
    }
}

impl Drop for Reader {
    fn drop(&mut self) {
        self.leave();
        self.epochs.free.lock().unwrap_or_else(PoisonError::into_inner).push(self.slot);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_retired_waits_for_readers_that_were_there() {
        let epochs = Epochs::new(3);
        let (one, other) = (epochs.reader().expect("room"), epochs.reader().expect("room"));
        one.enter();
        let first = epochs.retire();
        assert!(epochs.earliest() <= first, "one may have found it");
        other.enter();
        assert!(epochs.earliest() <= first);
        one.leave();
        assert!(epochs.earliest() > first, "the other came later");
        let second = epochs.retire();
        assert!(epochs.earliest() <= second);
        other.leave();
        assert!(epochs.earliest() > second);
    }

    #[test]
    fn places_are_given_back() {
        let epochs = Epochs::new(1);
        let only = epochs.reader().expect("room");
        assert!(epochs.reader().is_none());
        only.enter();
        let retired = epochs.retire();
        drop(only);
        assert!(epochs.earliest() > retired, "who is gone reads no more");
        assert!(epochs.reader().is_some());
    }
}
