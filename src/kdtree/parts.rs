//! A tree taken apart and put together again, for who keeps it in a file.

use super::lines::{AFTER, Line, Lines, MAX_LINE, MAX_RECORD};
use super::node::{MAX_INDEX, Node};
use super::pages::Pages;
use super::{BuildParams, KdTree, Pools, Scale, TreeStats};
use crate::column::Column;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use std::sync::OnceLock;

/// The arrays of a tree.
#[derive(Clone, Copy, Debug)]
pub struct Arrays<'a> {
    /// The root, an unused place, and then pairs of siblings.
    pub nodes: &'a [Node],
    /// The leaves' records: each leaf's primitive ids behind their number; seven words behind the last.
    pub references: &'a [u32],
    /// The nodes above the pages, laid out like `nodes`; leaves are pages.
    pub upper: &'a [Node],
    /// The place in `nodes` of each node of `upper`.
    pub beneath: &'a [u32],
    /// The pages' primitive ids.
    pub pages: &'a [u32],
    /// The tree in cache lines, the root first.
    pub lines: &'a [Line],
    /// Corners and planes by primitive id.
    pub triangles: &'a [Triangle],
    /// Leaves that hold their corners, if they have been made.
    pub pools: Option<&'a Pools>,
}

/// All that a tree consists of: its arrays, as in [`Arrays`], and what is known about it.
#[derive(Debug)]
pub struct Parts {
    /// See [`Arrays::nodes`].
    pub nodes: Column<Node>,
    /// See [`Arrays::references`].
    pub references: Column<u32>,
    /// See [`Arrays::upper`].
    pub upper: Column<Node>,
    /// See [`Arrays::beneath`].
    pub beneath: Column<u32>,
    /// See [`Arrays::pages`].
    pub pages: Column<u32>,
    /// See [`Arrays::lines`].
    pub lines: Column<Line>,
    /// See [`Arrays::triangles`].
    pub triangles: Column<Triangle>,
    /// See [`Arrays::pools`].
    pub pools: Option<Pools>,
    /// The box around all triangles, in the tree's coordinates.
    pub bounds: Aabb,
    /// What the mesh's coordinates were multiplied by.
    pub scale: Scale,
    /// The settings that it was built with.
    pub params: BuildParams,
    /// The most bytes that the build's arrays held.
    pub build_peak: usize,
    /// What [`KdTree::stats`] is to give.
    pub stats: TreeStats,
}

impl KdTree {
    /// The arrays that it consists of.
    pub fn arrays(&self) -> Arrays<'_> {
        Arrays {
            nodes: &self.nodes,
            references: &self.references,
            upper: &self.pages.upper,
            beneath: &self.pages.beneath,
            pages: &self.pages.primitives,
            lines: self.lines.all(),
            triangles: &self.triangles,
            pools: self.pools(),
        }
    }

    /// A tree of the parts of one that was built before.
    ///
    /// Looks at what costs no walk: lengths that belong together, the root. That the rest is as it was built
    /// is for the caller to know, as by checksums; a tree that is not may give wrong answers, panic or walk in
    /// circles, but reaches nothing outside of its arrays. [`validate`](Self::validate) would find out.
    ///
    /// # Errors
    /// A sentence about what cannot be part of any tree.
    pub fn of_parts(parts: Parts) -> Result<Self, String> {
        parts.check()?;
        let pages = Pages { upper: parts.upper, beneath: parts.beneath, primitives: parts.pages };
        Ok(Self {
            nodes: parts.nodes,
            references: parts.references,
            lines: Lines::of_packed(parts.lines),
            pages,
            triangles: parts.triangles,
            bounds: parts.bounds,
            scale: parts.scale,
            params: parts.params,
            build_peak: parts.build_peak,
            stats: OnceLock::from(parts.stats),
            pools: parts.pools.map_or_else(OnceLock::new, |pools| OnceLock::from(Some(pools))),
        })
    }
}

/// What is needed of a tree to trace packets and beams through it.
#[derive(Debug)]
pub(crate) struct Walked {
    /// See [`Arrays::nodes`].
    pub nodes: Column<Node>,
    /// See [`Arrays::references`].
    pub references: Column<u32>,
    /// See [`Arrays::upper`].
    pub upper: Column<Node>,
    /// See [`Arrays::beneath`].
    pub beneath: Column<u32>,
    /// See [`Arrays::pages`].
    pub pages: Column<u32>,
    /// See [`Arrays::triangles`].
    pub triangles: Column<Triangle>,
    /// See [`Parts::bounds`].
    pub bounds: Aabb,
    /// See [`Parts::scale`].
    pub scale: Scale,
}

impl From<Walked> for KdTree {
    /// A tree without lines, which streams of rays are traced through, and without what was known when it was built. Of its
    /// arrays, nothing is looked at.
    fn from(walked: Walked) -> Self {
        let Walked { nodes, references, upper, beneath, pages, triangles, bounds, scale } = walked;
        Self {
            nodes,
            references,
            lines: Lines::of_packed(Column::default()),
            pages: Pages { upper, beneath, primitives: pages },
            triangles,
            bounds,
            scale,
            params: BuildParams::default(),
            build_peak: 0,
            stats: OnceLock::new(),
            pools: OnceLock::new(),
        }
    }
}

impl Parts {
    fn check(&self) -> Result<(), String> {
        let count = self.triangles.len();
        if count == 0 || count > MAX_INDEX || self.stats.triangles != count {
            return Err(format!("it has {count} triangles and speaks of {}", self.stats.triangles));
        }
        if self.references.len() < AFTER || self.references.len() > MAX_RECORD + AFTER {
            return Err(format!("{} words are no leaves' records", self.references.len()));
        }
        if self.lines.is_empty() || self.lines.len() > MAX_LINE {
            return Err(format!("{} is no number of lines", self.lines.len()));
        }
        if self.upper.len() != self.beneath.len() {
            let (upper, beneath) = (self.upper.len(), self.beneath.len());
            return Err(format!("there are {upper} upper nodes and {beneath} places for them"));
        }
        is_root(&self.nodes, self.references.len()).map_err(|what| format!("the tree {what}"))?;
        is_root(&self.upper, self.pages.len()).map_err(|what| format!("the upper tree {what}"))?;
        if !self.bounds.min.is_finite() || !self.bounds.max.is_finite() || self.bounds.is_empty() {
            return Err(format!("its bounds are {} to {}", self.bounds.min, self.bounds.max));
        }
        self.params.check().map_err(|error| error.to_string())
    }
}

/// Whether nodes begin with a root whose children, or so many references, are there.
fn is_root(nodes: &[Node], references: usize) -> Result<(), String> {
    let Some(root) = nodes.first().filter(|_| nodes.len() <= MAX_INDEX) else {
        return Err(format!("has {} nodes", nodes.len()));
    };
    let range = root.references();
    match (root.is_leaf(), root.below() as usize) {
        (true, _) if range.end > references => Err(format!("has a root with references {range:?}")),
        (false, below) if below < 2 || below + 1 >= nodes.len() => {
            Err(format!("has a root with children at {below}"))
        }
        _ => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::Tree;
    use crate::mesh::generate::shapes;

    fn taken_apart(tree: &KdTree) -> Parts {
        let arrays = tree.arrays();
        Parts {
            nodes: arrays.nodes.to_vec().into(),
            references: arrays.references.to_vec().into(),
            upper: arrays.upper.to_vec().into(),
            beneath: arrays.beneath.to_vec().into(),
            pages: arrays.pages.to_vec().into(),
            lines: arrays.lines.to_vec().into(),
            triangles: arrays.triangles.to_vec().into(),
            pools: arrays.pools.map(copied),
            bounds: *tree.bounds(),
            scale: tree.scale(),
            params: tree.params().clone(),
            build_peak: tree.build_peak(),
            stats: tree.stats(),
        }
    }

    fn copied(pools: &Pools) -> Pools {
        let (nodes, words) = (pools.nodes().to_vec(), pools.words().to_vec());
        Pools::of_parts(nodes.into(), words.into(), pools.most()).expect("they are whole")
    }

    fn tree(triangles: usize) -> KdTree {
        KdTree::build(&shapes::soup(triangles, 3), &BuildParams::default(), None).expect("builds")
    }

    #[test]
    fn a_tree_put_together_is_the_same() {
        for triangles in [1, 2, 700] {
            let tree = tree(triangles);
            let again = KdTree::of_parts(taken_apart(&tree)).expect("is whole");
            again.validate().expect("is whole");
            assert_eq!((again.stats(), again.build_peak()), (tree.stats(), tree.build_peak()));
            assert_eq!(again.arrays().lines, tree.arrays().lines);
            assert!(again.pools().is_none());
        }
    }

    #[test]
    fn so_are_pools() {
        for (triangles, most) in [(1, 16), (700, 8), (700, 16)] {
            let tree = tree(triangles);
            assert!(tree.make_pools(most));
            let again = KdTree::of_parts(taken_apart(&tree)).expect("is whole");
            let [pools, theirs] = [&again, &tree].map(|tree| tree.pools().expect("they were made"));
            assert_eq!((pools.nodes(), pools.words()), (theirs.nodes(), theirs.words()));
            assert_eq!(pools.most(), most);
            // They are not made anew.
            assert!(again.make_pools(24 - most) && again.pools().is_some_and(|pools| pools.most() == most));
            again.validate().expect("is whole");
        }
    }

    #[test]
    fn told_figures_are_believed() {
        let mut parts = taken_apart(&tree(100));
        parts.stats.sah_cost = 12.5;
        assert_eq!(KdTree::of_parts(parts).expect("is whole").stats().sah_cost, 12.5);
    }

    #[test]
    fn parts_that_do_not_belong_together_are_refused() {
        let tree = tree(700);
        let refused = |change: fn(&mut Parts), expected: &str| {
            let mut parts = taken_apart(&tree);
            change(&mut parts);
            let message = KdTree::of_parts(parts).expect_err(expected);
            assert!(message.contains(expected), "\"{message}\" is not about {expected}");
        };
        refused(|p| p.triangles = Column::default(), "0 triangles");
        refused(|p| p.stats.triangles += 1, "speaks of 701");
        refused(|p| p.references = vec![0; 6].into(), "6 words");
        refused(|p| p.lines = Column::default(), "0 is no number of lines");
        refused(|p| p.beneath = vec![0; 2].into(), "2 places");
        refused(|p| p.nodes = Column::default(), "the tree has 0 nodes");
        refused(|p| p.nodes = vec![Node::inner(0, 0.0, 2)].into(), "the tree has a root with children at 2");
        refused(|p| p.nodes = vec![Node::leaf(9, MAX_INDEX)].into(), "the tree has a root with references");
        refused(
            |p| (p.upper, p.beneath) = (vec![Node::inner(0, 0.0, 0); 4].into(), vec![0; 4].into()),
            "the upper tree has a root with children at 0",
        );
        refused(|p| p.bounds = Aabb::EMPTY, "its bounds are");
        refused(|p| p.params.bins = 0, "build.bins");
    }
}
