//! Blocks that come with others, because they lie beside them in the file.
//!
//! To a disk, four blocks side by side are hardly more work than one: on the machine that this was measured on, 16
//! reads at a time of 4 KiB bring 38 MB a second, of 16 KiB 114. And what lies beside a block that is needed is
//! often needed soon, for the tree and models are in about the order of space. So a loader that goes to the disk for
//! one brings those beside it that are absent, with the same read, as long as nothing has to go for them. Where blocks
//! have to go, they would drive out what is needed: with 16 % of the power plant in memory, a fifth of them was ever used.

use super::blocks::Blocks;
use super::pieces::READ;
use std::ops::Range;

impl Blocks {
    /// As [`load`](Self::load) without haste, and what lies beside the block comes with it.
    pub fn load_with_others(&self, block: u32) {
        if self.is_settled(block) {
            return;
        }
        self.make_room();
        // Where something has to go, it would go for what nobody may ever want.
        if !self.brings_others || self.is_short() {
            self.load_into_room(block, false);
            return;
        }
        let tick = self.tick();
        let others = self.claim_beside(block);
        if others.len() > 1 && matches!(self.read(others.clone(), false), Ok(true)) {
            self.directory(block).arrived(block, &self.words, tick);
            for other in others.filter(|&other| other != block) {
                self.came_unasked(other);
            }
            return;
        }
        // One of them alone may be what is wrong: the block is read by itself.
        for other in others.filter(|&other| other != block) {
            self.give_room();
            self.directory(other).failed(other);
        }
        self.load_into_room(block, false);
    }

    /// The blocks around one that is about to be read that are absent as well, have room, and from now on are this
    /// thread's to read.
    pub(super) fn claim_beside(&self, block: u32) -> Range<u32> {
        // From a multiple of as many bytes on.
        let near = self.layout.beside(block, READ);
        let end = (block + 1..near.end).find(|&other| !self.claim(other)).unwrap_or(near.end);
        let before = (near.start..block).rev().find(|&other| !self.claim(other));
        before.map_or(near.start, |other| other + 1)..end
    }

    /// Whether a block is now this thread's to read, and there is room for it.
    pub(super) fn claim(&self, block: u32) -> bool {
        let directory = self.directory(block);
        if !directory.claim(block, &self.words) {
            return false;
        }
        if self.is_kept(block) {
            self.came_unasked(block);
            return false;
        }
        let has_room = self.try_room();
        if !has_room {
            directory.failed(block);
        }
        has_room
    }
}

#[cfg(test)]
mod tests {
    use super::super::directory::Asked;
    use super::super::layout::{Array, Layout};
    use super::super::loaders::Loaders;
    use super::super::plan::{CacheOptions, Plan};
    use super::super::source::Source;
    use super::super::sync::{Arc, Mutex, Ordering};
    use super::*;
    use crate::error::{Error, Result};
    use std::io;

    const BLOCK: usize = 4096;

    /// The blocks of each read.
    type Reads = Arc<Mutex<Vec<Range<usize>>>>;

    /// Blocks of ones; number 14 cannot be read. What was read is written down.
    #[derive(Debug)]
    struct Noted(Reads);

    impl Source for Noted {
        fn read(&self, _: Array, byte: usize, into: &mut [u8]) -> Result<()> {
            let blocks = byte / BLOCK..(byte + into.len()) / BLOCK;
            let is_broken = blocks.contains(&14);
            self.0.lock().expect("whole").push(blocks);
            if is_broken {
                let source = io::Error::other("the disk is gone");
                return Err(Error::Read { path: "scene.rpk".into(), source });
            }
            into.fill(1);
            Ok(())
        }
    }

    /// Twenty blocks, room for all of them, and a list of what was read.
    fn blocks() -> (Arc<Blocks>, Loaders, Reads) {
        let options = CacheOptions::default();
        let layout = Layout::new([0, 0, 0, 20 * BLOCK, 0, 0], BLOCK);
        let plan = Plan::new(&options, 100, 2, 1, 1).expect("enough");
        let reads = Reads::default();
        let source = Box::new(Noted(Arc::clone(&reads)));
        let (blocks, loaders) = Blocks::new(layout, source, &options, &plan, 1).expect("begins");
        (blocks, loaders, reads)
    }

    fn ask(blocks: &Blocks, block: u32) {
        let asked = blocks.directory(block).ask(block, &blocks.words, &blocks.pins, &mut |_| ());
        assert_eq!(asked, Asked::Absent);
    }

    fn here(blocks: &Blocks) -> Vec<usize> {
        (0..20).filter(|&block| blocks.words.is_here(block)).collect()
    }

    #[test]
    fn what_lies_beside_a_block_comes_with_it() {
        let (blocks, _loaders, reads) = blocks();
        ask(&blocks, 5);
        blocks.load_with_others(5);
        assert_eq!((here(&blocks), reads.lock().expect("whole").pop()), (vec![4, 5, 6, 7], Some(4..8)));
        let unused: Vec<_> = (0..20).filter(|&block| blocks.words.is_unused(block)).collect();
        assert_eq!((unused, blocks.take_stats().prefetched), (vec![4, 6, 7], 3));
        // Another one brings 9: what is beyond it would be a second read.
        [9, 10].into_iter().for_each(|block| ask(&blocks, block));
        blocks.load_with_others(10);
        assert_eq!(reads.lock().expect("whole").pop(), Some(10..12));
        blocks.load_with_others(9);
        assert_eq!(reads.lock().expect("whole").pop(), Some(8..10));
        assert_eq!(here(&blocks), (4..12).collect::<Vec<_>>());
    }

    #[test]
    fn where_something_had_to_go_blocks_come_alone() {
        let (blocks, _loaders, reads) = blocks();
        blocks.gone.store(blocks.limit as u32, Ordering::Relaxed);
        ask(&blocks, 5);
        blocks.load_with_others(5);
        assert_eq!((here(&blocks), reads.lock().expect("whole").pop()), (vec![5], Some(5..6)));
    }

    #[test]
    fn one_that_cannot_be_read_is_no_error_for_those_beside_it() {
        let (blocks, _loaders, reads) = blocks();
        ask(&blocks, 13);
        blocks.load_with_others(13);
        assert_eq!(*reads.lock().expect("whole"), [12..16, 13..14]);
        assert!(here(&blocks) == [13] && blocks.take_failure().is_none());
        assert_eq!((blocks.committed_bytes()[0], blocks.take_stats().prefetched), (BLOCK, 0));
        // Nobody was left believing that the others are on their way.
        ask(&blocks, 12);
        blocks.load_with_others(12);
        assert_eq!(here(&blocks), [12, 13]);
        ask(&blocks, 14);
        blocks.load_with_others(14);
        let error = blocks.take_failure().expect("it was needed").to_string();
        assert!(here(&blocks) == [12, 13] && error.contains("the disk is gone"), "{error}");
    }
}
