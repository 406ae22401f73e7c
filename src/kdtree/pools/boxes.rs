//! The way to the pools: eight boxes at a time.
//!
//! A ray that walks a kd-tree by itself has to cross each plane in its way to learn that nothing is beyond. A box around what a
//! subtree holds says that at once. So between the root and the pools lie nodes of eight boxes, each around one of the
//! subtrees that a node's subtree is cut into; a ray meets all eight together (Wald, Benthin & Boulos, "Getting rid of packets",
//! 2008). Which parts those are is planned ahead ([`wide`](super::wide)).
//!
//! ```text
//!                 +---------------------------+---------------------------+----- ... -----+
//! faces           | least x of eight boxes    | greatest x                | y, then z     |    192 bytes
//!                 +---------------------------+---------------------------+----- ... -----+
//! ways            | of eight boxes            |                                              32 bytes
//! orders          | for each of eight octants |                                              32 bytes
//!                 +---------------------------+
//!
//!                  31                            0
//!                 +---+---------------------------+
//! way             | 1 | ! first word of a pool    |    (-1 is no pool's, as no pool begins at word 0)
//!                 | 0 | number of a node          |
//!                 +---+---------------------------+
//! ```
//!
//! **Which box is nearest** is not asked of each ray. An *order* has four bits for each lane, the farthest first, that tell which
//! box comes there for rays that run into an octant: of two parts of the hierarchy the one comes first that lies
//! first along the axis across which they were cut. Boxes may overlap, so that is a guess, a good one mostly; and rays go
//! on until nothing that is left begins before what they have found.

use super::MAX_WORD;
use super::wide::Shares;
use crate::geometry::Aabb;
use crate::huge;
use crate::kdtree::Node;
use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// Eight boxes.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(64))]
pub struct Boxes {
    /// For each axis the least coordinates, and the greatest. A box that is not there begins at infinity and ends at the
    /// other.
    pub faces: [[[f32; 8]; 2]; 3],
    /// [`Way`]s to what is in them. From a box that is not there, the way to [nothing](Way::NOTHING).
    pub ways: [i32; 8],
    /// By octant, bit 0 of which is set for rays that run downward along x, and so on.
    pub orders: [u32; 8],
}

impl Boxes {
    /// One of the boxes; an empty one if it is not there.
    pub fn bounds(&self, lane: usize) -> Aabb {
        let [min, max] = [0, 1].map(|side| Vec3::from_array(self.faces.map(|faces| faces[side][lane])));
        Aabb { min, max }
    }

    /// Which box comes at each place, the farthest first, for rays that run into an octant.
    #[inline(always)]
    pub fn lanes(&self, octant: usize) -> [usize; 8] {
        let order = self.orders[octant & 7];
        [0, 4, 8, 12, 16, 20, 24, 28].map(|shift| (order >> shift & 7) as usize)
    }
}

/// The way to what is in a box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Way(pub i32);

impl Way {
    /// The way to the root.
    pub const ROOT: Self = Self(0);

    /// The way to a pool without triangles, which lies before all others.
    pub const NOTHING: Self = Self::to_pool(1);

    /// The way to a pool, by its first word, which is not 0.
    pub const fn to_pool(word: usize) -> Self {
        assert!(0 < word && word <= MAX_WORD);
        Self(!(word as i32))
    }

    /// Whether it leads to a pool. Otherwise it leads to a node.
    #[inline(always)]
    pub const fn is_pool(self) -> bool {
        self.0 < 0
    }

    /// The way to a chunk so many words further on.
    #[inline(always)]
    pub const fn further(self, words: usize) -> Self {
        Self(self.0.wrapping_sub(words as i32))
    }

    /// The pool's first word.
    #[inline(always)]
    pub const fn word(self) -> usize {
        !self.0 as usize
    }

    /// The node's number.
    #[inline(always)]
    pub const fn node(self) -> usize {
        self.0 as usize
    }
}

/// Nodes of eight boxes for a hierarchy whose leaves name the first words of their pools; boxes by node, and how they are shared out.
/// The root is the first; others lie in the order of a depth-first walk that takes larger boxes first.
pub fn pack(nodes: &[Node], boxes: &[Aabb], shares: &[Shares]) -> Vec<Boxes> {
    let mut packed: Vec<Boxes> = Vec::new();
    // Inner nodes of the hierarchy, and from where they are led to.
    let mut stack = vec![(0, None)];
    while let Some((index, from)) = stack.pop() {
        let number = packed.len();
        if let Some((parent, lane)) = from {
            let parent: &mut Boxes = &mut packed[parent];
            parent.ways[lane] = number as i32;
        }
        let cut = Cut::below(index, nodes, shares);
        let (node, mut inner) = cut.node(nodes, boxes);
        packed.push(node);
        inner.sort_by(|&(a, _), &(b, _)| boxes[a].area().total_cmp(&boxes[b].area()));
        stack.extend(inner.into_iter().map(|(index, lane)| (index, Some((number, lane)))));
    }
    let mut all = huge::room_for(packed.len());
    all.extend_from_slice(&packed);
    all
}

/// What a subtree is cut into: all of it first, and parts behind those that they are halves of.
struct Cut(Vec<Part>);

/// A part of a subtree.
#[derive(Clone, Copy)]
enum Part {
    /// A node of the hierarchy, for one box.
    Whole(usize),
    /// Two parts, one behind the other along an axis.
    Halves { axis: usize, low: usize, high: usize },
}

impl Cut {
    /// Boxes are shared out as is planned.
    fn below(index: usize, nodes: &[Node], shares: &[Shares]) -> Self {
        let mut parts = vec![Part::Whole(index)];
        // Parts that are cut, and how many boxes their halves get.
        let mut stack = Vec::new();
        if !nodes[index].is_leaf() {
            stack.push((0, index, shares[index].of_node()));
        }
        while let Some((place, index, halves)) = stack.pop() {
            let (low, below) = (parts.len(), nodes[index].below() as usize);
            parts.extend([Part::Whole(below), Part::Whole(below + 1)]);
            parts[place] = Part::Halves { axis: nodes[index].axis(), low, high: low + 1 };
            for (half, boxes) in halves.into_iter().enumerate() {
                let shared_out = shares[below + half].of_boxes(boxes);
                stack.extend(shared_out.map(|halves| (low + half, below + half, halves)));
            }
        }
        Self(parts)
    }

    /// The node, in which ways to other nodes are not filled in; and the inner nodes of the hierarchy that those lead to, with
    /// their lanes.
    fn node(&self, nodes: &[Node], boxes: &[Aabb]) -> (Boxes, Vec<(usize, usize)>) {
        let mut node = Boxes {
            faces: [[[f32::INFINITY; 8], [f32::NEG_INFINITY; 8]]; 3],
            ways: [Way::NOTHING.0; 8],
            orders: [0; 8],
        };
        let mut lanes = Vec::with_capacity(8);
        self.visit(0, 0, &mut |index| lanes.push(index));
        let mut inner = Vec::new();
        for (lane, &index) in lanes.iter().enumerate() {
            let Aabb { min, max } = boxes[index];
            for axis in 0..3 {
                (node.faces[axis][0][lane], node.faces[axis][1][lane]) = (min[axis], max[axis]);
            }
            match nodes[index].is_leaf() {
                true => node.ways[lane] = Way::to_pool(nodes[index].references().start).0,
                false => inner.push((index, lane)),
            }
        }
        for (octant, order) in node.orders.iter_mut().enumerate() {
            let mut place = lanes.len();
            self.visit(0, octant, &mut |index| {
                let lane =
                    lanes.iter().position(|&other| other == index).expect("parts are the same in all orders");
                place -= 1;
                *order |= (lane as u32) << (4 * place);
            });
            for place in lanes.len()..8 {
                *order |= (place as u32) << (4 * place);
            }
        }
        (node, inner)
    }

    /// Visits the parts that are not cut in the order in which rays into an octant come to them.
    fn visit(&self, place: usize, octant: usize, visit: &mut impl FnMut(usize)) {
        match self.0[place] {
            Part::Whole(index) => visit(index),
            Part::Halves { axis, low, high } => {
                let runs_down = octant >> axis & 1 == 1;
                let [first, second] = if runs_down { [high, low] } else { [low, high] };
                self.visit(first, octant, visit);
                self.visit(second, octant, visit);
            }
        }
    }
}
