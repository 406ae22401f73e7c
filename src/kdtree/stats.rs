//! Figures about a tree.

use super::{KdTree, Node, Tree};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
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
        let mut stats = TreeStats {
            triangles: self.triangles.len(),
            leaf_histogram: vec![0; HISTOGRAM + 1],
            node_bytes: self.nodes.len() * size_of::<Node>(),
            reference_bytes: self.references.len() * size_of::<u32>(),
            triangle_bytes: self.triangles.len() * size_of::<Triangle>(),
            page_bytes: self.pages.bytes(),
            line_bytes: self.lines.bytes(),
            pages: self.pages.upper.iter().filter(|n| n.is_leaf() && !n.references().is_empty()).count(),
            ..TreeStats::default()
        };
        let root_area = self.bounds.area();
        let probability = |cell: &Aabb| if root_area > 0.0 { cell.area() / root_area } else { 1.0 };

        let mut stack = vec![(self.root(), self.bounds, 0)];
        while let Some((node, cell, depth)) = stack.pop() {
            stats.nodes += 1;
            stats.depth = stats.depth.max(depth);
            if node.is_leaf() {
                let count = self.primitives(node).len();
                if stats.depth_histogram.len() <= depth {
                    stats.depth_histogram.resize(depth + 1, 0);
                }
                stats.depth_histogram[depth] += 1;
                stats.leaves += 1;
                stats.empty_leaves += usize::from(count == 0);
                stats.references += count;
                stats.largest_leaf = stats.largest_leaf.max(count);
                stats.leaf_histogram[count.min(HISTOGRAM)] += 1;
                stats.expected_leaves += probability(&cell);
                stats.expected_tests += probability(&cell) * count as f64;
            } else {
                stats.expected_steps += probability(&cell);
                let [below, above] = self.children(node);
                let [low, high] = cell.halves(node.axis(), node.split());
                stack.push((above, high, depth + 1));
                stack.push((below, low, depth + 1));
            }
        }

        let triangles = stats.triangles.max(1) as f64;
        stats.references_per_triangle = stats.references as f64 / triangles;
        stats.triangles_per_leaf =
            stats.references as f64 / (stats.leaves - stats.empty_leaves).max(1) as f64;
        stats.triangles_per_page = self.pages.primitives.len() as f64 / stats.pages.max(1) as f64;
        stats.sah_cost = f64::from(self.params.traversal_cost) * stats.expected_steps
            + f64::from(self.params.intersection_cost) * stats.expected_tests;
        stats.bytes_per_triangle = stats.bytes() as f64 / triangles;
        stats
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
