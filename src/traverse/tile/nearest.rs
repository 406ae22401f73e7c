//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, load_part, load_part3};
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::Lanes;
use crate::simd::Mask;
use crate::traverse::closest::Closest;
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk};

/// Most parts that sixteen packets are traced in: halves, where registers hold eight lanes.
const PARTS: usize = 2 * PACKETS;

/// What the tests of `N` rays keep for a beam.
type Kept<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Kept;

/// A triangle as the tests see it from a beam's apex.
type Placed<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Placed;

/// Up to sixteen packets.
///
/// Packets stand in the lanes of `L`, as the beam has them. Rays stand in the lanes of `R`, as many as a
/// register holds: part `i` of packet `p` is at `p * (16 / N) + i`.
pub struct Nearest<'a, L, R, T, M, const N: usize>
where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [u32; PACKETS],
    beam: &'a Beam<L, false>,
    kept: [Kept<M, R, N>; PARTS],
    closest: [Closest<N, R>; PARTS],
    /// The depth beyond which no ray of a packet looks for anything any more.
    reach: [f32; PACKETS],
    /// The block's triangles that are left.
    placed: [Placed<M, R, N>; 16],
}

impl<'a, L, R, T, M, const N: usize> Nearest<'a, L, R, T, M, N>
where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    /// The rays at their start.
    #[inline(always)]
    pub fn new(
        tree: &'a T,
        rays: &'a [RayPacket<16>],
        active: &'a [u32; PACKETS],
        beam: &'a Beam<L, false>,
    ) -> Self {
        let mut bundle = Self {
            tree,
            rays,
            active,
            beam,
            kept: [Default::default(); PARTS],
            closest: [Closest::new(R::splat(f32::NEG_INFINITY)); PARTS],
            reach: [f32::INFINITY; PACKETS],
            placed: [Default::default(); 16],
        };
        for packet in 0..rays.len().min(PACKETS) {
            for part in 0..16 / N {
                let rays = &rays[packet];
                let place = packet * (16 / N) + part;
                let direction = load_part3::<N, R>(&rays.direction, part);
                bundle.kept[place] = M::Test::<N, R>::keep(&direction, beam.frame.axes[2]);
                // Lanes that do not count have found what they look for.
                let tfar = R::select(
                    bundle.counts(packet, part),
                    load_part::<N, R>(&rays.tfar, part),
                    R::splat(f32::NEG_INFINITY),
                );
                bundle.closest[place] = Closest::new(tfar);
            }
        }
        bundle
    }

    /// The lanes of a part that count.
    #[inline(always)]
    fn counts(&self, packet: usize, part: usize) -> R::Mask {
        R::mask_from_bits(self.active[packet] >> (part * N) & ((1 << N) - 1))
    }

    /// A part's test.
    #[inline(always)]
    fn part_test(&self, packet: usize, part: usize) -> M::Test<N, R> {
        let direction = load_part3::<N, R>(&self.rays[packet].direction, part);
        let kept = &self.kept[packet * (16 / N) + part];
        M::Test::<N, R>::revive(kept, &self.beam.frame.apex, &direction, self.beam.frame.axes[2])
    }

    /// Writes a packet's hits.
    #[inline(always)]
    pub fn give(&self, packet: usize, hits: &mut HitPacket<16>) {
        for part in 0..16 / N {
            let test = self.part_test(packet, part);
            let again = if M::Test::<N, R>::DEFERS { Some(&test) } else { None };
            let found = self.closest[packet * (16 / N) + part].records::<T, M>(self.tree, again);
            hits.set_part(part, &found);
        }
    }

    /// Draws a packet's reach in to what its rays still look for.
    #[inline(always)]
    fn shorten(&mut self, packet: usize) {
        let mut reach = f32::NEG_INFINITY;
        for part in 0..16 / N {
            let speed = load_part::<N, R>(&self.rays[packet].direction[self.beam.frame.axes[2]], part).abs();
            let depth = (self.closest[packet * (16 / N) + part].t * speed).greatest();
            reach = if depth > reach { depth } else { reach };
        }
        self.reach[packet] = reach + reach.abs() * ROUNDINGS;
    }
}

impl<L, R, T, M, const N: usize> Bundle<L> for Nearest<'_, L, R, T, M, N>
where
    L: Lanes<16>,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    // Half of this lost up to 7 % in interiors, and twice as much gained 3 % there and lost 10 % among small
    // triangles.
    const PATIENCE: u32 = 5120;

    #[inline(always)]
    fn reach(&self) -> L {
        L::load(&self.reach)
    }

    #[inline(always)]
    fn place(&mut self, lane: usize, primitive: u32, block: &Block) {
        let frame = &self.beam.frame;
        let record = self.tree.record_of(primitive);
        self.placed[lane & 15] =
            M::Test::<N, R>::place(record, &frame.apex, frame.axes[2], frame.sign, &block.edges_of(lane));
    }

    #[inline(always)]
    fn test(&mut self, packet: usize, primitives: &[u32], chosen: u32) {
        let packet = packet & 15;
        let mut changed = false;
        for part in 0..16 / N {
            let test = self.part_test(packet, part);
            let place = packet * (16 / N) + part;
            let mut closest = self.closest[place];
            let tnear = load_part::<N, R>(&self.rays[packet].tnear, part);
            let live = self.counts(packet, part);
            let mut part_changed = false;
            for triangle in bits(chosen) {
                let primitive = primitives[triangle];
                let placed = &self.placed[triangle & 15];
                let candidate = test.test_placed(self.tree.record_of(primitive), placed, live);
                part_changed |=
                    closest.take::<false>(&candidate, primitive, tnear, live, !M::Test::<N, R>::DEFERS);
            }
            if part_changed {
                self.closest[place] = closest;
            }
            changed |= part_changed;
        }
        if changed {
            self.shorten(packet);
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: usize, place: usize, tmin: f32, tmax: f32) {
        let mut changed = false;
        for part in 0..16 / N {
            let rays = self.rays[packet].part::<N>(part);
            let active = self.active[packet] >> (part * N) & ((1 << N) - 1);
            let (walk, inside) = Walk::<N, R>::new(&rays, active, self.tree.bounds());
            let speed = R::load(&rays.direction[self.beam.frame.axes[2]]).abs();
            let mut closest = self.closest[packet * (16 / N) + part];
            let interval = Interval {
                tmin: (R::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
                tmax: (R::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(closest.t),
            };
            if interval.live().any() {
                let test = self.part_test(packet, part);
                let tnear = R::load(&rays.tnear);
                let node = self.tree.beneath(place);
                descend::<N, R, T, M, false>(self.tree, &walk, &test, tnear, node, interval, &mut closest);
                self.closest[packet * (16 / N) + part] = closest;
                changed = true;
            }
        }
        if changed {
            self.shorten(packet);
        }
    }
}
