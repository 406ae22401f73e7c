//! So many threads at work at a time, whoever they are.
//!
//! There are more threads than processors when blocks come by themselves: one that waits for a block lets
//! another go on in its place. What a thread has begun and the blocks that it waited for are in its hands,
//! so who comes back goes before who begins something new.

use super::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// A number of places.
#[derive(Debug)]
pub struct Gate {
    state: Mutex<State>,
    begin: Condvar,
    resume: Condvar,
}

#[derive(Debug)]
struct State {
    free: usize,
    /// Threads that want to go on with what they have begun.
    resuming: usize,
}

impl Gate {
    /// So many places, all free.
    pub fn new(places: usize) -> Self {
        Self {
            state: Mutex::new(State { free: places, resuming: 0 }),
            begin: Condvar::new(),
            resume: Condvar::new(),
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Takes a place for something new.
    pub fn begin(&self) {
        let mut state = self.state();
        while state.free == 0 || state.resuming > 0 {
            state = self.begin.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.free -= 1;
    }

    /// Takes a place again, before all that begin.
    pub fn resume(&self) {
        let mut state = self.state();
        state.resuming += 1;
        while state.free == 0 {
            state = self.resume.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.resuming -= 1;
        state.free -= 1;
        // There may be room for who begins, which was held back for this one's sake.
        if state.free > 0 && state.resuming == 0 {
            self.begin.notify_one();
        }
    }

    /// Whether somebody waits for a place to go on with what he has begun.
    pub fn is_wanted(&self) -> bool {
        self.state().resuming > 0
    }

    /// Gives a place back.
    pub fn leave(&self) {
        let mut state = self.state();
        state.free += 1;
        if state.resuming > 0 {
            self.resume.notify_one();
        } else {
            self.begin.notify_one();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::thread;

    #[test]
    fn never_more_than_there_are_places() {
        let (gate, inside, most) = (Gate::new(3), AtomicUsize::new(0), AtomicUsize::new(0));
        thread::scope(|scope| {
            for i in 0..16 {
                let (gate, inside, most) = (&gate, &inside, &most);
                scope.spawn(move || {
                    for round in 0..200 {
                        if (i + round) % 3 == 0 {
                            gate.resume()
                        } else {
                            gate.begin()
                        }
                        most.fetch_max(inside.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
                        thread::yield_now();
                        inside.fetch_sub(1, Ordering::SeqCst);
                        gate.leave();
                    }
                });
            }
        });
        assert_eq!(most.into_inner(), 3);
    }

    #[test]
    fn who_comes_back_goes_first() {
        let gate = Gate::new(1);
        gate.begin();
        let order = Mutex::new(Vec::new());
        thread::scope(|scope| {
            let (gate, order) = (&gate, &order);
            scope.spawn(move || {
                gate.begin();
                order.lock().expect("whole").push("begins");
                gate.leave();
            });
            scope.spawn(move || {
                gate.resume();
                order.lock().expect("whole").push("resumes");
                gate.leave();
            });
            // Both wait, whichever came first, before there is a place.
            while gate.state().resuming == 0 {
                thread::yield_now();
            }
            assert!(gate.is_wanted());
            gate.leave();
        });
        assert!(!gate.is_wanted());
        assert_eq!(order.into_inner().expect("whole"), ["resumes", "begins"]);
    }
}
