//! Memory for blocks: whose it is, and when it is the next one's.

use super::blocks::Blocks;
use super::retired::Retired;
use super::sync::thread;
use super::sync::{MutexGuard, Ordering, PoisonError};
use std::time::Duration;

/// One in so many of all blocks that may be here moves before a frame, at most: so that all have after some frames, and
/// none takes much longer for it.
const MOVES: usize = 8;

impl Blocks {
    /// What was given up and still has its memory.
    pub(super) fn retired(&self) -> MutexGuard<'_, Retired> {
        self.retired.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Frees what nobody reads any more; whether that was anything.
    pub fn reclaim(&self) -> bool {
        let mut retired = self.retired();
        let earliest = self.epochs.earliest();
        let mut freed = 0;
        // Before blocks: no block that has moved since is away before its home is.
        while let Some(homes) = retired.take_homes_before(earliest) {
            // SAFETY: their blocks had moved before all epochs that a reader may be in.
            unsafe { self.slots.leave_homes(&homes) };
            freed += homes.len();
        }
        let free = retired.take_before(earliest);
        // SAFETY: they were declared gone before all epochs that a reader may be in, and they can only come back by being
        // taken out of the list, whose lock is held.
        unsafe { self.slots.give_back(&free) };
        freed += free.len();
        self.committed.fetch_sub(freed, Ordering::AcqRel);
        freed > 0
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

    /// Takes memory for up to `most` blocks more, as many as there is at once; for how many.
    fn take_rooms(&self, most: usize) -> usize {
        let mut taken = 0;
        let _ = self.committed.fetch_update(Ordering::AcqRel, Ordering::Acquire, |committed| {
            taken = (self.limit - committed).min(most);
            Some(committed + taken)
        });
        self.most_committed.fetch_max(self.committed.load(Ordering::Relaxed), Ordering::Relaxed);
        taken
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

    /// Gives back the room of a block that has not come.
    pub fn give_room(&self) {
        self.committed.fetch_sub(1, Ordering::AcqRel);
    }

    /// Moves some blocks from their [homes](super::slots) to slots; how many.
    pub fn move_in(&self) -> usize {
        let most = (self.limit / MOVES).max(1);
        let mut done = 0;
        while done < most {
            let count = self.take_rooms(most - done);
            let mut retired = self.retired();
            // SAFETY: blocks are given back by who has the lock of the list.
            let moved = unsafe { self.slots.move_in(count, || self.epochs.earliest()) };
            self.committed.fetch_sub(count - moved.len(), Ordering::AcqRel);
            if moved.is_empty() {
                break;
            }
            done += moved.len();
            retired.push_homes(self.epochs.retire(), moved);
            drop(retired);
            self.reclaim();
        }
        done
    }
}
