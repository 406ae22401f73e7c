//! Blocks under stress: many threads, a cache much too small for all, deadlines that come and go.

use super::blocks::Blocks;
use super::layout::{Array, Layout};
use super::plan::{CacheOptions, Loading, Plan, Prefetch};
use super::policy::Replacement;
use super::source::Source;
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
                    let found = || {
                        wanted.iter().all(|&block| {
                            // SAFETY: it was here when the epoch was entered, which goes on.
                            let words: &[u8; BLOCK] = unsafe { &*blocks.slots.at(block as usize).cast() };
                            words.as_chunks::<4>().0.iter().all(|word| *word == (block + 1).to_le_bytes())
                        })
                    };
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
