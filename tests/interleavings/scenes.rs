//! Short scenes of two to four threads around a cache's blocks, each to be played in thousands of ways.

use crate::blocks::Blocks;
use crate::directory::Shape;
use crate::error::{Error, Result};
use crate::layout::{Array, Layout};
use crate::loaders::Loaders;
use crate::plan::{CacheOptions, Loading, Plan, Prefetch};
use crate::policy::Replacement;
use crate::source::Source;
use crate::sync::{Arc, Ordering, thread};
use std::io;
use std::time::Instant;

const BLOCK: usize = 4096;

/// Blocks that may be here ahead of need, or on their way.
const AHEAD: usize = 2;

/// Blocks full of their own number; one of them may be one that cannot be read.
#[derive(Debug)]
struct Numbered {
    broken: Option<usize>,
}

impl Source for Numbered {
    fn read(&self, _: Array, byte: usize, into: &mut [u8]) -> Result<()> {
        let blocks = byte / BLOCK..(byte + into.len()) / BLOCK;
        if self.broken.is_some_and(|broken| blocks.contains(&broken)) {
            let source = io::Error::other("the disk is gone");
            return Err(Error::Read { path: "scene.rpk".into(), source });
        }
        // Not all at once: somebody may look meanwhile who should not.
        for (block, into) in blocks.zip(into.chunks_mut(BLOCK)) {
            let (first, second) = into.split_at_mut(BLOCK / 2);
            first.fill(number(block));
            thread::yield_now();
            second.fill(number(block));
        }
        Ok(())
    }
}

/// What a block is full of; never 0, which is what freed memory reads as.
fn number(block: usize) -> u8 {
    block as u8 + 1
}

/// A cache that holds as few of a scene's blocks as can be: one set, and hardly more memory than what may be
/// pinned, so that almost every miss drives something out and has to wait until memory is freed.
fn cache(ways: usize, policy: Replacement, broken: Option<usize>) -> (Arc<Blocks>, Loaders) {
    cache_with(ways, policy, broken, Loading::Synchronous, Prefetch::Off)
}

const BLOCKS: usize = 6;

/// The same with this loading. Loaders may have two blocks there that nobody has used yet: one of them is being
/// read.
fn cache_with(
    ways: usize,
    policy: Replacement,
    broken: Option<usize>,
    loading: Loading,
    prefetch: Prefetch,
) -> (Arc<Blocks>, Loaders) {
    const PINNED: usize = 3;
    let options = CacheOptions {
        block: BLOCK,
        ways,
        stripes: 1,
        policy,
        nodes: None,
        loading,
        prefetch,
        direct: false,
    };
    let layout = Layout::new([0, 0, 0, BLOCKS * BLOCK, 0, 0], BLOCK);
    let shape = Shape { stripes: 1, sets: 1, ways, policy };
    let ahead = if prefetch == Prefetch::Ahead { AHEAD } else { 0 };
    let plan = Plan { shapes: [Some(shape), None], pinned: PINNED, ahead, all: ways + PINNED, lines: 128 };
    Blocks::new(layout, Box::new(Numbered { broken }), &options, &plan, 3).expect("it can begin")
}

/// Has blocks come and looks at them for a while; whether they came.
fn read(blocks: &Blocks, loaders: &Loaders, wanted: &[u32]) -> bool {
    let reader = blocks.epochs.reader().expect("there is room");
    let Ok(gathered) = blocks.gather(loaders, wanted, || ()) else { return false };
    reader.enter();
    drop(gathered);
    if blocks.has_failed() {
        return false;
    }
    // As kernels do, without a look at the table if there seems to be no need of it.
    let (in_order, is_whole) = (blocks.slots.are_in_order(), blocks.is_whole());
    let find = |block: usize| {
        if in_order { blocks.slots.home(block * BLOCK) } else { blocks.slots.at(block) }
    };
    let look = |block: usize, place: *const u8| {
        // SAFETY: it was here when the epoch had been entered, which goes on.
        let bytes: &[u8; BLOCK] = unsafe { &*place.cast() };
        assert!(bytes.iter().all(|&byte| byte == number(block)), "block {block} is another's");
    };
    // Where a block lies is asked once, and holds until the epoch ends, wherever it may lie by then.
    let found: Vec<(usize, *const u8)> =
        wanted.iter().map(|&block| (block as usize, find(block as usize))).collect();
    for _ in 0..2 {
        found.iter().for_each(|&(block, place)| look(block, place));
        if is_whole {
            (0..BLOCKS).for_each(|block| look(block, blocks.slots.home(block * BLOCK)));
        }
        thread::yield_now();
    }
    // What others have brought meanwhile is good, too.
    (0..BLOCKS).filter(|&block| blocks.words.is_here(block)).for_each(|block| look(block, find(block)));
    true
}

/// What a thread reads, one after the other.
type List = &'static [&'static [u32]];

/// Threads read lists of blocks that drive one another's out; how much of its list came to each.
fn play(ways: usize, policy: Replacement, broken: Option<usize>, lists: &[List]) -> Vec<usize> {
    let (blocks, loaders) = cache(ways, policy, broken);
    let loaders = Arc::new(loaders);
    let threads = start(&blocks, &loaders, lists);
    let came = threads.into_iter().map(|thread| thread.join().expect("no panic")).collect();
    blocks.take_failure();
    leaves_nothing(&blocks);
    came
}

/// A thread for each list.
fn start(blocks: &Arc<Blocks>, loaders: &Arc<Loaders>, lists: &[List]) -> Vec<thread::JoinHandle<usize>> {
    let start = |&list: &List| {
        let (blocks, loaders) = (Arc::clone(blocks), Arc::clone(loaders));
        thread::spawn(move || list.iter().filter(|wanted| read(&blocks, &loaders, wanted)).count())
    };
    lists.iter().map(start).collect()
}

/// Nothing is pinned, kept or owed when nobody reads any more.
fn leaves_nothing(blocks: &Blocks) {
    blocks.clear();
    assert_eq!(blocks.committed_bytes()[0], 0, "memory is left");
}

/// Pairs of six blocks, each needed again after it was driven out.
const PAIRS: [List; 3] =
    [&[&[0, 1], &[2, 3], &[0, 1]], &[&[2, 4], &[0, 5], &[2, 1]], &[&[5, 3], &[4, 0], &[1, 2]]];

pub fn blocks_are_whole() {
    play(2, Replacement::Lru, None, &PAIRS);
}

pub fn sets_of_one() {
    play(1, Replacement::Fifo, None, &PAIRS);
}

pub fn asked_for_again() {
    // What one thread drives out again and again, the other asks for at the same moment.
    play(1, Replacement::Fifo, None, &[&[&[1], &[2], &[3], &[4]], &[&[0], &[0], &[0], &[0]]]);
}

pub fn a_failure_ends() {
    let came = play(1, Replacement::Fifo, Some(2), &PAIRS);
    assert!(came.iter().sum::<usize>() < 9, "one of them cannot come");
    let came = play(1, Replacement::Fifo, Some(2), &[&[&[2]], &[&[2]], &[&[2]]]);
    assert_eq!(came, [0; 3]);
}

/// Threads read while another one moves blocks from their homes to slots.
fn play_moves(lists: &[List]) -> usize {
    let (blocks, loaders) = cache(2, Replacement::Lru, None);
    let loaders = Arc::new(loaders);
    // The first one has to go for the last, but has its home until somebody needs room. So has the one between them.
    (0..3).for_each(|block| assert!(read(&blocks, &loaders, &[block])));
    let threads = start(&blocks, &loaders, lists);
    let moved = (0..3)
        .map(|_| {
            thread::yield_now();
            blocks.move_in()
        })
        .sum();
    threads.into_iter().for_each(|thread| assert!(thread.join().is_ok(), "no panic"));
    leaves_nothing(&blocks);
    moved
}

pub fn blocks_move() {
    assert_eq!(play_moves(&[&[&[1], &[1, 2]], &[&[2], &[2, 1]]]), 2);
    assert!(play_moves(&[&[&[1, 4], &[5], &[0, 1]], &[&[1], &[5, 4]]]) <= 2);
}

/// Threads read lists of blocks while another one asks for some ahead of need, one list after the other; how much of its
/// list came to each, and whether a block could not be read that was needed.
fn play_ahead(
    loaders: usize,
    ways: usize,
    broken: Option<usize>,
    lists: &[List],
    guesses: List,
) -> (Vec<usize>, bool) {
    let loading = Loading::Asynchronous { loaders };
    let (blocks, loaders) = cache_with(ways, Replacement::Sieve, broken, loading, Prefetch::Ahead);
    let loaders = Arc::new(loaders);
    let threads = start(&blocks, &loaders, lists);
    for guess in guesses {
        loaders.ahead(guess);
        thread::yield_now();
    }
    let came = threads.into_iter().map(|thread| thread.join().expect("no panic")).collect();
    loaders.forget_ahead();
    let has_failed = blocks.take_failure().is_some();
    let unused = (0..BLOCKS).filter(|&block| blocks.words.is_unused(block)).count() as u64;
    // One more could be on its way, but now none is.
    assert!(unused < AHEAD as u64, "{unused} blocks that nobody has used");
    let stats = blocks.take_stats();
    assert_eq!(stats.prefetched, stats.prefetched_used + stats.prefetched_unused + unused, "{stats:?}");
    leaves_nothing(&blocks);
    (came, has_failed)
}

const GUESSES: List = &[&[2, 4], &[1, 0, 5], &[3]];

pub fn ahead_of_need() {
    let (came, has_failed) = play_ahead(2, 2, None, &PAIRS[..2], GUESSES);
    assert!(came == [3, 3] && !has_failed, "all of it can be read");
}

pub fn ahead_in_sets_of_one() {
    let (came, has_failed) = play_ahead(1, 1, None, &[&[&[1], &[2]], &[&[0], &[1]]], &[&[1], &[0, 2], &[1]]);
    assert!(came == [2, 2] && !has_failed, "all of it can be read");
}

pub fn ahead_fails() {
    let (came, has_failed) = play_ahead(2, 1, Some(2), &[&[&[0], &[1]]], &[&[2, 1], &[2]]);
    assert!(came == [2] && !has_failed, "nobody needed what could not be read");
    let (came, has_failed) = play_ahead(2, 1, Some(2), &[&[&[2]], &[&[0], &[2]]], &[&[2, 0], &[2]]);
    assert!(came[0] == 0 && came[1] < 2 && has_failed, "{came:?}");
}

/// Threads read lists of blocks, which come with those beside them where there is room, while frames begin; how much of
/// its list came to each, and whether a block could not be read that was needed.
fn play_beside(ways: usize, broken: Option<usize>, lists: &[List]) -> (Vec<usize>, bool) {
    let loading = Loading::Asynchronous { loaders: 2 };
    let (blocks, loaders) = cache_with(ways, Replacement::Sieve, broken, loading, Prefetch::Beside);
    let loaders = Arc::new(loaders);
    let threads = start(&blocks, &loaders, lists);
    for _ in 0..3 {
        // Nothing had to go in this one so far.
        blocks.gone.store(0, Ordering::Relaxed);
        thread::yield_now();
    }
    let came = threads.into_iter().map(|thread| thread.join().expect("no panic")).collect();
    // They end what they have begun.
    drop(loaders);
    let has_failed = blocks.take_failure().is_some();
    let unused = (0..BLOCKS).filter(|&block| blocks.words.is_unused(block)).count() as u64;
    let stats = blocks.take_stats();
    assert_eq!(stats.prefetched, stats.prefetched_used + stats.prefetched_unused + unused, "{stats:?}");
    leaves_nothing(&blocks);
    (came, has_failed)
}

pub fn beside() {
    let (came, has_failed) = play_beside(3, None, &PAIRS[..2]);
    assert!(came == [3, 3] && !has_failed, "all of it can be read");
    let (came, has_failed) = play_beside(4, None, &[&[&[1], &[4]], &[&[2], &[5]], &[&[0]]]);
    assert!(came == [2, 2, 1] && !has_failed, "all of it can be read");
}

pub fn beside_fails() {
    let (came, has_failed) = play_beside(4, Some(2), &[&[&[1], &[0]], &[&[3]]]);
    assert!(came == [2, 1] && !has_failed, "nobody needed what could not be read");
    let (came, has_failed) = play_beside(4, Some(2), &[&[&[1]], &[&[2]]]);
    assert!(came[1] == 0 && has_failed, "{came:?}");
}

pub fn all_goes() {
    all_goes_while_it_is_looked_at(true);
    all_goes_while_it_is_looked_at(false);
}

/// All of a scene goes, which may be known to be whole by then, while somebody looks whether it is, and somebody else relies
/// on it.
fn all_goes_while_it_is_looked_at(is_known: bool) {
    let (blocks, _) = cache(BLOCKS, Replacement::Lru, None);
    while blocks.load_rest().expect("all can be read") > 0 {}
    assert!(!is_known || blocks.look_whether_whole(), "there is room for all");
    let reader = {
        let blocks = Arc::clone(&blocks);
        thread::spawn(move || {
            let reader = blocks.epochs.reader().expect("there is room");
            reader.enter();
            let look = |block: usize| {
                // SAFETY: all blocks were here when the epoch had been entered, which goes on.
                let bytes: &[u8; BLOCK] = unsafe { &*blocks.slots.home(block * BLOCK).cast() };
                assert!(bytes.iter().all(|&byte| byte == number(block)), "block {block} is not here");
            };
            if blocks.is_whole() {
                for _ in 0..3 {
                    thread::yield_now();
                    (0..BLOCKS).for_each(look);
                }
            }
            reader.leave();
        })
    };
    let looker = {
        let blocks = Arc::clone(&blocks);
        thread::spawn(move || blocks.look_whether_whole())
    };
    blocks.clear();
    thread::yield_now();
    blocks.reclaim();
    [reader.join(), looker.join().map(drop)].into_iter().for_each(|thread| thread.expect("no panic"));
    leaves_nothing(&blocks);
    assert!(!blocks.is_whole());
}

pub fn whole_and_not() {
    let loading = Loading::Asynchronous { loaders: 2 };
    let (blocks, loaders) = cache_with(BLOCKS, Replacement::Lru, None, loading, Prefetch::Beside);
    let loaders = Arc::new(loaders);
    let threads = start(&blocks, &loaders, &[&[&[0], &[4, 1], &[2]], &[&[2], &[5]]]);
    let fill = || while blocks.load_rest().expect("all can be read") > 0 {};
    for _ in 0..2 {
        blocks.allow_rest(1.0);
        loaders.rest();
        fill();
        blocks.look_whether_whole();
        thread::yield_now();
        loaders.forget_ahead();
        blocks.clear();
    }
    threads.into_iter().for_each(|thread| assert_eq!(thread.join().expect("no panic") / 2, 1));
    fill();
    assert!(blocks.look_whether_whole(), "nothing else brings or takes any");
    leaves_nothing(&blocks);
    assert!(!blocks.is_whole());
}

pub fn ahead_at_the_end() {
    let loading = Loading::Asynchronous { loaders: 2 };
    let (blocks, loaders) = cache_with(1, Replacement::Lru, None, loading, Prefetch::Ahead);
    loaders.ahead(&[0, 1, 2]);
    let reader = {
        let blocks = Arc::clone(&blocks);
        let loaders = Arc::new(loaders);
        let others = Arc::clone(&loaders);
        let reader = thread::spawn(move || read(&blocks, &others, &[3]));
        loaders.ahead(&[4, 5]);
        // They end with whoever has them last.
        reader
    };
    assert!(reader.join().expect("no panic"));
    leaves_nothing(&blocks);
}

pub fn a_deadline() {
    let (blocks, loaders) = cache(1, Replacement::Lru, None);
    let loaders = Arc::new(loaders);
    let readers = start(&blocks, &loaders, &[&[&[0], &[1], &[0, 1]], &[&[0], &[1], &[1, 0]]]);
    for _ in 0..4 {
        blocks.deadline.set(Some(Instant::now()));
        thread::yield_now();
        blocks.deadline.set(None);
        thread::yield_now();
    }
    for reader in readers {
        reader.join().expect("no panic");
    }
    assert!(read(&blocks, &loaders, &[0, 1]) && read(&blocks, &loaders, &[4, 5]), "all is as before");
    leaves_nothing(&blocks);
}
