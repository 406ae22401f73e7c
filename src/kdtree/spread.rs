//! How far apart in memory lies what belongs together.

use super::{KdTree, Node};
use crate::geometry::triangle::Triangle;
use rayon::prelude::*;
use std::ops::Range;

/// The sizes of blocks that [`KdTree::spread`] tells of: powers of two, in bytes.
pub const SPREAD_BLOCKS: [usize; 5] = [1 << 12, 1 << 13, 1 << 14, 1 << 15, 1 << 16];

impl KdTree {
    /// The most blocks, for each size in [`SPREAD_BLOCKS`], that a page's or a leaf's list of primitives and
    /// its triangles lie in together, if arrays begin at the start of a block.
    pub fn spread(&self) -> [usize; SPREAD_BLOCKS.len()] {
        let arrays = self.arrays();
        greatest(of_leaves(arrays.nodes, arrays.references, 0), of_leaves(arrays.upper, arrays.pages, 0))
    }
}

/// Blocks, for each size.
pub(super) type Spread = [usize; SPREAD_BLOCKS.len()];

/// The most blocks of a leaf's list and its triangles, where the lists are words of a longer array, from its
/// word `first` on.
pub(super) fn of_leaves(nodes: &[Node], lists: &[u32], first: usize) -> Spread {
    let leaves = nodes.par_iter().filter(|node| node.is_leaf() && !node.references().is_empty());
    let spread = leaves.map_init(Vec::new, |blocks, leaf| {
        let list = leaf.references();
        let triangles = of_list(&lists[list.clone()], blocks);
        let words = list_blocks(first + list.start..first + list.end);
        std::array::from_fn(|i| triangles[i] + words[i])
    });
    spread.reduce(|| [0; SPREAD_BLOCKS.len()], greatest)
}

/// The greater of each.
pub(super) fn greatest(a: Spread, b: Spread) -> Spread {
    std::array::from_fn(|i| a[i].max(b[i]))
}

/// Blocks that some words of an array lie in.
fn list_blocks(words: Range<usize>) -> Spread {
    let (first, last) = (words.start * size_of::<u32>(), words.end * size_of::<u32>() - 1);
    SPREAD_BLOCKS.map(|block| last / block - first / block + 1)
}

/// Blocks that the records of some triangles lie in.
fn of_list(primitives: &[u32], blocks: &mut Vec<usize>) -> Spread {
    blocks.clear();
    let size = size_of::<Triangle>();
    // A record may lie across the border of two blocks.
    let ends = |&primitive: &u32| [primitive as usize * size, primitive as usize * size + size - 1];
    blocks.extend(primitives.iter().flat_map(ends).map(|byte| byte / SPREAD_BLOCKS[0]));
    blocks.sort_unstable();
    let mut counts = [0; SPREAD_BLOCKS.len()];
    for (shift, count) in counts.iter_mut().enumerate() {
        // Coarser blocks are in the same order.
        *count = 1 + blocks.windows(2).filter(|pair| pair[0] >> shift != pair[1] >> shift).count();
    }
    counts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use std::collections::HashSet;

    #[test]
    fn it_is_what_the_widest_list_takes() {
        let tree = KdTree::build(&shapes::soup(3000, 2), &BuildParams::default(), None).expect("builds");
        let arrays = tree.arrays();
        let lists = [(arrays.nodes, arrays.references), (arrays.upper, arrays.pages)];
        for (i, block) in SPREAD_BLOCKS.into_iter().enumerate() {
            let mut most = 0;
            for (nodes, words) in lists {
                for leaf in nodes.iter().filter(|node| node.is_leaf() && !node.references().is_empty()) {
                    let list = leaf.references();
                    let mut blocks = HashSet::new();
                    blocks.extend(list.clone().flat_map(|word| [(0, word * 4 / block)]));
                    for &primitive in &words[list] {
                        let bytes = primitive as usize * 48..primitive as usize * 48 + 48;
                        blocks.extend(bytes.map(|byte| (1, byte / block)));
                    }
                    most = most.max(blocks.len());
                }
            }
            assert_eq!(tree.spread()[i], most, "{block}");
        }
    }
}
