//! The tile kernel: up to 256 rays from one point walk the tree together.
//!
//! Neighbouring rays of a picture visit the same nodes and miss the same triangles. So what a packet
//! does for its rays, this kernel does for packets: each lane stands for one of sixteen packets, by
//! *intervals* that hold what all of its rays do (multi-level ray tracing: Reshetov, Soupikov & Hurley
//! 2005; interval traversal: Boulos, Wald & Benthin 2008). In order:
//!
//! 1. `beam`: the rays are made a beam; that decides whether they are alike enough at all.
//! 2. `walk` (here): the beam descends the *upper tree*, whose leaves are pages of some fifty
//!    triangles, near cells first.
//! 3. `outline`: of a page's triangles, sixteen at a time, those that no ray can hit are culled: first
//!    for the whole beam, then for single packets.
//! 4. `leaf`: what is left is tested by the mode's own test, sixteen rays against one triangle, as the
//!    packet kernel does, and so with the same answers to the bit.
//! 5. Where no more than [`FEW`] packets of the beam are left at a node, each goes on alone as a
//!    packet through the full tree below; and so does every packet, from the start, of a tile that has
//!    taken so much work that its rays cannot be alike.

mod beam;
mod leaf;
mod outline;
mod probe;

pub use beam::PACKETS;
pub use probe::{Probe, TileCounts};

use super::lanes::{HitPacket, RayPacket};
use super::stack::Stack;
use super::walk::Interval;
use crate::geometry::triangle::Mode;
use crate::kdtree::Tree;
use crate::simd::{Lanes, Mask, Simd};
use beam::Beam;
use leaf::{Tile, WORK};

/// So many packets, or fewer, go on alone.
const FEW: u32 = 1;

/// A subtree that waits for its turn, with the packets' depths in it.
#[derive(Clone, Copy)]
struct Waiting<L> {
    place: usize,
    interval: Interval<L>,
}

/// The closest hits of the lanes in `active` of up to sixteen packets; the others come out as misses.
/// `false`, and nothing done, if the rays are no beam.
#[inline(always)]
pub fn intersect<S: Simd, T: Tree, M: Mode, P: Probe>(
    tree: &T,
    records: &[M::Record],
    rays: &[RayPacket<16>],
    active: &[u32; PACKETS],
    hits: &mut [HitPacket<16>],
    probe: &mut P,
) -> bool {
    let Some((beam, interval)) = beam::<S::F16, T>(tree, rays, active) else { return false };
    if S::NATIVE == 16 {
        let mut tile = Tile::<_, S::F16, T, M, 16, false>::new(tree, records, rays, active, &beam);
        walk(&mut tile, interval, probe);
        for (packet, hits) in hits.iter_mut().enumerate() {
            tile.give(packet, hits);
        }
    } else {
        let mut tile = Tile::<_, S::F8, T, M, 8, false>::new(tree, records, rays, active, &beam);
        walk(&mut tile, interval, probe);
        for (packet, hits) in hits.iter_mut().enumerate() {
            tile.give(packet, hits);
        }
    }
    true
}

/// The lanes in `active` that hit anything, packet by packet. `false`, and nothing done, if the rays
/// are no beam.
#[inline(always)]
pub fn occluded<S: Simd, T: Tree, M: Mode>(
    tree: &T,
    records: &[M::Record],
    rays: &[RayPacket<16>],
    active: &[u32; PACKETS],
    found: &mut [u32],
) -> bool {
    let Some((beam, interval)) = beam::<S::F16, T>(tree, rays, active) else { return false };
    if S::NATIVE == 16 {
        let mut tile = Tile::<_, S::F16, T, M, 16, true>::new(tree, records, rays, active, &beam);
        walk(&mut tile, interval, &mut ());
        for (packet, found) in found.iter_mut().enumerate() {
            *found = tile.found(packet);
        }
    } else {
        let mut tile = Tile::<_, S::F8, T, M, 8, true>::new(tree, records, rays, active, &beam);
        walk(&mut tile, interval, &mut ());
        for (packet, found) in found.iter_mut().enumerate() {
            *found = tile.found(packet);
        }
    }
    true
}

/// The beam of rays that are alike enough, and its depths inside of the tree's bounds.
#[inline(always)]
fn beam<L: Lanes<16>, T: Tree>(
    tree: &T,
    rays: &[RayPacket<16>],
    active: &[u32; PACKETS],
) -> Option<(Beam<L>, Interval<L>)> {
    if tree.scale().is_none() { Beam::new(rays, active, tree.bounds()) } else { None }
}

/// Walks the upper tree with all packets of a tile.
#[inline(always)]
fn walk<L, R, T, M, P, const N: usize, const ANY: bool>(
    tile: &mut Tile<'_, L, R, T, M, N, ANY>,
    mut interval: Interval<L>,
    probe: &mut P,
) where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Tree,
    M: Mode,
    P: Probe,
{
    let (tree, beam) = (tile.tree, tile.beam);
    let mut live = interval.live().bits();
    if live == 0 {
        return;
    }
    let start = interval;
    let mut place = 0;
    let mut node = tree.upper(place);
    let mut stack = Stack::new();
    loop {
        // Descend to a page, leaving far children on the stack.
        let mut nodes = 0;
        loop {
            nodes += 1;
            probe.node(live.count_ones());
            if node.is_leaf() {
                tile.visit(tree.page(node), &interval, live, probe);
                break;
            }
            if live.count_ones() <= FEW {
                probe.alone(live.count_ones());
                let (tmin, tmax) = (interval.tmin.store(), interval.tmax.store());
                while live != 0 {
                    let packet = live.trailing_zeros() as usize & 15;
                    live &= live - 1;
                    tile.go_alone(packet, place, tmin[packet], tmax[packet]);
                }
                break;
            }
            let crossing = beam.crossing(node.axis(), node.split());
            let near = Interval { tmin: interval.tmin, tmax: crossing.leave.min(interval.tmax) };
            let far = Interval { tmin: crossing.enter.max(interval.tmin), tmax: interval.tmax };
            let (in_near, in_far) = (near.live().bits(), far.live().bits());
            let below = node.below() as usize;
            let (near_place, far_place) = (below + crossing.near, below + (1 - crossing.near));
            if in_far == 0 {
                // Whoever was live still is: the near cell holds all that is left.
                place = near_place;
            } else if in_near == 0 {
                place = far_place;
            } else {
                stack.push(Waiting { place: far_place, interval: far });
                (place, interval, live) = (near_place, near, in_near);
            }
            node = tree.upper(place);
        }

        // Where it does not pay, each packet goes on alone from the start, with what was found as its bound.
        tile.work += nodes;
        if tile.work > WORK {
            let (tmin, tmax) = (start.tmin.store(), L::load(&tile.reach).min(start.tmax).store());
            let packets = start.live().bits();
            probe.alone(packets.count_ones());
            for packet in (0..PACKETS).filter(|packet| packets >> packet & 1 == 1) {
                tile.go_alone(packet, 0, tmin[packet], tmax[packet]);
            }
            return;
        }

        // Take up the next subtree that some packet can still find something nearer in.
        loop {
            let Some(next) = stack.pop() else { return };
            let tmax = L::load(&tile.reach).min(next.interval.tmax);
            interval = Interval { tmin: next.interval.tmin, tmax };
            live = interval.live().bits();
            if live != 0 {
                place = next.place;
                break;
            }
        }
        node = tree.upper(place);
    }
}
