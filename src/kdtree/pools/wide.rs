//! Which parts of the hierarchy share a node of eight boxes, and which are leaves.
//!
//! A ray meets eight boxes at the price of one. Where a node has lanes left, a leaf had better be cut into smaller ones that are met by
//! fewer rays; where it has none, what lies deeper takes another node. So both are chosen together: from below upwards, for each
//! part of the hierarchy, what it costs if one box stands for it in the node above, or up to two of its parts, and so
//! on up to eight. One box is that of a leaf, or that of a node, whose own eight boxes are shared out among both halves (Ylitie,
//! Karras & Laine, "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", 2017). The least that all
//! of it costs, and how that comes about, is the plan.
//!
//! Beside leaves that are chosen first, and nodes that come of cutting the largest box until there are eight, nodes have 6.7 boxes
//! rather than 5, and rays are up to 1.1 times as fast (`docs/incoherent.md`).

use super::chunk::{self, MOST};
use super::hierarchy::Hierarchy;
use crate::geometry::triangle::Triangle;
use crate::kdtree::Node;
use rayon::prelude::*;
use std::ops::Range;

/// Boxes of a node.
pub const WIDTH: usize = 8;

/// What a node costs a ray that comes to it, where a chunk costs 1. (0.2 or 0.5 make no difference that can be measured.)
const NODE: f32 = 0.3;

/// How a part's boxes are shared out among its halves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shares {
    /// How many the lower half gets of the eight of a node below.
    of_node: u8,
    /// How many it gets of two, of three and so on up to eight in the node above. 0 if the part does with one fewer.
    of_more: [u8; WIDTH - 1],
}

impl Shares {
    const NONE: Self = Self { of_node: 0, of_more: [0; WIDTH - 1] };

    /// How many boxes of a node below are for the lower half at most, and for the upper one.
    pub fn of_node(&self) -> [usize; 2] {
        let low = usize::from(self.of_node);
        [low, WIDTH - low]
    }

    /// The same of up to `boxes` in the node above. `None` if one box is for the part as a whole.
    pub fn of_boxes(&self, boxes: usize) -> Option<[usize; 2]> {
        let all = (2..=boxes).rev().find(|all| self.of_more[all - 2] != 0)?;
        let low = usize::from(self.of_more[all - 2]);
        Some([low, all - low])
    }
}

/// Makes leaves of up to `most` triangles of the parts that had better be, and says how the boxes of all others are shared out, node
/// by node.
pub fn plan(hierarchy: &mut Hierarchy, triangles: &[Triangle], most: usize) -> Vec<Shares> {
    let Plan { shares, is_leaf, .. } = Plan::new(hierarchy, triangles, most);
    let Hierarchy { nodes, ids, .. } = hierarchy;
    // Parts, and up to how many boxes may stand for each.
    let mut stack = vec![(0, 1)];
    while let Some((index, boxes)) = stack.pop() {
        let halves = match shares[index].of_boxes(boxes) {
            Some(halves) => halves,
            None if is_leaf[index] => {
                let named = named(nodes, index);
                nodes[index] = Node::leaf(named.start, sort_and_dedup(&mut ids[named]));
                continue;
            }
            None => shares[index].of_node(),
        };
        let below = nodes[index].below() as usize;
        stack.extend([(below, halves[0]), (below + 1, halves[1])]);
    }
    shares
}

/// What is best for each node of a hierarchy.
struct Plan {
    shares: Vec<Shares>,
    /// Whether it had better be a leaf than a node of eight boxes, if one box stands for it.
    is_leaf: Vec<bool>,
    /// What it costs if up to one box stands for it, up to two, and so on, relative to a chunk that all rays meet.
    costs: Vec<[f32; WIDTH]>,
}

impl Plan {
    fn new(hierarchy: &Hierarchy, triangles: &[Triangle], most: usize) -> Self {
        let Hierarchy { nodes, boxes, .. } = hierarchy;
        let all = boxes[0].area();
        let share_of_rays = |index: usize| if all > 0.0 { (boxes[index].area() / all) as f32 } else { 1.0 };
        let chunks = chunks(hierarchy, triangles, most);
        let mut plan = Self {
            shares: vec![Shares::NONE; nodes.len()],
            is_leaf: vec![true; nodes.len()],
            costs: vec![[0.0; WIDTH]; nodes.len()],
        };
        // Children lie behind their parents.
        for (index, node) in nodes.iter().enumerate().rev() {
            let as_leaf = chunks[index] * share_of_rays(index);
            if node.is_leaf() {
                plan.costs[index] = [as_leaf; WIDTH];
                continue;
            }
            let below = node.below() as usize;
            let halves = [plan.costs[below], plan.costs[below + 1]];
            let (mut costs, Shares { mut of_node, mut of_more }) = ([0.0; WIDTH], Shares::NONE);
            for boxes in 2..=WIDTH {
                (costs[boxes - 1], of_node) = cheapest(&halves, boxes);
                of_more[boxes - 2] = of_node;
            }
            let as_node = NODE * share_of_rays(index) + costs[WIDTH - 1];
            // (Too many triangles in a box that no ray meets cost a NaN, which is no leaf's.)
            plan.is_leaf[index] = as_leaf <= as_node;
            costs[0] = as_leaf.min(as_node);
            for boxes in 2..=WIDTH {
                if costs[boxes - 2] <= costs[boxes - 1] {
                    (costs[boxes - 1], of_more[boxes - 2]) = (costs[boxes - 2], 0);
                }
            }
            (plan.costs[index], plan.shares[index]) = (costs, Shares { of_node, of_more });
        }
        plan
    }
}

/// The least that both halves cost if so many boxes are shared out among them, and how many are for the lower one then.
fn cheapest([low, high]: &[[f32; WIDTH]; 2], boxes: usize) -> (f32, u8) {
    let (mut least, mut of_low) = (f32::INFINITY, 1);
    for first in 1..boxes {
        let cost = low[first - 1] + high[boxes - first - 1];
        if cost < least {
            (least, of_low) = (cost, first as u8);
        }
    }
    (least, of_low)
}

/// How many chunks the triangles of each node take as a leaf. Infinitely many if there are more than `most`, and it is none yet.
fn chunks(Hierarchy { nodes, ids, .. }: &Hierarchy, triangles: &[Triangle], most: usize) -> Vec<f32> {
    let chunks = |(index, node): (usize, &Node)| {
        let named = &ids[named(nodes, index)];
        if node.is_leaf() {
            return chunk::count(named, triangles) as f32;
        }
        // Several of its leaves may name the same one.
        let mut room = [0; 2 * MOST];
        let Some(few) = room.get_mut(..named.len()) else { return f32::INFINITY };
        few.copy_from_slice(named);
        let count = sort_and_dedup(few);
        if count <= most { chunk::count(&few[..count], triangles) as f32 } else { f32::INFINITY }
    };
    nodes.par_iter().enumerate().map(chunks).collect()
}

/// Where the ids lie that the leaves below a node name, which is one behind the other.
fn named(nodes: &[Node], index: usize) -> Range<usize> {
    let (mut first, mut last) = (nodes[index], nodes[index]);
    while !first.is_leaf() {
        first = nodes[first.below() as usize];
    }
    while !last.is_leaf() {
        last = nodes[last.below() as usize + 1];
    }
    first.references().start..last.references().end
}

/// Puts ids in ascending order, each once, in front; how many those are.
fn sort_and_dedup(ids: &mut [u32]) -> usize {
    ids.sort_unstable();
    let mut count = 0;
    for place in 0..ids.len() {
        if count == 0 || ids[count - 1] != ids[place] {
            ids[count] = ids[place];
            count += 1;
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::mesh::generate::shapes;

    fn triangles_of(mesh: &Mesh) -> Vec<Triangle> {
        let corners = |id| mesh.corners(id).map(|corner| corner.to_array());
        (0..mesh.triangles.len() as u32).map(|id| Triangle::new(corners(id))).collect()
    }

    /// All that a part may cost for which up to so many boxes stand: every way to share them out is tried.
    fn all_costs(
        hierarchy: &Hierarchy,
        chunks: &[f32],
        index: usize,
        boxes: usize,
        width: usize,
    ) -> Vec<f32> {
        let Hierarchy { nodes, boxes: bounds, .. } = hierarchy;
        let share = (bounds[index].area() / bounds[0].area()) as f32;
        let shared_out = |boxes: usize| {
            let (below, mut costs) = (nodes[index].below() as usize, Vec::new());
            for first in 1..boxes {
                let low = all_costs(hierarchy, chunks, below, first, width);
                let high = all_costs(hierarchy, chunks, below + 1, boxes - first, width);
                costs.extend(low.iter().flat_map(|low| high.iter().map(move |high| low + high)));
            }
            costs.sort_by(f32::total_cmp);
            costs.dedup();
            costs
        };
        let mut costs = vec![chunks[index] * share];
        if !nodes[index].is_leaf() {
            costs.extend(shared_out(width).iter().map(|cost| cost + NODE * share));
            (2..=boxes).for_each(|boxes| costs.extend(shared_out(boxes)));
        }
        costs
    }

    /// What a plan comes to, counted from the root.
    fn cost_of(hierarchy: &Hierarchy, chunks: &[f32], shares: &[Shares], index: usize, boxes: usize) -> f32 {
        let Hierarchy { nodes, boxes: bounds, .. } = hierarchy;
        let share = (bounds[index].area() / bounds[0].area()) as f32;
        let (halves, own) = match shares[index].of_boxes(boxes) {
            Some(halves) => (halves, 0.0),
            None if nodes[index].is_leaf() => return chunks[index] * share,
            None => (shares[index].of_node(), NODE * share),
        };
        assert!(halves[0] > 0 && halves[1] > 0 && halves[0] + halves[1] <= WIDTH);
        let below = nodes[index].below() as usize;
        let cost = |half: usize| cost_of(hierarchy, chunks, shares, below + half, halves[half]);
        own + cost(0) + cost(1)
    }

    #[test]
    fn nothing_is_cheaper_than_the_plan() {
        for seed in 0..20 {
            let (triangles, most) = (triangles_of(&shapes::soup(10, seed)), [MOST, 8, 3][seed as usize % 3]);
            let mut hierarchy = Hierarchy::new(&triangles);
            let chunks = chunks(&hierarchy, &triangles, most);
            let promised = Plan::new(&hierarchy, &triangles, most).costs[0][0];
            let all = all_costs(&hierarchy, &chunks, 0, 1, WIDTH);
            let least = all.iter().copied().fold(f32::INFINITY, f32::min);
            let shares = plan(&mut hierarchy, &triangles, most);
            let kept = cost_of(&hierarchy, &chunks, &shares, 0, 1);
            for cost in [promised, kept] {
                assert!((cost - least).abs() <= 1e-5 * least, "{cost} in place of {least} of {}", all.len());
            }
        }
    }

    #[test]
    fn leaves_name_what_those_below_them_named_once() {
        let triangles = triangles_of(&shapes::sphere(4));
        for most in [8, MOST] {
            let mut hierarchy = Hierarchy::new(&triangles);
            let (nodes, ids) = (hierarchy.nodes.clone(), hierarchy.ids.clone());
            plan(&mut hierarchy, &triangles, most);
            // Leaves that were made; those below them are reached no more.
            let made = |(index, node): &(usize, &Node)| node.is_leaf() && !nodes[*index].is_leaf();
            let (mut count, mut largest) = (0, 0);
            for (index, node) in hierarchy.nodes.iter().enumerate().filter(made) {
                let mut before = ids[named(&nodes, index)].to_vec();
                before.sort_unstable();
                before.dedup();
                assert_eq!(hierarchy.ids[node.references()], before);
                (count, largest) = (count + 1, before.len().max(largest));
            }
            assert!(count > 50 && most - 3 < largest && largest <= most, "{count}, of up to {largest}");
        }
    }

    #[test]
    fn a_triangle_without_extent_is_a_leaf() {
        let triangles = vec![Triangle::new([[1.0; 3]; 3])];
        let mut hierarchy = Hierarchy::new(&triangles);
        let shares = plan(&mut hierarchy, &triangles, MOST);
        assert!(hierarchy.nodes[0].is_leaf() && shares[0].of_boxes(WIDTH).is_none());
    }
}
