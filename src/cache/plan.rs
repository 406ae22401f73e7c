//! How the memory for blocks is divided.

use super::directory::Shape;
use super::known::Known;
use super::policy::Replacement;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::str::FromStr;

/// What can be chosen about a cache.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct CacheOptions {
    /// Bytes of a block: a power of two from 512 to 65,536.
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
    /// Which blocks come before they are needed. None do if who needs them reads them.
    pub prefetch: Prefetch,
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
            prefetch: Prefetch::default(),
            direct: false,
        }
    }
}

/// Which blocks come before they are needed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Prefetch {
    /// None.
    Off,
    /// Those that lie beside one that is needed, with the same read from the disk, as long as nothing has to go for
    /// want of room.
    #[default]
    Beside,
    /// What the tiles that come next and the next frame will need, as far as a few of their rays tell.
    Ahead,
}

impl Prefetch {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Off, Self::Beside, Self::Ahead];

    /// `off`, `beside` or `ahead`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Off => "off",
            Self::Beside => "beside",
            Self::Ahead => "ahead",
        }
    }
}

impl FromStr for Prefetch {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        let named = Self::ALL.into_iter().find(|prefetch| prefetch.name() == name);
        named.ok_or_else(|| {
            Error::option("--prefetch", format!("\"{name}\" is not one of off, beside, ahead"))
        })
    }
}

/// Who reads blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
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

    /// What tables call it, with some blocks coming before they are needed.
    pub const fn name(self, prefetch: Prefetch) -> &'static str {
        match (self, prefetch) {
            (Self::Synchronous, _) => "sync",
            (Self::Asynchronous { .. }, Prefetch::Off) => "async",
            (Self::Asynchronous { .. }, prefetch) => prefetch.name(),
        }
    }

    /// Loaders: none, if who needs a block reads it.
    pub const fn loaders(self) -> usize {
        match self {
            Self::Synchronous => 0,
            Self::Asynchronous { loaders } => loaders,
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
                format!("{} is not a power of two from 512 to 65536 (64 KiB)", self.block),
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
    /// That may have come ahead of need and not been used yet, of those that each cache holds: 0, or at least 2.
    pub ahead: usize,
    /// All that may have memory, with those that have been given up and are still read.
    pub all: usize,
    /// Lines of lists that are known, which each thread at work keeps beside its tree (`cache/known.rs`).
    pub lines: usize,
}

/// Of so many blocks that a cache holds, one may have come ahead of need: few enough that guesses which are wrong
/// drive out little, and several tiles' needs even so.
const AHEAD: usize = 16;

impl Plan {
    /// Divides `blocks`. A walk needs up to `most` at a time; so many threads walk, and so many of them at a time.
    ///
    /// `None` if they are too few: fewer than [`least`](Self::least).
    pub fn new(
        options: &CacheOptions,
        blocks: usize,
        most: usize,
        workers: usize,
        at_work: usize,
    ) -> Option<Self> {
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
        let lines = Known::lines(blocks * options.block, at_work);
        let mut plan = Self { shapes, pinned, ahead: 0, all: blocks, lines };
        if options.prefetch == Prefetch::Ahead && options.loading.loaders() > 0 {
            // All of them may be nodes, or leaves. One is being read while another is here.
            let least = plan.shapes.iter().flatten().map(Shape::blocks).min().unwrap_or(0);
            plan.ahead = Some(least / AHEAD).filter(|&ahead| ahead >= 2).unwrap_or(0);
        }
        Some(plan)
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
            let (off, ahead) = (Prefetch::Off, Prefetch::Ahead);
            for (ways, stripes, prefetch) in
                [(1, 1, ahead), (32, 16, Prefetch::Beside), (1024, 3, off), (7, 1024, ahead)]
            {
                let options = CacheOptions { ways, stripes, nodes, prefetch, ..CacheOptions::default() };
                options.check().expect("sensible");
                for most in [1, 5, 130] {
                    let least = Plan::least(&options, most);
                    assert_eq!(Plan::new(&options, least - 1, most, 16, 2), None);
                    for blocks in [least, least + 1, 1000, 100_000] {
                        let plan = Plan::new(&options, blocks, most, 16, 2).expect("enough");
                        let held = plan.held();
                        assert!(held >= 2 && plan.pinned >= most);
                        let each = plan.shapes.iter().flatten().map(|shape| shape.blocks() / 16);
                        assert!(plan.ahead != 1 && each.clone().all(|most| plan.ahead <= most), "{plan:?}");
                        assert_eq!(
                            plan.ahead > 0,
                            prefetch == ahead && each.clone().all(|most| most > 1),
                            "{plan:?}"
                        );
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
