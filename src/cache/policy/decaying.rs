//! Least frequently used, with uses that count less and less.

use super::{Policy, Use, Way, least};

/// Gives up what has the least score: the number of uses, halved each time that the set gives something up.
///
/// A way's score so far is its mark, in 65536ths; `seen.count` is how many uses are in it already.
#[derive(Debug)]
pub struct Decaying;

const ONE: u32 = 1 << 16;

impl Policy for Decaying {
    fn arrived(&mut self, way: &mut Way) {
        way.mark = ONE;
    }

    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        for way in &mut *ways {
            if let Some(now) = uses(way.block) {
                let new = now.count.saturating_sub(way.seen.count);
                // A count that is full still tells that there was a use.
                let new = new.max(u32::from(now.tick != way.seen.tick));
                way.mark = (way.mark / 2).saturating_add(new.saturating_mul(ONE));
                way.seen = now;
            }
        }
        least(ways, uses, |way, seen| (way.mark, seen.tick))
    }
}
