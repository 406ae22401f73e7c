//! Least frequently used.

use super::{Policy, Use, Way, least};

/// Gives up what was used least often since it came; of those, what was used longest ago.
#[derive(Debug)]
pub struct Frequency;

impl Policy for Frequency {
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        least(ways, uses, |_, seen| (seen.count, seen.tick))
    }
}
