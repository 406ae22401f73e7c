//! The tree cut into pages, for kernels that look at many triangles at once.
//!
//! Kernels disagree about leaves: a single ray wants some six triangles in one, a tile of rays some
//! fifty. So the fine tree is cut where a subtree's triangles are few enough for a tile: such a subtree
//! is a *page*. Above the cut lie the *upper nodes*, a small tree of their own whose leaves are pages:
//!
//! ```text
//! upper nodes      full tree
//!      o  . . . . . . o           the same planes, node for node: an upper node's index
//!     / \            / \          leads to the same place in the full tree (`beneath`)
//!    o   P  . . . . o   o
//!   / \            / \  |\        P: a page: the primitives of its subtree, each once
//!  P   P  . . . . o   o o o
//! ```

use super::node::Node;
use crate::column::Column;
use crate::huge;
use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::AtomicBool;
use std::sync::atomic::Ordering::Relaxed;

/// Upper nodes and pages.
#[derive(Debug, Default)]
pub(super) struct Pages {
    /// The root, an unused place, and then pairs of siblings. A leaf's references are its page's.
    pub upper: Column<Node>,
    /// The indices of the full tree's nodes at the same places.
    pub beneath: Column<u32>,
    /// Primitive ids, page after page, ascending in each.
    pub primitives: Column<u32>,
}

impl Pages {
    /// Cuts a tree into the largest subtrees of at most `limit` triangles. A leaf with more is a page
    /// of its own. The references are those of the leaves in the order of a depth-first walk.
    pub fn cut(nodes: &[Node], references: &[u32], limit: usize) -> Self {
        let fits = (0..nodes.len()).map(|_| AtomicBool::new(false)).collect();
        let cutter = Cutter { nodes, references, limit, fits };
        cutter.find(0, 0, &mut Vec::new());

        let mut cut = Cut { upper: vec![Node::leaf(0, 0); 2], beneath: vec![0; 2], primitives: Vec::new() };
        let mut roots = Vec::new();
        cut.place(&cutter, 0, 0, &mut roots);
        cut.fill(&cutter, &roots);
        Self { upper: cut.upper.into(), beneath: cut.beneath.into(), primitives: cut.primitives.into() }
    }

    /// Memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.upper[..]) + size_of_val(&self.beneath[..]) + size_of_val(&self.primitives[..])
    }
}

/// [`Pages`] in the making.
struct Cut {
    upper: Vec<Node>,
    beneath: Vec<u32>,
    primitives: Vec<u32>,
}

impl Cut {
    /// Puts the node `index` of the full tree to the upper place `at`, and what is below it behind; the
    /// places of pages, which stay empty, go to `roots`.
    fn place(&mut self, cutter: &Cutter, index: usize, at: usize, roots: &mut Vec<usize>) {
        let node = cutter.nodes[index];
        self.beneath[at] = index as u32;
        if cutter.fits[index].load(Relaxed) {
            roots.push(at);
            return;
        }
        let pair = self.upper.len();
        self.upper.extend([Node::leaf(0, 0); 2]);
        self.beneath.extend([0; 2]);
        self.upper[at] = Node::inner(node.axis(), node.split(), pair);
        for child in 0..2 {
            self.place(cutter, node.below() as usize + child, pair + child, roots);
        }
    }

    /// Lists every page's triangles.
    fn fill(&mut self, cutter: &Cutter, roots: &[usize]) {
        let beneath = &self.beneath;
        let list = |places: &[usize]| {
            let (mut primitives, mut counts) = (Vec::new(), Vec::with_capacity(places.len()));
            for &at in places {
                let first = primitives.len();
                primitives.extend_from_slice(
                    &cutter.references[cutter.references_below(cutter.nodes[beneath[at] as usize])],
                );
                sort_and_dedup(&mut primitives, first);
                counts.push(primitives.len() - first);
            }
            (primitives, counts)
        };
        let lists: Vec<(Vec<u32>, Vec<usize>)> = roots.par_chunks(PAGES_PER_TASK).map(list).collect();
        self.primitives = huge::room_for(lists.iter().map(|(primitives, _)| primitives.len()).sum());
        for (places, (primitives, counts)) in roots.chunks(PAGES_PER_TASK).zip(lists) {
            let mut first = self.primitives.len();
            for (&at, count) in places.iter().zip(counts) {
                self.upper[at] = Node::leaf(first, count);
                first += count;
            }
            self.primitives.extend(primitives);
        }
    }
}

/// Finds out which subtrees can be part of a page.
struct Cutter<'a> {
    nodes: &'a [Node],
    references: &'a [u32],
    limit: usize,
    /// By node.
    fits: Vec<AtomicBool>,
}

impl Cutter<'_> {
    /// The references of a subtree if it can be part of a page.
    fn find(&self, index: usize, depth: usize, scratch: &mut Vec<u32>) -> Option<Range<usize>> {
        let node = self.nodes[index];
        let range = if node.is_leaf() {
            node.references()
        } else {
            let below = node.below() as usize;
            let (lower, upper) = if depth < PARALLEL_DEPTH {
                rayon::join(
                    || self.find(below, depth + 1, &mut Vec::new()),
                    || self.find(below + 1, depth + 1, &mut Vec::new()),
                )
            } else {
                (self.find(below, depth + 1, scratch), self.find(below + 1, depth + 1, scratch))
            };
            let range = lower?.start..upper?.end;
            self.is_page(&range, scratch).then_some(range)?
        };
        self.fits[index].store(true, Relaxed);
        Some(range)
    }

    /// Whether there are not too many different triangles in some leaves in a row.
    fn is_page(&self, range: &Range<usize>, scratch: &mut Vec<u32>) -> bool {
        if range.len() <= self.limit {
            return true;
        }
        scratch.clear();
        scratch.extend_from_slice(&self.references[range.clone()]);
        sort_and_dedup(scratch, 0);
        scratch.len() <= self.limit
    }

    /// The references of all leaves below a node.
    fn references_below(&self, node: Node) -> Range<usize> {
        let (mut first, mut last) = (node, node);
        while !first.is_leaf() {
            first = self.nodes[first.below() as usize];
        }
        while !last.is_leaf() {
            last = self.nodes[last.below() as usize + 1];
        }
        first.references().start..last.references().end
    }
}

/// Sorts what a list has from `first` on, and drops what is there twice.
pub(super) fn sort_and_dedup(list: &mut Vec<u32>, first: usize) {
    list[first..].sort_unstable();
    let mut kept = first;
    for i in first..list.len() {
        if i == first || list[i] != list[kept - 1] {
            list[kept] = list[i];
            kept += 1;
        }
    }
    list.truncate(kept);
}

/// Subtrees so far down are cut side by side.
const PARALLEL_DEPTH: usize = 6;

/// Pages that a task lists.
const PAGES_PER_TASK: usize = 512;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::build::{self, Built};
    use crate::kdtree::memory::Ledger;
    use crate::kdtree::{BuildParams, gather};
    use crate::mesh::generate::shapes;

    /// Walks both trees together, and gives the pages' sizes.
    fn compare(tree: &Built, pages: &Pages, index: usize, at: usize, sizes: &mut Vec<usize>) {
        let (node, upper) = (tree.nodes[index], pages.upper[at]);
        assert_eq!(pages.beneath[at] as usize, index);
        if upper.is_leaf() {
            let mut below: Vec<u32> = Vec::new();
            let mut stack = vec![node];
            while let Some(node) = stack.pop() {
                if node.is_leaf() {
                    below.extend(&tree.references[node.references()]);
                } else {
                    stack.extend([0, 1].map(|child| tree.nodes[node.below() as usize + child]));
                }
            }
            below.sort_unstable();
            below.dedup();
            assert_eq!(pages.primitives[upper.references()], below);
            sizes.push(below.len());
            return;
        }
        assert_eq!((upper.axis(), upper.split()), (node.axis(), node.split()));
        for child in 0..2 {
            compare(tree, pages, node.below() as usize + child, upper.below() as usize + child, sizes);
        }
    }

    #[test]
    fn pages_hold_what_is_below_them() {
        let mesh = shapes::soup(5000, 1);
        let (triangles, bounds, _) = gather(&mesh).expect("triangles");
        let tree = build::build(&triangles, bounds, &BuildParams::default(), &Ledger::default(), None)
            .expect("builds");
        for limit in [1, 16, 64, 1 << 30] {
            let pages = Pages::cut(&tree.nodes, &tree.references, limit);
            let mut sizes = Vec::new();
            compare(&tree, &pages, 0, 0, &mut sizes);
            assert_eq!(pages.upper.len(), sizes.len() * 2);
            let full = sizes.iter().filter(|&&size| size * 4 > limit).count();
            assert!(limit != 64 || full * 2 > sizes.len(), "{full} of {} pages are full", sizes.len());
        }
    }
}
