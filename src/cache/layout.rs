//! Which byte of which array is in which block.
//!
//! A block is a piece of one array. What a page or a leaf needs of several comes together, but from several blocks; blocks
//! that hold all of a page side by side were measured and save next to nothing where memory is short
//! (`docs/out-of-core.md`), and an array would no longer mean the same in memory as in the file.

use std::ops::Range;

/// The arrays of a scene that come in blocks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Array {
    /// The full tree's nodes.
    Nodes,
    /// The leaves' references.
    References,
    /// The pages' primitives.
    Pages,
    /// Triangle records.
    Triangles,
    /// What colour each triangle has, or which material.
    Colors,
    /// Which material each triangle has, and what its corners have: in scenes with attributes.
    Surfaces,
}

impl Array {
    /// All of them, in the order of their blocks: nodes before what leaves need.
    pub const ALL: [Self; 6] =
        [Self::Nodes, Self::References, Self::Pages, Self::Triangles, Self::Colors, Self::Surfaces];

    /// What messages call it.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Nodes => "nodes",
            Self::References => "references",
            Self::Pages => "pages",
            Self::Triangles => "triangles",
            Self::Colors => "colours",
            Self::Surfaces => "surface records",
        }
    }
}

/// The least and the greatest size of a block.
pub const BLOCK_BYTES: Range<usize> = 512..(1 << 16) + 1;

/// An array's place among the bytes of all.
#[derive(Clone, Copy, Debug)]
pub struct Column {
    /// Its first byte, at the start of a block.
    pub base: usize,
    /// How many it has.
    pub bytes: usize,
}

/// All arrays, one behind the other, each from the start of a block on.
#[derive(Clone, Debug)]
pub struct Layout {
    columns: [Column; Array::ALL.len()],
    shift: u32,
    blocks: usize,
}

impl Layout {
    /// Lays out arrays of so many bytes in blocks of `block` bytes. Panics if that is no power of two
    /// between half a KiB and 64 KiB.
    pub fn new(bytes: [usize; Array::ALL.len()], block: usize) -> Self {
        assert!(block.is_power_of_two() && BLOCK_BYTES.contains(&block));
        let mut end = 0;
        let columns = bytes.map(|bytes| {
            let base = end;
            end += bytes.next_multiple_of(block);
            Column { base, bytes }
        });
        let shift = block.trailing_zeros();
        Self { columns, shift, blocks: end >> shift }
    }

    /// Bytes of a block.
    pub const fn block_bytes(&self) -> usize {
        1 << self.shift
    }

    /// The power of two that a block is.
    #[inline(always)]
    pub const fn shift(&self) -> u32 {
        self.shift
    }

    /// How many blocks there are.
    pub const fn blocks(&self) -> usize {
        self.blocks
    }

    /// An array's place.
    pub const fn column(&self, array: Array) -> Column {
        self.columns[array as usize]
    }

    /// Bytes of all arrays.
    pub fn bytes(&self) -> usize {
        self.columns.iter().map(|column| column.bytes).sum()
    }

    /// The array that a block is of.
    fn array_of(&self, block: u32) -> Array {
        let at = (block as usize) << self.shift;
        let holds = |array: &Array| {
            let Column { base, bytes } = self.column(*array);
            (base..base + bytes).contains(&at)
        };
        Array::ALL.into_iter().find(holds).expect("a block of the layout")
    }

    /// The array that some blocks are of, which follow one another, the byte of it that they begin with, and how many
    /// they hold.
    pub fn locate(&self, blocks: Range<u32>) -> (Array, usize, usize) {
        let array = self.array_of(blocks.start);
        let Column { base, bytes } = self.column(array);
        let first = ((blocks.start as usize) << self.shift) - base;
        (array, first, (blocks.len() << self.shift).min(bytes - first))
    }

    /// The blocks of the same array that share a piece of so many bytes with a block; the pieces begin where the
    /// array does.
    pub fn beside(&self, block: u32, bytes: usize) -> Range<u32> {
        let Column { base, bytes: all } = self.column(self.array_of(block));
        let [first, end] = [base, base + all].map(|byte| byte.div_ceil(self.block_bytes()) as u32);
        let count = (bytes >> self.shift).max(1) as u32;
        let start = first + (block - first) / count * count;
        start..end.min(start + count)
    }

    /// The first block of what leaves need.
    pub const fn first_of_leaves(&self) -> usize {
        self.columns[Array::References as usize].base >> self.shift
    }

    /// Which part a block is of: 0 for nodes, 1 for what leaves need.
    pub const fn part(&self, block: u32) -> usize {
        (block as usize >= self.first_of_leaves()) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_beside_a_block_is_of_its_array() {
        let layout = Layout::new([3 * 4096, 9 * 4096 + 1, 0, 5000, 0, 4096], 4096);
        let beside = |block| layout.beside(block, 16 << 10);
        assert_eq!([0, 2].map(beside), [0..3, 0..3]);
        assert_eq!([3, 6, 7, 12].map(beside), [3..7, 3..7, 7..11, 11..13]);
        assert_eq!([13, 14, 15].map(beside), [13..15, 13..15, 15..16]);
        assert!((0..16).all(|block| layout.beside(block, 100) == (block..block + 1)));
        let located: Vec<_> = [3..7, 11..13, 13..15].map(|blocks| layout.locate(blocks)).into();
        assert_eq!(located[0], (Array::ALL[1], 0, 4 * 4096));
        assert_eq!(located[1], (Array::ALL[1], 8 * 4096, 4097));
        assert_eq!(located[2], (Array::ALL[3], 0, 5000));
    }

    #[test]
    fn every_byte_is_in_one_block() {
        let layout = Layout::new([5000, 0, 4096, 1, 12_288, 40], 4096);
        let found: Vec<_> =
            (0..layout.blocks() as u32).map(|block| layout.locate(block..block + 1)).collect();
        use Array::{Colors, Nodes, Pages, Surfaces, Triangles};
        let expected = [
            (Nodes, 0, 4096),
            (Nodes, 4096, 904),
            (Pages, 0, 4096),
            (Triangles, 0, 1),
            (Colors, 0, 4096),
            (Colors, 4096, 4096),
            (Colors, 8192, 4096),
            (Surfaces, 0, 40),
        ];
        assert_eq!(found, expected);
        assert_eq!(layout.bytes(), 5000 + 4096 + 1 + 12_288 + 40);
        assert_eq!(layout.first_of_leaves(), 2);
    }
}
