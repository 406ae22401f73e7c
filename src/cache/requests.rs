//! What loaders are asked for: what somebody waits for, and behind that what may be needed soon.
//!
//! ```text
//! who needs a block -- need --> [ needed ]  first, all of them, as long as there is one
//!                                              \
//!                                               next --> loaders
//!                                              /
//! who looks ahead --- ahead --> [ ahead  ]  when nothing is needed, and some loaders stay free
//!                                              /
//! where there is room for all  - rest --> the rest  when nothing else is to be done, by one loader
//! ```
//!
//! Who needs a block reads it himself as long as loaders are left over: to hand it over and to be told that it has come is
//! to change threads twice more. That too counts among the reads that are under way, of which there are never more
//! than loaders.
//!
//! A block that is asked for ahead of need has not been asked for in the [directory](super::directory) before a
//! loader takes it: who needs it meanwhile asks for it as if nobody had, and goes first.

use super::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::collections::VecDeque;

/// Requests of blocks that are needed, before who asks for another has to wait.
const NEEDED: usize = 256;

/// Requests ahead of need. When there are more, the oldest are forgotten: what they were for has begun.
const AHEAD: usize = 256;

/// What a loader is to read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// A block that somebody waits for, which the directory has said is absent.
    Needed(u32),
    /// One that may be needed soon. [`Requests::done_ahead`] is told when it is here, or not.
    Ahead(u32),
    /// Some of those that are not here and that nobody has asked for.
    Rest,
}

/// The requests of one cache.
#[derive(Debug)]
pub struct Requests {
    state: Mutex<State>,
    /// There is something for a loader.
    work: Condvar,
    /// There is room for what is needed.
    room: Condvar,
    /// Nothing is being read ahead of need any more.
    calm: Condvar,
    /// Reads at a time.
    loaders: usize,
    /// Blocks that are read ahead of need at a time.
    most: usize,
}

#[derive(Debug, Default)]
struct State {
    needed: VecDeque<u32>,
    ahead: VecDeque<u32>,
    /// Reads that are under way, whoever does them.
    busy: usize,
    /// Blocks that are being read ahead of need.
    reading: usize,
    /// Whether the rest is to come, and whether a loader is bringing some of it.
    rest: bool,
    bringing: bool,
    closed: bool,
}

impl State {
    /// Whether nothing is being read that nobody waits for.
    fn is_calm(&self) -> bool {
        self.reading == 0 && !self.bringing
    }
}

impl Requests {
    /// None yet; so many loaders will read, and up to `most` blocks ahead of need at a time.
    pub fn new(loaders: usize, most: usize) -> Self {
        Self {
            state: Mutex::default(),
            work: Condvar::new(),
            room: Condvar::new(),
            calm: Condvar::new(),
            loaders,
            most,
        }
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Asks for a block that the directory has said is absent. Waits while there are very many.
    pub fn need(&self, block: u32) {
        let mut state = self.state();
        while state.needed.len() >= NEEDED {
            state = self.room.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
        state.needed.push_back(block);
        self.work.notify_one();
    }

    /// Asks for blocks ahead of need. Never waits.
    pub fn ahead(&self, blocks: &[u32]) {
        if self.most == 0 {
            return;
        }
        let mut state = self.state();
        for &block in blocks {
            if state.ahead.contains(&block) {
                continue;
            }
            if state.ahead.len() == AHEAD {
                state.ahead.pop_front();
            }
            state.ahead.push_back(block);
            if state.reading < self.most {
                self.work.notify_one();
            }
        }
    }

    /// Asks for blocks that are not here yet, whichever they are.
    pub fn rest(&self) {
        let mut state = self.state();
        if !state.rest && !state.closed {
            state.rest = true;
            self.work.notify_one();
        }
    }

    /// Said by the loader that brings them, before it is done, when there are no more to bring.
    pub fn rest_has_come(&self) {
        self.state().rest = false;
    }

    /// Whether who needs a block may read it himself: there is a loader for each that waits for one, and still another
    /// one free. Then [`done_own`](Self::done_own) is to be told.
    pub fn try_own(&self) -> bool {
        let mut state = self.state();
        let may = state.needed.len() + state.busy < self.loaders;
        state.busy += usize::from(may);
        may
    }

    /// Said when that is over.
    pub fn done_own(&self) {
        let mut state = self.state();
        state.busy -= 1;
        // It may have held something up.
        let has_ahead = !state.ahead.is_empty() && state.reading < self.most;
        if !state.needed.is_empty() || has_ahead || state.rest && !state.bringing {
            self.work.notify_one();
        }
    }

    /// What a loader is to read next, when there is something; `None` at the end. [`done`](Self::done) is to be told.
    pub fn next(&self) -> Option<Request> {
        let mut state = self.state();
        loop {
            if state.busy < self.loaders {
                if let Some(block) = state.needed.pop_front() {
                    state.busy += 1;
                    self.room.notify_one();
                    return Some(Request::Needed(block));
                }
                if state.reading < self.most
                    && let Some(block) = state.ahead.pop_front()
                {
                    state.busy += 1;
                    state.reading += 1;
                    return Some(Request::Ahead(block));
                }
                // Another one stays free for what is needed.
                if state.rest && !state.bringing && (state.busy == 0 || state.busy + 1 < self.loaders) {
                    state.bringing = true;
                    state.busy += 1;
                    return Some(Request::Rest);
                }
            }
            if state.closed && state.needed.is_empty() {
                return None;
            }
            state = self.work.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Said by a loader when a block is here, or is not going to be. It asks for the next one afterwards.
    pub fn done(&self, request: Request) {
        let mut state = self.state();
        state.busy -= 1;
        match request {
            Request::Needed(_) => return,
            Request::Ahead(_) => state.reading -= 1,
            Request::Rest => state.bringing = false,
        }
        // Who says so may go on with what is needed: another loader may have to take what is left.
        if !state.ahead.is_empty() || state.rest {
            self.work.notify_one();
        }
        if state.is_calm() {
            self.calm.notify_all();
        }
    }

    /// Forgets what was asked for ahead of need, and waits until nothing of it is being read.
    pub fn forget_ahead(&self) {
        let mut state = self.state();
        state.ahead.clear();
        state.rest = false;
        while !state.is_calm() {
            state = self.calm.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Waits until all that was asked for ahead of need has been read, or has not.
    #[cfg(test)]
    pub fn wait_ahead(&self) {
        let mut state = self.state();
        while !state.is_calm() || !state.ahead.is_empty() || state.rest {
            state = self.calm.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Ends the loaders once they have read all that is needed.
    pub fn close(&self) {
        let mut state = self.state();
        state.closed = true;
        state.ahead.clear();
        state.rest = false;
        self.work.notify_all();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::thread;

    #[test]
    fn what_is_needed_goes_first_and_some_loaders_stay_free() {
        let requests = Requests::new(4, 2);
        requests.ahead(&[1, 2, 3, 2]);
        requests.need(7);
        let next = || requests.next().expect("it is not closed");
        assert_eq!([next(), next(), next()], [Request::Needed(7), Request::Ahead(1), Request::Ahead(2)]);
        // Two are being read: the third has to wait, what is needed has not.
        requests.need(8);
        assert_eq!(next(), Request::Needed(8));
        thread::scope(|scope| {
            let third = scope.spawn(next);
            requests.done(Request::Ahead(1));
            assert_eq!(third.join().expect("no panic"), Request::Ahead(3));
        });
        [2, 3].into_iter().for_each(|block| requests.done(Request::Ahead(block)));
        requests.forget_ahead();
        requests.ahead(&[4]);
        requests.need(9);
        requests.close();
        assert_eq!((requests.next(), requests.next()), (Some(Request::Needed(9)), None), "4 is forgotten");
    }

    #[test]
    fn one_loader_brings_the_rest_when_nothing_else_is_to_be_done() {
        let requests = Requests::new(2, 1);
        let next = || requests.next().expect("it is not closed");
        requests.rest();
        requests.ahead(&[2]);
        requests.need(1);
        let first = [next(), next()];
        assert_eq!(first, [Request::Needed(1), Request::Ahead(2)]);
        first.into_iter().for_each(|request| requests.done(request));
        assert_eq!(next(), Request::Rest);
        // The other one has nothing to do with it.
        requests.need(3);
        assert_eq!(next(), Request::Needed(3));
        requests.done(Request::Needed(3));
        requests.done(Request::Rest);
        // Beside somebody who reads for himself there is one loader, for what is needed.
        assert_eq!((next(), requests.try_own()), (Request::Rest, true));
        requests.done(Request::Rest);
        thread::scope(|scope| {
            let loader = scope.spawn(next);
            thread::sleep(std::time::Duration::from_millis(2));
            assert!(!loader.is_finished());
            requests.done_own();
            assert_eq!(loader.join().expect("no panic"), Request::Rest);
        });
        // To forget it is to wait for who brings some of it.
        thread::scope(|scope| {
            let forgets = scope.spawn(|| requests.forget_ahead());
            thread::sleep(std::time::Duration::from_millis(2));
            assert!(!forgets.is_finished());
            requests.done(Request::Rest);
        });
        requests.rest();
        assert_eq!(next(), Request::Rest);
        requests.rest_has_come();
        requests.done(Request::Rest);
        requests.close();
        assert_eq!(requests.next(), None);
    }

    #[test]
    fn there_are_never_more_reads_than_loaders() {
        let requests = Requests::new(2, 1);
        assert!(requests.try_own() && requests.try_own() && !requests.try_own());
        requests.need(1);
        thread::scope(|scope| {
            let loader = scope.spawn(|| requests.next());
            thread::sleep(std::time::Duration::from_millis(2));
            assert!(!loader.is_finished());
            // It is the loader's turn, not that of somebody who comes later.
            requests.done_own();
            assert_eq!(loader.join().expect("no panic"), Some(Request::Needed(1)));
        });
        assert!(!requests.try_own());
        requests.done(Request::Needed(1));
        requests.need(2);
        assert!(!requests.try_own(), "the loader that is free is for what waits");
        requests.ahead(&[3]);
        requests.done_own();
        let next = || requests.next().expect("it is not closed");
        assert_eq!([next(), next()], [Request::Needed(2), Request::Ahead(3)]);
        requests.close();
        [Request::Needed(2), Request::Ahead(3)].into_iter().for_each(|request| requests.done(request));
        assert_eq!(requests.next(), None);
    }

    #[test]
    fn the_oldest_are_forgotten_when_there_are_too_many() {
        let requests = Requests::new(1, 1);
        let blocks: Vec<u32> = (0..AHEAD as u32 + 10).collect();
        requests.ahead(&blocks);
        assert_eq!(requests.next(), Some(Request::Ahead(10)));
        requests.done(Request::Ahead(10));
        let none = Requests::new(1, 0);
        none.ahead(&blocks);
        none.close();
        assert_eq!(none.next(), None);
    }
}
