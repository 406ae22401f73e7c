//! Large nodes: all threads count, sweep and divide them together.
//!
//! Their references lie in chunks of fixed size. A pass over a node is a pass over its chunks in
//! parallel; dividing makes two lists of chunks out of one and frees what it has read, so that hardly
//! more memory is in use than the references need.

use super::binned::{self, Extent, Frame, Table};
use super::clear::Gap;
use super::exact::Event;
use super::partition::Divider;
use super::reference::Reference;
use super::subtree::{self, Subtree};
use super::{Built, Context, Place, Verdict};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::huge;
use crate::kdtree::memory::{Ledger, bytes_of};
use crate::kdtree::node::Node;
use crate::kdtree::params::{BuildParams, MOST_BINS};
use crate::kdtree::sah::{CellCost, Split};
use crate::simd::Chosen;
use rayon::prelude::*;
use std::convert::Infallible;

/// References in a chunk: half a megabyte, what a core's own cache holds.
pub const CHUNK: usize = 16_384;

/// A node with fewer references is one task.
const SMALL: usize = 8192;

/// Nodes with more references are worth this many times more bins: fewer ends to sort.
const MANY: usize = 8 * CHUNK;
const FINER: usize = 8;

/// References, chunk after chunk; none is empty.
pub type Chunks = Vec<Vec<Reference>>;

/// A large node's references, wherever they are.
pub trait Gather: Sync {
    /// Why they cannot be had.
    type Error: Send;

    /// Shows all chunks, on all threads: values that begin as `empty` take them in by `add`, and become one by
    /// `join`, in the order of the chunks.
    fn gather<T: Send>(
        &self,
        empty: impl Fn() -> T + Sync + Send,
        add: impl Fn(T, &[Reference]) -> T + Sync + Send,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> Result<T, Self::Error>;
}

impl Gather for Chunks {
    type Error = Infallible;

    fn gather<T: Send>(
        &self,
        empty: impl Fn() -> T + Sync + Send,
        add: impl Fn(T, &[Reference]) -> T + Sync + Send,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> Result<T, Infallible> {
        Ok(self.par_iter().fold(&empty, |value, chunk| add(value, chunk)).reduce(&empty, join))
    }
}

/// The references of all triangles, whole.
pub fn chunks_of(triangles: &[Triangle]) -> Chunks {
    let chunk = |(chunk, triangles): (usize, &[Triangle])| whole((chunk * CHUNK) as u32, triangles).collect();
    triangles.par_chunks(CHUNK).enumerate().map(chunk).collect()
}

/// The references of triangles whose ids begin with `first`, whole.
pub fn whole(first: u32, triangles: &[Triangle]) -> impl Iterator<Item = Reference> {
    let reference = |(primitive, triangle): (u32, &Triangle)| {
        Reference::new(primitive, &Aabb::of_points(triangle.corners.map(Into::into)))
    };
    (first..).zip(triangles).map(reference)
}

/// A part of the tree that is done.
pub enum Part {
    /// An inner node and its children, below and above.
    Inner(Split, Box<[Part; 2]>),
    /// All of a small subtree.
    Whole(Subtree),
}

/// Builds a subtree, its children side by side while they are large.
pub fn build(context: &Context, chunks: Chunks, place: Place) -> Part {
    let count = chunks.iter().map(Vec::len).sum();
    if count < SMALL || count > place.in_flight {
        if count >= SMALL && context.ledger.is_limited() {
            // What one thread builds of so many is on the ledger too late.
            context.ledger.give_up();
            return leaf(context, chunks, &place);
        }
        let references = chunks.concat();
        context.ledger.add(bytes_of(&references));
        free(context, chunks);
        return Part::Whole(subtree::build(context, references, place));
    }
    let split = context.may_split(count, &place).and_then(|costs| {
        let Ok(split) = best_split(context.isa, context.params, &chunks, count, &costs);
        let split = split?;
        (split.cost < costs.leaf(count)).then_some(split)
    });
    let Some(split) = split else { return leaf(context, chunks, &place) };
    let parts = divide(context, chunks, &split);
    let counts = [0, 1].map(|side: usize| parts[side].iter().map(Vec::len).sum::<usize>());
    let Some([place_below, place_above]) = place.children(&split, &Verdict::Good, counts, count) else {
        return leaf(context, parts.into_iter().flatten().collect(), &place);
    };
    let [below, above] = parts;
    let (below, above) =
        rayon::join(|| build(context, below, place_below), || build(context, above, place_above));
    Part::Inner(split, Box::new([below, above]))
}

/// Drops chunks.
fn free(context: &Context, chunks: Chunks) {
    context.ledger.sub(chunks.iter().map(bytes_of).sum());
}

/// All in one leaf, each triangle once.
fn leaf(context: &Context, chunks: Chunks, place: &Place) -> Part {
    context.finished(place.share);
    let mut ids: Vec<u32> = chunks.iter().flatten().map(Reference::primitive).collect();
    context.ledger.add(bytes_of(&ids));
    free(context, chunks);
    ids.par_sort_unstable();
    ids.dedup();
    Part::Whole(Subtree::leaf(ids))
}

/// The cheapest plane found, clear of what it parts; `None` if none divides.
pub fn best_split<G: Gather>(
    isa: Chosen,
    params: &BuildParams,
    references: &G,
    count: usize,
    costs: &CellCost,
) -> Result<Option<Split>, G::Error> {
    let Some(split) = cheapest_split(isa, params, references, count, costs)? else { return Ok(None) };
    let beside = |gap: Gap, chunk: &[Reference]| gap.beside(&split, chunk);
    let gap = references.gather(|| Gap::ALL, beside, Gap::and)?;
    Ok(Some(gap.clear(split, costs)))
}

/// The cheapest plane found; `None` if none divides.
fn cheapest_split<G: Gather>(
    isa: Chosen,
    params: &BuildParams,
    references: &G,
    count: usize,
    costs: &CellCost,
) -> Result<Option<Split>, G::Error> {
    let bins = if count > MANY { (params.bins * FINER).min(MOST_BINS) } else { params.bins };
    let grown = |mut extent: Extent, chunk: &[Reference]| {
        extent.grow(chunk);
        extent
    };
    let extent = references.gather(|| Extent::NONE, grown, Extent::union)?;
    let frame = Frame::new(&extent, bins);
    let empty = || {
        let mut table = Table::default();
        table.reset(bins);
        table
    };
    let counted = |mut table: Table, chunk: &[Reference]| {
        table.count(isa, chunk, &frame);
        table
    };
    let added = |mut a: Table, b: Table| {
        a.add(&b);
        a
    };
    let table = references.gather(empty, counted, added)?;
    let Some(boundary) = table.best_boundary(&frame, costs, count) else {
        return Ok(binned::ends_of_extent(&frame, costs, count));
    };
    if !params.perfect {
        return Ok(table.coarse(&boundary, &frame, costs, count));
    }
    let gathered = |mut events: Vec<Event>, chunk: &[Reference]| {
        boundary.gather(chunk, &frame, &mut events);
        events
    };
    let appended = |mut a: Vec<Event>, b: Vec<Event>| {
        a.extend_from_slice(&b);
        a
    };
    let mut events = references.gather(Vec::new, gathered, appended)?;
    events.par_sort_unstable();
    Ok(boundary.refine(&events, &table, &frame, costs, count))
}

/// The references below a plane and above.
fn divide(context: &Context, chunks: Chunks, split: &Split) -> [Chunks; 2] {
    let divided = |divider: &mut Divider, mut chunk: Vec<Reference>| {
        let before = bytes_of(&chunk);
        let clips = context.params.perfect;
        let below = divider.divide(context.isa, &mut chunk, 0, context.triangles, split, clips).to_vec();
        context.ledger.add(bytes_of(&below));
        chunk.shrink_to_fit();
        context.ledger.sub(before - bytes_of(&chunk));
        [below, chunk]
    };
    let parts: Vec<[Vec<Reference>; 2]> =
        chunks.into_par_iter().map_init(Divider::default, divided).collect();
    let mut sides: [Chunks; 2] = Default::default();
    for pair in parts {
        for (side, part) in sides.iter_mut().zip(pair) {
            match side.last_mut() {
                _ if part.is_empty() => {}
                Some(last) if last.len() + part.len() <= CHUNK => {
                    let before = bytes_of(last) + bytes_of(&part);
                    last.reserve_exact(part.len());
                    last.extend_from_slice(&part);
                    context.ledger.sub(before - bytes_of(last));
                }
                _ => side.push(part),
            }
        }
    }
    sides
}

impl Part {
    /// Its nodes, the root not counted.
    pub fn nodes(&self) -> usize {
        match self {
            Self::Inner(_, children) => 2 + children.iter().map(Self::nodes).sum::<usize>(),
            Self::Whole(subtree) => subtree.nodes.len(),
        }
    }

    /// The references of all its leaves.
    pub fn references(&self) -> usize {
        match self {
            Self::Inner(_, children) => children.iter().map(Self::references).sum(),
            Self::Whole(subtree) => subtree.references.len(),
        }
    }

    /// What it is on the ledger with.
    fn bytes(&self) -> usize {
        match self {
            Self::Inner(_, children) => children.iter().map(Self::bytes).sum(),
            Self::Whole(subtree) => bytes_of(&subtree.nodes) + bytes_of(&subtree.references),
        }
    }

    /// The whole tree in two arrays: the root, an unused place, so that pairs of siblings are aligned,
    /// and then the pairs.
    pub fn gathered(self, ledger: &Ledger) -> Built {
        let mut nodes = huge::copies_of(Node::leaf(0, 0), 2 + self.nodes());
        let mut references = vec![0; self.references()];
        ledger.add(bytes_of(&nodes) + bytes_of(&references));
        let bytes = self.bytes();
        let (root, rest) = nodes.split_at_mut(2);
        root[0] = self.place(rest, 2, &mut references, 0);
        ledger.sub(bytes);
        Built { nodes, references }
    }

    /// Writes it to slices that begin at `first_node` and `first_reference` of the whole arrays; its root.
    fn place(
        self,
        nodes: &mut [Node],
        first_node: usize,
        references: &mut [u32],
        first_reference: usize,
    ) -> Node {
        match self {
            Self::Whole(subtree) => {
                references.copy_from_slice(&subtree.references);
                for (node, built) in nodes.iter_mut().zip(&subtree.nodes) {
                    *node = built.moved(first_node, first_reference);
                }
                subtree.root.moved(first_node, first_reference)
            }
            Self::Inner(split, children) => {
                let [below, above] = *children;
                let (pair, rest) = nodes.split_at_mut(2);
                let (nodes_below, nodes_above) = rest.split_at_mut(below.nodes());
                let (ids_below, ids_above) = references.split_at_mut(below.references());
                let (node_above, reference_above) =
                    (first_node + 2 + nodes_below.len(), first_reference + ids_below.len());
                (pair[0], pair[1]) = rayon::join(
                    || below.place(nodes_below, first_node + 2, ids_below, first_reference),
                    || above.place(nodes_above, node_above, ids_above, reference_above),
                );
                Node::inner(split.axis, split.position, first_node)
            }
        }
    }
}
