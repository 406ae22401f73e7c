//! Small subtrees: one thread, no allocation per node.
//!
//! The references of a node are the end of one stack. Dividing leaves those above the plane in their
//! place and puts those below on top; when these have become a subtree they are popped, and the others
//! follow.

use super::binned::{self, Extent, Frame, Table};
use super::clear::Gap;
use super::exact::{self, Event};
use super::few::{self, Few};
use super::partition::Divider;
use super::reference::Reference;
use super::{Context, Place, Verdict};
use crate::kdtree::memory::bytes_of;
use crate::kdtree::node::Node;
use crate::kdtree::pages::sort_and_dedup;
use crate::kdtree::sah::{CellCost, Split};

/// A subtree whose indices count from its own arrays' beginnings.
pub struct Subtree {
    pub root: Node,
    pub nodes: Vec<Node>,
    /// Primitive ids, leaf after leaf.
    pub references: Vec<u32>,
}

impl Subtree {
    pub fn leaf(references: Vec<u32>) -> Self {
        Self { root: Node::leaf(0, references.len()), nodes: Vec::new(), references }
    }
}

/// Builds the subtree of some references on this thread.
pub fn build(context: &Context, references: Vec<Reference>, place: Place) -> Subtree {
    let given = bytes_of(&references);
    let mut builder = Builder {
        context,
        stack: references,
        nodes: Vec::new(),
        references: Vec::new(),
        scratch: Scratch::default(),
        divider: Divider::default(),
    };
    let (root, _) = builder.node(0, place);
    context.finished(place.share);
    let Builder { stack, mut nodes, mut references, .. } = builder;
    nodes.shrink_to_fit();
    references.shrink_to_fit();
    // How far the stack has grown is known only now.
    context.ledger.add(bytes_of(&stack) - given + bytes_of(&nodes) + bytes_of(&references));
    context.ledger.sub(bytes_of(&stack));
    Subtree { root, nodes, references }
}

/// Bins that even a handful of references is worth.
const LEAST_BINS: usize = 16;

/// Memory that the search for splits reuses.
#[derive(Default)]
pub struct Scratch {
    table: Table,
    events: Vec<Event>,
    few: Few,
}

impl Scratch {
    /// The cheapest plane found for a small node, clear of what it parts; `None` if none divides.
    fn best_split(&mut self, context: &Context, references: &[Reference], costs: &CellCost) -> Option<Split> {
        let split = self.cheapest_split(context, references, costs)?;
        Some(Gap::ALL.beside(&split, references).clear(split, costs))
    }

    /// The cheapest plane found.
    fn cheapest_split(
        &mut self,
        context: &Context,
        references: &[Reference],
        costs: &CellCost,
    ) -> Option<Split> {
        let (count, params) = (references.len(), context.params);
        if count >= params.exact_below.max(2) {
            let mut extent = Extent::NONE;
            extent.grow(references);
            // No more bins than there are ends.
            let bins = params.bins.min(count.max(LEAST_BINS));
            let frame = Frame::new(&extent, bins);
            self.table.reset(bins);
            self.table.count(context.isa, references, &frame);
            match self.table.best_boundary(&frame, costs, count) {
                Some(boundary) if !params.perfect => self.table.coarse(&boundary, &frame, costs, count),
                Some(boundary) => {
                    self.events.clear();
                    boundary.gather(references, &frame, &mut self.events);
                    self.events.sort_unstable();
                    boundary.refine(&self.events, &self.table, &frame, costs, count)
                }
                None => binned::ends_of_extent(&frame, costs, count),
            }
        } else if count <= few::MOST {
            self.few.best_split(context.isa, references, costs)
        } else {
            exact::best_split(references, costs, &mut self.events)
        }
    }
}

struct Builder<'a> {
    context: &'a Context<'a>,
    stack: Vec<Reference>,
    nodes: Vec<Node>,
    references: Vec<u32>,
    scratch: Scratch,
    divider: Divider,
}

impl Builder<'_> {
    /// Builds the node of the references from `start` on and pops them; the node, and its expected cost.
    fn node(&mut self, start: usize, place: Place) -> (Node, f64) {
        let context = self.context;
        let count = self.stack.len() - start;
        let Some(costs) = context.may_split(count, &place) else { return self.leaf(start) };
        let Some(split) = self.scratch.best_split(context, &self.stack[start..], &costs) else {
            return self.leaf(start);
        };
        let Some(verdict) = context.judge(&split, &self.stack[start..], &place, &costs) else {
            return self.leaf(start);
        };

        let clips = context.params.perfect;
        let below =
            self.divider.divide(context.isa, &mut self.stack, start, context.triangles, &split, clips);
        let middle = self.stack.len();
        let Some([place_below, place_above]) =
            place.children(&split, &verdict, [below.len(), middle - start], count)
        else {
            self.stack.extend_from_slice(below);
            return self.undivided(start);
        };
        self.stack.extend_from_slice(below);

        let (pair, first) = (self.nodes.len(), self.references.len());
        self.nodes.extend([Node::leaf(0, 0); 2]);
        let (node_below, cost_below) = self.node(middle, place_below);
        let (node_above, cost_above) = self.node(start, place_above);
        let cost = costs.of_children(split.axis, split.position, [cost_below, cost_above]);
        if matches!(verdict, Verdict::Tried(_)) && cost >= costs.leaf(count) {
            // What was hoped for has not come.
            self.nodes.truncate(pair);
            return self.merged(first);
        }
        (self.nodes[pair], self.nodes[pair + 1]) = (node_below, node_above);
        (Node::inner(split.axis, split.position, pair), cost)
    }

    /// A leaf of the references from `start` on.
    fn leaf(&mut self, start: usize) -> (Node, f64) {
        let first = self.references.len();
        self.references.extend(self.stack.drain(start..).map(|reference| reference.primitive()));
        self.leaf_of(first)
    }

    /// The same, where they have been divided in vain: triangles that were cut are on the stack twice.
    fn undivided(&mut self, start: usize) -> (Node, f64) {
        let first = self.references.len();
        self.leaf(start);
        self.merged(first)
    }

    /// One leaf in place of those whose references begin at `first`.
    fn merged(&mut self, first: usize) -> (Node, f64) {
        sort_and_dedup(&mut self.references, first);
        self.leaf_of(first)
    }

    fn leaf_of(&self, first: usize) -> (Node, f64) {
        let count = self.references.len() - first;
        (Node::leaf(first, count), self.context.leaf_cost(count))
    }
}
