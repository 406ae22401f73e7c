//! Rays of a beam from its apex that ask for their closest hits.

use super::beam::{Beam, Frame, PACKETS};
use super::bundle::{Bundle, ROUNDINGS, greatest_of_lanes};
use super::form::Slopes;
use super::outline::Block;
use super::page::bits;
use super::pairs::Pairs;
use crate::geometry::triangle::{Mode, Test, Weights};
use crate::simd::{Lanes, Mask, Simd, Sixteen, Task};
use crate::traverse::closest::{Closest, Normals};
use crate::traverse::lanes::{HitPacket, RayPacket};
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk, load3};

/// So many normals are remembered from packet to packet.
pub const SEEN: usize = 8;

/// Of so many packets of a square, or more, that have found something the reach is drawn in for all at once.
const FEW_CHANGED: u32 = 4;

/// What the test of a packet keeps for a beam, and of a hit's weights.
type Kept<M, L> = <<M as Mode>::Test<16, L> as Test<16, L>>::Kept;
type WeightsOf<M, L> = <<M as Mode>::Test<16, L> as Test<16, L>>::Weights;

/// What a packet's rays have found, in memory: of a [`Closest`] what is not worked out again in the end.
struct Found<L: Sixteen, M: Mode> {
    t: L,
    primitive: L::Ids,
    weights: WeightsOf<M, L>,
}

impl<L: Sixteen, M: Mode> Clone for Found<L, M> {
    #[inline(always)]
    fn clone(&self) -> Self {
        *self
    }
}

impl<L: Sixteen, M: Mode> Copy for Found<L, M> {}

impl<L: Sixteen, M: Mode> Found<L, M> {
    #[inline(always)]
    fn of(closest: &Closest<16, L>) -> Self {
        let weights = WeightsOf::<M, L>::of(closest.weights());
        Self { t: closest.t, primitive: closest.ids(), weights }
    }

    #[inline(always)]
    fn closest(&self) -> Closest<16, L> {
        Closest::of_found(self.t, self.primitive, self.weights.get())
    }
}

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
    slopes: &'a Slopes<K>,
    kept: [[Kept<M, S::F16>; PACKETS]; K],
    found: [[Found<S::F16, M>; PACKETS]; K],
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
        slopes: &'a Slopes<K>,
    ) -> Self {
        Self {
            tree,
            rays,
            active,
            beam,
            slopes,
            kept: [[Default::default(); PACKETS]; K],
            found: [[Found::of(&Closest::new(S::F16::splat(f32::NEG_INFINITY))); PACKETS]; K],
            reach: [S::F16::splat(f32::INFINITY); K],
        }
    }

    /// Puts the rays at their start. Not a part of [`new`](Self::new): what is made by many steps may be copied when it is
    /// given, and this is large.
    #[inline(always)]
    pub fn begin(&mut self) {
        let axis = self.beam.frame.axes[2];
        for square in 0..K {
            let packets = self.rays.len().saturating_sub(square * PACKETS).min(PACKETS);
            for packet in 0..packets {
                let rays = &self.rays[square * PACKETS + packet];
                self.kept[square][packet] = M::Test::<16, S::F16>::keep(S::F16::load(&rays.direction[axis]));
                // Lanes that do not count have found what they look for.
                let nowhere = S::F16::splat(f32::NEG_INFINITY);
                let tfar = S::F16::select(self.counts(square, packet), S::F16::load(&rays.tfar), nowhere);
                self.found[square][packet] = Found::of(&Closest::new(tfar));
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
        let slopes = self.slopes.of(square, packet);
        revive::<S::F16, M>(&self.beam.frame, rays, slopes, &self.kept[square][packet])
    }

    /// Writes the hits of a packet's lanes that count. `normals` knows what it was asked for packets before.
    #[inline(always)]
    pub fn give(&self, square: usize, packet: usize, normals: &mut Normals<SEEN>, hits: &mut HitPacket<16>) {
        let test = self.test_of(square, packet);
        let again = if WeightsOf::<M, S::F16>::ARE_KEPT { None } else { Some(&test) };
        let closest = self.found[square][packet].closest();
        let found = closest.records::<T, M, SEEN>(self.tree, again, normals);
        hits.set_part(0, &found, self.active[square][packet]);
    }

    /// The depths to which a packet's rays still look: those that count. What the others' speed is may be 0 or no number, and no
    /// number is the greatest of any.
    #[inline(always)]
    fn depths(&self, square: usize, packet: usize) -> S::F16 {
        let rays = &self.rays[square * PACKETS + packet];
        let speed = S::F16::load(&rays.direction[self.beam.frame.axes[2]]).abs();
        let nowhere = S::F16::splat(f32::NEG_INFINITY);
        S::F16::select(self.counts(square, packet), self.found[square][packet].t * speed, nowhere)
    }

    /// Draws the reach of packets of a square in, as far as their bits are set, to what is given for each.
    #[inline(always)]
    fn draw_in(&mut self, square: usize, packets: u32, reach: S::F16) {
        let reach = reach + reach.abs() * S::F16::splat(ROUNDINGS);
        self.reach[square] = S::F16::select(S::F16::mask_from_bits(packets), reach, self.reach[square]);
    }

    /// Draws a packet's reach in to what its rays still look for.
    #[inline(always)]
    fn shorten(&mut self, square: usize, packet: usize) {
        let reach = S::F16::splat(self.depths(square, packet).greatest());
        self.draw_in(square, 1 << packet, reach);
    }

    /// Draws the reach of packets of a square in that have found something.
    #[inline(always)]
    fn settle(&mut self, square: usize, changed: u32) {
        if changed.count_ones() < FEW_CHANGED {
            for packet in bits(changed) {
                self.shorten(square, packet & 15);
            }
            return;
        }
        let mut depths = [S::F16::splat(f32::NEG_INFINITY); PACKETS];
        for packet in bits(changed) {
            depths[packet & 15] = self.depths(square, packet & 15);
        }
        self.draw_in(square, changed, S::F16::greatest_of_each(&depths));
    }
}

impl<S: Simd, T: Records<M>, M: Mode, const K: usize> Bundle<S::F16, K> for Nearest<'_, S, T, M, K> {
    // 5120 lost up to a tenth; 12288 was as good as this (sponza, armadillo, kitchen, power plant; AVX-512).
    const PATIENCE: u32 = 8192;

    // With it beams had 0.93 of the rate (AVX-512, Zen 4, six views): few tiles are given up at all, and all are walked by
    // what is compiled for it.
    const TAKES_UP_THE_REST: bool = false;

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
    fn test(&mut self, square: usize, pairs: &Pairs, block: &Block, primitives: &[u32]) {
        let [i, j, k] = self.beam.frame.axes;
        let mut changed = 0;
        for (packet, triangle) in pairs.iter() {
            let rays = &self.rays[square * PACKETS + packet];
            let direction = [
                S::F16::load(&rays.direction[i]),
                S::F16::load(&rays.direction[j]),
                S::F16::load(&rays.direction[k]),
            ];
            let (tnear, live) = (S::F16::load(&rays.tnear), self.counts(square, packet));
            let (kept, slopes) = (&self.kept[square][packet], self.slopes.of(square, packet));
            let primitive = primitives[triangle];
            // No `unwrap_or_else`: its closure might stay out of line, and be compiled without the
            // instruction set.
            let told =
                M::Test::<16, S::F16>::test_placed(kept, slopes, &direction, &block.placed, triangle, live);
            let candidate = match told {
                Some(candidate) => candidate,
                None => self.test_of(square, packet).test(self.tree.record_of(primitive), live),
            };
            let mut closest = self.found[square][packet].closest();
            let weights = WeightsOf::<M, S::F16>::ARE_KEPT;
            if closest.take::<false>(&candidate, primitive, tnear, live, weights) {
                self.found[square][packet] = Found::of(&closest);
                changed |= 1 << packet;
            }
        }
        self.settle(square, changed);
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
            slopes: self.slopes.of(square, packet),
            kept: &self.kept[square][packet],
            found: &mut self.found[square][packet],
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
fn revive<L: Sixteen, M: Mode>(
    frame: &Frame,
    rays: &RayPacket<16>,
    slopes: [L; 2],
    kept: &Kept<M, L>,
) -> M::Test<16, L> {
    M::Test::<16, L>::revive(kept, slopes, &frame.apex, &load3(&rays.direction), frame.axes[2])
}

/// A packet that goes on alone, as a beam has it.
struct Alone<'a, L: Sixteen, T, M: Mode> {
    tree: &'a T,
    frame: Frame,
    rays: &'a RayPacket<16>,
    /// Which of its lanes count.
    active: u32,
    slopes: [L; 2],
    kept: &'a Kept<M, L>,
    found: &'a mut Found<L, M>,
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
        let Self { tree, frame, rays, active, slopes, kept, found, place, depths } = self;
        let Interval { tmin, tmax } = depths;
        let (walk, inside) = Walk::<16, L>::new(rays, active, tree.bounds());
        let speed = L::load(&rays.direction[frame.axes[2]]).abs();
        let mut closest = found.closest();
        let interval = Interval {
            tmin: (L::splat(tmin - tmin.abs() * ROUNDINGS) / speed).max(inside.tmin),
            tmax: (L::splat(tmax + tmax.abs() * ROUNDINGS) / speed).min(inside.tmax).min(closest.t),
        };
        if !interval.live().any() {
            return false;
        }
        let test = revive::<L, M>(&frame, rays, slopes, kept);
        let (tnear, node) = (L::load(&rays.tnear), tree.beneath(place));
        descend::<16, L, T, M, false>(tree, &walk, &test, tnear, node, interval, &mut closest);
        *found = Found::of(&closest);
        true
    }
}
