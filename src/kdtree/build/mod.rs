//! The builder: top down, by the SAH, with perfect splits.
//!
//! Each node holds its triangles as references with *clipped* bounds: the box around the part of
//! the triangle that lies in the cell (Wald & Havran 2006). Large nodes are binned and then swept
//! exactly around the best bin (after Shevtsov, Soupikov & Kapustin 2007), small ones are swept
//! exactly. The two halves of a large node are built side by side; the tree does not depend on
//! how many threads take part.

mod binned;
mod exact;
mod partition;

use super::node::{MAX_INDEX, Node};
use super::params::BuildParams;
use super::sah::{CellCost, Split};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::geometry::triangle::Corners;
use partition::partition;
use std::sync::atomic::{AtomicU64, Ordering};

/// A triangle's part in a cell.
#[derive(Clone, Copy, Debug)]
pub(super) struct Reference {
    pub min: [f32; 3],
    pub max: [f32; 3],
    pub primitive: u32,
}

impl Reference {
    fn bounds(&self) -> Aabb {
        Aabb { min: self.min.into(), max: self.max.into() }
    }

    fn with_bounds(primitive: u32, bounds: Aabb) -> Self {
        Self { min: bounds.min.into(), max: bounds.max.into(), primitive }
    }
}

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
}

/// What every node of a build needs to know.
struct Context<'a> {
    params: &'a BuildParams,
    triangles: &'a [Corners],
    depth_limit: usize,
    progress: Option<&'a BuildProgress>,
}

/// A subtree whose indices count from its own arrays' beginnings.
struct Subtree {
    root: Node,
    nodes: Vec<Node>,
    references: Vec<u32>,
}

/// What a node inherits.
#[derive(Clone, Copy)]
struct Place {
    cell: Aabb,
    depth: usize,
    /// Splits in a row that cost more than a leaf.
    bad_splits: u32,
    /// How many references its leaves may hold together.
    budget: usize,
    /// Its share of the whole work, for the progress bar.
    share: f64,
}

/// A node with at least this many references builds its children side by side.
const PARALLEL: usize = 8192;

/// Nodes, with the root first, and the leaves' references, in the order of a depth-first walk.
pub(super) struct Built {
    pub nodes: Vec<Node>,
    pub references: Vec<u32>,
}

/// Builds the tree of all triangles, whose corners must be finite.
///
/// # Errors
/// The tree would need more nodes or references than a node can address.
pub(super) fn build(
    triangles: &[Corners],
    bounds: Aabb,
    params: &BuildParams,
    progress: Option<&BuildProgress>,
) -> Result<Built> {
    let references: Vec<Reference> = (0..)
        .zip(triangles)
        .map(|(primitive, corners)| {
            Reference::with_bounds(primitive, Aabb::of_points(corners.map(Into::into)))
        })
        .collect();
    let context = Context { params, triangles, depth_limit: params.depth_limit(triangles.len()), progress };
    let budget = (triangles.len() as f64 * f64::from(params.max_duplication)) as usize + 1024;
    if budget > MAX_INDEX / 4 && triangles.len() > MAX_INDEX / 16 {
        return Err(Error::Mesh(format!(
            "{} triangles are more than one tree can hold; split the model",
            triangles.len()
        )));
    }
    let place =
        Place { cell: bounds, depth: 0, bad_splits: 0, budget: budget.min(MAX_INDEX / 4), share: 1.0 };
    let Subtree { root, mut nodes, references } = build_subtree(&context, references, place);

    // The root goes first; the second place of its pair stays empty, so that pairs are aligned.
    let mut all = Vec::with_capacity(nodes.len() + 2);
    all.push(root.moved(2, 0));
    all.push(Node::leaf(0, 0));
    all.extend(nodes.drain(..).map(|node| node.moved(2, 0)));
    if all.len() > MAX_INDEX || references.len() > MAX_INDEX {
        return Err(Error::Mesh("its tree is too large to address; raise build.min_leaf".into()));
    }
    Ok(Built { nodes: all, references })
}

/// Builds a subtree, its children side by side while they are large.
fn build_subtree(context: &Context, references: Vec<Reference>, place: Place) -> Subtree {
    if references.len() < PARALLEL {
        let mut small = Subtree { root: Node::leaf(0, 0), nodes: Vec::new(), references: Vec::new() };
        let mut scratch = exact::Scratch::default();
        small.root =
            build_node(context, &references, place, &mut small.nodes, &mut small.references, &mut scratch);
        return small;
    }
    let mut scratch = exact::Scratch::default();
    let Some((split, [below, above])) = divide(context, &references, &place, &mut scratch) else {
        context.finished(place.share);
        let ids = references.iter().map(|r| r.primitive).collect();
        return Subtree { root: Node::leaf(0, references.len()), nodes: Vec::new(), references: ids };
    };
    drop(references);
    let (below, above) = rayon::join(
        || build_subtree(context, below.references, below.place),
        || build_subtree(context, above.references, above.place),
    );
    join(split, below, above)
}

/// Two subtrees under one inner node.
fn join(split: Split, below: Subtree, above: Subtree) -> Subtree {
    let (nodes_below, references_below) = (2, 0);
    let (nodes_above, references_above) = (2 + below.nodes.len(), below.references.len());
    let mut nodes = Vec::with_capacity(nodes_above + above.nodes.len());
    nodes.push(below.root.moved(nodes_below, references_below));
    nodes.push(above.root.moved(nodes_above, references_above));
    nodes.extend(below.nodes.iter().map(|node| node.moved(nodes_below, references_below)));
    nodes.extend(above.nodes.iter().map(|node| node.moved(nodes_above, references_above)));
    let mut references = below.references;
    references.extend_from_slice(&above.references);
    Subtree { root: Node::inner(split.axis, split.position, 0), nodes, references }
}

/// Builds a subtree into arrays, on this thread, and gives its root.
fn build_node(
    context: &Context,
    references: &[Reference],
    place: Place,
    nodes: &mut Vec<Node>,
    leaves: &mut Vec<u32>,
    scratch: &mut exact::Scratch,
) -> Node {
    let Some((split, [below, above])) = divide(context, references, &place, scratch) else {
        context.finished(place.share);
        let first = leaves.len();
        leaves.extend(references.iter().map(|r| r.primitive));
        return Node::leaf(first, references.len());
    };
    let pair = nodes.len();
    nodes.extend([Node::leaf(0, 0); 2]);
    nodes[pair] = build_node(context, &below.references, below.place, nodes, leaves, scratch);
    drop(below);
    nodes[pair + 1] = build_node(context, &above.references, above.place, nodes, leaves, scratch);
    Node::inner(split.axis, split.position, pair)
}

/// A child to be.
struct Child {
    references: Vec<Reference>,
    place: Place,
}

/// Finds the best split and divides the references by it; `None` if a leaf is the better choice.
fn divide(
    context: &Context,
    references: &[Reference],
    place: &Place,
    scratch: &mut exact::Scratch,
) -> Option<(Split, [Child; 2])> {
    let params = context.params;
    let count = references.len();
    if count <= params.min_leaf || place.depth >= context.depth_limit {
        return None;
    }
    let costs = CellCost::new(params, place.cell)?;
    let split = if count < params.exact_below {
        exact::best_split(references, &place.cell, &costs, scratch)
    } else {
        binned::best_split(references, &place.cell, &costs, params.bins, scratch)
    }?;

    // Is it better than a leaf, or may it be tried all the same?
    let leaf_cost = costs.leaf(count);
    let mut bad_splits = 0;
    if split.cost >= leaf_cost {
        bad_splits = place.bad_splits + 1;
        let hopeless = split.cost > 1.25 * leaf_cost + f64::from(params.traversal_cost);
        if bad_splits > params.bad_splits || hopeless {
            return None;
        }
    }

    let parts = partition(references, context.triangles, &split);
    let total = parts.below.len() + parts.above.len();
    // A plane that divides nothing would be tried for ever.
    let useless = (parts.below.len() == count && parts.above.len() == count)
        && (split.position <= place.cell.min[split.axis] || split.position >= place.cell.max[split.axis]);
    if total > place.budget || useless {
        return None;
    }

    let child = |references: Vec<Reference>, cell: Aabb| {
        let part = references.len() as f64 / total.max(1) as f64;
        let budget = (place.budget as f64 * part) as usize;
        let place = Place { cell, depth: place.depth + 1, bad_splits, budget, share: place.share * part };
        Child { references, place }
    };
    let [below, above] = place.cell.halves(split.axis, split.position);
    Some((split, [child(parts.below, below), child(parts.above, above)]))
}

impl Context<'_> {
    /// A leaf is done that had this share of the work.
    fn finished(&self, share: f64) {
        // Shares are tiny: what is rounded away shows as a bar that ends a little short of full.
        if let Some(progress) = self.progress {
            progress.millionths.fetch_add((share * 1e6).round() as u64, Ordering::Relaxed);
        }
    }
}
