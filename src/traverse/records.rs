//! What a kernel reads of a tree's triangles.

use super::sieve::Sieve;
use crate::cache::View;
use crate::geometry::Aabb;
use crate::geometry::triangle::{Mode, Triangle};
use crate::kdtree::{KdTree, Node, Scale, Tree};
use crate::simd::prefetch_both;

/// A tree, with what a mode keeps of each of its triangles.
pub trait Records<M: Mode>: Tree {
    /// Whether triangles have holes.
    const SIFTS: bool = false;

    /// What is kept of a triangle.
    fn record_of(&self, primitive: u32) -> &M::Record;

    /// Has what is kept of a triangle fetched into the caches, if it is in memory: it will be looked at soon.
    #[inline(always)]
    fn fetch(&self, _primitive: u32) {}

    /// The same of a node's children. A leaf has none; then something else is asked for, which does no harm.
    #[inline(always)]
    fn fetch_children(&self, _node: Node) {}

    /// What says where triangles have holes, if any have.
    #[inline(always)]
    fn sieve(&self) -> Option<&dyn Sieve> {
        None
    }
}

/// A tree in memory, and the records of a mode, by primitive id.
///
/// They stand side by side here, so that a kernel finds either with one load.
pub struct Resident<'a, R> {
    pub tree: &'a KdTree,
    pub records: &'a [R],
}

impl<M: Mode> Records<M> for Resident<'_, M::Record> {
    #[inline(always)]
    fn record_of(&self, primitive: u32) -> &M::Record {
        &self.records[primitive as usize]
    }

    #[inline(always)]
    fn fetch(&self, primitive: u32) {
        prefetch_both(self.records.as_ptr().wrapping_add(primitive as usize));
    }

    #[inline(always)]
    fn fetch_children(&self, node: Node) {
        self.tree.fetch_children(node);
    }
}

impl<M: Mode<Record = Triangle>> Records<M> for View<'_> {
    #[inline(always)]
    fn record_of(&self, primitive: u32) -> &Triangle {
        self.triangle(primitive)
    }
}

impl<R> Tree for Resident<'_, R> {
    #[inline(always)]
    fn scale(&self) -> Scale {
        self.tree.scale()
    }

    #[inline(always)]
    fn bounds(&self) -> &Aabb {
        self.tree.bounds()
    }

    #[inline(always)]
    fn root(&self) -> Node {
        self.tree.root()
    }

    #[inline(always)]
    fn children(&self, inner: Node) -> [Node; 2] {
        self.tree.children(inner)
    }

    #[inline(always)]
    fn primitives(&self, leaf: Node) -> &[u32] {
        self.tree.primitives(leaf)
    }

    #[inline(always)]
    fn upper(&self, place: usize) -> Node {
        self.tree.upper(place)
    }

    #[inline(always)]
    fn beneath(&self, place: usize) -> Node {
        self.tree.beneath(place)
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        self.tree.page(leaf)
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &Triangle {
        self.tree.triangle(primitive)
    }
}
