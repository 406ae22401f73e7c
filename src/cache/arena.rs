//! Room for everything, and memory for what is here.
//!
//! The arrays of a scene keep their places: each has its addresses for as long as the scene is open, but only
//! the blocks that are here have memory behind them. So an index means the same whether the array is all in
//! memory or not, the kernels find a thing by adding to a pointer, and a block is read from its file right
//! to where it is used.

use memmap2::{Advice, MmapOptions, MmapRaw};
use std::io;

/// Addresses without memory.
#[derive(Debug)]
pub struct Arena {
    map: MmapRaw,
}

impl Arena {
    /// Takes `bytes` of address space.
    ///
    /// # Errors
    /// The system does not give it.
    pub fn new(bytes: usize) -> io::Result<Self> {
        let map = MmapOptions::new().len(bytes.max(1)).no_reserve_swap().map_anon()?;
        // A huge page would bring memory for blocks that nobody asked for.
        #[cfg(target_os = "linux")]
        if let Err(error) = map.advise(Advice::NoHugePage) {
            // A kernel without huge pages does not know the word.
            tracing::debug!("no advice about huge pages: {error}");
        }
        Ok(Self { map: map.into() })
    }

    /// Where a byte lies. Behind it there is memory or none.
    #[inline(always)]
    pub fn at(&self, byte: usize) -> *mut u8 {
        debug_assert!(byte <= self.map.len());
        self.map.as_mut_ptr().wrapping_add(byte)
    }

    /// Bytes of a range, to be filled.
    ///
    /// # Safety
    /// Nobody else may read or write them while the slice lives.
    #[expect(clippy::mut_from_ref, reason = "who may write where is the loaders' business")]
    pub unsafe fn fill(&self, byte: usize, len: usize) -> &mut [u8] {
        assert!(byte.checked_add(len).is_some_and(|end| end <= self.map.len()), "inside of the arena");
        // SAFETY: it is inside of the mapping, which is readable and writable (memory comes when it is
        // touched, and is zero then); the caller sees to it that nobody else is there.
        unsafe { std::slice::from_raw_parts_mut(self.at(byte), len) }
    }

    /// Gives the memory of a range back; it reads as zeros afterwards.
    ///
    /// # Safety
    /// Nobody may have a reference into it.
    pub unsafe fn release(&self, byte: usize, len: usize) {
        assert!(byte.checked_add(len).is_some_and(|end| end <= self.map.len()), "inside of the arena");
        // A reference that is kept too long is to be seen at once in a checked build.
        if cfg!(debug_assertions) {
            // SAFETY: inside of the mapping, and nobody has a reference.
            unsafe { self.at(byte).write_bytes(0xff, len) };
        }
        #[cfg(unix)]
        // SAFETY: the mapping is private and anonymous, so that what is given back reads as zeros; nobody
        // has a reference into it.
        let released =
            unsafe { self.map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, byte, len) };
        #[cfg(unix)]
        released.expect("the mapping takes this advice");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_released_is_empty_again_and_the_rest_is_not() {
        const BLOCK: usize = 1 << 16;
        let arena = Arena::new(1 << 36).expect("addresses are free");
        for block in [0, 1, 2, 99_999] {
            // SAFETY: nobody else knows of the arena.
            unsafe { arena.fill(block * BLOCK, BLOCK) }.fill(block as u8 + 1);
        }
        // SAFETY: as above.
        unsafe { arena.release(BLOCK, BLOCK) };
        for (block, byte) in [(0, 1), (1, 0), (2, 3), (99_999, 160)] {
            // SAFETY: as above.
            assert!(unsafe { arena.fill(block * BLOCK, BLOCK) }.iter().all(|&b| b == byte), "{block}");
        }
    }

    #[test]
    #[should_panic(expected = "inside of the arena")]
    fn nothing_beyond_its_end_is_given_out() {
        let arena = Arena::new(4096).expect("addresses are free");
        // SAFETY: it panics.
        unsafe { arena.fill(4000, 97) };
    }
}
