//! The tree in cache lines, for kernels that fetch a line for one ray at a time.
//!
//! Three levels of the tree, a *treelet*, fill the 64 bytes of a [`Line`]: seven planes and eight exits, so
//! that a ray waits for memory once in three levels and meets all seven planes at once.
//!
//! ```text
//!                 0                            place  0   1   2   3   4   5   6   7
//!             /       \                              +---+---+---+---+---+---+---+---+
//!          1             5               planes      | 0 | 1 | 3 | 4 | 0 | 2 | 5 | 6 |  nodes, breadth first
//!        /   \         /   \                         +---+---+---+---+---+---+---+---+
//!      2       3     6       7           exits       | a | b | c | d | e | f | g | h |
//!     / \     / \   / \     / \                      +---+---+---+---+---+---+---+---+
//!    a   b   c   d e   f   g   h             below all planes ...            ... above all
//! ```
//!
//! In the drawing the planes have the numbers of their places. The root's plane is there twice (0 and 4),
//! so that each half of four planes is all that the exits beside it depend on.
//!
//! ```text
//!             31  30                                     2   1   0
//!            +---+----------------------------------------+-------+
//! exit       | 1 | first word of a leaf's record          | axis  |
//!            | 0 | 0 | number of a line, 0: nothing there | axis  |   of the plane at the same place
//!            +---+---+------------------------------------+-------+
//!             31  30 27
//! ```
//!
//! Bits 27 to 30 of an exit to a line are free for who walks: see [`Exit::without`].
//!
//! A leaf's record is a word of the reference array that tells how many references follow. Where the tree is
//! less than three levels deep, planes at infinity let everything pass to the exit below them.
//!
//! Lines lie in the order of a depth-first walk that takes the larger exits first: what is met often after
//! one another lies together.

use super::node::Node;
use crate::column::Column;
use crate::geometry::Aabb;
use crate::huge;
use bytemuck::{Pod, Zeroable};

/// A treelet.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Line {
    /// Planes, by place.
    pub planes: [f32; 8],
    /// [`Exit`]s, with the planes' axes in their low bits.
    pub exits: [i32; 8],
}

/// Where a walk goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Exit(pub i32);

impl Exit {
    /// Whether it is a leaf. Otherwise it is a line, or nothing.
    #[inline(always)]
    pub const fn is_leaf(self) -> bool {
        self.0 < 0
    }

    /// The first word of a leaf's record.
    #[inline(always)]
    pub const fn record(self) -> usize {
        ((self.0 as u32) << 1 >> 3) as usize
    }

    /// The number of a line.
    #[inline(always)]
    pub const fn line(self) -> usize {
        ((self.0 as u32) << 5 >> 7) as usize
    }

    /// The way to a line.
    #[inline(always)]
    pub const fn of_line(index: usize) -> Self {
        Self((index as i32) << 2)
    }

    /// The way to a line, of whose exits one is not to be taken.
    #[inline(always)]
    pub const fn without(self, exit: usize) -> Self {
        Self(self.0 | (8 | exit as i32) << 27)
    }

    /// What [`without`](Self::without) put there: 8 and the exit, or 0.
    #[inline(always)]
    pub const fn barred(self) -> usize {
        (self.0 as u32 >> 27 & 15) as usize
    }

    fn of_leaf(record: usize) -> Self {
        Self((1 << 31 | (record as u32) << 2) as i32)
    }
}

/// Words behind the last record, so that eight can be read wherever one is.
pub const AFTER: usize = 7;

/// Greatest record that an exit can hold: 29 bits, the last value left out.
pub const MAX_RECORD: usize = (1 << 29) - 2;

/// Greatest line: 25 bits.
pub const MAX_LINE: usize = (1 << 25) - 1;

/// The place of a node of a treelet, breadth first. The root's second place is 4.
const PLACES: [usize; 7] = [0, 1, 5, 2, 3, 6, 7];

/// All lines. The root is line 0, which no exit leads to.
#[derive(Debug, Default)]
pub struct Lines(Column<Line>);

impl Lines {
    /// Packs a tree whose references are [`counted`].
    pub fn pack(nodes: &[Node], bounds: &Aabb) -> Self {
        Self(pack(nodes, nodes[0], bounds).into())
    }

    /// Lines that were packed before.
    pub fn of_packed(lines: Column<Line>) -> Self {
        Self(lines)
    }

    /// The lines.
    #[inline(always)]
    pub fn all(&self) -> &[Line] {
        &self.0
    }

    /// Memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.0[..])
    }
}

/// The lines of a subtree that begins with a line of its own, numbered from 0.
pub fn pack(nodes: &[Node], root: Node, cell: &Aabb) -> Vec<Line> {
    let mut lines = huge::copies_of(Line::NOTHING, count(nodes, root));
    Treelets { nodes }.fill(&mut lines, 0, root, cell, 0);
    lines
}

/// How many lines a subtree takes.
fn count(nodes: &[Node], root: Node) -> usize {
    let mut level = vec![root];
    let mut next = Vec::new();
    let mut lines = 0;
    // Breadth first, three levels at a time.
    while !level.is_empty() {
        lines += level.len();
        for _ in 0..3 {
            let inner = level.iter().filter(|node| !node.is_leaf());
            next.extend(inner.flat_map(|node| [0, 1].map(|child| nodes[node.below() as usize + child])));
            (level, next) = (next, level);
            next.clear();
        }
        level.retain(|node| !node.is_leaf());
    }
    lines
}

/// A tree on its way into lines.
struct Treelets<'a> {
    nodes: &'a [Node],
}

impl Treelets<'_> {
    /// Fills the first of `lines`, whose numbers begin at `first`, with a subtree that begins `depth`
    /// treelets down; says how many it took.
    fn fill(&self, lines: &mut [Line], first: usize, root: Node, cell: &Aabb, depth: usize) -> usize {
        use rayon::prelude::*;
        let (mut line, below) = Line::of_treelet(self.nodes, root, cell);
        let mut taken = 1;
        if depth < PARALLEL_DEPTH {
            let counts = below.par_iter().map(|(_, node, _)| count(self.nodes, *node)).collect::<Vec<_>>();
            let (_, mut rest) = lines.split_at_mut(1);
            let mut tasks = Vec::with_capacity(below.len());
            for ((exit, node, cell), count) in below.into_iter().zip(counts) {
                let (part, behind) = rest.split_at_mut(count);
                rest = behind;
                line.exits[exit] |= Exit::of_line(first + taken).0;
                tasks.push((part, first + taken, node, cell));
                taken += count;
            }
            tasks.into_par_iter().for_each(|(part, first, node, cell)| {
                self.fill(part, first, node, &cell, depth + 1);
            });
        } else {
            for (exit, node, cell) in below {
                line.exits[exit] |= Exit::of_line(first + taken).0;
                taken += self.fill(&mut lines[taken..], first + taken, node, &cell, depth + 1);
            }
        }
        lines[0] = line;
        taken
    }
}

/// An exit that goes on: its place, the node there, and its cell.
pub type Below = (usize, Node, Aabb);

impl Line {
    /// A line in which nothing is.
    pub const NOTHING: Self = Self { planes: [f32::INFINITY; 8], exits: [0; 8] };

    /// The same line in a longer array: lines `lines` further on, and records `words`.
    pub fn moved(mut self, lines: usize, words: usize) -> Self {
        for exit in &mut self.exits {
            let (to, axis) = (Exit(*exit), *exit & 3);
            if to.is_leaf() {
                *exit = Exit::of_leaf(to.record() + words).0 | axis;
            } else if to.line() != 0 {
                *exit = Exit::of_line(to.line() + lines).0 | axis;
            }
        }
        self
    }

    /// The treelet under `root`, and its exits that go on, larger ones first, whose lines are not filled in.
    pub fn of_treelet(nodes: &[Node], root: Node, cell: &Aabb) -> (Self, Vec<Below>) {
        let mut line = Self::NOTHING;
        // The treelet's nodes and then its exits, breadth first; there is nothing above a plane at infinity.
        let mut found: [Option<(Node, Aabb)>; 15] = [None; 15];
        found[0] = Some((root, *cell));
        for (i, place) in PLACES.into_iter().enumerate() {
            match found[i] {
                Some((node, cell)) if !node.is_leaf() => {
                    line.planes[place] = node.split();
                    line.exits[place] = node.axis() as i32;
                    let cells = cell.halves(node.axis(), node.split());
                    for (child, cell) in cells.into_iter().enumerate() {
                        found[2 * i + 1 + child] = Some((nodes[node.below() as usize + child], cell));
                    }
                }
                other => found[2 * i + 1] = other,
            }
        }
        line.planes[4] = line.planes[0];
        line.exits[4] = line.exits[0];

        let mut below = Vec::with_capacity(8);
        for (exit, found) in found[7..].iter().enumerate() {
            match found {
                Some((node, cell)) if !node.is_leaf() => below.push((exit, *node, *cell)),
                Some((leaf, _)) if !leaf.references().is_empty() => {
                    line.exits[exit] |= Exit::of_leaf(leaf.references().start - 1).0;
                }
                _ => {}
            }
        }
        below.sort_by(|(_, _, a), (_, _, b)| b.area().total_cmp(&a.area()));
        (line, below)
    }
}

/// The references with a word in front of each leaf's, which tells how many there are; the nodes' leaves are
/// moved accordingly. Records are in the order of a depth-first walk, as the references are.
pub fn counted(nodes: &mut [Node], references: &[u32]) -> Vec<u32> {
    let leaves = nodes.iter().filter(|node| node.is_leaf() && !node.references().is_empty()).count();
    let mut all = huge::room_for(references.len() + leaves + AFTER);
    let mut stack = vec![0];
    while let Some(index) = stack.pop() {
        let node = nodes[index];
        let range = node.references();
        if !node.is_leaf() {
            stack.extend([node.below() as usize + 1, node.below() as usize]);
        } else if range.is_empty() {
            nodes[index] = Node::leaf(0, 0);
        } else {
            all.push(range.len() as u32);
            nodes[index] = Node::leaf(all.len(), range.len());
            all.extend_from_slice(&references[range]);
        }
    }
    all
}

/// Treelets so far down are packed side by side.
const PARALLEL_DEPTH: usize = 2;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::{BuildParams, KdTree, Tree};
    use crate::mesh::generate::shapes;

    /// What lies at a point: from above if the point is in a plane.
    fn leaf_of_tree(tree: &KdTree, point: [f32; 3]) -> Vec<u32> {
        let mut node = tree.root();
        while !node.is_leaf() {
            node = tree.children(node)[usize::from(point[node.axis()] >= node.split())];
        }
        tree.primitives(node).to_vec()
    }

    /// The same by lines; counts them, and marks those that are met.
    fn leaf_of_lines(tree: &KdTree, point: [f32; 3], met: &mut [bool]) -> Vec<u32> {
        let mut index = 0;
        loop {
            met[index] = true;
            let line = &tree.lines()[index];
            let above =
                |place: usize| usize::from(point[(line.exits[place] & 3) as usize] >= line.planes[place]);
            assert_eq!(above(0), above(4));
            let half = 4 * above(0);
            let quarter = above(half + 1);
            let exit = Exit(line.exits[half | (2 * quarter) | above(half + 2 + quarter)]);
            if exit.is_leaf() {
                return tree.record(exit.record()).to_vec();
            }
            if exit.line() == 0 {
                return Vec::new();
            }
            index = exit.line();
        }
    }

    #[test]
    fn lines_lead_where_nodes_do() {
        for (count, seed) in [(1, 1), (2, 2), (30, 3), (5000, 4)] {
            let tree =
                KdTree::build(&shapes::soup(count, seed), &BuildParams::default(), None).expect("builds");
            tree.validate().expect("is whole");
            let mut met = vec![false; tree.lines().len()];
            let bounds = *tree.bounds();
            let mut state = 0.0f32;
            for i in 0..200 * count.min(1000) {
                state = (state + 0.618_034).fract();
                let at =
                    glam::Vec3::new(state, (i as f32 * 0.754_877).fract(), (i as f32 * 0.569_84).fract());
                let point = (bounds.min + bounds.extent() * at).to_array();
                assert_eq!(leaf_of_lines(&tree, point, &mut met), leaf_of_tree(&tree, point), "{point:?}");
            }
            let unmet = met.iter().filter(|&&met| !met).count();
            assert!(unmet * 4 <= met.len(), "{unmet} of {} lines are never met", met.len());
        }
    }
}
