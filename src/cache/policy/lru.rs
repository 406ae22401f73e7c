//! Least recently used.

use super::{Policy, Use, Way, least};

/// Gives up what was used longest ago.
#[derive(Debug)]
pub struct Lru;

impl Policy for Lru {
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        least(ways, uses, |_, seen| seen.tick)
    }
}
