//! Blocks under stress: many threads, a cache much too small for all, deadlines that come and go.

use super::blocks::Blocks;
use super::layout::{Array, Layout};
use super::plan::{CacheOptions, Loading, Plan, Prefetch};
use super::policy::Replacement;
use super::source::Source;
use super::words::Notes;
use std::ops::Range;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;
use std::time::{Duration, Instant};

const BLOCK: usize = 4096;

/// Blocks full of their own number.
#[derive(Debug)]
struct Numbered;

impl Source for Numbered {
    fn read(&self, _: Array, byte: usize, into: &mut [u8]) -> crate::error::Result<()> {
        for (block, into) in (byte / BLOCK..).zip(into.chunks_mut(BLOCK)) {
            into.as_chunks_mut::<4>().0.fill((block as u32 + 1).to_le_bytes());
        }
        Ok(())
    }

    fn read_at_once(&self, array: Array, byte: usize, into: &mut [u8]) -> crate::error::Result<bool> {
        // Of every third block something is there, but not all.
        let is_whole = !(byte / BLOCK).is_multiple_of(3);
        let count = if is_whole { into.len() } else { 100 };
        self.read(array, byte, &mut into[..count])?;
        Ok(is_whole)
    }
}

/// Whether a block that is here is full of its own number.
///
/// # Safety
/// It was here when the epoch was entered that the caller is in.
unsafe fn is_itself(blocks: &Blocks, block: u32) -> bool {
    // SAFETY: the caller says so.
    let words: &[u8; BLOCK] = unsafe { &*blocks.slots.at(block as usize).cast() };
    words.as_chunks::<4>().0.iter().all(|word| *word == (block + 1).to_le_bytes())
}

/// Threads that ask for blocks at random, hold some for a while, and look whether they are what they
/// should be, in a cache that is much too small for all.
fn stress(threads: usize, options: &CacheOptions, rounds: u32, bounded: bool) {
    const BLOCKS: usize = 60;
    let layout = Layout::new([0, 0, 0, BLOCKS * BLOCK, 0, 0], BLOCK);
    let most = 3;
    let plan = Plan::new(options, Plan::least(options, most) + 4, most, threads, threads).expect("enough");
    let plan = Plan { ahead: if options.prefetch == Prefetch::Ahead { 3 } else { 0 }, ..plan };
    let (blocks, loaders) = Blocks::new(layout, Box::new(Numbered), options, &plan, threads).expect("starts");
    let late = AtomicU32::new(0);
    thread::scope(|scope| {
        if bounded {
            // Deadlines that come and go, which threads run into wherever they are.
            let blocks = &blocks;
            scope.spawn(move || {
                for i in 0..400 {
                    let soon = Instant::now() + Duration::from_micros(i % 90);
                    blocks.deadline.set((i % 4 != 0).then_some(soon));
                    thread::sleep(Duration::from_micros(100));
                }
                blocks.deadline.set(None);
            });
        }
        for number in 0..threads as u32 {
            let (blocks, loaders, late) = (&blocks, &loaders, &late);
            scope.spawn(move || {
                let mut state = number.wrapping_mul(0x9e37_79b9) | 1;
                let mut random = |below: usize| {
                    state ^= state << 13;
                    state ^= state >> 17;
                    state ^= state << 5;
                    state as usize % below
                };
                let reader = blocks.epochs.reader().expect("there is room");
                for _ in 0..rounds {
                    let wanted: Vec<u32> = (0..=random(most)).map(|_| random(BLOCKS) as u32).collect();
                    if random(3) == 0 {
                        let guess: Vec<u32> = (0..random(8)).map(|_| random(BLOCKS) as u32).collect();
                        loaders.ahead(&guess);
                    }
                    if options.prefetch == Prefetch::Beside && random(50) == 0 {
                        // Room, and a new frame in which nothing had to go so far.
                        blocks.clear();
                        blocks.begin_frame();
                    }
                    if random(20) == 0 {
                        // What is still at home moves.
                        blocks.begin_frame();
                    }
                    let Ok(gathered) = blocks.gather(loaders, &wanted, || ()) else {
                        late.fetch_add(1, Ordering::Relaxed);
                        continue;
                    };
                    reader.enter();
                    drop(gathered);
                    // SAFETY: they were here when the epoch was entered, which goes on.
                    let found = || wanted.iter().all(|&block| unsafe { is_itself(blocks, block) });
                    assert!(found(), "{wanted:?} at once");
                    (0..random(4)).for_each(|_| thread::yield_now());
                    assert!(found(), "{wanted:?} later in the epoch");
                    reader.leave();
                }
            });
        }
    });
    assert!(blocks.committed_bytes()[1] <= plan.all * BLOCK);
    let late = late.into_inner();
    assert!(late > 0 || !bounded, "the test tests nothing");
    loaders.wait_ahead();
    let stats = blocks.take_stats();
    assert!(bounded || stats.evictions > u64::from(rounds));
    let comes = options.loading.loaders() > 0;
    assert_eq!(stats.prefetched > 0, comes, "{stats:?}");
    let left = (0..BLOCKS).filter(|&block| blocks.words.is_unused(block)).count();
    assert_eq!(stats.prefetched, stats.prefetched_used + stats.prefetched_unused + left as u64);
    if options.prefetch == Prefetch::Ahead {
        assert!(bounded || comes == (stats.prefetched_used > 0), "{stats:?}");
        assert!(left <= plan.ahead, "{left} blocks that nobody has used");
    }
    // Nothing is left pinned, or taken from the quota.
    for block in 0..BLOCKS as u32 {
        let _ = blocks.gather(&loaders, &[block], || ()).expect("there is no deadline");
    }
    blocks.clear();
    assert_eq!(blocks.committed_bytes()[0], 0);
}

#[test]
fn blocks_are_what_they_should_be_for_as_long_as_they_are_read() {
    for (i, policy) in Replacement::ALL.into_iter().enumerate() {
        for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }] {
            let options = CacheOptions {
                block: BLOCK,
                ways: [1, 2, 5][i % 3],
                stripes: [1, 3][i % 2],
                policy,
                nodes: None,
                loading,
                direct: false,
                prefetch: [Prefetch::Ahead, Prefetch::Beside][i % 2],
            };
            stress(6, &options, 3000, false);
            stress(6, &options, 3000, true);
        }
    }
}

#[test]
fn every_policy_holds_sets_of_one() {
    for policy in Replacement::ALL {
        for (stripes, loading) in [
            (1, Loading::Synchronous),
            (1024, Loading::Asynchronous { loaders: 2 }),
            (3, Loading::Synchronous),
        ] {
            let nodes = (stripes == 3).then_some((0.4, policy));
            let prefetch = if stripes == 1 { Prefetch::Ahead } else { Prefetch::Beside };
            let options = CacheOptions {
                block: BLOCK,
                ways: 1,
                stripes,
                policy,
                nodes,
                loading,
                direct: false,
                prefetch,
            };
            stress(4, &options, 1500, false);
        }
    }
}

#[test]
fn many_threads_get_through_a_tiny_cache() {
    /// Only what hangs takes so long.
    const LONG: Duration = Duration::from_secs(120);
    for (ways, loading) in [
        (1, Loading::Synchronous),
        (1, Loading::Asynchronous { loaders: 1 }),
        (8, Loading::Asynchronous { loaders: 16 }),
    ] {
        let (tell, told) = mpsc::channel();
        // Not in a scope: what hangs is left behind.
        thread::spawn(move || {
            let prefetch = Prefetch::Beside;
            let options =
                CacheOptions { block: BLOCK, ways, stripes: 2, loading, prefetch, ..CacheOptions::default() };
            stress(32, &options, 400, false);
            stress(32, &options, 400, true);
            let _ = tell.send(());
        });
        match told.recv_timeout(LONG) {
            Ok(()) => {}
            Err(RecvTimeoutError::Timeout) => panic!("32 threads hang: {ways} ways, {loading:?}"),
            Err(RecvTimeoutError::Disconnected) => panic!("it failed: {ways} ways, {loading:?}"),
        }
    }
}

#[test]
#[cfg(target_os = "linux")]
fn homes_that_wait_to_be_left_are_nobody_s_before() {
    let options = CacheOptions {
        block: BLOCK,
        loading: Loading::Synchronous,
        prefetch: Prefetch::Off,
        ..CacheOptions::default()
    };
    let plan = Plan::new(&options, Plan::least(&options, 3) + 4, 3, 1, 1).expect("enough");
    let layout = Layout::new([0, 0, 0, 60 * BLOCK, 0, 0], BLOCK);
    let (blocks, loaders) = Blocks::new(layout, Box::new(Numbered), &options, &plan, 1).expect("starts");
    let bring = |block: u32| drop(blocks.gather(&loaders, &[block], || ()).expect("there is no deadline"));
    bring(7);
    // It is given up while somebody may read it, who leaves; somebody else comes before it moves, and stays.
    let [first, second] = [(); 2].map(|()| blocks.epochs.reader().expect("there is room"));
    first.enter();
    blocks.clear();
    first.leave();
    second.enter();
    assert_eq!(blocks.move_in(), 1, "its place is its own until somebody takes it back");
    blocks.clear();
    bring(7);
    second.leave();
    assert!(blocks.reclaim(), "its first home goes now");
    // SAFETY: it is here, and nobody else is.
    assert_eq!(unsafe { *blocks.slots.at(7).cast::<u32>() }, 8);
}

/// Threads that keep in mind which pairs of blocks they have seen, while others drive these out and frames and ticks go on.
fn stress_known(policy: Replacement, loading: Loading, prefetch: Prefetch) {
    const BLOCKS: usize = 60;
    const THREADS: usize = 4;
    // Each thread goes so many rounds; then it goes on until enough has been known, which is up to who runs when, but not for ever.
    const ROUNDS: Range<usize> = 6000..1_000_000;
    const ENOUGH: u32 = 200;
    let layout = Layout::new([0, 0, 0, BLOCKS * BLOCK, 0, 0], BLOCK);
    let options =
        CacheOptions { block: BLOCK, ways: 4, policy, loading, prefetch, ..CacheOptions::default() };
    let plan = Plan::new(&options, Plan::least(&options, 2) + 20, 2, THREADS, THREADS).expect("enough");
    let (blocks, loaders) =
        Blocks::new(layout, Box::new(Numbered), &options, &plan, THREADS).expect("starts");
    let times_known = AtomicU32::new(0);
    thread::scope(|scope| {
        for number in 0..THREADS {
            let (blocks, loaders, times_known) = (&blocks, &loaders, &times_known);
            scope.spawn(move || {
                let reader = blocks.epochs.reader().expect("there is room");
                let (notes, mut state) = (Notes::default(), number as u64 * 7919 + 1);
                let mut known = blocks.knowledge();
                for round in 0..ROUNDS.end {
                    if round >= ROUNDS.start && times_known.load(Ordering::Relaxed) >= ENOUGH {
                        break;
                    }
                    state =
                        state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                    // Mostly one of a few.
                    let first = (state >> 33) as usize % if round % 8 == 0 { BLOCKS } else { 8 };
                    let list = [first as u32, ((first * 7 + 3) % BLOCKS) as u32];
                    let enter = || {
                        reader.enter();
                        known.begin(blocks.words.eras.now());
                    };
                    enter();
                    let tick = blocks.tick();
                    if known.has(first * 10, tick) {
                        times_known.fetch_add(1, Ordering::Relaxed);
                    } else {
                        let uses = list.map(|block| blocks.words.use_in(block as usize, tick, &notes));
                        if uses == [true; 2] {
                            known.add(first * 10, tick);
                        } else {
                            reader.leave();
                            let gathered =
                                blocks.gather(loaders, &list, || ()).expect("there is no deadline");
                            enter();
                            drop(gathered);
                        }
                    }
                    for _ in 0..2 {
                        for block in list {
                            // SAFETY: it was here when the epoch was entered, which goes on.
                            assert!(unsafe { is_itself(blocks, block) }, "{block} is another's");
                        }
                        thread::yield_now();
                    }
                    reader.leave();
                    blocks.words.hand_over(&notes, known.take_uses(), number);
                    blocks.sessions.fetch_add(1, Ordering::Relaxed);
                    if round % 300 == 0 {
                        blocks.begin_frame();
                        // Another thread goes on with what this one knew.
                        blocks.pass_on(known);
                        known = blocks.knowledge();
                    }
                }
            });
        }
    });
    assert!(times_known.into_inner() >= ENOUGH, "too little is known, or for too short a time");
    assert!(blocks.take_stats().evictions > 100, "what is known is never driven out");
}

#[test]
fn lists_that_are_known_are_here() {
    for policy in Replacement::ALL {
        stress_known(policy, Loading::Synchronous, Prefetch::Off);
        for prefetch in [Prefetch::Beside, Prefetch::Ahead] {
            stress_known(policy, Loading::Asynchronous { loaders: 3 }, prefetch);
        }
    }
}

#[test]
fn what_others_give_up_is_looked_at_anew_and_what_nobody_uses_goes_unnoticed() {
    const LIST: usize = 40;
    let options = CacheOptions {
        block: BLOCK,
        ways: 64,
        policy: Replacement::Lru,
        loading: Loading::Synchronous,
        prefetch: Prefetch::Off,
        ..CacheOptions::default()
    };
    let plan = Plan::new(&options, 40, 3, 1, 1).expect("enough");
    let layout = Layout::new([0, 0, 0, 60 * BLOCK, 0, 0], BLOCK);
    let (blocks, loaders) = Blocks::new(layout, Box::new(Numbered), &options, &plan, 1).expect("starts");
    let bring = |block: u32| drop(blocks.gather(&loaders, &[block], || ()).expect("there is no deadline"));
    let evictions = || blocks.take_stats().evictions;
    let next_tick = || {
        let tick = blocks.tick();
        while blocks.tick() == tick {
            blocks.sessions.fetch_add(1, Ordering::Relaxed);
        }
    };
    (0..40).for_each(bring);
    assert!(evictions() > 0);
    let (known, reader) = (blocks.knowledge(), blocks.epochs.reader().expect("there is room"));
    // Whether a list of block 39 is known; it is from then on.
    let visit = || {
        reader.enter();
        known.begin(blocks.words.eras.now());
        let is_known = known.has(LIST, blocks.tick());
        assert!(is_known || blocks.words.use_in(39, blocks.tick(), &Notes::default()));
        known.add(LIST, blocks.tick());
        reader.leave();
        is_known
    };
    next_tick();
    bring(40);
    assert!(!visit() && visit());
    bring(41);
    bring(42);
    assert!(visit(), "what went was used before this tick");
    next_tick();
    assert!(visit(), "nothing went");
    bring(43);
    assert!(!visit() && visit(), "policies know what is in view of each tick in which something goes");
    assert_eq!(evictions(), 4);
    // Somebody else gives it up, and it comes again.
    blocks.clear();
    bring(39);
    assert!(!visit() && visit());
}

#[test]
fn an_era_ends_with_its_ticks_where_nothing_goes() {
    // As `ERA` has it: in ticks, of 64 squares each.
    const ERA: u32 = 1 << 14;
    let options = CacheOptions { block: BLOCK, loading: Loading::Synchronous, ..CacheOptions::default() };
    let plan = Plan::new(&options, 100, 3, 1, 1).expect("enough");
    let layout = Layout::new([0, 0, 0, 10 * BLOCK, 0, 0], BLOCK);
    let (blocks, _loaders) = Blocks::new(layout, Box::new(Numbered), &options, &plan, 1).expect("starts");
    let first = blocks.words.eras.now();
    for (squares, is_first) in [(0, true), (ERA * 64, true), (1, false)] {
        blocks.sessions.fetch_add(squares, Ordering::Relaxed);
        blocks.begin_frame();
        assert_eq!(blocks.words.eras.now() == first, is_first, "{squares} more");
    }
    let second = blocks.words.eras.now();
    blocks.begin_frame();
    assert_eq!(blocks.words.eras.now(), second, "it has just begun");
}
