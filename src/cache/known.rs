//! Lists that a thread has found to be here, with all their triangles.
//!
//! A page's list names some fifty triangles, each of which lies in a block with a word of its own. Neighbouring
//! packets and beams come to the same pages and leaves one after the other, and looked at all of these words each
//! time. So a thread keeps in mind which lists it has seen whole: where everything was here, that and longer ticks took
//! scenes from 0.83 to 0.87 of the resident ones' speed.
//!
//! **How long that holds.** Whatever is given up moves the epoch on, before its memory can go (`epoch.rs`, 4). A list
//! that was seen whole in a use that began in one epoch is whole in every use that begins in the same one: what was
//! given up since, if anything, was declared gone but not yet retired when that use began, and so is not freed before
//! it ends. A tick ends it too: what is used in the next one is to be marked again.

use std::cell::Cell;

/// Lists that are kept in mind. Each has one place where it can be.
const LISTS: usize = 512;

/// A list, and what must still be the same for it to be whole.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Seen {
    list: usize,
    epoch: u64,
    tick: u32,
}

/// No epoch is as late as this.
const NOTHING: Seen = Seen { list: 0, epoch: u64::MAX, tick: 0 };

/// What one thread keeps in mind.
#[derive(Debug)]
pub struct Known {
    seen: Box<[Cell<Seen>; LISTS]>,
}

impl Known {
    /// Nothing.
    pub fn new() -> Self {
        Self { seen: Box::new([const { Cell::new(NOTHING) }; LISTS]) }
    }

    /// Memory of one.
    pub const fn bytes() -> usize {
        LISTS * size_of::<Seen>()
    }

    /// Whether a list, by where its array and it begin, was seen whole in this epoch and tick.
    #[inline(always)]
    pub fn has(&self, list: usize, epoch: u64, tick: u32) -> bool {
        self.seen[place(list)].get() == Seen { list, epoch, tick }
    }

    /// Keeps in mind that it was.
    #[inline(always)]
    pub fn add(&self, list: usize, epoch: u64, tick: u32) {
        self.seen[place(list)].set(Seen { list, epoch, tick });
    }
}

/// Where a list is kept: lists that follow one another lie apart (Fibonacci hashing: Knuth, "The Art of Computer
/// Programming", volume 3, 6.4).
#[inline(always)]
fn place(list: usize) -> usize {
    ((list as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> (64 - LISTS.trailing_zeros())) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_list_is_known_in_its_epoch_and_tick_alone() {
        let known = Known::new();
        assert!(!known.has(0, 0, 0));
        for list in 0..20 {
            known.add(40 * list, 7, 3);
            assert!(known.has(40 * list, 7, 3));
            assert!(!known.has(40 * list + 1, 7, 3));
            assert!(!known.has(40 * list, 8, 3) && !known.has(40 * list, 7, 4));
        }
        let kept = (0..20).filter(|list| known.has(40 * list, 7, 3)).count();
        assert!(kept > 16, "{kept} of 20 lists have a place of their own");
    }
}
