//! S3-FIFO (Yang et al., "FIFO queues are all you need for cache eviction", SOSP 2023).

use super::{Policy, Use, Way};
use std::collections::VecDeque;

/// Newcomers wait in a small queue, from which only what was used again goes over to the main one; what falls
/// out of it is remembered for a while, and goes to the main queue at once if it comes back. The main queue
/// is a [clock](super::clock).
///
/// A way's mark is 1 in the main queue and 0 in the small one; both are in the order of `ways`.
#[derive(Debug)]
pub struct S3Fifo {
    /// Ways that newcomers may take.
    small: usize,
    /// Blocks that fell out of the small queue, oldest first, and how many are remembered.
    ghosts: VecDeque<u32>,
    remembered: usize,
}

const MAIN: u32 = 1;

impl S3Fifo {
    /// For a set of so many ways: a tenth of them for newcomers.
    pub fn new(ways: usize) -> Self {
        Self { small: (ways / 10).max(1), ghosts: VecDeque::new(), remembered: ways }
    }

    /// The oldest way of a queue that was not used since it was last looked at; those that were used get
    /// their chance.
    fn oldest_unused(ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>, mark: u32) -> Option<usize> {
        for _ in 0..2 * ways.len() {
            let at = ways.iter().position(|way| way.mark == mark)?;
            let now = uses(ways[at].block);
            if now.is_some_and(|now| now == ways[at].seen) {
                return Some(at);
            }
            let mut way = ways.remove(at);
            // Only a use counts: what must stay for the moment does not move up for that.
            if let Some(now) = now {
                (way.seen, way.mark) = (now, MAIN);
            }
            ways.push(way);
        }
        None
    }
}

impl Policy for S3Fifo {
    fn arrived(&mut self, way: &mut Way) {
        if let Some(at) = self.ghosts.iter().position(|&ghost| ghost == way.block) {
            self.ghosts.remove(at);
            way.mark = MAIN;
        }
    }

    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        let newcomers = ways.iter().filter(|way| way.mark != MAIN).count();
        let order = if newcomers > self.small { [0, MAIN] } else { [MAIN, 0] };
        for mark in order {
            if let Some(at) = Self::oldest_unused(ways, uses, mark) {
                if mark != MAIN {
                    if self.ghosts.len() == self.remembered {
                        self.ghosts.pop_front();
                    }
                    self.ghosts.push_back(ways[at].block);
                }
                return Some(at);
            }
        }
        None
    }
}
