//! Which lights are strong and near: a tree of boxes around them.

use super::Emitter;
use crate::geometry::Aabb;
use glam::Vec3;
use std::ops::Range;

/// The most lights in a leaf.
const LEAF: usize = 4;

/// A tree over lights that a choice goes down: at each node to either side by how much light its box can be expected
/// to send to a point, in the leaf to one light by the same measure (after Conty Estevez & Kulla, "Importance sampling
/// of many lights with adaptive tree splitting", 2018, without cones of directions, since lights shine to both
/// sides).
///
/// It is balanced: node `i` has the children `2i` and `2i + 1`, node 1 is the root, and the leaves, a power of two
/// in number, share the lights in the order that building left them in evenly. So there are no pointers, and the way
/// from the root to a light is known from its place. 14 to 28 bytes a light.
#[derive(Clone, Debug)]
pub(super) struct LightTree {
    nodes: Box<[Node]>,
    leaves: usize,
    lights: usize,
}

/// The lights below a node.
#[derive(Clone, Copy, Debug)]
struct Node {
    bounds: Aabb,
    /// What they are chosen by, of all lights': at most 1.
    share: f32,
}

impl LightTree {
    /// The tree over one light or more, which are put in its order. `weight` is what all of them weigh.
    pub fn new(lights: &mut [Emitter], weight: f64) -> Self {
        let leaves = lights.len().div_ceil(LEAF).next_power_of_two();
        let nothing = Node { bounds: Aabb::EMPTY, share: 0.0 };
        let mut tree = Self { nodes: vec![nothing; 2 * leaves].into(), leaves, lights: lights.len() };
        tree.build(1, 0..leaves, lights, weight);
        tree
    }

    /// Builds a node over some of the leaves and their lights.
    fn build(&mut self, node: usize, leaves: Range<usize>, lights: &mut [Emitter], weight: f64) {
        let bounds = Aabb::of_points(lights.iter().flat_map(|light| light.corners));
        let share = (lights.iter().map(Emitter::weight).sum::<f64>() / weight) as f32;
        self.nodes[node] = Node { bounds, share };
        if leaves.len() == 1 {
            // An order that does not depend on how selection works inside.
            lights.sort_unstable_by_key(|light| light.primitive);
            return;
        }
        let extent = bounds.extent();
        let axis = if extent.x >= extent.max_element() { 0 } else { 1 + usize::from(extent.z > extent.y) };
        let middle = leaves.start.midpoint(leaves.end);
        let place = self.first(middle) - self.first(leaves.start);
        let sum = |light: &Emitter| light.corners.iter().map(|p| f64::from(p[axis])).sum::<f64>();
        lights.select_nth_unstable_by(place, |a, b| {
            sum(a).total_cmp(&sum(b)).then(a.primitive.cmp(&b.primitive))
        });
        let (below, above) = lights.split_at_mut(place);
        self.build(2 * node, leaves.start..middle, below, weight);
        self.build(2 * node + 1, middle..leaves.end, above, weight);
    }

    /// The place of a light, and the probability with which this function chooses it for `point`. `number` is in
    /// [0, 1).
    pub fn pick(&self, lights: &[Emitter], point: Vec3, mut number: f64) -> (usize, f64) {
        let (mut node, mut probability) = (1, 1.0);
        while node < self.leaves {
            let share = self.first_share(node, point);
            let side = usize::from(number >= share);
            let [start, size] = if side == 0 { [0.0, share] } else { [share, 1.0 - share] };
            number = ((number - start) / size).clamp(0.0, BELOW_ONE);
            probability *= size;
            node = 2 * node + side;
        }
        let range = self.range(node);
        let shares = leaf_shares(&lights[range.clone()], point);
        let mut chosen = 0;
        for (i, share) in shares.into_iter().enumerate().filter(|&(_, share)| share > 0.0) {
            chosen = i;
            if number < share {
                break;
            }
            number -= share;
        }
        (range.start + chosen, probability * shares[chosen])
    }

    /// The probability with which [`pick`](Self::pick) chooses the light in a place, for `point`: the same to the
    /// bit.
    pub fn probability(&self, lights: &[Emitter], point: Vec3, place: usize) -> f64 {
        // The last leaf that begins no later.
        let leaf = ((place as u64 + 1) * self.leaves as u64 - 1) / self.lights as u64;
        let leaf = self.leaves + leaf as usize;
        let mut probability = 1.0;
        for depth in (0..self.leaves.ilog2()).rev() {
            let (node, side) = (leaf >> (depth + 1), leaf >> depth & 1);
            let share = self.first_share(node, point);
            probability *= if side == 0 { share } else { 1.0 - share };
        }
        let range = self.range(leaf);
        probability * leaf_shares(&lights[range.clone()], point)[place - range.start]
    }

    /// Bytes of memory that it takes up.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }

    /// The share of a node's choices that go to its first child.
    #[inline]
    fn first_share(&self, node: usize, point: Vec3) -> f64 {
        let [a, b] = [2 * node, 2 * node + 1].map(|child| {
            let Node { bounds, share } = self.nodes[child];
            importance(&bounds, f64::from(share), point)
        });
        // With one of them all but dark, rounding does not make it dark.
        if a + b > 0.0 { a / (a + b) } else { 0.5 }
    }

    /// The place of a leaf's first light.
    #[inline]
    fn first(&self, leaf: usize) -> usize {
        (leaf as u64 * self.lights as u64 / self.leaves as u64) as usize
    }

    /// The places of the lights of a node that is a leaf.
    #[inline]
    fn range(&self, node: usize) -> Range<usize> {
        self.first(node - self.leaves)..self.first(node - self.leaves + 1)
    }
}

/// The greatest number less than 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// The shares of a leaf's choices that go to each of its lights.
#[inline]
fn leaf_shares(lights: &[Emitter], point: Vec3) -> [f64; LEAF] {
    let mut shares = [0.0; LEAF];
    for (share, light) in shares.iter_mut().zip(lights) {
        *share = importance(&Aabb::of_points(light.corners), light.weight(), point);
    }
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum)
}

/// What a box of lights with this power may send to a point: less with the square of the distance to its middle, but
/// no more than from its corners to its middle, since within the box some lights are near and some are far.
#[inline]
fn importance(bounds: &Aabb, power: f64, point: Vec3) -> f64 {
    let (min, max) = (bounds.min.as_dvec3(), bounds.max.as_dvec3());
    let away = (min + max) * 0.5 - point.as_dvec3();
    power / away.length_squared().max((max - min).length_squared() * 0.25)
}
