//! The hierarchy of boxes that leads to the pools.
//!
//! A ray that is alone does not care for cells that know their neighbours; what counts is how few boxes it meets, and how few
//! triangles. A kd-tree names a triangle in each cell that it reaches into, two or three of them; a hierarchy of boxes names
//! it once, unless it pays to part it. So this is built from the triangles, and not made of the tree: from the top down by the
//! surface-area heuristic, by groups of triangles ([`objects`]), or where those overlap, across a plane
//! ([`spatial`]; Stich, Friedrich & Dietrich, "Spatial splits in bounding volume hierarchies", 2009).
//!
//! When all is built, parts move to where they do better ([`reinsertion`]). That makes up for what a builder cannot see from above,
//! up to a fifth of the boxes that rays meet.
//!
//! Beside pools that were made of the tree, rays by lists are 0.9 to 1.3 times as fast that way, and pools take 0.4 to 0.8 times
//! the memory (`docs/incoherent.md`).
//!
//! Leaves are small here: on the way back up a subtree of up to four triangles is one leaf if its chunk, met by every ray that
//! comes to its box, costs less than its boxes and what lies in them. Triangles that several of its leaves named are named once then. What
//! sixteen triangles cost is no more than four do, so larger leaves are made in the end, where boxes are short ([`wide`](super::wide)).

mod few;
mod objects;
mod reference;
mod reinsertion;
mod spatial;

use super::chunk;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::{MAX_DEPTH, Node};
use few::Few;
use reference::{Reference, around};
use reinsertion::{Holds, Loose, Place};

/// What cutting a box in two costs a ray, where a chunk costs 1: some of what a node of eight boxes does, which stands for two or three
/// levels. (Half or twice as much makes no difference that can be measured.)
const CUT: f64 = 0.06;

/// Triangles are parted only where groups of them overlap by more than this, relative to the box around everything (Stich
/// and others' alpha). With a tenth of it, rays meet up to 2 % fewer boxes and triangles, and building takes up to twice the time.
const OVERLAP: f64 = 1e-3;

/// How many references there may be beyond one of each triangle, relative to those.
const PARTS: f64 = 1.0;

/// References for which it pays to ask another worker.
const PARALLEL: usize = 4096;

/// A binary hierarchy. A node's children are behind it, side by side; planes mean nothing.
pub struct Hierarchy {
    pub nodes: Vec<Node>,
    /// The box around what each node holds.
    pub boxes: Vec<Aabb>,
    /// What leaves name, each in ascending order.
    pub ids: Vec<u32>,
}

/// Where references are parted.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Split {
    axis: usize,
    /// The first bin, or the first in the order of centres, that is on the upper side.
    at: usize,
    /// How many are on each side, and the box around them.
    counts: [usize; 2],
    boxes: [Aabb; 2],
}

impl Split {
    /// The cheapest boundary between bins, of which it is known how many references begin and end in each, and the box around
    /// what lies there; `None` if all references are on one side of each, or both sides together have more than `most`.
    fn between<const BINS: usize>(
        axis: usize,
        begins: &[usize; BINS],
        ends: &[usize; BINS],
        boxes: &[Aabb; BINS],
        most: usize,
    ) -> Option<Self> {
        // What is on the upper side of each boundary.
        let mut above = [(0, Aabb::EMPTY); BINS];
        let mut all = (0, Aabb::EMPTY);
        for bin in (0..BINS).rev() {
            all = (all.0 + ends[bin], all.1.union(boxes[bin]));
            above[bin] = all;
        }
        let (mut below, mut best) = ((0, Aabb::EMPTY), None);
        for at in 1..BINS {
            below = (below.0 + begins[at - 1], below.1.union(boxes[at - 1]));
            let counts = [below.0, above[at].0];
            if counts[0] != 0 && counts[1] != 0 && counts[0] + counts[1] <= most {
                best = Self::cheaper(best, Some(Self { axis, at, counts, boxes: [below.1, above[at].1] }));
            }
        }
        best
    }

    /// What it costs, by the surface-area heuristic.
    fn cost(&self) -> f64 {
        let [low, high] = self.boxes.map(|bounds| bounds.area());
        low * self.counts[0] as f64 + high * self.counts[1] as f64
    }

    /// The cheaper one of two; the first if they cost the same.
    fn cheaper(a: Option<Self>, b: Option<Self>) -> Option<Self> {
        match (a, b) {
            (Some(a), Some(b)) => Some(if b.cost() < a.cost() { b } else { a }),
            (a, b) => a.or(b),
        }
    }

    /// The area that both sides have in common.
    fn overlap(&self) -> f64 {
        let [low, high] = self.boxes;
        Aabb { min: low.min.max(high.min), max: low.max.min(high.max) }.area()
    }
}

/// A part of the hierarchy.
enum Part {
    Leaf { bounds: Aabb, ids: Vec<u32> },
    Cut { bounds: Aabb, below: Box<[Self; 2]> },
}

/// A part, and what is known of it.
struct Built {
    part: Part,
    /// What it costs, times the area of its box.
    cost: f64,
    /// Its triangles, each once, if they are few enough for one leaf.
    few: Option<Few>,
}

/// What all parts are built of.
struct Builder<'a> {
    triangles: &'a [Triangle],
    /// The least overlap for which triangles are parted.
    overlap: f64,
}

impl Hierarchy {
    /// Builds that of some triangles, of which there is one at least. It does not depend on the number of threads.
    pub fn new(triangles: &[Triangle]) -> Self {
        let references: Vec<Reference> =
            triangles.iter().enumerate().map(|(id, triangle)| Reference::new(id as u32, triangle)).collect();
        let builder = Builder { triangles, overlap: OVERLAP * around(&references).area() };
        let more = (references.len() as f64 * PARTS) as usize;
        let mut loose = Loose::of_part(builder.build(references, 0, more).part);
        loose.optimize();
        Self::of_loose(loose)
    }

    /// In the order of a depth-first walk, of two parts the one first that lies first along the axis along which they are farthest
    /// apart, or overlap least.
    fn of_loose(mut loose: Loose) -> Self {
        let nothing = Node::leaf(0, 0);
        // (The second node is the root's sibling that there is not.)
        let mut all = Self { nodes: vec![nothing; 2], boxes: vec![Aabb::EMPTY; 2], ids: Vec::new() };
        let mut stack = vec![(0, 0)];
        while let Some((from, to)) = stack.pop() {
            all.boxes[to] = loose.0[from].bounds;
            match std::mem::replace(&mut loose.0[from].holds, Holds::Parts(0)) {
                Holds::Triangles(ids) => {
                    all.nodes[to] = Node::leaf(all.ids.len(), ids.len());
                    all.ids.extend(ids);
                }
                Holds::Parts(below) => {
                    let below = below as usize;
                    let [a, b] = [below, below + 1].map(|place| loose.0[place].bounds);
                    let (forth, back) = (b.min - a.max, a.min - b.max);
                    let is_back = back.max_element() > forth.max_element();
                    let axis = if is_back { back.max_position() } else { forth.max_position() };
                    let (low, high) = if is_back { (below + 1, below) } else { (below, below + 1) };
                    let first = all.nodes.len();
                    all.nodes.extend([nothing; 2]);
                    all.boxes.extend([Aabb::EMPTY; 2]);
                    all.nodes[to] = Node::inner(axis, 0.0, first);
                    stack.extend([(high, first + 1), (low, first)]);
                }
            }
        }
        all
    }
}

impl Loose {
    fn of_part(root: Part) -> Self {
        let nothing = Place { bounds: Aabb::EMPTY, above: 0, holds: Holds::Parts(0) };
        // (The second place is for the root's sibling that there is not.)
        let mut all = Self(vec![nothing.clone(), nothing.clone()]);
        let mut stack = vec![(root, 0, 0)];
        while let Some((part, place, above)) = stack.pop() {
            all.0[place] = match part {
                Part::Leaf { bounds, ids } => Place { bounds, above, holds: Holds::Triangles(ids) },
                Part::Cut { bounds, below } => {
                    let first = all.0.len();
                    all.0.extend([nothing.clone(), nothing.clone()]);
                    let [low, high] = *below;
                    stack.extend([(high, first + 1, place as u32), (low, first, place as u32)]);
                    Place { bounds, above, holds: Holds::Parts(first as u32) }
                }
            };
        }
        all
    }
}

impl Builder<'_> {
    /// Builds the part of some references at a depth, with up to so many more of them.
    fn build(&self, references: Vec<Reference>, depth: usize, more: usize) -> Built {
        let (bounds, before) = (around(&references), references.len());
        let [low, high] = match self.part(references, &bounds, depth, more) {
            Ok(sides) => sides,
            Err(references) => return self.leaf(&references, bounds),
        };

        // What is left of them is shared.
        let all = low.len() + high.len();
        let more = (more + before - all) as u128;
        let [more_low, more_high] =
            [&low, &high].map(|side| (more * side.len() as u128 / all as u128) as usize);
        let low = || self.build(low, depth + 1, more_low);
        let high = || self.build(high, depth + 1, more_high);
        let (low, high) = if before >= PARALLEL { rayon::join(low, high) } else { (low(), high()) };
        self.join(bounds, low, high)
    }

    /// Parts references: those on the lower side, and on the upper one. Or gives them back, as they are a leaf.
    fn part(
        &self,
        references: Vec<Reference>,
        bounds: &Aabb,
        depth: usize,
        more: usize,
    ) -> Result<[Vec<Reference>; 2], Vec<Reference>> {
        let count = references.len();
        if count == 1 {
            return Err(references);
        }
        // Halves and halves of these are as deep as they may be at last.
        if depth + 1 + count.next_power_of_two().ilog2() as usize > MAX_DEPTH {
            return Ok(objects::halves(references, bounds));
        }
        let by_objects = objects::best(&references);
        let overlaps = by_objects.is_none_or(|split| split.overlap() > self.overlap);
        let by_plane = if overlaps && more > 0 {
            spatial::best(&references, bounds, self.triangles, count + more)
        } else {
            None
        };
        let least = match by_objects {
            Some(split) => split.cost(),
            // Nothing but planes can part them: that has to be worth it.
            None => (count as f64 - CUT) * bounds.area(),
        };
        if let Some(split) = by_plane.filter(|split| split.cost() < least) {
            let sides = spatial::part(&references, bounds, &split, self.triangles);
            // (Where bins were wrong by roundings, one of them may be empty.)
            if sides.iter().all(|side| !side.is_empty()) {
                return Ok(sides);
            }
        }
        match by_objects {
            Some(split) => Ok(objects::part(references, &split)),
            None => Err(references),
        }
    }

    /// A leaf.
    fn leaf(&self, references: &[Reference], bounds: Aabb) -> Built {
        let mut ids: Vec<u32> = references.iter().map(|reference| reference.id).collect();
        ids.sort_unstable();
        ids.dedup();
        Built {
            cost: self.cost_of_leaf(&ids, &bounds),
            few: Few::of_ids(&ids),
            part: Part::Leaf { bounds, ids },
        }
    }

    /// Two parts become one, or one leaf where that is cheaper.
    fn join(&self, bounds: Aabb, low: Built, high: Built) -> Built {
        let cost = CUT * bounds.area() + low.cost + high.cost;
        let few = low.few.zip(high.few).and_then(|(low, high)| low.with(&high));
        match few.map(|few| (few, self.cost_of_leaf(few.ids(), &bounds))) {
            Some((few, as_leaf)) if as_leaf <= cost => {
                Built { part: Part::Leaf { bounds, ids: few.ids().to_vec() }, cost: as_leaf, few: Some(few) }
            }
            _ => {
                let below = Box::new([low.part, high.part]);
                Built { part: Part::Cut { bounds, below }, cost, few }
            }
        }
    }

    fn cost_of_leaf(&self, ids: &[u32], bounds: &Aabb) -> f64 {
        chunk::count(ids, self.triangles) as f64 * bounds.area()
    }
}

#[cfg(test)]
mod tests;
