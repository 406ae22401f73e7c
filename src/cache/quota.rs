//! How many blocks may be pinned at a time.

use super::sync::{Condvar, Mutex, PoisonError};

/// A number that threads take from, all that one needs at once, and give back: nobody holds some while he
/// waits for more, so all come to their turn.
#[derive(Debug)]
pub struct Quota {
    left: Mutex<usize>,
    given: Condvar,
    all: usize,
}

impl Quota {
    /// So many.
    pub fn new(all: usize) -> Self {
        Self { left: Mutex::new(all), given: Condvar::new(), all }
    }

    /// Takes `count`, or all if that is more than there are; waits until they are there. Says how many to
    /// give back.
    pub fn take(&self, count: usize) -> usize {
        let count = count.min(self.all);
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        while *left < count {
            left = self.given.wait(left).unwrap_or_else(PoisonError::into_inner);
        }
        *left -= count;
        count
    }

    /// The same if they are there at once.
    pub fn try_take(&self, count: usize) -> Option<usize> {
        let count = count.min(self.all);
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        *left = left.checked_sub(count)?;
        Some(count)
    }

    /// Gives `count` back.
    pub fn give(&self, count: usize) {
        *self.left.lock().unwrap_or_else(PoisonError::into_inner) += count;
        self.given.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};

    #[test]
    fn no_more_is_taken_than_there_is() {
        let (quota, out) = (Quota::new(10), AtomicUsize::new(0));
        std::thread::scope(|scope| {
            for size in [1, 3, 7, 10, 25] {
                let (quota, out) = (&quota, &out);
                scope.spawn(move || {
                    for _ in 0..200 {
                        let taken = quota.take(size);
                        assert_eq!(taken, size.min(10));
                        assert!(out.fetch_add(taken, Ordering::SeqCst) + taken <= 10);
                        out.fetch_sub(taken, Ordering::SeqCst);
                        quota.give(taken);
                    }
                });
            }
        });
        assert_eq!(quota.try_take(4), Some(4));
        assert_eq!(quota.try_take(7), None);
        assert_eq!(quota.take(6), 6);
    }
}
