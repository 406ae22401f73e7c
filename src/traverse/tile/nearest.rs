//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, Frame, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, greatest_of_lanes, load_part, load_part3};
use super::form::Slopes;
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Lanes, Mask, Sixteen};
use crate::traverse::closest::{Closest, Normals};
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk};

/// What the tests of `N` rays keep for a beam.
type Kept<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Kept;

/// Up to `K` squares of sixteen packets.
///
/// A square's packets stand in the lanes of `L`. Rays stand in the lanes of `R`, as many as a
/// register holds, in `P` parts.
pub struct Nearest<'a, L, R, T, M, const N: usize, const P: usize, const K: usize>
where
    L: Sixteen,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [[u32; PACKETS]; K],
    beam: &'a Beam<L, false>,
    kept: [[[Kept<M, R, N>; P]; PACKETS]; K],
    closest: [[[Closest<N, R>; P]; PACKETS]; K],
    /// The depth beyond which no ray of a packet looks for anything any more. In a register: a lane that is stored
    /// by itself and loaded with the others at once waits for the memory.
    reach: [L; K],
}

impl<'a, L, R, T, M, const N: usize, const P: usize, const K: usize> Nearest<'a, L, R, T, M, N, P, K>
where
    L: Sixteen,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    /// Rays of which none looks for anything, until they [`begin`](Self::begin).
    #[inline(always)]
    pub fn new(
        tree: &'a T,
        rays: &'a [RayPacket<16>],
        active: &'a [[u32; PACKETS]; K],
        beam: &'a Beam<L, false>,
    ) -> Self {
        Self {
            tree,
            rays,
            active,
            beam,
            kept: [[[Default::default(); P]; PACKETS]; K],
            closest: [[[Closest::new(R::splat(f32::NEG_INFINITY)); P]; PACKETS]; K],
            reach: [L::splat(f32::INFINITY); K],
        }
    }

    /// Puts the rays at their start; `slopes` are those of the beam's rays. Not a part of [`new`](Self::new): what is made by
    /// many steps may be copied when it is given, and this is large.
    #[inline(always)]
    pub fn begin(&mut self, slopes: &Slopes<K>) {
        let Frame { axes, sign, .. } = self.beam.frame;
        for square in 0..K {
            let packets = self.rays.len().saturating_sub(square * PACKETS).min(PACKETS);
            let [first, second] = &slopes.0[square];
            for packet in 0..packets {
                for part in 0..P {
                    let rays = &self.rays[square * PACKETS + packet];
                    // Relative to the depth: turning the divisor turns the quotient, and changes nothing else.
                    let slopes = [
                        load_part::<N, R>(&first[packet], part) * R::splat(sign),
                        load_part::<N, R>(&second[packet], part) * R::splat(sign),
                    ];
                    let along = load_part::<N, R>(&rays.direction[axes[2]], part);
                    self.kept[square][packet][part] = M::Test::<N, R>::keep(slopes, along);
                    // Lanes that do not count have found what they look for.
                    let tfar = R::select(
                        self.counts(square, packet, part),
                        load_part::<N, R>(&rays.tfar, part),
                        R::splat(f32::NEG_INFINITY),
                    );
                    self.closest[square][packet][part] = Closest::new(tfar);
                }
            }
        }
    }

    /// The lanes of a part that count, a bit for each.
    #[inline(always)]
    fn lanes(&self, square: usize, packet: usize, part: usize) -> u32 {
        self.active[square][packet] >> (part * N) & ((1 << N) - 1)
    }

    /// The same as a mask.
    #[inline(always)]
    fn counts(&self, square: usize, packet: usize, part: usize) -> R::Mask {
        R::mask_from_bits(self.lanes(square, packet, part))
    }

    /// A part's test.
    #[inline(always)]
    fn part_test(&self, square: usize, packet: usize, part: usize) -> M::Test<N, R> {
        let direction = load_part3::<N, R>(&self.rays[square * PACKETS + packet].direction, part);
        let kept = &self.kept[square][packet][part];
        M::Test::<N, R>::revive(kept, &self.beam.frame.apex, &direction, self.beam.frame.axes[2])
    }

    /// Writes the hits of a packet's lanes that count. `normals` knows what it was asked for the packet before.
    #[inline(always)]
    pub fn give(&self, square: usize, packet: usize, normals: &mut Normals, hits: &mut HitPacket<16>) {
        for part in 0..P {
            let test = self.part_test(square, packet, part);
            let again = if M::Test::<N, R>::DEFERS { Some(&test) } else { None };
            let found = self.closest[square][packet][part].records::<T, M>(self.tree, again, normals);
            hits.set_part(part, &found, self.lanes(square, packet, part));
        }
    }

    /// Draws a packet's reach in to what its rays still look for: those that count. What the others' speed is may be 0 or
    /// no number, and no number is the greatest of any.
    #[inline(always)]
    fn shorten(&mut self, square: usize, packet: usize) {
        let mut reach = f32::NEG_INFINITY;
        let rays = &self.rays[square * PACKETS + packet];
        for part in 0..P {
            let speed = load_part::<N, R>(&rays.direction[self.beam.frame.axes[2]], part).abs();
            let depths = self.closest[square][packet][part].t * speed;
            let counts = self.counts(square, packet, part);
            let depth = R::select(counts, depths, R::splat(f32::NEG_INFINITY)).greatest();
            reach = if depth > reach { depth } else { reach };
        }
        let reach = L::splat(reach + reach.abs() * ROUNDINGS);
        self.reach[square] = L::select(L::mask_from_bits(1 << packet), reach, self.reach[square]);
    }
}

impl<L, R, T, M, const N: usize, const P: usize, const K: usize> Bundle<L, K>
    for Nearest<'_, L, R, T, M, N, P, K>
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
    fn reach(&self, square: usize) -> L {
        self.reach[square]
    }

    #[inline(always)]
    fn reach_of_lanes(&self) -> L {
        greatest_of_lanes(&self.reach)
    }

    #[inline(always)]
    fn test(&mut self, square: usize, packet: usize, block: &Block, primitives: &[u32], chosen: u32) {
        let packet = packet & 15;
        let mut changed = false;
        let [i, j, k] = self.beam.frame.axes;
        let rays = &self.rays[square * PACKETS + packet];
        for part in 0..P {
            let direction = [
                load_part::<N, R>(&rays.direction[i], part),
                load_part::<N, R>(&rays.direction[j], part),
                load_part::<N, R>(&rays.direction[k], part),
            ];
            let tnear = load_part::<N, R>(&rays.tnear, part);
            let live = self.counts(square, packet, part);
            for triangle in bits(chosen) {
                let (primitive, kept) = (primitives[triangle], &self.kept[square][packet][part]);
                // No `unwrap_or_else`: its closure might stay out of line, and be compiled without the
                // instruction set.
                let told = M::Test::<N, R>::test_placed(kept, &direction, &block.placed, triangle, live);
                let candidate = match told {
                    Some(candidate) => candidate,
                    None => self.part_test(square, packet, part).test(self.tree.record_of(primitive), live),
                };
                let closest = &mut self.closest[square][packet][part];
                changed |=
                    closest.take::<false>(&candidate, primitive, tnear, live, !M::Test::<N, R>::DEFERS);
            }
        }
        if changed {
            self.shorten(square, packet);
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, square: usize, packet: usize, place: usize, tmin: f32, tmax: f32) {
        // A lane may hold packets that are not there.
        if self.active[square][packet] == 0 {
            return;
        }
        let mut changed = false;
        for part in 0..P {
            let rays = self.rays[square * PACKETS + packet].part::<N>(part);
            let active = self.lanes(square, packet, part);
            let (walk, inside) = Walk::<N, R>::new(&rays, active, self.tree.bounds());
            let speed = R::load(&rays.direction[self.beam.frame.axes[2]]).abs();
            let mut closest = self.closest[square][packet][part];
            let interval = Interval {
                tmin: (R::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
                tmax: (R::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(closest.t),
            };
            if interval.live().any() {
                let test = self.part_test(square, packet, part);
                let tnear = R::load(&rays.tnear);
                let node = self.tree.beneath(place);
                descend::<N, R, T, M, false>(self.tree, &walk, &test, tnear, node, interval, &mut closest);
                self.closest[square][packet][part] = closest;
                changed = true;
            }
        }
        if changed {
            self.shorten(square, packet);
        }
    }
}
