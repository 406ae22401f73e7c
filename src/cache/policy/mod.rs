//! Which block makes room for another: one policy to a file.
//!
//! A cache is set-associative: a block has one set that it can lie in, and a set has so many *ways*. A policy
//! looks at the ways of one set, oldest arrival first, when one of them has to go; nothing is told to it when
//! a block is used, because a hit must cost next to nothing. What it may ask is a block's [`Use`]: the tick of
//! its last use, and in how many ticks it was used. A tick is some squares of a picture, or as long as nothing has to go, a
//! frame.
//!
//! | policy | file | gives up |
//! |---|---|---|
//! | [`Fifo`](Replacement::Fifo) | `fifo` | what came first |
//! | [`Lru`](Replacement::Lru) | `lru` | what was used longest ago |
//! | [`Frequency`](Replacement::Frequency) | `frequency` | what was used least often |
//! | [`Decaying`](Replacement::Decaying) | `decaying` | the same, with uses that count half as much after a while |
//! | [`Clock`](Replacement::Clock) | `clock` | what came first, unless it was used since it was last looked at |
//! | [`Sieve`](Replacement::Sieve) | `sieve` | likewise, but what is kept keeps its place |
//! | [`S3Fifo`](Replacement::S3Fifo) | `s3fifo` | newcomers that were used in one tick only |
//!
//! The first four are those of Portelli, "Out-of-core rendering of massive data sets".

mod clock;
mod decaying;
mod fifo;
mod frequency;
mod lru;
mod s3fifo;
mod sieve;

use crate::error::Error;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How often and when a block was used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Use {
    /// The tick of the last use.
    pub tick: u32,
    /// In how many ticks it was used, to 127.
    pub count: u32,
}

/// A block in a set.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    /// Which block.
    pub block: u32,
    /// What its [`Use`] was when the policy last looked at it.
    pub seen: Use,
    /// The policy's own mark.
    pub mark: u32,
}

/// Chooses among the ways of one set.
pub trait Policy: Send + fmt::Debug {
    /// A block has come to the end of the ways, with its first use in `way.seen`.
    fn arrived(&mut self, _way: &mut Way) {}

    /// The way to give up, or `None` if all are in use. `ways` are in the order of arrival (which a policy
    /// may change); `uses` gives `None` for a block that must stay.
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize>;
}

/// The policies by name.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Replacement {
    /// What came first goes.
    Fifo,
    /// What was used longest ago goes.
    Lru,
    /// What was used least often goes.
    Frequency,
    /// What was used least often lately goes.
    Decaying,
    /// A second chance for what was used.
    Clock,
    /// SIEVE.
    #[default]
    Sieve,
    /// S3-FIFO.
    S3Fifo,
}

impl Replacement {
    /// All of them.
    pub const ALL: [Self; 7] =
        [Self::Fifo, Self::Lru, Self::Frequency, Self::Decaying, Self::Clock, Self::Sieve, Self::S3Fifo];

    /// Its name, as an option has it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fifo => "fifo",
            Self::Lru => "lru",
            Self::Frequency => "frequency",
            Self::Decaying => "decaying",
            Self::Clock => "clock",
            Self::Sieve => "sieve",
            Self::S3Fifo => "s3-fifo",
        }
    }

    /// A policy for one set of so many ways.
    pub fn policy(self, ways: usize) -> Box<dyn Policy> {
        match self {
            Self::Fifo => Box::new(fifo::Fifo),
            Self::Lru => Box::new(lru::Lru),
            Self::Frequency => Box::new(frequency::Frequency),
            Self::Decaying => Box::new(decaying::Decaying),
            Self::Clock => Box::new(clock::Clock),
            Self::Sieve => Box::<sieve::Sieve>::default(),
            Self::S3Fifo => Box::new(s3fifo::S3Fifo::new(ways)),
        }
    }
}

impl fmt::Display for Replacement {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

impl FromStr for Replacement {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|policy| policy.name() == name).ok_or_else(|| {
            let names = Self::ALL.map(Self::name).join(", ");
            Error::option("--policy", format!("\"{name}\" is none of {names}"))
        })
    }
}

/// The way with the least key among those that may go; the first of equal ones.
fn least<K: Ord>(
    ways: &[Way],
    uses: &dyn Fn(u32) -> Option<Use>,
    key: impl Fn(&Way, Use) -> K,
) -> Option<usize> {
    let keyed = ways.iter().enumerate().filter_map(|(i, way)| Some((key(way, uses(way.block)?), i)));
    keyed.min().map(|(_, i)| i)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashMap;

    /// A set of four ways, its blocks' uses, and a clock that ticks with each use.
    struct Small {
        ways: Vec<Way>,
        uses: HashMap<u32, Use>,
        policy: Box<dyn Policy>,
        tick: u32,
        misses: usize,
    }

    impl Small {
        fn new(policy: Replacement) -> Self {
            Self { ways: vec![], uses: HashMap::new(), policy: policy.policy(4), tick: 0, misses: 0 }
        }

        /// Uses a block; which one it took the place of, if any.
        fn use_block(&mut self, block: u32) -> Option<u32> {
            self.tick += 1;
            if self.ways.iter().any(|way| way.block == block) {
                let seen = self.uses.entry(block).or_default();
                *seen = Use { tick: self.tick, count: seen.count + 1 };
                return None;
            }
            self.misses += 1;
            let mut gone = None;
            if self.ways.len() == 4 {
                let uses = &self.uses;
                let victim = self.policy.victim(&mut self.ways, &|block| uses.get(&block).copied());
                gone = victim.map(|way| self.ways.remove(way).block);
            }
            let first = Use { tick: self.tick, count: 1 };
            self.uses.insert(block, first);
            let mut way = Way { block, seen: first, mark: 0 };
            self.policy.arrived(&mut way);
            self.ways.push(way);
            gone
        }
    }

    #[test]
    fn each_gives_up_what_its_name_says() {
        // Blocks 1 to 4 come; then 1 is used three times, 3 and 2 twice, 4 once and last.
        let mut gone = HashMap::new();
        for policy in Replacement::ALL {
            let mut small = Small::new(policy);
            for block in [1, 2, 3, 4, 1, 1, 3, 2, 4] {
                assert_eq!(small.use_block(block), None);
            }
            gone.insert(policy.name(), [5, 6].map(|block| small.use_block(block).expect("four ways")));
        }
        assert_eq!(gone["fifo"], [1, 2]);
        assert_eq!(gone["lru"], [1, 3]);
        // All counts but 1's are equal: the oldest use goes; then the newcomer, used once.
        assert_eq!(gone["frequency"], [3, 5]);
        assert_eq!(gone["clock"][0], 1, "all were used: the first one looked at goes in the end");
        assert_eq!(gone["sieve"][0], 1);
    }

    #[test]
    fn what_must_stay_stays() {
        for policy in Replacement::ALL {
            let mut small = Small::new(policy);
            (1..5).for_each(|block| assert_eq!(small.use_block(block), None));
            let pinned = |free: u32| move |block| (block == free).then_some(Use { tick: 9, count: 9 });
            for free in [3, 1, 4] {
                let way = small.policy.victim(&mut small.ways, &pinned(free)).expect("one is free");
                assert_eq!(small.ways[way].block, free, "{policy}");
            }
            assert_eq!(small.policy.victim(&mut small.ways, &|_| None), None, "{policy}");
        }
    }

    #[test]
    fn a_scan_does_not_drive_out_what_is_used_again_and_again() {
        // Two blocks are used all the time, among others that are used once.
        let misses = |policy| {
            let mut small = Small::new(policy);
            for i in 0..400 {
                small.use_block(1);
                small.use_block(2);
                small.use_block(100 + i);
                small.use_block(1);
                small.use_block(2);
                small.use_block(1000 + i);
                small.use_block(2000 + i);
                small.use_block(3000 + i);
            }
            small.misses - 4 * 400
        };
        assert!(misses(Replacement::Fifo) > 300);
        for policy in [Replacement::Frequency, Replacement::Decaying, Replacement::Sieve, Replacement::S3Fifo]
        {
            assert!(misses(policy) < 100, "{policy}: {}", misses(policy));
        }
    }

    #[test]
    fn what_was_used_often_long_ago_is_forgotten() {
        // After a long time with blocks 1 to 4, only 11 to 14 are used.
        let misses = |policy| {
            let mut small = Small::new(policy);
            for i in 0..800 {
                small.use_block(if i < 400 { 1 } else { 11 } + i % 4);
            }
            small.misses
        };
        assert!(misses(Replacement::Frequency) > 300, "counts alone never forget");
        for policy in [Replacement::Fifo, Replacement::Lru, Replacement::Decaying, Replacement::Clock] {
            assert!(misses(policy) < 100, "{policy}: {}", misses(policy));
        }
    }

    #[test]
    fn names_are_read_and_written_alike() {
        for policy in Replacement::ALL {
            assert_eq!(policy.to_string().parse::<Replacement>().expect("its own name"), policy);
        }
        let error = "mru".parse::<Replacement>().expect_err("unknown").to_string();
        assert!(error.starts_with("--policy: \"mru\" is none of fifo, lru,"), "{error}");
    }
}
