//! CLOCK, a second chance for what was used (Corbató 1968).

use super::{Policy, Use, Way};

/// Gives up what came first, unless it was used since it came or was last looked at: then it goes to the end.
#[derive(Debug)]
pub struct Clock;

impl Policy for Clock {
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        // Twice round: the first time all may have been used, or be in use.
        for _ in 0..2 * ways.len() {
            let now = uses(ways[0].block);
            if now.is_some_and(|now| now == ways[0].seen) {
                return Some(0);
            }
            ways[0].seen = now.unwrap_or(ways[0].seen);
            ways.rotate_left(1);
        }
        None
    }
}
