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
    /// Where in the array the block begins that was looked at last, in bytes, or [`NO_BLOCK`]. It is here, and what lies
    /// in it needs no look at any word or slot.
    last: Cell<usize>,
    /// Where the array would begin in memory if all of it lay as that block does.
    origin: Cell<*const u8>,
    /// Bytes of a block.
    block: usize,
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
        Self {
            count: bytes / size_of::<T>(),
            base,
            last,
            origin,
            block: 1 << blocks.layout.shift(),
            of: PhantomData,
        }
    }

    /// Panics if there are no such elements.
    #[inline(always)]
    pub fn check(&self, elements: Range<usize>) {
        assert!(elements.start <= elements.end && elements.end <= self.count);
    }

    /// The bytes of some elements, among those of all arrays. Panics if there are no such elements.
    #[inline(always)]
    pub fn bytes(&self, elements: Range<usize>) -> Range<usize> {
        self.check(elements.clone());
        self.base + elements.start * size_of::<T>()..self.base + elements.end * size_of::<T>()
    }

    /// Where an element is, if its block lies as the one does that was looked at last.
    #[inline(always)]
    pub fn place(&self, first: usize) -> *const u8 {
        self.origin.get().wrapping_add(first * size_of::<T>())
    }

    /// Whether so many elements from one on lie in the block that was looked at last.
    #[inline(always)]
    pub fn is_in_last(&self, first: usize, count: usize) -> bool {
        let into = (first * size_of::<T>()).wrapping_sub(self.last.get());
        // Ahead of the block it is more than any block has.
        into < self.block && count * size_of::<T>() <= self.block - into
    }

    /// Where so many elements are from one on, if they lie in that block.
    ///
    /// A walk asks this at every node: with a number that is known beforehand it is a subtraction and a comparison.
    #[inline(always)]
    pub fn in_last<const N: usize>(&self, first: usize) -> Option<*const [T; N]> {
        let into = (first * size_of::<T>()).wrapping_sub(self.last.get());
        if into <= self.block - N * size_of::<T>() { Some(self.place(first).cast()) } else { None }
    }

    /// Keeps in mind where a block lies that begins with this of all arrays' bytes.
    #[inline(always)]
    pub fn keep(&self, byte: usize, place: *const u8) {
        self.keep_in_order(byte);
        self.origin.set(place.wrapping_sub(byte - self.base));
    }

    /// The same where all blocks are at home: the array's origin stays what it is.
    #[inline(always)]
    pub fn keep_in_order(&self, byte: usize) {
        self.last.set(byte - self.base);
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
