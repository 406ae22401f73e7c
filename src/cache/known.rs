//! Lists that a thread has found to be here, with all their triangles.
//!
//! A page's list names some fifty triangles, each of which lies in a block with a word of its own. Neighbouring
//! packets and beams come to the same pages and leaves one after the other, and looked at all of these words each
//! time. So a thread keeps in mind which lists it has seen whole; and when it ends, with its frame, the next one goes on
//! with what it knew.
//!
//! **How long that holds.** For an [era](super::eras), be it another thread's: until something goes that may be part of a
//! list. What went since a use began, if anything, was not yet retired then, and so is not freed before the use ends. A
//! list whose blocks had to come is not kept in mind before it is looked at again: who brings a block marks it with the
//! tick in which he began to, and that may be before the era.
//!
//! **What policies know.** A list that is known is not marked as used again. As long as few blocks have to go, that is no
//! matter: whenever one is chosen that was used in the era, all lists are looked at anew, and what is in view has marks
//! of the present frame. Where many have to, an era begins with each tick: every list is looked at once in a tick, and
//! marks are those that they would be if it always were.
//!
//! **How it is kept.** A line of the cache for the lists that begin in 448 words after one another, which are those of
//! some forty neighbouring leaves, or eight pages. Each has one line that it may have, or else the one beside it:
//!
//! ```text
//!            63                     24 23       8 7         0
//!           +-------------------------+----------+-----------+
//! tag       | which 448 words         | era      | last tick |   era 0: nothing
//!           +-------------------------+----------+-----------+
//! 7 words   | a bit for each of the words: is it the first of a list that was seen? |
//!           +-----------------------------------------------------------------------+
//! ```

use super::eras::{Era, is_before};
use std::cell::Cell;
use std::ops::Range;

/// Lines that a thread has, as far as the memory allows.
const LINES: Range<usize> = 128..1 << 16;

/// One in so many bytes of the memory for blocks is for lines. (With a hundredth, a thread of a flight of which all was in
/// memory knew too few lists to go by, and looked at the rest at each visit.)
const SHARE: usize = 32;

const TICK_BITS: u32 = 8;
const ERA_BITS: u32 = 16;

/// Words that a line is for.
const WORDS: usize = 7 * 64;

/// Neighbouring lists.
#[derive(Debug, Default)]
#[repr(align(64))]
struct Line {
    tag: Cell<u64>,
    begin: [Cell<u64>; WORDS / 64],
}

/// What one thread keeps in mind.
#[derive(Debug, Default)]
pub struct Known {
    lines: Box<[Line]>,
    /// From 1 to 2^16 - 1.
    era: Cell<u64>,
    /// Which one that is of [all](super::eras).
    now: Cell<Era>,
    /// First uses in a tick of lists that were known.
    uses: Cell<u64>,
}

impl Known {
    /// Nothing, with as many lines as [`lines`](Self::lines) has said.
    pub fn new(lines: usize) -> Self {
        debug_assert!(lines.is_power_of_two());
        Self { lines: (0..lines).map(|_| Line::default()).collect(), ..Self::default() }
    }

    /// How many lines a thread should have where so many of them share `memory` bytes of blocks.
    pub fn lines(memory: usize, threads: usize) -> usize {
        let most = memory / SHARE / threads.max(1) / size_of::<Line>();
        (most.clamp(LINES.start, LINES.end) + 1).next_power_of_two() / 2
    }

    /// Whether nothing can be kept in mind: there are no lines.
    pub const fn is_none(&self) -> bool {
        self.lines.is_empty()
    }

    /// Memory of one.
    pub const fn bytes(lines: usize) -> usize {
        lines * size_of::<Line>()
    }

    /// A use begins, or goes on, in an era.
    #[inline(always)]
    pub fn begin(&self, now: Era) {
        if self.now.get() != now || self.era.get() == 0 {
            self.now.set(now);
            self.next_era();
        }
    }

    fn next_era(&self) {
        let mut era = self.era.get() + 1;
        if era >> ERA_BITS != 0 {
            // The first ones' numbers come again.
            self.lines.iter().for_each(|line| line.tag.set(0));
            era = 1;
        }
        self.era.set(era);
    }

    /// Whether a list was seen whole in this era: the one that begins at this of all arrays' words.
    #[inline(always)]
    pub fn has(&self, list: usize, tick: u32) -> bool {
        let (place, now, bit) = self.find(list, tick);
        for place in [place, place ^ 1] {
            let Some(line) = self.lines.get(place) else { return false };
            let seen = line.tag.get();
            if (seen ^ now) >> TICK_BITS == 0 {
                let has = line.begin[bit / 64].get() >> (bit % 64) & 1 != 0;
                if has && seen != now {
                    line.tag.set(now);
                    self.uses.set(self.uses.get() + 1);
                }
                return has;
            }
        }
        false
    }

    /// Keeps in mind that it was, and that its words were marked with this tick or a later one. Does nothing if that is
    /// before the era.
    pub fn add(&self, list: usize, tick: u32) {
        if is_before(tick, self.now.get().1) {
            return;
        }
        let (place, now, bit) = self.find(list, tick);
        let (Some(first), Some(other)) = (self.lines.get(place), self.lines.get(place ^ 1)) else { return };
        let is_its = |line: &&Line| (line.tag.get() ^ now) >> TICK_BITS == 0;
        let line = [first, other].into_iter().find(is_its).unwrap_or_else(|| {
            // Others are there. Those of another era are nothing; of two, those that were seen longer ago go.
            let age = |line: &Line| {
                let (seen, era) = (line.tag.get(), (1 << ERA_BITS) - 1);
                let is_past = (seen ^ now) >> TICK_BITS & era != 0;
                if is_past { u64::MAX } else { now.wrapping_sub(seen) & ((1 << TICK_BITS) - 1) }
            };
            let line = if age(other) > age(first) { other } else { first };
            line.begin.iter().for_each(|word| word.set(0));
            line
        });
        line.tag.set(now);
        let word = &line.begin[bit / 64];
        word.set(word.get() | 1 << (bit % 64));
    }

    /// A list's place among the lines, the tag that its line has if the list was seen now, and the list's bit.
    #[inline(always)]
    fn find(&self, list: usize, tick: u32) -> (usize, u64, usize) {
        let (range, bit) = (list / WORDS, list % WORDS);
        // An array of a hundred terabytes is not in sight.
        debug_assert!((range as u64) >> (u64::BITS - ERA_BITS - TICK_BITS) == 0);
        // Of two ticks that are taken for one, a use is not counted.
        let tick = u64::from(tick) & ((1 << TICK_BITS) - 1);
        let tag = ((range as u64) << ERA_BITS | self.era.get()) << TICK_BITS | tick;
        (range & self.lines.len().wrapping_sub(1), tag, bit)
    }

    /// First uses in a tick of lists that were known, since the last call.
    pub fn take_uses(&self) -> u64 {
        self.uses.take()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn known() -> Known {
        let known = Known::new(128);
        known.begin((0, 0));
        known
    }

    #[test]
    fn a_list_is_known_in_its_era_alone() {
        let known = known();
        assert!(!known.has(0, 0));
        for list in (0..800).step_by(40) {
            known.begin((7, 3));
            known.add(list, 3);
            assert!(known.has(list, 3));
            assert!(!known.has(list + 1, 3) && !known.has(list + 40, 3));
            // What would have the same line and bit.
            assert!(!known.has(list + 128 * WORDS, 3));
            known.begin((7, 3));
            assert!(known.has(list, 99));
            for other in [(8, 3), (7, 4)] {
                known.begin(other);
                assert!(!known.has(list, 4), "{other:?}");
            }
        }
        known.begin((9, 3));
        (0..60_000).filter(|list| list % 7 == 0).for_each(|list| known.add(list, 3));
        // Those that came last are there, each in its place, and the first ones had to go.
        let first = 60_000_usize.div_ceil(WORDS) - 128;
        for list in 0..60_000 {
            assert_eq!(known.has(list, 3), list % 7 == 0 && list >= first * WORDS, "{list}");
        }
    }

    #[test]
    fn what_was_marked_before_an_era_is_not_known_in_it() {
        let known = known();
        known.begin((0, 5));
        known.add(40, 4);
        assert!(!known.has(40, 5), "a block of it may go without a word");
        known.add(80, 5);
        known.add(120, 6);
        assert!(known.has(80, 4) && known.has(120, 5), "whoever asks");
    }

    #[test]
    fn known_neighbours_are_used_once_in_a_tick() {
        let known = known();
        known.add(40, 0);
        known.add(47, 0);
        for tick in [0, 0, 1, 1, 2] {
            known.begin((0, 0));
            assert!(known.has(40, tick) && known.has(47, tick));
        }
        assert_eq!((known.take_uses(), known.take_uses()), (2, 0));
    }

    #[test]
    fn numbers_of_eras_that_come_again_are_others() {
        let known = known();
        known.add(40, 0);
        known.era.set((1 << ERA_BITS) - 1);
        known.add(80, 0);
        assert!(known.has(80, 0));
        known.begin((1, 0));
        assert_eq!(known.era.get(), 1, "that of the first list");
        assert!(!known.has(40, 0) && !known.has(80, 0) && !known.has(0, 0));
    }

    #[test]
    fn what_was_seen_longer_ago_makes_room() {
        let known = known();
        let lists = [0, 128, 256].map(|range| range * WORDS);
        known.add(lists[0], 1);
        known.add(lists[1], 2);
        assert!(known.has(lists[0], 3) && known.has(lists[1], 2), "one of them beside its line");
        known.add(lists[2], 4);
        assert_eq!(lists.map(|list| known.has(list, 4)), [true, false, true]);
        known.begin((1, 0));
        known.add(lists[1], 4);
        assert_eq!(lists.map(|list| known.has(list, 4)), [false, true, false]);
        known.add(lists[0], 4);
        assert!(known.has(lists[0], 4) && known.has(lists[1], 4), "what is of the past has no age");
    }

    #[test]
    fn who_has_no_lines_knows_nothing() {
        let known = Known::default();
        assert!(known.is_none());
        known.begin((0, 0));
        known.add(40, 0);
        assert!(!known.has(40, 0) && !known.has(0, 0));
    }

    #[test]
    fn lines_are_a_power_of_two_within_their_share() {
        for (memory, threads, lines) in [
            (0, 1, 128),
            (1 << 20, 2, 256),
            (48 << 20, 16, 1 << 10),
            (48 << 20, 2, 1 << 13),
            (500_000_000, 2, 1 << 16),
            (1 << 40, 1, 1 << 16),
        ] {
            assert_eq!(Known::lines(memory, threads), lines, "{memory} bytes, {threads} threads");
        }
        assert_eq!(size_of::<Line>(), 64);
    }
}
