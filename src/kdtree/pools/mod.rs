//! Leaves that hold their triangles' corners, for kernels that meet a leaf with one ray alone.
//!
//! A leaf of the tree names its triangles, whose records lie anywhere. For packets, which share what they fetch, that takes the
//! least memory; but a ray that is alone fetches a line or two of the cache for each triangle, and has to bring their numbers
//! together. A *pool* is a leaf's vertices side by side, each once, with the numbers of each triangle's three: a ray meets up to
//! sixteen triangles at once, out of three or four lines of the cache that lie in a row.
//!
//! What sixteen cost no more than one of changes what a good leaf is, too, and rays that are alone are led to it by few boxes rather
//! than by many planes: pools are the leaves of a hierarchy of their own (`hierarchy/`), whose nodes are [`Boxes`].
//!
//! They are made beside a tree when someone asks ([`KdTree::make_pools`](super::KdTree::make_pools)), and a scene file holds those of its tree if
//! it was written with them. One ray against as many
//! triangles as a register has lanes: Wald, Benthin & Boulos, "Getting rid of packets", 2008.

mod boxes;
mod chunk;
mod hierarchy;
mod validate;
mod wide;

pub use boxes::{Boxes, Way};
pub use chunk::{Chunk, MOST};

use super::Node;
use crate::column::Column;
use crate::geometry::triangle::Triangle;
use crate::huge;
use hierarchy::Hierarchy;
use rayon::prelude::*;

/// The greatest word at which a pool may begin: what a leaf of the tree can name.
const MAX_WORD: usize = (1 << 29) - 2;

/// Leaves that hold their corners, and the nodes that lead to them.
#[derive(Debug)]
pub struct Pools {
    nodes: Column<Boxes>,
    /// Chunks, one behind the other; a leaf's in a row.
    words: Column<u32>,
    /// Up to how many triangles leaves mostly have.
    most: usize,
    /// The corners of the box around all of them, and a fourth number that says nothing.
    corners: [[f32; 4]; 2],
}

impl Pools {
    /// Makes those of some triangles, one at least, mostly with up to `most` in a leaf; `None` if there are more of them than ways
    /// can lead to.
    pub(super) fn new(triangles: &[Triangle], most: usize) -> Option<Self> {
        let mut hierarchy = Hierarchy::new(triangles);
        let shares = wide::plan(&mut hierarchy, triangles, most);
        let Hierarchy { mut nodes, boxes, ids } = hierarchy;
        let words = fill(&mut nodes, &ids, triangles);
        if words.len() > MAX_WORD {
            return None;
        }
        Some(Self::with_corners(boxes::pack(&nodes, &boxes, &shares).into(), words.into(), most))
    }

    /// Those of arrays that were theirs before, whose leaves mostly have up to `most` triangles.
    ///
    /// Looks at what costs no walk. That the rest is as it was made is for the caller to know, as of
    /// [`KdTree::of_parts`](super::KdTree::of_parts).
    ///
    /// # Errors
    /// A sentence about what cannot be part of any pools.
    pub fn of_parts(nodes: Column<Boxes>, words: Column<u32>, most: usize) -> Result<Self, String> {
        if nodes.is_empty() || nodes.len() > MAX_WORD {
            return Err(format!("{} is no number of nodes of boxes", nodes.len()));
        }
        if words.len() < 2 + chunk::SPAN || words.len() > MAX_WORD + chunk::SPAN {
            return Err(format!("{} words are no pools", words.len()));
        }
        if most == 0 || most > MOST {
            return Err(format!("leaves of pools have up to {MOST} triangles, not {most}"));
        }
        Ok(Self::with_corners(nodes, words, most))
    }

    /// The same with the box around all of them, which is what the root's boxes are in.
    fn with_corners(nodes: Column<Boxes>, words: Column<u32>, most: usize) -> Self {
        let mut corners = [[0.0; 4]; 2];
        for axis in 0..3 {
            let [least, greatest] = &nodes[0].faces[axis];
            corners[0][axis] = least.iter().copied().fold(f32::INFINITY, f32::min);
            corners[1][axis] = greatest.iter().copied().fold(f32::NEG_INFINITY, f32::max);
        }
        Self { nodes, words, most, corners }
    }

    /// The corners of the box around all triangles, and a fourth number that says nothing.
    #[inline(always)]
    pub const fn corners(&self) -> &[[f32; 4]; 2] {
        &self.corners
    }

    /// Up to how many triangles leaves mostly have: as many as kernels meet at once, where they were made.
    pub const fn most(&self) -> usize {
        self.most
    }

    /// Nodes of boxes; the root is the first.
    #[inline(always)]
    pub fn nodes(&self) -> &[Boxes] {
        &self.nodes
    }

    /// The words of all chunks, with room behind them for as many as a chunk may span.
    #[inline(always)]
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&self.nodes[..]) + size_of_val(&self.words[..])
    }
}

/// Leaves whose chunks are written at once.
const LEAVES: usize = 1024;

/// Writes all leaves' chunks and has the leaves name theirs, in the order of a depth-first walk. No chunk begins at word
/// 0; the first one has no triangles.
fn fill(nodes: &mut [Node], ids: &[u32], triangles: &[Triangle]) -> Vec<u32> {
    let mut leaves = Vec::new();
    let mut stack = vec![0];
    while let Some(index) = stack.pop() {
        let node = nodes[index];
        if !node.is_leaf() {
            stack.extend([node.below() as usize + 1, node.below() as usize]);
        } else {
            leaves.push(index);
        }
    }
    let blocks: Vec<(Vec<u32>, Vec<usize>)> = leaves
        .par_chunks(LEAVES)
        .map(|leaves| {
            let (mut words, mut starts) = (Vec::new(), Vec::with_capacity(leaves.len()));
            for &leaf in leaves {
                starts.push(words.len());
                chunk::write(&ids[nodes[leaf].references()], triangles, &mut words);
            }
            (words, starts)
        })
        .collect();
    let total: usize = blocks.iter().map(|(words, _)| words.len()).sum();
    let mut all = huge::room_for(2 + total + chunk::SPAN);
    all.extend([0; 2]);
    for ((words, starts), leaves) in blocks.iter().zip(leaves.chunks(LEAVES)) {
        for (&leaf, start) in leaves.iter().zip(starts) {
            let count = nodes[leaf].references().len();
            if all.len() + start <= MAX_WORD {
                nodes[leaf] = Node::leaf(all.len() + start, count);
            }
        }
        all.extend_from_slice(words);
    }
    all.resize(all.len() + chunk::SPAN, 0);
    all
}

#[cfg(test)]
mod tests;
