//! What is where: sets of blocks behind striped locks.
//!
//! A block has one set that it can lie in, by its number, and sets share locks, a *stripe* to each. Locks
//! are taken by who misses, never by who hits: see [`words`](super::words).
//!
//! A block is *pinned* while somebody needs it to stay: from before it is asked for until he who asked is in an
//! epoch that protects it. Pinned blocks are not given up, so a set can come to hold more than its ways for
//! a while. That is bounded, because a thread pins no more than one page or leaf needs, and the budget holds
//! it back beforehand.

use super::deadline::Deadline;
use super::policy::{Policy, Replacement, Use, Way};
use super::sync::{AtomicU16, AtomicUsize, Condvar, Mutex, MutexGuard, Ordering, PoisonError};
use super::words::Words;
use crossbeam::utils::CachePadded;

/// How a cache is laid out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape {
    /// Locks, each for every so-manieth set.
    pub stripes: usize,
    /// Sets, at least as many.
    pub sets: usize,
    /// Blocks that a set holds.
    pub ways: usize,
    /// Which of them makes room.
    pub policy: Replacement,
}

impl Shape {
    /// Blocks that it holds.
    pub const fn blocks(&self) -> usize {
        self.sets * self.ways
    }
}

/// What became of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Asked {
    /// It is here.
    Here,
    /// Somebody else is getting it.
    Coming,
    /// Who asked is to get it, and to say [`arrived`](Directory::arrived) or [`failed`](Directory::failed).
    Absent,
}

/// The sets of one cache.
#[derive(Debug)]
pub struct Directory {
    shape: Shape,
    stripes: Box<[CachePadded<Stripe>]>,
    /// Blocks that sets hold or wait for, in all.
    held: CachePadded<AtomicUsize>,
}

#[derive(Debug)]
struct Stripe {
    sets: Mutex<Sets>,
    arrived: Condvar,
}

#[derive(Debug)]
struct Sets {
    sets: Vec<Set>,
    /// Blocks on their way: a stripe's share of what threads have asked for, few enough to look through.
    coming: Vec<u32>,
    /// Threads that wait for one of them: to wake nobody takes a call to the system.
    waiting: usize,
}

#[derive(Debug)]
struct Set {
    /// In the order of arrival, as far as the policy keeps it.
    ways: Vec<Way>,
    policy: Box<dyn Policy>,
    coming: usize,
}

/// How often each block is pinned.
#[derive(Debug)]
pub struct Pins(Box<[AtomicU16]>);

impl Pins {
    /// None is.
    pub fn new(blocks: usize) -> Self {
        Self((0..blocks).map(|_| AtomicU16::new(0)).collect())
    }

    /// Memory of so many.
    pub const fn bytes(blocks: usize) -> usize {
        blocks * size_of::<AtomicU16>()
    }

    /// Lets go of a block that [`Directory::pin`] holds.
    pub fn unpin(&self, block: u32) {
        self.0[block as usize].fetch_sub(1, Ordering::Release);
    }

    fn is_pinned(&self, block: u32) -> bool {
        self.0[block as usize].load(Ordering::Acquire) > 0
    }
}

impl Set {
    /// Declares blocks gone until there are no more than `ways`, or all the others are pinned.
    fn make_room(&mut self, ways: usize, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) {
        let uses =
            |block: u32| -> Option<Use> { (!pins.is_pinned(block)).then(|| words.uses(block as usize)) };
        while self.ways.len() + self.coming > ways {
            let Some(victim) = self.policy.victim(&mut self.ways, &uses) else { break };
            let victim = self.ways.remove(victim).block;
            words.leave(victim as usize);
            gone(victim);
        }
    }
}

impl Stripe {
    /// Wakes those that wait for what was on its way.
    fn wake(&self, sets: &Sets) {
        if sets.waiting > 0 {
            self.arrived.notify_all();
        }
    }
}

impl Sets {
    /// A block that was on its way to a set is here, and was used so.
    fn arrived(&mut self, at: usize, block: u32, seen: Use) {
        self.coming.retain(|&other| other != block);
        let set = &mut self.sets[at];
        set.coming -= 1;
        let mut way = Way { block, seen, mark: 0 };
        set.policy.arrived(&mut way);
        set.ways.push(way);
    }
}

impl Directory {
    /// Empty sets.
    pub fn new(shape: Shape) -> Self {
        assert!(shape.stripes > 0 && shape.sets >= shape.stripes && shape.ways > 0);
        let set = || Set { ways: Vec::new(), policy: shape.policy.policy(shape.ways), coming: 0 };
        let stripe = || {
            let sets = (0..shape.sets.div_ceil(shape.stripes)).map(|_| set()).collect();
            let sets = Mutex::new(Sets { sets, coming: Vec::new(), waiting: 0 });
            CachePadded::new(Stripe { sets, arrived: Condvar::new() })
        };
        let stripes = (0..shape.stripes).map(|_| stripe()).collect();
        Self { shape, stripes, held: CachePadded::default() }
    }

    /// Blocks that a set with so many, the one that comes among them, may hold at the moment. As long as there is room in
    /// all, as many as come: otherwise some sets would have to give blocks up that others have room for. From then on, one
    /// has to go for each that comes, and two where a set has more than its ways.
    fn ways(&self, held: usize) -> usize {
        if self.held.load(Ordering::Relaxed) <= self.shape.blocks() {
            usize::MAX
        } else if held > self.shape.ways {
            self.shape.ways.max(held - 2)
        } else {
            held.saturating_sub(1).max(1)
        }
    }

    /// Has a set be within what it may hold, and counts what goes.
    fn make_room(&self, set: &mut Set, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) {
        set.make_room(self.ways(set.ways.len() + set.coming), words, pins, &mut self.counting(gone));
    }

    /// Tells `gone` of blocks that go, and counts them.
    fn counting(&self, gone: &mut dyn FnMut(u32)) -> impl FnMut(u32) {
        |block| {
            self.held.fetch_sub(1, Ordering::Relaxed);
            gone(block);
        }
    }

    /// A block's stripe, locked, and its set's place there.
    fn lock(&self, block: u32) -> (&Stripe, MutexGuard<'_, Sets>, usize) {
        // Neighbours go to different stripes and sets, and no set gets more of a scene than its share: what
        // fits all together stays.
        let set = block as usize % self.shape.sets;
        let stripe = &self.stripes[set % self.shape.stripes];
        (stripe, stripe.sets.lock().unwrap_or_else(PoisonError::into_inner), set / self.shape.stripes)
    }

    /// Pins a block and asks for it. What must go for it is declared gone, and `gone` is told.
    ///
    /// `gone` is told while the lock is held: from then on somebody else may ask for that block, and must find
    /// it among those that are on their way out.
    pub fn pin(&self, block: u32, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) -> Asked {
        let (_, mut sets, at) = self.lock(block);
        // Under the lock, so that nobody is giving it up at the moment.
        pins.0[block as usize].fetch_add(1, Ordering::AcqRel);
        self.ask_locked(&mut sets, at, block, words, pins, gone)
    }

    /// The same without pinning it.
    pub fn ask(&self, block: u32, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) -> Asked {
        let (_, mut sets, at) = self.lock(block);
        self.ask_locked(&mut sets, at, block, words, pins, gone)
    }

    /// Asks for an absent block that has a way free in its set: whether it is that, and now the caller's to bring.
    pub fn claim(&self, block: u32, words: &Words) -> bool {
        let (_, mut sets, at) = self.lock(block);
        let Sets { sets, coming, .. } = &mut *sets;
        let set = &mut sets[at];
        let has_way = set.ways.len() + set.coming < self.shape.ways;
        let is_absent = has_way && !words.is_here(block as usize) && !coming.contains(&block);
        if is_absent {
            coming.push(block);
            set.coming += 1;
            self.held.fetch_add(1, Ordering::Relaxed);
        }
        is_absent
    }

    fn ask_locked(
        &self,
        sets: &mut Sets,
        at: usize,
        block: u32,
        words: &Words,
        pins: &Pins,
        gone: &mut dyn FnMut(u32),
    ) -> Asked {
        if words.is_here(block as usize) {
            return Asked::Here;
        }
        if sets.coming.contains(&block) {
            return Asked::Coming;
        }
        sets.coming.push(block);
        let set = &mut sets.sets[at];
        set.coming += 1;
        self.held.fetch_add(1, Ordering::Relaxed);
        self.make_room(set, words, pins, gone);
        Asked::Absent
    }

    /// The block has come: all of it has been written.
    pub fn arrived(&self, block: u32, words: &Words, tick: u32) {
        let (stripe, mut sets, at) = self.lock(block);
        sets.arrived(at, block, words.arrive(block as usize, tick));
        stripe.wake(&sets);
    }

    /// The block has come ahead of need; whether nobody needs it yet.
    pub fn arrived_ahead(&self, block: u32, words: &Words, pins: &Pins, tick: u32) -> bool {
        let (stripe, mut sets, at) = self.lock(block);
        // Who has pinned it looks at it without another word.
        let is_needed = pins.is_pinned(block);
        let arrive = if is_needed { Words::arrive_used } else { Words::arrive_ahead };
        sets.arrived(at, block, arrive(words, block as usize, tick));
        stripe.wake(&sets);
        !is_needed
    }

    /// Declares a block gone that came ahead of need, unless it was used or is pinned, and tells `gone`.
    pub fn give_up_unused(&self, block: u32, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) {
        let (_, mut sets, at) = self.lock(block);
        if !pins.is_pinned(block) && words.leave_unused(block as usize) {
            sets.sets[at].ways.retain(|way| way.block != block);
            self.counting(gone)(block);
        }
    }

    /// The block will not come.
    pub fn failed(&self, block: u32) {
        let (stripe, mut sets, at) = self.lock(block);
        sets.coming.retain(|&other| other != block);
        sets.sets[at].coming -= 1;
        self.held.fetch_sub(1, Ordering::Relaxed);
        stripe.wake(&sets);
    }

    /// Waits until a pinned block has come, or has failed to; whether that was before the deadline.
    pub fn wait(&self, block: u32, deadline: &Deadline) -> bool {
        let (stripe, mut sets, _) = self.lock(block);
        while sets.coming.contains(&block) {
            let left = deadline.left();
            if left.is_some_and(|left| left.is_zero()) {
                return false;
            }
            sets.waiting += 1;
            sets = match left {
                None => stripe.arrived.wait(sets).unwrap_or_else(PoisonError::into_inner),
                Some(left) => {
                    stripe.arrived.wait_timeout(sets, left).unwrap_or_else(PoisonError::into_inner).0
                }
            };
            sets.waiting -= 1;
        }
        true
    }

    /// Declares blocks gone that sets hold beyond their ways, but for pinned ones, and tells `gone`.
    pub fn shrink(&self, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) {
        let mut gone = self.counting(gone);
        for stripe in &self.stripes {
            let mut sets = stripe.sets.lock().unwrap_or_else(PoisonError::into_inner);
            sets.sets.iter_mut().for_each(|set| set.make_room(self.shape.ways, words, pins, &mut gone));
        }
    }

    /// Declares all blocks gone that are not pinned, and tells `gone`.
    pub fn clear(&self, words: &Words, pins: &Pins, gone: &mut dyn FnMut(u32)) {
        let mut gone = self.counting(gone);
        for stripe in &self.stripes {
            let mut sets = stripe.sets.lock().unwrap_or_else(PoisonError::into_inner);
            for set in &mut sets.sets {
                set.ways.retain(|way| {
                    let stays = pins.is_pinned(way.block);
                    if !stays {
                        words.leave(way.block as usize);
                        gone(way.block);
                    }
                    stays
                });
                set.policy = self.shape.policy.policy(self.shape.ways);
            }
        }
    }

    /// Blocks that are here or on their way.
    #[cfg(test)]
    fn len(&self) -> usize {
        let held = |stripe: &CachePadded<Stripe>| {
            let sets = stripe.sets.lock().unwrap_or_else(PoisonError::into_inner);
            sets.sets.iter().map(|set| set.ways.len() + set.coming).sum::<usize>()
        };
        self.stripes.iter().map(held).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::{Duration, Instant};

    struct Small {
        directory: Directory,
        words: Words,
        pins: Pins,
    }

    impl Small {
        fn new(sets: usize, ways: usize) -> Self {
            let shape = Shape { stripes: 1, sets, ways, policy: Replacement::Fifo };
            Self { directory: Directory::new(shape), words: Words::new(200, 0), pins: Pins::new(200) }
        }

        fn pin(&self, block: u32) -> (Asked, Vec<u32>) {
            let mut gone = Vec::new();
            let asked = self.directory.pin(block, &self.words, &self.pins, &mut |block| gone.push(block));
            (asked, gone)
        }

        fn arrived(&self, block: u32) {
            self.directory.arrived(block, &self.words, 0);
        }
    }

    #[test]
    fn a_block_is_got_once_and_pinned_ones_stay() {
        let small = Small::new(1, 2);
        assert_eq!(small.pin(7), (Asked::Absent, vec![]));
        assert_eq!(small.pin(7), (Asked::Coming, vec![]));
        small.arrived(7);
        assert_eq!(small.pin(7), (Asked::Here, vec![]));
        assert_eq!(small.pin(8), (Asked::Absent, vec![]));
        small.arrived(8);
        // Full, and all are pinned: it holds more for a while.
        assert_eq!(small.pin(9), (Asked::Absent, vec![]));
        small.arrived(9);
        assert_eq!(small.directory.len(), 3);
        small.pins.unpin(8);
        (0..2).for_each(|_| small.pins.unpin(7));
        // Pinned once more: 8 has to go, and one more is too many, but 7 and 9 must stay.
        assert_eq!(small.pin(10), (Asked::Absent, vec![8]));
        small.arrived(10);
        assert!(!small.words.is_here(8) && small.words.is_here(7));
        small.pins.unpin(7);
        assert_eq!(small.pin(11), (Asked::Absent, vec![7]));
        (9..12).for_each(|block| small.pins.unpin(block));
        small.arrived(11);
        assert_eq!(small.pin(12), (Asked::Absent, vec![9, 10]), "back to what it may hold");
    }

    #[test]
    fn what_failed_can_be_asked_for_again() {
        let small = Small::new(1, 1);
        assert_eq!(small.pin(1).0, Asked::Absent);
        small.directory.failed(1);
        assert!(small.directory.wait(1, &Deadline::default()));
        assert!(!small.words.is_here(1));
        assert_eq!(small.pin(1).0, Asked::Absent);
        assert_eq!(small.directory.len(), 1);
    }

    #[test]
    fn nobody_waits_beyond_the_deadline() {
        let small = Small::new(1, 1);
        assert_eq!(small.pin(1).0, Asked::Absent);
        let deadline = Deadline::default();
        deadline.set(Some(Instant::now() + Duration::from_millis(5)));
        assert!(!small.directory.wait(1, &deadline));
        assert!(deadline.has_passed());
        small.arrived(1);
        assert!(small.directory.wait(1, &deadline), "it is here: there is nothing to wait for");
    }

    #[test]
    fn a_full_set_holds_more_while_others_have_room() {
        let small = Small::new(8, 2);
        // All of one set, until there is no room for more in all.
        let come = |block| {
            let (asked, gone) = small.pin(block);
            assert_eq!(asked, Asked::Absent, "{block}");
            small.arrived(block);
            small.pins.unpin(block);
            assert_eq!(small.directory.len(), small.directory.held.load(Ordering::Relaxed));
            assert!(small.directory.len() <= 16);
            gone
        };
        assert!((0..16).all(|i| come(8 * i).is_empty()));
        assert_eq!(come(8 * 16), [0, 8], "two for one");
        assert!(come(1).is_empty(), "there is room that the full set has given up");
        assert_eq!(come(9), [1], "there is none, and its own set is not the one that has too many");
        small.directory.shrink(&small.words, &small.pins, &mut |_| ());
        assert_eq!(small.directory.len(), 3, "two of the full set");
        assert!((2..15).all(|i| come(8 * i + 2).is_empty()), "there is room again");
    }

    #[test]
    fn blocks_spread_over_the_sets() {
        let small = Small::new(8, 2);
        for block in 0..100 {
            let (asked, gone) = small.pin(block);
            assert_eq!((asked, gone.len()), (Asked::Absent, usize::from(block >= 16)));
            small.arrived(block);
            small.pins.unpin(block);
        }
        assert_eq!(small.directory.len(), 16);
    }
}
