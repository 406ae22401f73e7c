//! SIEVE (Zhang et al., "SIEVE is Simpler than LRU", NSDI 2024).

use super::{Policy, Use, Way};

/// A hand goes from the oldest way to the newest and gives up the first that was not used since it was last
/// there. What was used keeps its place, so newcomers that nobody uses again are found at once.
#[derive(Debug, Default)]
pub struct Sieve {
    hand: usize,
}

impl Policy for Sieve {
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        for _ in 0..2 * ways.len() {
            if self.hand >= ways.len() {
                self.hand = 0;
            }
            let way = &mut ways[self.hand];
            let now = uses(way.block);
            if now.is_some_and(|now| now == way.seen) {
                // What comes after it moves into its place, under the hand.
                return Some(self.hand);
            }
            way.seen = now.unwrap_or(way.seen);
            self.hand += 1;
        }
        None
    }
}
