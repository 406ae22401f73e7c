//! Bytes of buffers that are looked at here and there.

use super::buffers::Buffers;
use std::cell::Cell;
use std::ops::Range;

/// Bytes that a look at a mapped file brings into memory: Linux maps what the system has around a page that is missing
/// as well, this much.
const BLOCK: usize = 1 << 16;

/// Bytes of a buffer, of which some are looked at now and then. The buffers are told each time that it is not where
/// the last look was.
#[derive(Clone)]
pub(super) struct View<'a> {
    bytes: &'a [u8],
    buffers: &'a Buffers<'a>,
    /// The block of the last look.
    last: Cell<usize>,
}

impl<'a> View<'a> {
    /// Of these bytes of `buffers`.
    pub fn new(bytes: &'a [u8], buffers: &'a Buffers<'a>) -> Self {
        Self { bytes, buffers, last: Cell::new(usize::MAX) }
    }

    /// How many bytes there are.
    pub fn len(&self) -> usize {
        self.bytes.len()
    }

    /// Some of them, to be looked at as well; `None` if they are not all there.
    pub fn part(&self, range: Range<usize>) -> Option<Self> {
        self.bytes.get(range).map(|bytes| Self::new(bytes, self.buffers))
    }

    /// So many bytes from one on. Panics if they are not all there.
    #[inline]
    pub fn look(&self, first: usize, count: usize) -> &'a [u8] {
        let block = first / BLOCK;
        if block != self.last.get() {
            self.last.set(block);
            self.buffers.looked_elsewhere();
        }
        &self.bytes[first..][..count]
    }

    /// All of them.
    pub fn all(&self) -> &'a [u8] {
        self.bytes
    }
}
