//! An array of a scene as one thread sees it.
//!
//! What is looked at next lies mostly in the block that was looked at last: then its place is known with a comparison
//! and an addition, without a look at the table of slots.

use super::blocks::Blocks;
use super::layout::{Array, Column};
use std::cell::Cell;
use std::marker::PhantomData;
use std::ops::Range;

/// An array, found with few loads.
#[derive(Debug)]
pub struct Part<T> {
    /// How many elements it has.
    pub count: usize,
    /// Its first byte among those of all arrays.
    pub base: usize,
    /// The first byte of the block that was looked at last, or [`NO_BLOCK`]. It is here, and what lies in it needs no
    /// look at any word or slot.
    pub last: Cell<usize>,
    /// Where the array would begin in memory if all of it lay as that block does.
    pub origin: Cell<*const u8>,
    of: PhantomData<T>,
}

/// So far from all bytes that nothing lies behind it.
const NO_BLOCK: usize = usize::MAX / 2;

impl<T> Part<T> {
    #[inline(always)]
    pub fn new(blocks: &Blocks, array: Array) -> Self {
        let Column { base, bytes } = blocks.layout.column(array);
        // Right from the beginning where blocks lie in order.
        let (last, origin) = (Cell::new(NO_BLOCK), Cell::new(blocks.slots.home(base)));
        Self { count: bytes / size_of::<T>(), base, last, origin, of: PhantomData }
    }

    /// The bytes of some elements, among those of all arrays. Panics if there are no such elements.
    #[inline(always)]
    pub fn bytes(&self, elements: Range<usize>) -> Range<usize> {
        assert!(elements.start <= elements.end && elements.end <= self.count);
        self.base + elements.start * size_of::<T>()..self.base + elements.end * size_of::<T>()
    }

    /// Where so many elements are from one on, if they lie in the block that was looked at last.
    #[inline(always)]
    pub fn in_last<const N: usize>(&self, first: usize, shift: u32) -> Option<*const [T; N]> {
        let into = (self.base + first * size_of::<T>()).wrapping_sub(self.last.get());
        let most = (1_usize << shift) - N * size_of::<T>();
        if into <= most { Some(self.origin.get().wrapping_add(first * size_of::<T>()).cast()) } else { None }
    }

    /// Keeps in mind where a block lies that begins with a byte.
    #[inline(always)]
    pub fn keep(&self, first: usize, place: *const u8) {
        self.last.set(first);
        self.origin.set(place.wrapping_sub(first).wrapping_add(self.base));
    }

    /// Nothing is known of any block any more.
    pub fn forget(&self) {
        self.last.set(NO_BLOCK);
    }

    /// The blocks that hold some elements.
    #[inline(always)]
    pub fn blocks(&self, elements: Range<usize>, shift: u32) -> Range<usize> {
        let first = self.base + elements.start * size_of::<T>();
        let end = self.base + elements.end * size_of::<T>();
        first >> shift..((end - 1) >> shift) + 1
    }
}
