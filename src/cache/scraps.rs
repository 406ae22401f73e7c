//! Copies of what lies across the border of two blocks.
//!
//! Blocks that follow one another in an array lie anywhere in memory. A triangle or a list that begins in one and ends in
//! the next is put together here, for as long as a walk looks at it.

use std::cell::{Cell, UnsafeCell};

/// What pieces are multiples of, so that whatever lies in arrays is aligned in them: records of triangles are as much.
type Unit = u128;

/// Units that one stretch has at least.
const STRETCH: usize = 512;

/// Memory that is handed out piece by piece and taken back all at once.
#[derive(Debug, Default)]
pub struct Scraps {
    /// Stretches keep their places; the one that pieces come from is the last one in use.
    stretches: UnsafeCell<Vec<Vec<Unit>>>,
    /// Stretches that have been begun.
    begun: Cell<usize>,
    /// Units of the last of these that were handed out.
    used: Cell<usize>,
}

impl Scraps {
    /// Memory that is taken, but for lists that are longer than a stretch.
    pub const BYTES: usize = STRETCH * size_of::<Unit>();

    /// Takes all pieces back.
    ///
    /// # Safety
    /// Nobody reads or writes any of them any more.
    #[inline(always)]
    pub unsafe fn clear(&self) {
        if self.begun.get() > 0 {
            self.begun.set(0);
        }
    }

    /// Room for so many bytes, whatever is in them, until all are taken back.
    #[cold]
    #[inline(never)]
    pub fn room(&self, bytes: usize) -> *mut u8 {
        let count = bytes.div_ceil(size_of::<Unit>());
        // SAFETY: this borrow of the list ends here, and the list is borrowed nowhere else. What was handed out
        // is no part of it, but of what its elements point to, which stays where it is when the list grows.
        let stretches = unsafe { &mut *self.stretches.get() };
        let has_room = |stretch: &Vec<Unit>, used: usize| stretch.capacity() - used >= count;
        let mut used = self.used.get();
        if self.begun.get() == 0 || !has_room(&stretches[self.begun.get() - 1], used) {
            used = 0;
            let next = self.begun.get();
            if stretches.get(next).is_none_or(|stretch| !has_room(stretch, 0)) {
                stretches.insert(next, Vec::with_capacity(count.max(STRETCH)));
            }
            self.begun.set(next + 1);
        }
        self.used.set(used + count);
        stretches[self.begun.get() - 1].as_mut_ptr().wrapping_add(used).cast()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_lie_apart_until_they_are_taken_back() {
        let scraps = Scraps::default();
        let mut most = 0;
        for round in 0..3 {
            let counts = [1, 48, 20_000, 16_000, 364, 48, 16_384, 3];
            let pieces: Vec<(*mut u8, usize)> = counts.map(|count| (scraps.room(count), count)).into();
            for (number, &(piece, count)) in (round * 10..).zip(&pieces) {
                assert!(piece.cast::<crate::geometry::triangle::Triangle>().is_aligned());
                // SAFETY: a piece has so many bytes, and is ours until all are taken back.
                unsafe { piece.write_bytes(number, count) };
            }
            for (number, &(piece, count)) in (round * 10..).zip(&pieces) {
                // SAFETY: as above; all of them have been written.
                assert!((0..count).all(|i| unsafe { piece.add(i).read() } == number));
            }
            // SAFETY: nobody looks at them any more.
            unsafe { scraps.clear() };
            // SAFETY: nobody else looks at the list.
            let stretches = unsafe { &*scraps.stretches.get() }.len();
            assert!(most == 0 || stretches == most, "what there is is used again");
            most = stretches;
        }
    }
}
