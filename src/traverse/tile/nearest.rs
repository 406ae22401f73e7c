//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, Frame, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, greatest_of_lanes, load_part, load_part3};
use super::form::Slopes;
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Lanes, Mask, Simd, Task};
use crate::traverse::closest::{Closest, Normals};
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk};
use std::marker::PhantomData;

/// What the tests of `N` rays keep for a beam.
type Kept<M, R, const N: usize> = <<M as Mode>::Test<N, R> as Test<N, R>>::Kept;

/// Up to `K` squares of sixteen packets.
///
/// A square's packets stand in sixteen lanes. Rays stand in the lanes of `R`, as many as a
/// register holds, in `P` parts.
pub struct Nearest<'a, S, R, T, M, const N: usize, const P: usize, const K: usize>
where
    S: Simd,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [[u32; PACKETS]; K],
    beam: &'a Beam<S::F16, false>,
    kept: [[[Kept<M, R, N>; P]; PACKETS]; K],
    closest: [[[Closest<N, R>; P]; PACKETS]; K],
    /// The depth beyond which no ray of a packet looks for anything any more. In a register: a lane that is stored
    /// by itself and loaded with the others at once waits for the memory.
    reach: [S::F16; K],
}

impl<'a, S, R, T, M, const N: usize, const P: usize, const K: usize> Nearest<'a, S, R, T, M, N, P, K>
where
    S: Simd,
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
        beam: &'a Beam<S::F16, false>,
    ) -> Self {
        Self {
            tree,
            rays,
            active,
            beam,
            kept: [[[Default::default(); P]; PACKETS]; K],
            closest: [[[Closest::new(R::splat(f32::NEG_INFINITY)); P]; PACKETS]; K],
            reach: [S::F16::splat(f32::INFINITY); K],
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
        let rays = &self.rays[square * PACKETS + packet];
        part_test::<R, M, N>(&self.beam.frame, rays, part, &self.kept[square][packet][part])
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
        let reach = S::F16::splat(reach + reach.abs() * ROUNDINGS);
        let this = S::F16::mask_from_bits(1 << packet);
        self.reach[square] = S::F16::select(this, reach, self.reach[square]);
    }
}

impl<S, R, T, M, const N: usize, const P: usize, const K: usize> Bundle<S::F16, K>
    for Nearest<'_, S, R, T, M, N, P, K>
where
    S: Simd,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    // 5120 lost up to a tenth; 12288 was as good as this (sponza, armadillo, kitchen, power plant; AVX-512).
    const PATIENCE: u32 = 8192;

    // Squares of a picture are all as wide.
    const WIDEST: f32 = f32::INFINITY;

    #[inline(always)]
    fn reach(&self, square: usize) -> S::F16 {
        self.reach[square]
    }

    #[inline(always)]
    fn reach_of_lanes(&self) -> S::F16 {
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
            // Out of memory and back: from triangle to triangle it stays in registers.
            let mut closest = self.closest[square][packet][part];
            let kept = &self.kept[square][packet][part];
            for triangle in bits(chosen) {
                let primitive = primitives[triangle];
                // No `unwrap_or_else`: its closure might stay out of line, and be compiled without the
                // instruction set.
                let told = M::Test::<N, R>::test_placed(kept, &direction, &block.placed, triangle, live);
                let candidate = match told {
                    Some(candidate) => candidate,
                    None => self.part_test(square, packet, part).test(self.tree.record_of(primitive), live),
                };
                changed |=
                    closest.take::<false>(&candidate, primitive, tnear, live, !M::Test::<N, R>::DEFERS);
            }
            self.closest[square][packet][part] = closest;
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
        let alone = Alone::<R, T, M, N, P> {
            tree: self.tree,
            frame: self.beam.frame,
            rays: &self.rays[square * PACKETS + packet],
            active: self.active[square][packet],
            kept: &self.kept[square][packet],
            closest: &mut self.closest[square][packet],
            place,
            depths: Interval { tmin, tmax },
            mode: PhantomData,
        };
        if S::apart(alone) {
            self.shorten(square, packet);
        }
    }
}

/// The test of a part of a packet, of which that was kept.
#[inline(always)]
fn part_test<R: Lanes<N>, M: Mode, const N: usize>(
    frame: &Frame,
    rays: &RayPacket<16>,
    part: usize,
    kept: &Kept<M, R, N>,
) -> M::Test<N, R> {
    let direction = load_part3::<N, R>(&rays.direction, part);
    M::Test::<N, R>::revive(kept, &frame.apex, &direction, frame.axes[2])
}

/// A packet that goes on alone, as a beam has it.
struct Alone<'a, R: Lanes<N>, T, M: Mode, const N: usize, const P: usize> {
    tree: &'a T,
    frame: Frame,
    rays: &'a RayPacket<16>,
    /// Which of its lanes count.
    active: u32,
    kept: &'a [Kept<M, R, N>; P],
    closest: &'a mut [Closest<N, R>; P],
    /// The place of the upper tree below which it goes on.
    place: usize,
    /// From which depth it does, and to which.
    depths: Interval<f32>,
    mode: PhantomData<M>,
}

impl<R, T, M, const N: usize, const P: usize> Task for Alone<'_, R, T, M, N, P>
where
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    /// Whether it may have found anything.
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self) -> bool {
        let Self { tree, frame, rays, active, kept, closest, place, depths: Interval { tmin, tmax }, .. } =
            self;
        let mut changed = false;
        for part in 0..P {
            let of_part = rays.part::<N>(part);
            let active = active >> (part * N) & ((1 << N) - 1);
            let (walk, inside) = Walk::<N, R>::new(&of_part, active, tree.bounds());
            let speed = R::load(&of_part.direction[frame.axes[2]]).abs();
            let mut found = closest[part];
            let interval = Interval {
                tmin: (R::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
                tmax: (R::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(found.t),
            };
            if interval.live().any() {
                let test = part_test::<R, M, N>(&frame, rays, part, &kept[part]);
                let (tnear, node) = (R::load(&of_part.tnear), tree.beneath(place));
                descend::<N, R, T, M, false>(tree, &walk, &test, tnear, node, interval, &mut found);
                closest[part] = found;
                changed = true;
            }
        }
        changed
    }
}
