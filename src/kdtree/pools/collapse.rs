//! Which subtrees are leaves where sixteen triangles cost no more than one.
//!
//! From the leaves up, a subtree of few triangles becomes a leaf if its chunks, met by every ray that comes to its cell,
//! cost less than its planes and what lies between them (the surface-area heuristic). Triangles that several of its leaves
//! named are named once then, so that there is less to keep, too.

use super::chunk::{self, MOST};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::Node;
use crate::kdtree::pages::sort_and_dedup;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

/// What a plane costs a ray, where a chunk costs 1: a third of what a node of eight boxes does, which stands for three levels.
/// (Half or twice as much makes no difference that can be measured.)
const PLANE: f64 = 0.06;

/// Levels whose subtrees are looked at side by side.
const PARALLEL_DEPTH: usize = 12;

/// A tree that was looked at.
pub struct Source<'a> {
    pub nodes: &'a [Node],
    pub references: &'a [u32],
    pub triangles: &'a [Triangle],
}

/// A tree whose leaves name their triangles in `ids`, each leaf's in ascending order.
pub struct Collapsed {
    pub nodes: Vec<Node>,
    pub ids: Vec<u32>,
}

/// What is known of a subtree.
struct Subtree {
    /// What it costs, times the area of its cell.
    cost: f64,
    /// Its triangles, each once, if they are few enough for one leaf.
    few: Option<Few>,
}

/// Up to sixteen ids in ascending order.
#[derive(Clone, Copy)]
struct Few {
    ids: [u32; MOST],
    count: usize,
}

impl Few {
    fn ids(&self) -> &[u32] {
        &self.ids[..self.count]
    }

    /// Those of both, each once, if they are few.
    fn with(&self, other: &Self) -> Option<Self> {
        let (mut a, mut b) = (self.ids(), other.ids());
        let mut both = Self { ids: [0; MOST], count: 0 };
        while let Some(&id) = a.first().into_iter().chain(b.first()).min() {
            a = a.strip_prefix(&[id]).unwrap_or(a);
            b = b.strip_prefix(&[id]).unwrap_or(b);
            *both.ids.get_mut(both.count)? = id;
            both.count += 1;
        }
        Some(both)
    }
}

impl Source<'_> {
    /// The tree with its leaves as large as they should be.
    pub fn collapse(&self, bounds: &Aabb) -> Collapsed {
        let leaves: Vec<AtomicBool> = self.nodes.iter().map(|_| AtomicBool::new(false)).collect();
        self.look_at(0, bounds, 0, &leaves);
        self.cut(&leaves)
    }

    /// Marks what is to be a leaf under a node.
    fn look_at(&self, index: usize, cell: &Aabb, depth: usize, leaves: &[AtomicBool]) -> Subtree {
        let node = self.nodes[index];
        if node.is_leaf() {
            leaves[index].store(true, Relaxed);
            let mut ids = self.references[node.references()].to_vec();
            ids.sort_unstable();
            let mut few = Few { ids: [0; MOST], count: ids.len() };
            let is_few = ids.len() <= MOST;
            if is_few {
                few.ids[..ids.len()].copy_from_slice(&ids);
            }
            return Subtree { cost: self.cost_of_leaf(&ids, cell), few: is_few.then_some(few) };
        }
        let below = node.below() as usize;
        let [low, high] = cell.halves(node.axis(), node.split());
        let low = || self.look_at(below, &low, depth + 1, leaves);
        let high = || self.look_at(below + 1, &high, depth + 1, leaves);
        let (low, high) = if depth < PARALLEL_DEPTH { rayon::join(low, high) } else { (low(), high()) };
        let cost = PLANE * cell.area() + low.cost + high.cost;
        let few = low.few.zip(high.few).and_then(|(low, high)| low.with(&high));
        let as_leaf = few.map_or(f64::INFINITY, |few| self.cost_of_leaf(few.ids(), cell));
        leaves[index].store(as_leaf <= cost, Relaxed);
        Subtree { cost: cost.min(as_leaf), few }
    }

    fn cost_of_leaf(&self, ids: &[u32], cell: &Aabb) -> f64 {
        chunk::count(ids, self.triangles) as f64 * cell.area()
    }

    /// The tree cut off at what was marked, siblings side by side.
    fn cut(&self, leaves: &[AtomicBool]) -> Collapsed {
        let nothing = Node::leaf(0, 0);
        let mut cut = Collapsed { nodes: vec![nothing; 2], ids: Vec::new() };
        let mut stack = vec![(0, 0)];
        while let Some((index, place)) = stack.pop() {
            let node = self.nodes[index];
            if leaves[index].load(Relaxed) {
                let first = cut.ids.len();
                self.gather(index, &mut cut.ids);
                sort_and_dedup(&mut cut.ids, first);
                cut.nodes[place] = Node::leaf(first, cut.ids.len() - first);
            } else {
                let below = cut.nodes.len();
                cut.nodes.extend([nothing; 2]);
                cut.nodes[place] = Node::inner(node.axis(), node.split(), below);
                let from = node.below() as usize;
                stack.extend([(from + 1, below + 1), (from, below)]);
            }
        }
        cut
    }

    /// Adds all references of a subtree.
    fn gather(&self, index: usize, ids: &mut Vec<u32>) {
        let node = self.nodes[index];
        if node.is_leaf() {
            ids.extend_from_slice(&self.references[node.references()]);
        } else {
            self.gather(node.below() as usize, ids);
            self.gather(node.below() as usize + 1, ids);
        }
    }
}
