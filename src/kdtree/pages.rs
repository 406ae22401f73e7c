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

/// Upper nodes and pages.
#[derive(Debug, Default)]
pub(super) struct Pages {
    /// The root, an unused place, and then pairs of siblings. A leaf's references are its page's.
    pub upper: Vec<Node>,
    /// The nodes of the full tree at the same places.
    pub beneath: Vec<Node>,
    /// Primitive ids, page after page, ascending in each.
    pub primitives: Vec<u32>,
}

/// A page in the making: its root's index in the full tree, and its primitives.
type Page = (usize, Vec<u32>);

impl Pages {
    /// Cuts a tree into the largest subtrees of at most `limit` triangles. A leaf with more is a page
    /// of its own.
    pub fn cut(nodes: &[Node], references: &[u32], limit: usize) -> Self {
        let cutter = Cutter { nodes, references, limit };
        let (whole, mut found) = cutter.find(0, 0);
        found.extend(whole.map(|primitives| (0, primitives)));

        // Both walks meet the pages in the same order.
        let mut pages = Self { upper: vec![Node::leaf(0, 0); 2], ..Self::default() };
        pages.beneath = pages.upper.clone();
        pages.place(nodes, 0, 0, &mut found.into_iter().peekable());
        pages
    }

    /// Puts the node `index` of the full tree to the upper place `at`, and what is below it behind.
    fn place(
        &mut self,
        nodes: &[Node],
        index: usize,
        at: usize,
        pages: &mut std::iter::Peekable<std::vec::IntoIter<Page>>,
    ) {
        let node = nodes[index];
        self.beneath[at] = node;
        if let Some((_, primitives)) = pages.next_if(|&(root, _)| root == index) {
            self.upper[at] = Node::leaf(self.primitives.len(), primitives.len());
            self.primitives.extend(primitives);
            return;
        }
        let pair = self.upper.len();
        self.upper.extend([Node::leaf(0, 0); 2]);
        self.beneath.extend([Node::leaf(0, 0); 2]);
        self.upper[at] = Node::inner(node.axis(), node.split(), pair);
        for child in 0..2 {
            self.place(nodes, node.below() as usize + child, pair + child, pages);
        }
    }

    /// Memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.upper[..]) + size_of_val(&self.beneath[..]) + size_of_val(&self.primitives[..])
    }
}

struct Cutter<'a> {
    nodes: &'a [Node],
    references: &'a [u32],
    limit: usize,
}

impl Cutter<'_> {
    /// The primitives of a subtree if it can be part of a page; and the pages in it that are settled, in
    /// the order of a depth-first walk.
    fn find(&self, index: usize, depth: usize) -> (Option<Vec<u32>>, Vec<Page>) {
        let node = self.nodes[index];
        if node.is_leaf() {
            let mut primitives = self.references[node.references()].to_vec();
            primitives.sort_unstable();
            return (Some(primitives), Vec::new());
        }
        let below = node.below() as usize;
        let ((lower, mut pages), (upper, later)) = if depth < PARALLEL_DEPTH {
            rayon::join(|| self.find(below, depth + 1), || self.find(below + 1, depth + 1))
        } else {
            (self.find(below, depth + 1), self.find(below + 1, depth + 1))
        };
        if let (Some(lower), Some(upper)) = (&lower, &upper)
            && let Some(both) = self.union(lower, upper)
        {
            return (Some(both), pages);
        }
        pages.extend(lower.map(|primitives| (below, primitives)));
        pages.extend(later);
        pages.extend(upper.map(|primitives| (below + 1, primitives)));
        (None, pages)
    }

    /// Two ascending lists as one, unless that is longer than a page may be.
    fn union(&self, a: &[u32], b: &[u32]) -> Option<Vec<u32>> {
        if a.len().max(b.len()) > self.limit {
            return None;
        }
        let mut union = Vec::with_capacity(a.len() + b.len());
        let (mut a, mut b) = (a.iter().copied().peekable(), b.iter().copied().peekable());
        while let Some(next) = a.peek().into_iter().chain(b.peek()).copied().min() {
            a.next_if_eq(&next);
            b.next_if_eq(&next);
            union.push(next);
            if union.len() > self.limit {
                return None;
            }
        }
        Some(union)
    }
}

/// Subtrees so far down are cut side by side.
const PARALLEL_DEPTH: usize = 6;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::{BuildParams, KdTree};
    use crate::mesh::generate::shapes;

    /// Walks both trees together, and gives the pages' sizes.
    fn compare(tree: &KdTree, pages: &Pages, index: usize, at: usize, sizes: &mut Vec<usize>) {
        let (node, upper) = (tree.nodes[index], pages.upper[at]);
        assert_eq!(pages.beneath[at], node);
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
        let tree = KdTree::build(&mesh, &BuildParams::default(), None).expect("builds");
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
