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

use super::closest::{Closest, Normals};
use super::lanes::{HitPacket, RayPacket};
use super::range::{adapt, is_ordinary};
use super::records::Records;
use super::sieve::sift;
use super::stack::Stack;
use super::walk::{Heading, Interval, Walk, load3};
use crate::geometry::triangle::{Mode, Test};
use crate::kdtree::Node;
use crate::simd::{Lanes, Mask, stay_a_branch};

/// A subtree that waits for its turn, with the lanes' intervals in it.
#[derive(Clone, Copy)]
struct Waiting<L> {
    node: Node,
    interval: Interval<L>,
}

/// The closest hit of every lane in `active`.
#[inline(always)]
pub fn intersect<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode>(
    tree: &T,
    rays: &RayPacket<W>,
    active: u32,
) -> HitPacket<W> {
    let adapted = (!is_ordinary::<W, L>(rays, active, tree.scale())).then(|| adapt(rays, tree.scale()));
    let traced = adapted.as_ref().map_or(rays, |adapted| &adapted.rays);
    let mut hits =
        walk::<W, L, T, M, false>(tree, traced, active).records::<T, M, 1>(tree, None, &mut Normals::new());
    if let Some(adapted) = adapted {
        adapted.undo(rays, &mut hits, tree);
    }
    hits
}

/// The lanes in `active` that hit anything.
#[inline(always)]
pub fn occluded<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode>(
    tree: &T,
    rays: &RayPacket<W>,
    active: u32,
) -> u32 {
    let adapted = (!is_ordinary::<W, L>(rays, active, tree.scale())).then(|| adapt(rays, tree.scale()));
    let rays = adapted.as_ref().map_or(rays, |adapted| &adapted.rays);
    walk::<W, L, T, M, true>(tree, rays, active).found() & active
}

/// Walks the tree; with `ANY`, a lane is done at its first hit.
#[inline(always)]
fn walk<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode, const ANY: bool>(
    tree: &T,
    rays: &RayPacket<W>,
    active: u32,
) -> Closest<W, L> {
    let (walk, interval) = Walk::<W, L>::new(rays, active, tree.bounds());
    let mut closest = Closest::new(L::load(&rays.tfar));
    let live = interval.live().bits();
    if live != 0 {
        let test = M::Test::<W, L>::new(&load3(&rays.origin), &load3(&rays.direction), live);
        let tnear = L::load(&rays.tnear);
        descend::<W, L, T, M, ANY>(tree, &walk, &test, tnear, tree.root(), interval, &mut closest);
    }
    closest
}

/// Walks the subtree under `node`, in which the lanes are in `interval`. Some lane must be live.
#[inline(always)]
pub fn descend<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode, const ANY: bool>(
    tree: &T,
    walk: &Walk<W, L>,
    test: &M::Test<W, L>,
    tnear: L,
    mut node: Node,
    mut interval: Interval<L>,
    closest: &mut Closest<W, L>,
) {
    let mut stack = Stack::new();
    loop {
        // Descend to a leaf, leaving farther children on the stack.
        while !node.is_leaf() {
            let axis = node.axis();
            let [below, above] = tree.children(node);
            let wall = walk.crossing(axis, node.split());
            let parts = walk.cut(&interval, &wall);
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
                tree.fetch_children(second);
                stack.push(Waiting { node: second, interval: second_part });
                (node, interval) = (first, first_part);
            } else if enters_first {
                // Where no lane enters one of the cells, the other's intervals are the parent's.
                stay_a_branch();
                node = first;
            } else {
                node = second;
            }
        }

        // Test the leaf's triangles against the lanes that are live in it.
        tree.enter_leaf(node);
        let primitives = tree.primitives(node);
        if !primitives.is_empty() {
            // Neighbouring packets find them in the caches only where triangles are large.
            for &primitive in primitives {
                tree.fetch(primitive);
            }
            test_leaf::<W, L, T, M, ANY>(tree, primitives, test, tnear, interval.live(), closest, true);
        }

        // Take up the next subtree that some lane can still find something nearer in. Its
        // interval begins before its wall, so a hit in the wall does not hide the cell behind.
        loop {
            let Some(next) = stack.pop() else { return };
            interval = Interval { tmin: next.interval.tmin, tmax: next.interval.tmax.min(closest.t) };
            if interval.live().any() {
                node = next.node;
                break;
            }
        }
    }
}

/// Tests a leaf's triangles against the lanes in `live`; `weights` says whether the hits' are kept.
#[inline(always)]
pub fn test_leaf<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode, const ANY: bool>(
    tree: &T,
    primitives: &[u32],
    test: &M::Test<W, L>,
    tnear: L,
    live: L::Mask,
    closest: &mut Closest<W, L>,
    weights: bool,
) {
    for &primitive in primitives {
        let mut candidate = test.test(tree.record_of(primitive), live);
        if T::SIFTS {
            sift::<W, L, T, M>(tree, &mut candidate, primitive, [tnear, closest.t], live);
        }
        closest.take::<ANY>(&candidate, primitive, tnear, live, weights);
    }
}
