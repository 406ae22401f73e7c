//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, load_part, load_part3};
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Lanes, Mask, Sixteen};
use crate::traverse::closest::Closest;
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk};

/// What the tests of `N` rays keep for a beam.
type Kept<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Kept;

/// Up to sixteen packets.
///
/// Packets stand in the lanes of `L`, as the beam has them. Rays stand in the lanes of `R`, as many as a
/// register holds, in `P` parts.
pub struct Nearest<'a, L, R, T, M, const N: usize, const P: usize>
where
    L: Sixteen,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [u32; PACKETS],
    beam: &'a Beam<L, false>,
    kept: [[Kept<M, R, N>; P]; PACKETS],
    closest: [[Closest<N, R>; P]; PACKETS],
    /// The depth beyond which no ray of a packet looks for anything any more. In a register: a lane that is stored
    /// by itself and loaded with the others at once waits for the memory.
    reach: L,
}

impl<'a, L, R, T, M, const N: usize, const P: usize> Nearest<'a, L, R, T, M, N, P>
where
    L: Sixteen,
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
            kept: [[Default::default(); P]; PACKETS],
            closest: [[Closest::new(R::splat(f32::NEG_INFINITY)); P]; PACKETS],
            reach: L::splat(f32::INFINITY),
        };
        for packet in 0..rays.len().min(PACKETS) {
            for part in 0..P {
                let rays = &rays[packet];
                let direction = load_part3::<N, R>(&rays.direction, part);
                bundle.kept[packet][part] = M::Test::<N, R>::keep(&direction, beam.frame.axes[2]);
                // Lanes that do not count have found what they look for.
                let tfar = R::select(
                    bundle.counts(packet, part),
                    load_part::<N, R>(&rays.tfar, part),
                    R::splat(f32::NEG_INFINITY),
                );
                bundle.closest[packet][part] = Closest::new(tfar);
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
        let kept = &self.kept[packet][part];
        M::Test::<N, R>::revive(kept, &self.beam.frame.apex, &direction, self.beam.frame.axes[2])
    }

    /// Writes a packet's hits.
    #[inline(always)]
    pub fn give(&self, packet: usize, hits: &mut HitPacket<16>) {
        for part in 0..P {
            let test = self.part_test(packet, part);
            let again = if M::Test::<N, R>::DEFERS { Some(&test) } else { None };
            let found = self.closest[packet][part].records::<T, M>(self.tree, again);
            hits.set_part(part, &found);
        }
    }

    /// Draws a packet's reach in to what its rays still look for.
    #[inline(always)]
    fn shorten(&mut self, packet: usize) {
        let mut reach = f32::NEG_INFINITY;
        for part in 0..P {
            let speed = load_part::<N, R>(&self.rays[packet].direction[self.beam.frame.axes[2]], part).abs();
            let depth = (self.closest[packet][part].t * speed).greatest();
            reach = if depth > reach { depth } else { reach };
        }
        let reach = L::splat(reach + reach.abs() * ROUNDINGS);
        self.reach = L::select(L::mask_from_bits(1 << packet), reach, self.reach);
    }
}

impl<L, R, T, M, const N: usize, const P: usize> Bundle<L> for Nearest<'_, L, R, T, M, N, P>
where
    L: Sixteen,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    // 5120 lost up to a tenth; 12288 was as good as this (sponza, armadillo, kitchen, power plant; AVX-512).
    const PATIENCE: u32 = 8192;

    // Squares of a picture are all as wide.
    const WIDEST: f32 = f32::INFINITY;

    #[inline(always)]
    fn reach(&self) -> L {
        self.reach
    }

    #[inline(always)]
    fn test(&mut self, packet: usize, block: &Block, primitives: &[u32], chosen: u32) {
        let packet = packet & 15;
        let mut changed = false;
        let [i, j, k] = self.beam.frame.axes;
        let rays = &self.rays[packet];
        for part in 0..P {
            let direction = [
                load_part::<N, R>(&rays.direction[i], part),
                load_part::<N, R>(&rays.direction[j], part),
                load_part::<N, R>(&rays.direction[k], part),
            ];
            let tnear = load_part::<N, R>(&rays.tnear, part);
            let live = self.counts(packet, part);
            for triangle in bits(chosen) {
                let (primitive, kept) = (primitives[triangle], &self.kept[packet][part]);
                // No `unwrap_or_else`: its closure might stay out of line, and be compiled without the
                // instruction set.
                let told = M::Test::<N, R>::test_placed(kept, &direction, &block.placed, triangle, live);
                let candidate = match told {
                    Some(candidate) => candidate,
                    None => self.part_test(packet, part).test(self.tree.record_of(primitive), live),
                };
                let closest = &mut self.closest[packet][part];
                changed |=
                    closest.take::<false>(&candidate, primitive, tnear, live, !M::Test::<N, R>::DEFERS);
            }
        }
        if changed {
            self.shorten(packet);
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, packet: usize, place: usize, tmin: f32, tmax: f32) {
        let mut changed = false;
        for part in 0..P {
            let rays = self.rays[packet].part::<N>(part);
            let active = self.active[packet] >> (part * N) & ((1 << N) - 1);
            let (walk, inside) = Walk::<N, R>::new(&rays, active, self.tree.bounds());
            let speed = R::load(&rays.direction[self.beam.frame.axes[2]]).abs();
            let mut closest = self.closest[packet][part];
            let interval = Interval {
                tmin: (R::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
                tmax: (R::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(closest.t),
            };
            if interval.live().any() {
                let test = self.part_test(packet, part);
                let tnear = R::load(&rays.tnear);
                let node = self.tree.beneath(place);
                descend::<N, R, T, M, false>(self.tree, &walk, &test, tnear, node, interval, &mut closest);
                self.closest[packet][part] = closest;
                changed = true;
            }
        }
        if changed {
            self.shorten(packet);
        }
    }
}
