//! Short scenes of two to four threads, each to be played in thousands of ways.

use crate::blocks::{Blocks, Loaders};
use crate::directory::Shape;
use crate::epoch::Epochs;
use crate::error::{Error, Result};
use crate::gate::Gate;
use crate::known::Known;
use crate::layout::{Array, Layout};
use crate::plan::{CacheOptions, Loading, Plan};
use crate::policy::Replacement;
use crate::quota::Quota;
use crate::source::Source;
use crate::sync::{Arc, AtomicBool, AtomicUsize, Ordering, thread};
use std::io;
use std::time::Instant;

const BLOCK: usize = 4096;

/// Blocks full of their own number; one of them may be one that cannot be read.
#[derive(Debug)]
struct Numbered {
    broken: Option<usize>,
}

impl Source for Numbered {
    fn read(&self, _: Array, byte: usize, into: &mut [u8]) -> Result<()> {
        if self.broken == Some(byte / BLOCK) {
            let source = io::Error::other("the disk is gone");
            return Err(Error::Read { path: "scene.rpk".into(), source });
        }
        // Not all at once: somebody may look meanwhile who should not.
        let (first, second) = into.split_at_mut(BLOCK / 2);
        first.fill(number(byte / BLOCK));
        thread::yield_now();
        second.fill(number(byte / BLOCK));
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
    const BLOCKS: usize = 6;
    const PINNED: usize = 3;
    let options = CacheOptions {
        block: BLOCK,
        ways,
        stripes: 1,
        policy,
        nodes: None,
        loading: Loading::Synchronous,
        direct: false,
    };
    let layout = Layout::new([0, 0, 0, BLOCKS * BLOCK, 0, 0], BLOCK);
    let shape = Shape { stripes: 1, sets: 1, ways, policy };
    let plan = Plan { shapes: [Some(shape), None], pinned: PINNED, all: ways + PINNED };
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
    for _ in 0..2 {
        for &block in wanted {
            // SAFETY: it was here when the epoch was entered, which goes on.
            let bytes = unsafe { blocks.arena.fill(block as usize * BLOCK, BLOCK) };
            assert!(bytes.iter().all(|&byte| byte == number(block as usize)), "block {block} is another's");
        }
        thread::yield_now();
    }
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

pub fn epochs_hold() {
    goes_while_it_is_read(false);
}

pub fn known_lists_hold() {
    goes_while_it_is_read(true);
}

/// Something that is there, declared gone, retired and freed, and two readers that may have found it; they may keep
/// in mind what they saw.
fn goes_while_it_is_read(keep_in_mind: bool) {
    let epochs = Epochs::new(4);
    let (here, freed) = (Arc::new(AtomicBool::new(true)), Arc::new(AtomicBool::new(false)));
    let readers: Vec<_> = (0..2)
        .map(|_| {
            let (reader, here, freed) =
                (epochs.reader().expect("room"), Arc::clone(&here), Arc::clone(&freed));
            thread::spawn(move || {
                let known = Known::new();
                for _ in 0..2 + usize::from(keep_in_mind) {
                    let epoch = reader.enter();
                    if known.has(1, epoch, 0) || here.load(Ordering::SeqCst) {
                        if keep_in_mind {
                            known.add(1, epoch, 0);
                        }
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                        thread::yield_now();
                        assert!(!freed.load(Ordering::SeqCst), "freed while it is read");
                    }
                    reader.leave();
                }
            })
        })
        .collect();
    here.store(false, Ordering::SeqCst);
    let retired = epochs.retire();
    while epochs.earliest() <= retired {
        thread::yield_now();
    }
    freed.store(true, Ordering::SeqCst);
    readers.into_iter().for_each(|reader| reader.join().expect("no panic"));
}

pub fn the_gate_holds() {
    let (gate, inside) = (Arc::new(Gate::new(1)), Arc::new(AtomicUsize::new(0)));
    let threads: Vec<_> = (0..3)
        .map(|i| {
            let (gate, inside) = (Arc::clone(&gate), Arc::clone(&inside));
            thread::spawn(move || {
                gate.begin();
                for waits in 0..=i % 2 {
                    if waits > 0 {
                        gate.leave();
                        thread::yield_now();
                        gate.resume();
                    }
                    assert_eq!(inside.fetch_add(1, Ordering::SeqCst), 0, "two at one place");
                    thread::yield_now();
                    inside.fetch_sub(1, Ordering::SeqCst);
                }
                gate.leave();
            })
        })
        .collect();
    threads.into_iter().for_each(|thread| thread.join().expect("no panic"));
}

pub fn the_quota_comes_round() {
    let (quota, out) = (Arc::new(Quota::new(3)), Arc::new(AtomicUsize::new(0)));
    let threads: Vec<_> = [1, 2, 5]
        .into_iter()
        .map(|size| {
            let (quota, out) = (Arc::clone(&quota), Arc::clone(&out));
            thread::spawn(move || {
                for _ in 0..2 {
                    let taken = quota.take(size);
                    assert!(out.fetch_add(taken, Ordering::SeqCst) + taken <= 3, "more than there is");
                    out.fetch_sub(taken, Ordering::SeqCst);
                    quota.give(taken);
                }
            })
        })
        .collect();
    threads.into_iter().for_each(|thread| thread.join().expect("no panic"));
}
