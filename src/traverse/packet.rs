//! The packet kernel: `W` rays walk the tree together (Wald 2004), whatever their directions
//! (Reshetov, "Omnidirectional Ray Tracing Traversal Algorithm for kd-trees", 2006).
//!
//! Every lane carries its own interval of the parameter; a lane whose interval in a cell is
//! empty sleeps there. Where all lanes run the same way along an axis, the nearer child is the
//! same for all; where they do not, each lane computes its intervals in the lower and the upper
//! child, and the child that more lanes meet first is entered first. Lanes that so come to a
//! farther cell first lose time, never a hit: a hit is the least `(t, primitive id)` of all
//! triangles met, and no cell is left out that could hold a lesser one.
//!
//! With `W = 1` and plain floats this is the single-ray kernel.

use super::lanes::{HitPacket, RayPacket};
use super::range::{adapt, is_ordinary};
use super::walk::{Heading, Interval, Walk, load3};
use crate::geometry::NO_PRIMITIVE;
use crate::geometry::triangle::{self, Mode, Test};
use crate::kdtree::{MAX_DEPTH, Node, Tree};
use crate::simd::{Lanes, Mask};
use std::mem::MaybeUninit;

/// The id of no triangle yet: greater than any, so that equal `t` lets the first hit in.
const NONE: i32 = i32::MAX;

/// The closest hits so far.
struct Closest<const W: usize, L: Lanes<W>> {
    t: L,
    u: L,
    v: L,
    primitive: L::Ids,
}

/// A subtree that waits for its turn, with the lanes' intervals in it.
#[derive(Clone, Copy)]
struct Waiting<L> {
    node: Node,
    interval: Interval<L>,
}

/// Subtrees that wait. Left uninitialised: clearing 8 KB would cost more than a short walk.
struct Stack<L> {
    entries: [MaybeUninit<Waiting<L>>; MAX_DEPTH],
    len: usize,
}

impl<L: Copy> Stack<L> {
    #[inline(always)]
    fn new() -> Self {
        Self { entries: [const { MaybeUninit::uninit() }; MAX_DEPTH], len: 0 }
    }

    /// Panics beyond `MAX_DEPTH` entries: a walk waits at most once a level.
    #[inline(always)]
    fn push(&mut self, waiting: Waiting<L>) {
        self.entries[self.len].write(waiting);
        self.len += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<Waiting<L>> {
        self.len = self.len.checked_sub(1)?;
        // SAFETY: `len` only grows in `push`, which has written every entry below it.
        Some(unsafe { self.entries[self.len].assume_init() })
    }
}

/// The closest hit of every lane in `active`. `records` holds what the mode keeps of each triangle.
#[inline(always)]
pub fn intersect<const W: usize, L: Lanes<W>, T: Tree, M: Mode>(
    tree: &T,
    records: &[M::Record],
    rays: &RayPacket<W>,
    active: u32,
) -> HitPacket<W> {
    let adapted = (!is_ordinary::<W, L>(rays, active, tree.scale())).then(|| adapt(rays, tree.scale()));
    let traced = adapted.as_ref().map_or(rays, |adapted| &adapted.rays);
    let closest = walk::<W, L, T, M, false>(tree, records, traced, active);

    // Fill in what belongs to the triangle.
    let primitive = L::ids_store(closest.primitive);
    let (t, u, v) = (closest.t.store(), closest.u.store(), closest.v.store());
    let mut hits = HitPacket::miss();
    for lane in 0..W {
        if primitive[lane] != NONE {
            let id = primitive[lane] as u32;
            let record = &records[id as usize];
            let normal = triangle::normal(tree.corners(id));
            // A zero is given out without a sign.
            let [u, v] = M::Test::<W, L>::weights(record, u[lane], v[lane]);
            (hits.t[lane], hits.u[lane], hits.v[lane]) = (t[lane] + 0.0, u + 0.0, v + 0.0);
            hits.primitive[lane] = id;
            for axis in 0..3 {
                hits.normal[axis][lane] = normal[axis];
            }
        }
    }
    if let Some(adapted) = adapted {
        adapted.undo(rays, &mut hits, tree);
    }
    hits
}

/// The lanes in `active` that hit anything.
#[inline(always)]
pub fn occluded<const W: usize, L: Lanes<W>, T: Tree, M: Mode>(
    tree: &T,
    records: &[M::Record],
    rays: &RayPacket<W>,
    active: u32,
) -> u32 {
    let adapted = (!is_ordinary::<W, L>(rays, active, tree.scale())).then(|| adapt(rays, tree.scale()));
    let rays = adapted.as_ref().map_or(rays, |adapted| &adapted.rays);
    let found = walk::<W, L, T, M, true>(tree, records, rays, active);
    !L::ids_less(L::ids(NONE - 1), found.primitive).bits() & active
}

/// Walks the tree; with `ANY`, a lane is done at its first hit.
#[inline(always)]
fn walk<const W: usize, L: Lanes<W>, T: Tree, M: Mode, const ANY: bool>(
    tree: &T,
    records: &[M::Record],
    rays: &RayPacket<W>,
    active: u32,
) -> Closest<W, L> {
    let (walk, mut interval) = Walk::<W, L>::new(rays, active, tree.bounds());
    let zero = L::splat(0.0);
    let mut closest =
        Closest { t: L::splat(f32::MAX).min(L::load(&rays.tfar)), u: zero, v: zero, primitive: L::ids(NONE) };
    let live = interval.live().bits();
    if live == 0 {
        return closest;
    }
    let test = M::Test::<W, L>::new(&load3(&rays.origin), &load3(&rays.direction), live);
    let tnear = L::load(&rays.tnear);

    let mut node = tree.root();
    let mut stack = Stack::new();
    loop {
        // Descend to a leaf, leaving farther children on the stack.
        while !node.is_leaf() {
            let axis = node.axis();
            let wall = walk.crossing(axis, node.split());
            let parts = walk.cut(&interval, &wall);
            let [below, above] = tree.children(node);
            let (first, second, [first_part, second_part]) = match walk.heading[axis] {
                Heading::Up => (below, above, parts),
                Heading::Down => (above, below, parts),
                Heading::Mixed => {
                    let [part_below, part_above] = walk.by_place(axis, parts);
                    if walk.mostly_down[axis] {
                        (above, below, [part_above, part_below])
                    } else {
                        (below, above, [part_below, part_above])
                    }
                }
            };
            let enters_first = first_part.live().any();
            let enters_second = second_part.live().any();
            if enters_first && enters_second {
                stack.push(Waiting { node: second, interval: second_part });
                (node, interval) = (first, first_part);
            } else {
                // Where no lane enters one of the cells, the other's intervals are the parent's.
                node = if enters_first { first } else { second };
            }
        }

        // Test the leaf's triangles against the lanes that are live in it.
        let primitives = tree.primitives(node);
        if !primitives.is_empty() {
            let live = interval.live();
            for &primitive in primitives {
                let candidate = test.test(&records[primitive as usize], live);
                let mut hit = candidate.inside & live;
                if !hit.any() {
                    continue;
                }
                let id = L::ids(primitive as i32);
                let nearer = candidate.t.lt(closest.t)
                    | (candidate.t.eq(closest.t) & L::ids_less(id, closest.primitive));
                hit = hit & tnear.le(candidate.t) & nearer;
                closest.primitive = L::ids_select(hit, id, closest.primitive);
                if ANY {
                    // A lane that is done has an interval that no later cell can reach.
                    closest.t = L::select(hit, L::splat(f32::NEG_INFINITY), closest.t);
                } else {
                    closest.t = L::select(hit, candidate.t, closest.t);
                    closest.u = L::select(hit, candidate.u, closest.u);
                    closest.v = L::select(hit, candidate.v, closest.v);
                }
            }
        }

        // Take up the next subtree that some lane can still find something nearer in. Its
        // interval begins before its wall, so a hit in the wall does not hide the cell behind.
        loop {
            let Some(next) = stack.pop() else { return closest };
            interval = Interval { tmin: next.interval.tmin, tmax: next.interval.tmax.min(closest.t) };
            if interval.live().any() {
                node = next.node;
                break;
            }
        }
    }
}

/// A hit's id as the library gives it.
const _: () = assert!(NO_PRIMITIVE > NONE as u32);
