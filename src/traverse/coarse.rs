//! What can be said of a ray without a triangle: which cells it goes through.

use crate::cache::Cached;
use crate::geometry::Ray;
use crate::kdtree::{MAX_DEPTH, Node};
use glam::Vec3;
use std::ops::ControlFlow;

/// Where a ray enters a page's cell.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Entry {
    /// The ray's parameter.
    pub t: f32,
    /// The axis that the face is across.
    pub axis: usize,
}

/// A part of the tree that waits for its turn.
#[derive(Clone, Copy)]
struct Waiting {
    place: usize,
    entry: Entry,
    exit: f32,
}

/// A ray's way through a box, in the tree's coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Way {
    origin: Vec3,
    direction: Vec3,
    /// Where it enters the box, or begins in it: no face then, and axis 3.
    pub entry: Entry,
    /// The ray's parameter where it leaves the box, or ends.
    pub exit: f32,
}

impl Way {
    /// A ray's way through the whole scene; `None` if it misses it.
    pub fn through(cached: &Cached, ray: &Ray) -> Option<Self> {
        let factor = cached.scale().factor() as f32;
        let (origin, direction) = (ray.origin * factor, ray.direction * factor);
        let (mut entry, mut exit) = (Entry { t: ray.tnear, axis: 3 }, ray.tfar);
        for axis in 0..3 {
            let (low, high) = (cached.bounds().min[axis], cached.bounds().max[axis]);
            if direction[axis] == 0.0 {
                if !(low..=high).contains(&origin[axis]) {
                    return None;
                }
                continue;
            }
            let [near, far] = [low, high].map(|face| (face - origin[axis]) / direction[axis]);
            let (near, far) = if near <= far { (near, far) } else { (far, near) };
            if near > entry.t {
                entry = Entry { t: near, axis };
            }
            exit = exit.min(far);
        }
        // Of a NaN this says no.
        let meets = entry.t <= exit;
        meets.then_some(Self { origin, direction, entry, exit })
    }

    /// The leaves that the way goes through, nearer ones first, from the node at `root` on, the cell of which is the
    /// box: `leaf` is told each one's place, the leaf, and the way through it, and says whether to go on. `node` gives
    /// the node at a place, whose children are at `below()` and the next place; where it gives none, all ends.
    ///
    /// Allocates nothing.
    pub fn leaves(
        self,
        root: usize,
        mut node: impl FnMut(usize) -> Option<Node>,
        mut leaf: impl FnMut(usize, Node, Self) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let Self { origin, direction, entry, exit } = self;
        let mut stack = [Waiting { place: root, entry, exit }; MAX_DEPTH + 1];
        let mut height = 1;
        while height > 0 {
            height -= 1;
            let Waiting { mut place, entry, mut exit } = stack[height];
            // Down to a leaf, nearer children first.
            loop {
                let Some(node) = node(place) else { return ControlFlow::Break(()) };
                if node.is_leaf() {
                    leaf(place, node, Self { entry, exit, ..self })?;
                    break;
                }
                let (axis, below) = (node.axis(), node.below() as usize);
                let is_below =
                    origin[axis] < node.split() || origin[axis] == node.split() && direction[axis] <= 0.0;
                let (near, far) = if is_below { (below, below + 1) } else { (below + 1, below) };
                let wall = (node.split() - origin[axis]) / direction[axis];
                // Behind the origin, beyond the interval, or NaN where the ray runs along the plane: only one side.
                let crosses = wall > 0.0 && wall < exit;
                if !crosses {
                    place = near;
                } else if wall <= entry.t {
                    place = far;
                } else {
                    if height <= MAX_DEPTH {
                        stack[height] = Waiting { place: far, entry: Entry { t: wall, axis }, exit };
                        height += 1;
                    }
                    (place, exit) = (near, wall);
                }
            }
        }
        ControlFlow::Continue(())
    }
}

/// Where a ray enters the first page's cell, in the upper tree of a scene that is in memory in part; `None` if
/// it enters none. The cell that it begins in does not count: nobody could see anything else.
///
/// Cells are larger than what is in them, by up to half in each direction: this is for a first impression.
/// Needs no block, never waits, and allocates nothing.
pub fn first_page(cached: &Cached, ray: &Ray) -> Option<Entry> {
    let mut first = None;
    let upper = |place: usize| Some(cached.upper()[place]);
    // It stops at the first.
    let _ = Way::through(cached, ray)?.leaves(0, upper, |_, page, way| {
        if page.references().is_empty() || way.entry.axis == 3 {
            return ControlFlow::Continue(());
        }
        first = Some(way.entry);
        ControlFlow::Break(())
    });
    first
}
