//! Figures about a tree.

use super::{BuildParams, KdTree, Node, Tree};
use crate::geometry::Aabb;
use serde::{Deserialize, Serialize};

/// What a tree looks like and what a ray is expected to pay in it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TreeStats {
    /// Triangles that the tree sorts.
    pub triangles: usize,
    /// Inner nodes and leaves.
    pub nodes: usize,
    /// Leaves, empty ones included.
    pub leaves: usize,
    /// Leaves without a triangle.
    pub empty_leaves: usize,
    /// Triangle references in all leaves.
    pub references: usize,
    /// References per triangle: how often perfect splits cut a triangle in two.
    pub references_per_triangle: f64,
    /// Triangles per leaf, empty leaves not counted.
    pub triangles_per_leaf: f64,
    /// Triangles in the fullest leaf.
    pub largest_leaf: usize,
    /// `leaf_histogram[i]` leaves hold `i` triangles; the last entry counts all larger ones.
    pub leaf_histogram: Vec<usize>,
    /// `depth_histogram[i]` leaves lie below `i` inner nodes.
    pub depth_histogram: Vec<usize>,
    /// Inner nodes on the longest way from the root to a leaf.
    pub depth: usize,
    /// Expected cost of a ray by the SAH, in the units of the build parameters.
    pub sah_cost: f64,
    /// Expected inner nodes for a ray that meets the bounds, early termination not counted.
    pub expected_steps: f64,
    /// Expected leaves, likewise.
    pub expected_leaves: f64,
    /// Expected triangle tests, likewise.
    pub expected_tests: f64,
    /// Memory of the nodes.
    pub node_bytes: usize,
    /// Memory of the leaves' references.
    pub reference_bytes: usize,
    /// Memory of the triangles' corners and planes.
    pub triangle_bytes: usize,
    /// Memory of the pages.
    pub page_bytes: usize,
    /// Memory of the lines.
    pub line_bytes: usize,
    /// Pages that are not empty.
    pub pages: usize,
    /// Triangles in a page, empty ones not counted.
    pub triangles_per_page: f64,
    /// All memory divided by the number of triangles.
    pub bytes_per_triangle: f64,
}

impl TreeStats {
    /// All memory of the tree.
    pub fn bytes(&self) -> usize {
        self.node_bytes + self.reference_bytes + self.line_bytes + self.page_bytes + self.triangle_bytes
    }
}

/// Leaf sizes that get a histogram entry of their own.
const HISTOGRAM: usize = 32;

impl KdTree {
    /// Figures about the tree. The first call walks all of it, unless a file has told them.
    pub fn stats(&self) -> TreeStats {
        self.stats.get_or_init(|| self.count()).clone()
    }

    /// Walks the whole tree and counts.
    fn count(&self) -> TreeStats {
        let mut tally = Tally::new(&self.bounds);
        tally.subtree(&self.nodes, self.root(), self.bounds, 0);
        tally.pages(&self.pages.upper);
        let bytes = Bytes {
            nodes: size_of_val(&self.nodes[..]),
            references: size_of_val(&self.references[..]),
            triangles: size_of_val(&self.triangles[..]),
            pages: self.pages.bytes(),
            lines: self.lines.bytes(),
        };
        tally.stats(self.triangles.len(), &self.params, &bytes)
    }

    /// How often perfect splits cut triangles: entry `i` counts those in `i + 1` leaves, the last one also
    /// those in more. Triangles without area may be in no leaf, and are not counted then.
    ///
    /// Walks the whole tree, and takes four bytes a triangle meanwhile.
    pub fn duplication(&self) -> Vec<usize> {
        let mut leaves_of = vec![0u32; self.triangles.len()];
        for leaf in self.nodes.iter().filter(|node| node.is_leaf()) {
            for &primitive in self.primitives(*leaf) {
                leaves_of[primitive as usize] += 1;
            }
        }
        let mut histogram = vec![0; HISTOGRAM];
        for count in leaves_of.into_iter().filter(|&count| count > 0) {
            histogram[(count as usize).min(HISTOGRAM) - 1] += 1;
        }
        histogram
    }
}

/// What a tree takes.
pub(super) struct Bytes {
    pub nodes: usize,
    pub references: usize,
    pub triangles: usize,
    pub pages: usize,
    pub lines: usize,
}

/// [`TreeStats`] in the making, subtree by subtree.
pub(super) struct Tally {
    root_area: f64,
    stats: TreeStats,
    page_primitives: usize,
}

impl Tally {
    /// Nothing counted, of a tree with these bounds.
    pub fn new(bounds: &Aabb) -> Self {
        let stats = TreeStats { leaf_histogram: vec![0; HISTOGRAM + 1], ..TreeStats::default() };
        Self { root_area: bounds.area(), stats, page_primitives: 0 }
    }

    /// Counts a subtree whose root lies in `cell`, below `depth` inner nodes.
    pub fn subtree(&mut self, nodes: &[Node], root: Node, cell: Aabb, depth: usize) {
        let mut stack = vec![(root, cell, depth)];
        while let Some((node, cell, depth)) = stack.pop() {
            if node.is_leaf() {
                self.leaf(node.references().len(), &cell, depth);
            } else {
                self.inner(&cell, depth);
                let below = node.below() as usize;
                let [low, high] = cell.halves(node.axis(), node.split());
                stack.push((nodes[below + 1], high, depth + 1));
                stack.push((nodes[below], low, depth + 1));
            }
        }
    }

    /// Counts an inner node.
    pub fn inner(&mut self, cell: &Aabb, depth: usize) {
        self.stats.nodes += 1;
        self.stats.depth = self.stats.depth.max(depth);
        self.stats.expected_steps += self.probability(cell);
    }

    fn leaf(&mut self, count: usize, cell: &Aabb, depth: usize) {
        let probability = self.probability(cell);
        let stats = &mut self.stats;
        if stats.depth_histogram.len() <= depth {
            stats.depth_histogram.resize(depth + 1, 0);
        }
        stats.nodes += 1;
        stats.depth = stats.depth.max(depth);
        stats.depth_histogram[depth] += 1;
        stats.leaves += 1;
        stats.empty_leaves += usize::from(count == 0);
        stats.references += count;
        stats.largest_leaf = stats.largest_leaf.max(count);
        stats.leaf_histogram[count.min(HISTOGRAM)] += 1;
        stats.expected_leaves += probability;
        stats.expected_tests += probability * count as f64;
    }

    /// Counts the pages among the nodes of an upper tree.
    pub fn pages(&mut self, upper: &[Node]) {
        for page in upper.iter().filter(|node| node.is_leaf() && !node.references().is_empty()) {
            self.stats.pages += 1;
            self.page_primitives += page.references().len();
        }
    }

    /// How likely a ray that meets the bounds meets a cell.
    fn probability(&self, cell: &Aabb) -> f64 {
        if self.root_area > 0.0 { cell.area() / self.root_area } else { 1.0 }
    }

    /// What has been counted.
    pub fn stats(self, triangles: usize, params: &BuildParams, bytes: &Bytes) -> TreeStats {
        let Self { mut stats, page_primitives, .. } = self;
        stats.triangles = triangles;
        stats.node_bytes = bytes.nodes;
        stats.reference_bytes = bytes.references;
        stats.triangle_bytes = bytes.triangles;
        stats.page_bytes = bytes.pages;
        stats.line_bytes = bytes.lines;
        stats.references_per_triangle = stats.references as f64 / triangles as f64;
        stats.triangles_per_leaf =
            stats.references as f64 / (stats.leaves - stats.empty_leaves).max(1) as f64;
        stats.triangles_per_page = page_primitives as f64 / stats.pages.max(1) as f64;
        stats.sah_cost = f64::from(params.traversal_cost) * stats.expected_steps
            + f64::from(params.intersection_cost) * stats.expected_tests;
        stats.bytes_per_triangle = stats.bytes() as f64 / triangles as f64;
        stats
    }
}
