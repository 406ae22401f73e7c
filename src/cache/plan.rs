//! How the memory for blocks is divided.

use super::directory::Shape;
use super::policy::Replacement;
use crate::error::{Error, Result};
use serde::Serialize;

/// What can be chosen about a cache.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CacheOptions {
    /// Bytes of a block: a power of two from 4 to 64 KiB, and at least a page of the system.
    pub block: usize,
    /// Blocks that a set holds.
    pub ways: usize,
    /// Locks.
    pub stripes: usize,
    /// Which block makes room for another.
    pub policy: Replacement,
    /// For a cache of nodes beside one of leaves, as in the seed paper: the nodes' share of the memory, and
    /// the policy of their cache. By itself, one cache holds both.
    pub nodes: Option<(f32, Replacement)>,
    /// Who reads.
    pub loading: Loading,
    /// Whether reads go past the system's own memory of the file, so that they take what the disk takes. For
    /// measurements; on Linux.
    pub direct: bool,
}

impl Default for CacheOptions {
    fn default() -> Self {
        Self {
            block: 1 << 12,
            ways: 32,
            stripes: 16,
            policy: Replacement::default(),
            nodes: None,
            loading: Loading::Asynchronous { loaders: Loading::LOADERS },
            direct: false,
        }
    }
}

/// Who reads blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Loading {
    /// Who needs one, while its processor waits.
    Synchronous,
    /// Threads of their own, while others go on.
    Asynchronous {
        /// How many.
        loaders: usize,
    },
}

/// Threads that are at work or wait, for each that is to be at work.
const PARKED: usize = 8;

impl Loading {
    /// Loaders by themselves: where blocks came from a disk and two threads traced, 5 to 7 of them were at work.
    pub const LOADERS: usize = 16;

    /// Threads that render, so that `threads` are at work when some wait.
    pub const fn workers(self, threads: usize) -> usize {
        match self {
            Self::Synchronous => threads,
            Self::Asynchronous { .. } => threads * PARKED,
        }
    }
}

impl CacheOptions {
    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first that does not.
    pub fn check(&self) -> Result<()> {
        let wrong = |option: &str, message: String| Err(Error::option(option, message));
        if !self.block.is_power_of_two() || !super::layout::BLOCK_BYTES.contains(&self.block) {
            return wrong(
                "--block",
                format!("{} is not a power of two from 4096 (4 KiB) to 65536 (64 KiB)", self.block),
            );
        }
        if !(1..=1024).contains(&self.ways) {
            return wrong("--ways", format!("{} is not a number of blocks from 1 to 1024", self.ways));
        }
        if !(1..=1024).contains(&self.stripes) {
            return wrong("--stripes", format!("{} is not a number of locks from 1 to 1024", self.stripes));
        }
        if let Loading::Asynchronous { loaders } = self.loading
            && !(1..=256).contains(&loaders)
        {
            return wrong("--loaders", format!("{loaders} is not a number of threads from 1 to 256"));
        }
        if let Some((share, _)) = self.nodes
            && !(0.01..=0.99).contains(&share)
        {
            return wrong("--nodes", format!("{share} is not a share of the memory from 0.01 to 0.99"));
        }
        Ok(())
    }
}

/// What blocks are for, in numbers of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Plan {
    /// The caches: one for all, or one for nodes and one for leaves.
    pub shapes: [Option<Shape>; 2],
    /// That may be pinned beyond what sets hold.
    pub pinned: usize,
    /// All that may have memory, with those that have been given up and are still read.
    pub all: usize,
}

impl Plan {
    /// Divides `blocks`. A walk needs up to `most` at a time; so many threads walk.
    ///
    /// `None` if they are too few: fewer than [`least`](Self::least).
    pub fn new(options: &CacheOptions, blocks: usize, most: usize, workers: usize) -> Option<Self> {
        if blocks < Self::least(options, most) {
            return None;
        }
        let pinned = most.max((workers * 8).min(blocks / 8));
        let spare = (blocks / 16).clamp(4, 128);
        let held = blocks - pinned - spare;
        let shapes = match options.nodes {
            None => [Some(shape(options, options.policy, held)), None],
            Some((share, policy)) => {
                let nodes = ((held as f32 * share) as usize).clamp(1, held - 1);
                [Some(shape(options, policy, nodes)), Some(shape(options, options.policy, held - nodes))]
            }
        };
        Some(Self { shapes, pinned, all: blocks })
    }

    /// Blocks that sets hold.
    pub fn held(&self) -> usize {
        self.shapes.iter().flatten().map(Shape::blocks).sum()
    }

    /// The least number of blocks that will do.
    pub fn least(options: &CacheOptions, most: usize) -> usize {
        // Some to hold, some to spare, and the needs of one walk; an eighth may be for other walks.
        let held = if options.nodes.is_some() { 8 } else { 4 };
        (most + held + 4).max((held + 4) * 4 / 3) + 8
    }
}

/// Sets for `blocks` at most.
fn shape(options: &CacheOptions, policy: Replacement, blocks: usize) -> Shape {
    let ways = options.ways.min(blocks);
    let sets = (blocks / ways).max(1);
    Shape { stripes: options.stripes.min(sets), sets, ways, policy }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_parts_are_no_more_than_the_whole() {
        for nodes in [None, Some((0.25, Replacement::Lru))] {
            for (ways, stripes) in [(1, 1), (32, 16), (1024, 3), (7, 1024)] {
                let options = CacheOptions { ways, stripes, nodes, ..CacheOptions::default() };
                options.check().expect("sensible");
                for most in [1, 5, 130] {
                    let least = Plan::least(&options, most);
                    assert_eq!(Plan::new(&options, least - 1, most, 16), None);
                    for blocks in [least, least + 1, 1000, 100_000] {
                        let plan = Plan::new(&options, blocks, most, 16).expect("enough");
                        let held = plan.held();
                        assert!(held >= 2 && plan.pinned >= most);
                        assert!(held + plan.pinned < blocks, "{held} + {} of {blocks}", plan.pinned);
                        let all = held + plan.pinned + (blocks / 16).clamp(4, 128);
                        assert!(
                            blocks < 1000 || ways > 99 || stripes > 99 || all * 10 > blocks * 9,
                            "{plan:?}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn absurd_options_are_named() {
        let good = CacheOptions::default();
        for (options, name) in [
            (CacheOptions { block: 5000, ..good }, "--block: 5000"),
            (CacheOptions { block: 1 << 20, ..good }, "--block: 1048576"),
            (CacheOptions { ways: 0, ..good }, "--ways: 0"),
            (CacheOptions { stripes: 0, ..good }, "--stripes: 0"),
            (CacheOptions { loading: Loading::Asynchronous { loaders: 0 }, ..good }, "--loaders: 0"),
            (CacheOptions { nodes: Some((1.5, Replacement::Lru)), ..good }, "--nodes: 1.5"),
        ] {
            let error = options.check().expect_err(name).to_string();
            assert!(error.starts_with(name), "{error}");
        }
    }
}
