//! A bounding volume hierarchy, so that a ray need not be tried on every triangle.
//!
//! It has one promise to keep: no triangle that a ray meets is left out. Boxes are exact (they are
//! made of the corners' own floats), and [`Probe::enters`] lets nothing through that could be met.
//! Where it splits is only a matter of speed: by the surface area heuristic over 16 bins of the
//! centroids along their longest axis (Wald, "On fast Construction of SAH-based Bounding Volume
//! Hierarchies", 2007).

use super::filter::Probe;
use crate::geometry::Aabb;
use std::ops::Range;

const BINS: usize = 16;

/// Triangles that are not worth a split.
const LEAF: usize = 4;

/// Triangles from which on the two halves are built in parallel.
const PARALLEL: usize = 1 << 14;

/// The tree over some boxes.
pub(super) struct Hierarchy {
    root: Option<Node>,
    /// Ids; a leaf has a range of them.
    order: Vec<u32>,
}

struct Node {
    bounds: Aabb,
    content: Content,
}

enum Content {
    Leaf(Range<u32>),
    Inner(Box<[Node; 2]>),
}

/// A thing to be put into the tree.
#[derive(Clone, Copy)]
pub(super) struct Item {
    pub id: u32,
    pub bounds: Aabb,
}

impl Hierarchy {
    pub fn new(mut items: Vec<Item>) -> Self {
        let root = (!items.is_empty()).then(|| build(&mut items, 0));
        Self { root, order: items.iter().map(|item| item.id).collect() }
    }

    /// Calls `visit` with the id of everything whose box the ray enters no later than at `reach`,
    /// nearer boxes first. `visit` may lessen `reach`.
    pub fn walk(&self, probe: &Probe, reach: &mut f64, visit: &mut impl FnMut(u32, &mut f64)) {
        if let Some(root) = &self.root
            && probe.enters(&root.bounds, *reach).is_some()
        {
            self.walk_node(root, probe, reach, visit);
        }
    }

    fn walk_node(&self, node: &Node, probe: &Probe, reach: &mut f64, visit: &mut impl FnMut(u32, &mut f64)) {
        match &node.content {
            Content::Leaf(range) => {
                self.order[range.start as usize..range.end as usize].iter().for_each(|&id| visit(id, reach));
            }
            Content::Inner(children) => {
                let entries = children.each_ref().map(|child| probe.enters(&child.bounds, *reach));
                let swap = matches!(entries, [Some(first), Some(second)] if second < first);
                for i in if swap { [1, 0] } else { [0, 1] } {
                    if entries[i].is_some_and(|entry| entry <= *reach) {
                        self.walk_node(&children[i], probe, reach, visit);
                    }
                }
            }
        }
    }
}

/// Builds over `items`, the first of which is number `start` of all, and puts them into the leaves' order.
fn build(items: &mut [Item], start: u32) -> Node {
    let bounds = items.iter().fold(Aabb::EMPTY, |all, item| all.union(item.bounds));
    if items.len() <= LEAF {
        return Node { bounds, content: Content::Leaf(start..start + items.len() as u32) };
    }
    let centers = Aabb::of_points(items.iter().map(|item| item.bounds.center()));
    let axis = longest(&centers);
    let center = |item: &Item| item.bounds.center()[axis];
    let below = best_split(items, &centers, axis).unwrap_or(items.len() / 2);
    items.select_nth_unstable_by(below, |p, q| center(p).total_cmp(&center(q)));

    let parallel = items.len() >= PARALLEL;
    let (left, right) = items.split_at_mut(below);
    let middle = start + below as u32;
    let children = if parallel {
        rayon::join(|| build(left, start), || build(right, middle))
    } else {
        (build(left, start), build(right, middle))
    };
    Node { bounds, content: Content::Inner(Box::new(children.into())) }
}

fn longest(bounds: &Aabb) -> usize {
    // Halves do not overflow.
    let half = bounds.max * 0.5 - bounds.min * 0.5;
    (0..3).max_by(|&i, &j| half[i].total_cmp(&half[j])).unwrap_or(0)
}

/// How many items lie below the cheapest plane between bins, where any lie on both sides of one.
fn best_split(items: &[Item], centers: &Aabb, axis: usize) -> Option<usize> {
    let (low, high) = (f64::from(centers.min[axis]), f64::from(centers.max[axis]));
    let bin = |item: &Item| {
        let place = (f64::from(item.bounds.center()[axis]) - low) / (high - low);
        ((place * BINS as f64) as usize).min(BINS - 1)
    };
    let mut bins = [(0usize, Aabb::EMPTY); BINS];
    for item in items {
        let (count, bounds) = &mut bins[bin(item)];
        (*count, *bounds) = (*count + 1, bounds.union(item.bounds));
    }
    let gather = |bins: &[(usize, Aabb)]| {
        bins.iter().fold((0, Aabb::EMPTY), |(n, all), (count, bounds)| (n + count, all.union(*bounds)))
    };
    let cost = |(count, bounds): (usize, Aabb)| count as f64 * bounds.area();
    let splits = (1..BINS).map(|i| bins.split_at(i)).map(|(left, right)| (gather(left), gather(right)));
    splits
        .filter(|(left, right)| left.0 > 0 && right.0 > 0)
        .min_by(|p, q| (cost(p.0) + cost(p.1)).total_cmp(&(cost(q.0) + cost(q.1))))
        .map(|(left, _)| left.0)
}
