//! The builder: top down, by the SAH, with perfect splits.
//!
//! Each node holds its triangles as references with *clipped* bounds: the box around the part of
//! the triangle that lies in the cell (Wald & Havran 2006). Large nodes are binned and then swept
//! exactly around the best bin (after Shevtsov, Soupikov & Kapustin 2007), small ones are swept
//! exactly.
//!
//! Large nodes ([`large`]) lie in chunks, which all threads count and divide together, and their two
//! children are built side by side; small ones ([`subtree`]) are a task each. How the work is cut
//! depends on the triangles alone, so the tree is the same for any number of threads.

mod binned;
mod clear;
mod exact;
mod few;
pub(super) mod large;
pub(super) mod partition;
mod reference;
mod subtree;

use super::memory::{IN_FLIGHT, Ledger, bytes_of};
use super::node::{MAX_INDEX, Node};
use super::params::BuildParams;
use super::sah::{CellCost, Split};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::simd::Chosen;
pub(super) use reference::Reference;
use std::sync::atomic::{AtomicU64, Ordering};

/// How far a build has come: triangles that have reached a leaf, out of all. For progress bars;
/// safe to read from another thread at any time.
#[derive(Debug, Default)]
pub struct BuildProgress {
    millionths: AtomicU64,
}

impl BuildProgress {
    /// A part of 1.
    pub fn fraction(&self) -> f64 {
        self.millionths.load(Ordering::Relaxed) as f64 * 1e-6
    }

    /// How much is done, to [go back to](Self::go_back).
    pub(super) fn mark(&self) -> u64 {
        self.millionths.load(Ordering::Relaxed)
    }

    /// What was done since then was in vain.
    pub(super) fn go_back(&self, mark: u64) {
        self.millionths.store(mark, Ordering::Relaxed);
    }

    /// A part of 1 more is done. Parts are tiny: what is rounded away shows as a bar that ends a little short
    /// of full.
    pub(super) fn add(&self, share: f64) {
        self.millionths.fetch_add((share * 1e6).round() as u64, Ordering::Relaxed);
    }
}

/// Nodes, with the root first, and the leaves' references, in the order of a depth-first walk.
pub(super) struct Built {
    pub nodes: Vec<Node>,
    pub references: Vec<u32>,
}

/// Nodes and references that even the smallest model may have.
pub(super) const SPARE: usize = 1024;

/// Builds the tree of all triangles, whose corners must be finite.
///
/// # Errors
/// The tree would need more nodes or references than a node can address.
pub(super) fn build(
    triangles: &[Triangle],
    bounds: Aabb,
    params: &BuildParams,
    ledger: &Ledger,
    progress: Option<&BuildProgress>,
) -> Result<Built> {
    let budget = budget_of(triangles.len(), params);
    if budget > MAX_INDEX / 4 && triangles.len() > MAX_INDEX / 16 {
        return Err(Error::Mesh(format!(
            "{} triangles are more than one tree can hold; split the model",
            triangles.len()
        )));
    }
    let depth_limit = params.depth_limit(triangles.len());
    let context = Context { params, triangles, depth_limit, isa: Chosen::best(), ledger, progress };
    let place = Place::of_root(bounds, triangles.len(), budget.min(MAX_INDEX / 4));
    let chunks = large::chunks_of(triangles);
    ledger.add(chunks.iter().map(bytes_of).sum());
    let part = large::build(&context, chunks, place);
    if part.nodes() + 2 > MAX_INDEX || part.references() > MAX_INDEX {
        return Err(Error::Mesh("its tree is too large to address; raise build.min_leaf".into()));
    }
    Ok(part.gathered(ledger))
}

/// How many nodes and references a tree of so many triangles may have together.
pub(super) fn budget_of(triangles: usize, params: &BuildParams) -> usize {
    (triangles as f64 * f64::from(params.max_duplication)) as usize + SPARE
}

/// What every node of a build needs to know.
pub(super) struct Context<'a> {
    pub params: &'a BuildParams,
    /// By the primitive ids of the references.
    pub triangles: &'a [Triangle],
    pub depth_limit: usize,
    pub isa: Chosen,
    pub ledger: &'a Ledger,
    pub progress: Option<&'a BuildProgress>,
}

/// What a node inherits.
#[derive(Clone, Copy)]
pub(super) struct Place {
    pub cell: Aabb,
    /// How far planes keep away from what they part.
    clearance: f32,
    pub depth: usize,
    /// Splits in a row that cost more than a leaf.
    bad_splits: u32,
    /// How many references and nodes it may have together.
    pub budget: usize,
    /// How many references its descendants may hold at a time.
    in_flight: usize,
    /// Its share of the whole work, for the progress bar.
    pub share: f64,
}

/// A tree of two children each has nearly two nodes for each leaf.
const NODES_PER_LEAF: usize = 2;

/// What to do about a split.
pub(super) enum Verdict {
    /// It is better than a leaf.
    Good,
    /// It is not, but the next ones may be; it is the so-manieth in a row.
    Tried(u32),
}

impl Context<'_> {
    /// The cost model of a node that may be split at all.
    pub fn may_split(&self, count: usize, place: &Place) -> Option<CellCost<'_>> {
        if count <= self.params.min_leaf || place.depth >= self.depth_limit || self.ledger.is_over() {
            return None;
        }
        CellCost::new(self.params, place.cell, place.clearance)
    }

    /// Whether a split is better than a leaf, or may be tried all the same.
    fn judge(
        &self,
        split: &Split,
        references: &[Reference],
        place: &Place,
        costs: &CellCost,
    ) -> Option<Verdict> {
        let leaf_cost = costs.leaf(references.len());
        if split.cost < leaf_cost {
            return Some(Verdict::Good);
        }
        let in_a_row = place.bad_splits + 1;
        if in_a_row > self.params.bad_splits {
            return None;
        }
        // A child that is split in turn costs a step at least: what can the two cost together?
        let step = f64::from(self.params.traversal_cost);
        let (mut below, mut above) = (0, 0);
        for reference in references {
            below += usize::from(reference.min(split.axis) < split.position);
            above += usize::from(reference.max(split.axis) > split.position);
        }
        let least = [below, above].map(|count| costs.leaf(count).min(step));
        let hopeful = costs.of_children(split.axis, split.position, least) < leaf_cost;
        hopeful.then_some(Verdict::Tried(in_a_row))
    }

    /// What a leaf costs.
    fn leaf_cost(&self, count: usize) -> f64 {
        f64::from(self.params.intersection_cost) * count as f64
    }

    /// A subtree is done that had this share of the work.
    pub fn finished(&self, share: f64) {
        if let Some(progress) = self.progress {
            progress.add(share);
        }
    }
}

impl Place {
    /// The root's, of a tree of so many triangles.
    pub fn of_root(bounds: Aabb, triangles: usize, budget: usize) -> Self {
        let in_flight = (triangles as f64 * IN_FLIGHT) as usize;
        let clearance = clear::clearance(&bounds);
        Self { cell: bounds, clearance, depth: 0, bad_splits: 0, budget, in_flight, share: 1.0 }
    }

    /// The places of the children, with so many references below and above, of a node of `count`; `None`
    /// if the split must not be.
    pub fn children(
        &self,
        split: &Split,
        verdict: &Verdict,
        parts: [usize; 2],
        count: usize,
    ) -> Option<[Self; 2]> {
        let (axis, total) = (split.axis, parts[0] + parts[1]);
        // A plane that divides nothing would be tried for ever.
        let in_face = split.position <= self.cell.min[axis] || split.position >= self.cell.max[axis];
        if total + 2 * NODES_PER_LEAF > self.budget || parts == [count; 2] && in_face {
            return None;
        }
        let bad_splits = match *verdict {
            Verdict::Good => 0,
            Verdict::Tried(in_a_row) => in_a_row,
        };
        let [below, above] = self.cell.halves(axis, split.position);
        let child = |references: usize, cell: Aabb| {
            let part = references as f64 / total.max(1) as f64;
            // What is left over when each has what a leaf needs.
            let spare = (self.budget - total - 2 * NODES_PER_LEAF) as f64;
            Self {
                cell,
                clearance: self.clearance,
                depth: self.depth + 1,
                bad_splits,
                budget: references + NODES_PER_LEAF + (spare * part) as usize,
                in_flight: (self.in_flight as f64 * part) as usize,
                share: self.share * part,
            }
        };
        Some([child(parts[0], below), child(parts[1], above)])
    }
}
