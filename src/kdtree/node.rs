//! The 8-byte node (Wald, "Realtime Ray Tracing and Interactive Global Illumination", 2004).
//!
//! ```text
//! word      31                                   2 1   0
//!           +------------------------------------+-----+
//! inner     | index of the lower child           | axis|   0 x, 1 y, 2 z
//! leaf      | index of the first reference       |  3  |
//!           +------------------------------------+-----+
//! payload   inner: split plane, f32       leaf: number of references, u32
//! ```
//!
//! Siblings are adjacent: the child above the plane follows the one below it.

use bytemuck::{Pod, Zeroable};

/// An inner node or a leaf.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(C, align(8))]
pub struct Node {
    payload: u32,
    word: u32,
}

/// Greatest index that a node can hold: 30 bits.
pub const MAX_INDEX: usize = (1 << 30) - 1;

const LEAF: u32 = 3;

impl Node {
    /// An inner node: `axis` is 0, 1 or 2, `below` the index of its lower child.
    #[inline]
    pub fn inner(axis: usize, split: f32, below: usize) -> Self {
        debug_assert!(axis < 3 && below <= MAX_INDEX);
        Self { payload: split.to_bits(), word: (below as u32) << 2 | axis as u32 }
    }

    /// A leaf that owns `count` references from index `first` on.
    #[inline]
    pub fn leaf(first: usize, count: usize) -> Self {
        debug_assert!(first <= MAX_INDEX && count <= MAX_INDEX);
        Self { payload: count as u32, word: (first as u32) << 2 | LEAF }
    }

    /// Whether it is a leaf.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.word & 3 == LEAF
    }

    /// An inner node's axis: 0, 1 or 2 (3 for a leaf).
    #[inline(always)]
    pub const fn axis(self) -> usize {
        (self.word & 3) as usize
    }

    /// An inner node's plane.
    #[inline(always)]
    pub const fn split(self) -> f32 {
        f32::from_bits(self.payload)
    }

    /// The index of an inner node's lower child; the upper one follows it.
    #[inline(always)]
    pub const fn below(self) -> u32 {
        self.word >> 2
    }

    /// A leaf's references.
    #[inline(always)]
    pub const fn references(self) -> std::ops::Range<usize> {
        let first = (self.word >> 2) as usize;
        first..first + self.payload as usize
    }

    /// The same node in a longer array: children `nodes` further on, references `references`.
    pub(super) fn moved(self, nodes: usize, references: usize) -> Self {
        if self.is_leaf() {
            let range = self.references();
            Self::leaf(range.start + references, range.len())
        } else {
            Self::inner(self.axis(), self.split(), self.below() as usize + nodes)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_is_eight_bytes_and_keeps_what_it_was_given() {
        assert_eq!(size_of::<Node>(), 8);
        for axis in 0..3 {
            let node = Node::inner(axis, -0.5, MAX_INDEX);
            assert!(!node.is_leaf());
            assert_eq!((node.axis(), node.split(), node.below() as usize), (axis, -0.5, MAX_INDEX));
        }
        let leaf = Node::leaf(MAX_INDEX, 7);
        assert!(leaf.is_leaf());
        assert_eq!(leaf.references(), MAX_INDEX..MAX_INDEX + 7);
    }
}
