//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, Frame, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, greatest_of_lanes};
use super::form::Slopes;
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Lanes, Mask, Simd, Sixteen, Task};
use crate::traverse::closest::{Closest, Normals};
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk, load3};

/// What the test of a packet keeps for a beam.
type Kept<M, L> = <<M as Mode>::Test<16, L> as Test<16, L>>::Kept;

/// Up to `K` squares of sixteen packets.
///
/// A square's packets stand in sixteen lanes, and so do a packet's rays. Where a register holds eight, the two halves of
/// a packet share what is worked out of a triangle, and branches: eight rays at a time have 0.89 to 0.97 of the rate there,
/// and those that ask for any hit 0.92 to 0.98 (AVX2 on Zen 3, seven views).
pub struct Nearest<'a, S: Simd, T, M: Mode, const K: usize> {
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// Which lanes of each packet count.
    active: &'a [[u32; PACKETS]; K],
    beam: &'a Beam<S::F16, false>,
    kept: [[Kept<M, S::F16>; PACKETS]; K],
    closest: [[Closest<16, S::F16>; PACKETS]; K],
    /// The depth beyond which no ray of a packet looks for anything any more. In a register: a lane that is stored
    /// by itself and loaded with the others at once waits for the memory.
    reach: [S::F16; K],
}

impl<'a, S: Simd, T: Records<M>, M: Mode, const K: usize> Nearest<'a, S, T, M, K> {
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
            kept: [[Default::default(); PACKETS]; K],
            closest: [[Closest::new(S::F16::splat(f32::NEG_INFINITY)); PACKETS]; K],
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
                let rays = &self.rays[square * PACKETS + packet];
                // Relative to the depth: turning the divisor turns the quotient, and changes nothing else.
                let turn = S::F16::splat(sign);
                let slopes = [S::F16::load(&first[packet]) * turn, S::F16::load(&second[packet]) * turn];
                let along = S::F16::load(&rays.direction[axes[2]]);
                self.kept[square][packet] = M::Test::<16, S::F16>::keep(slopes, along);
                // Lanes that do not count have found what they look for.
                let nowhere = S::F16::splat(f32::NEG_INFINITY);
                let tfar = S::F16::select(self.counts(square, packet), S::F16::load(&rays.tfar), nowhere);
                self.closest[square][packet] = Closest::new(tfar);
            }
        }
    }

    /// The lanes of a packet that count.
    #[inline(always)]
    fn counts(&self, square: usize, packet: usize) -> <S::F16 as Lanes<16>>::Mask {
        S::F16::mask_from_bits(self.active[square][packet])
    }

    /// A packet's test.
    #[inline(always)]
    fn test_of(&self, square: usize, packet: usize) -> M::Test<16, S::F16> {
        let rays = &self.rays[square * PACKETS + packet];
        revive::<S::F16, M>(&self.beam.frame, rays, &self.kept[square][packet])
    }

    /// Writes the hits of a packet's lanes that count. `normals` knows what it was asked for the packet before.
    #[inline(always)]
    pub fn give(&self, square: usize, packet: usize, normals: &mut Normals, hits: &mut HitPacket<16>) {
        let test = self.test_of(square, packet);
        let again = if M::Test::<16, S::F16>::DEFERS { Some(&test) } else { None };
        let found = self.closest[square][packet].records::<T, M>(self.tree, again, normals);
        hits.set_part(0, &found, self.active[square][packet]);
    }

    /// Draws a packet's reach in to what its rays still look for: those that count. What the others' speed is may be 0 or
    /// no number, and no number is the greatest of any.
    #[inline(always)]
    fn shorten(&mut self, square: usize, packet: usize) {
        let rays = &self.rays[square * PACKETS + packet];
        let depths =
            self.closest[square][packet].t * S::F16::load(&rays.direction[self.beam.frame.axes[2]]).abs();
        let nowhere = S::F16::splat(f32::NEG_INFINITY);
        let reach = S::F16::select(self.counts(square, packet), depths, nowhere).greatest();
        let reach = S::F16::splat(reach + reach.abs() * ROUNDINGS);
        let this = S::F16::mask_from_bits(1 << packet);
        self.reach[square] = S::F16::select(this, reach, self.reach[square]);
    }
}

impl<S: Simd, T: Records<M>, M: Mode, const K: usize> Bundle<S::F16, K> for Nearest<'_, S, T, M, K> {
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
        let direction = [
            S::F16::load(&rays.direction[i]),
            S::F16::load(&rays.direction[j]),
            S::F16::load(&rays.direction[k]),
        ];
        let (tnear, live) = (S::F16::load(&rays.tnear), self.counts(square, packet));
        // Out of memory and back: from triangle to triangle it stays in registers.
        let mut closest = self.closest[square][packet];
        let kept = &self.kept[square][packet];
        for triangle in bits(chosen) {
            let primitive = primitives[triangle];
            // No `unwrap_or_else`: its closure might stay out of line, and be compiled without the
            // instruction set.
            let told = M::Test::<16, S::F16>::test_placed(kept, &direction, &block.placed, triangle, live);
            let candidate = match told {
                Some(candidate) => candidate,
                None => self.test_of(square, packet).test(self.tree.record_of(primitive), live),
            };
            let weights = !M::Test::<16, S::F16>::DEFERS;
            changed |= closest.take::<false>(&candidate, primitive, tnear, live, weights);
        }
        self.closest[square][packet] = closest;
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
        let alone = Alone::<S::F16, T, M> {
            tree: self.tree,
            frame: self.beam.frame,
            rays: &self.rays[square * PACKETS + packet],
            active: self.active[square][packet],
            kept: &self.kept[square][packet],
            closest: &mut self.closest[square][packet],
            place,
            depths: Interval { tmin, tmax },
        };
        if S::apart(alone) {
            self.shorten(square, packet);
        }
    }
}

/// The test of a packet of which that was kept.
#[inline(always)]
fn revive<L: Sixteen, M: Mode>(frame: &Frame, rays: &RayPacket<16>, kept: &Kept<M, L>) -> M::Test<16, L> {
    M::Test::<16, L>::revive(kept, &frame.apex, &load3(&rays.direction), frame.axes[2])
}

/// A packet that goes on alone, as a beam has it.
struct Alone<'a, L: Sixteen, T, M: Mode> {
    tree: &'a T,
    frame: Frame,
    rays: &'a RayPacket<16>,
    /// Which of its lanes count.
    active: u32,
    kept: &'a Kept<M, L>,
    closest: &'a mut Closest<16, L>,
    /// The place of the upper tree below which it goes on.
    place: usize,
    /// From which depth it does, and to which.
    depths: Interval<f32>,
}

impl<L: Sixteen, T: Records<M>, M: Mode> Task for Alone<'_, L, T, M> {
    /// Whether it may have found anything.
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd>(self) -> bool {
        let Self { tree, frame, rays, active, kept, closest, place, depths: Interval { tmin, tmax } } = self;
        let (walk, inside) = Walk::<16, L>::new(rays, active, tree.bounds());
        let speed = L::load(&rays.direction[frame.axes[2]]).abs();
        let mut found = *closest;
        let interval = Interval {
            tmin: (L::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
            tmax: (L::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(found.t),
        };
        if !interval.live().any() {
            return false;
        }
        let test = revive::<L, M>(&frame, rays, kept);
        let (tnear, node) = (L::load(&rays.tnear), tree.beneath(place));
        descend::<16, L, T, M, false>(tree, &walk, &test, tnear, node, interval, &mut found);
        *closest = found;
        true
    }
}
