//! What the builder is free to choose.

use super::preset::Preset;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// The deepest tree that the kernels have stack for.
pub const MAX_DEPTH: usize = 64;

/// The most bins of an axis: the builder's tables have this length.
pub(super) const MOST_BINS: usize = 1024;

/// Build settings. The defaults suit all kernels on most models.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BuildParams {
    /// What the other values are by default: see [`Preset`].
    pub preset: Preset,
    /// SAH cost of a step through an inner node. Only its ratio to `intersection_cost` counts.
    /// Raising the ratio gives larger leaves and a smaller tree: 3 suits packets, 5 beams and memory.
    pub traversal_cost: f32,
    /// SAH cost of testing one triangle: 1, which makes `traversal_cost` the ratio.
    pub intersection_cost: f32,
    /// The part of a split's cost that is forgiven when it cuts off empty space, 0 to 1. Raising
    /// it skips more air and costs nodes; 0.2 is a good start.
    pub empty_bonus: f32,
    /// A leaf of at most this many triangles is never split. Raising it makes the build quicker
    /// and rays slower; 1 leaves it all to the SAH. Start from 2, and from 8 for a quick build.
    pub min_leaf: usize,
    /// How many splits in a row may cost more than a leaf would, in the hope of a good one below. Splits
    /// made in vain are taken back, so that raising it costs time to build and may help rays; start from 1.
    pub bad_splits: u32,
    /// Depth limit, at most 64; 0 derives it from the number of triangles, which is where to start. Lowering it
    /// cuts subtrees off, which then are large leaves.
    pub max_depth: usize,
    /// Bins per axis for nodes above `exact_below`, 8 to 1024, but no more than a small node has triangles. Raising it
    /// finds better planes in large nodes and makes the build slower; start from 32.
    pub bins: usize,
    /// Nodes with fewer triangles than this are swept exactly, endpoint by endpoint. Raising it makes the build
    /// slower and the tree's lower levels a little better; start from 32.
    pub exact_below: usize,
    /// Greatest number of references and nodes per triangle, on average: it bounds the tree's size, and
    /// with it the build's memory, on meshes that the SAH would duplicate without end (long slivers in a
    /// bundle). Real models have some 5; with a `traversal_cost` near 1 they would have 10. Start
    /// from 8; `--memory` lowers it to what fits.
    pub max_duplication: f32,
    /// Whether planes are looked for at the ends of triangles, and triangles that a plane cuts are clipped to all of
    /// each side's cell ("perfect splits"). `false` takes boundaries of bins and cuts triangles by one plane after the
    /// other: the build takes half of the time, some leaves list triangles that do not reach into them, and rays are
    /// a tenth or two slower.
    pub perfect: bool,
    /// A subtree of at most this many triangles is a page, in which a tile of rays looks at all
    /// triangles at once. Raising it saves tiles steps and costs them tests; 64 is a good start.
    pub page: usize,
}

impl Default for BuildParams {
    fn default() -> Self {
        Self {
            preset: Preset::Standard,
            traversal_cost: 5.0,
            intersection_cost: 1.0,
            empty_bonus: 0.2,
            min_leaf: 2,
            bad_splits: 1,
            max_depth: 0,
            bins: 32,
            exact_below: 32,
            max_duplication: 8.0,
            perfect: true,
            page: 64,
        }
    }
}

impl BuildParams {
    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first key that does not, and what is accepted.
    pub fn check(&self) -> Result<()> {
        let fail = |key: &str, what: &str| Err(Error::option(format!("build.{key}"), what));
        let positive = |x: f32| x.is_finite() && x > 0.0;
        if !positive(self.traversal_cost) {
            fail("traversal_cost", "must be a positive number")
        } else if !positive(self.intersection_cost) {
            fail("intersection_cost", "must be a positive number")
        } else if !(0.0..1.0).contains(&self.empty_bonus) {
            fail("empty_bonus", "must be at least 0 and less than 1")
        } else if !(1..=1 << 20).contains(&self.min_leaf) {
            fail("min_leaf", "must be between 1 and 1048576")
        } else if self.max_depth > MAX_DEPTH {
            fail("max_depth", "must be at most 64 (0 derives it from the model)")
        } else if !(8..=MOST_BINS).contains(&self.bins) {
            fail("bins", &format!("must be between 8 and {MOST_BINS}"))
        } else if !(1.0..=1000.0).contains(&self.max_duplication) {
            fail("max_duplication", "must be between 1 and 1000")
        } else if !(1..=1 << 20).contains(&self.page) {
            fail("page", "must be between 1 and 1048576")
        } else {
            Ok(())
        }
    }

    /// The depth limit for a number of triangles.
    pub(super) fn depth_limit(&self, triangles: usize) -> usize {
        let derived = || 12 + (1.6 * (triangles.max(1) as f64).log2()).round() as usize;
        if self.max_depth == 0 { derived().min(MAX_DEPTH) } else { self.max_depth }
    }
}
