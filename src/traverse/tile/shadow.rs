//! Rays of a beam that ask for any hit.
//!
//! Their answer is one bit. So a triangle that some ray passes through by more than an error bound, at
//! a depth that is within the ray's interval by more than that, is enough, whatever the mode's own test
//! would compute; and one that it misses by more is none. Only rays in doubt are put to that test, from
//! their own origins: those that graze an edge, and those that meet the triangle, or start near it and do not leave it for certain.

use super::beam::PACKETS;
use super::bundle::{Bundle, ROUNDINGS, load_part, load_part3, part_mut};
use super::form::Seen;
use super::outline::Block;
use super::page::bits;
use crate::geometry::triangle::{Mode, Test, leave};
use crate::simd::{Lanes, Mask, Simd, Task};
use crate::traverse::closest::Closest;
use crate::traverse::lanes::RayPacket;
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk, load3};
use std::marker::PhantomData;

/// A square's packets. Rays stand in the lanes of `R`, as many as a register holds.
pub struct Shadows<'a, S, R, T, M, const N: usize, const PARALLEL: bool>
where
    S: Simd,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// The axis along which all rays run fastest.
    axis: usize,
    seen: &'a Seen,
    /// The lanes of each packet that have found nothing yet.
    pub open: [u32; PACKETS],
    /// The depth beyond which no ray of a packet looks for anything any more.
    reach: [f32; PACKETS],
    types: PhantomData<(S, R, M)>,
}

impl<'a, S, R, T, M, const N: usize, const PARALLEL: bool> Shadows<'a, S, R, T, M, N, PARALLEL>
where
    S: Simd,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    /// The rays at their start, in `interval`, beyond which nothing is.
    #[inline(always)]
    pub fn new(
        tree: &'a T,
        rays: &'a [RayPacket<16>],
        active: &[u32; PACKETS],
        axis: usize,
        seen: &'a mut Seen,
        interval: &Interval<S::F16>,
    ) -> Self {
        let reach = interval.tmax.store();
        for packet in 0..rays.len().min(PACKETS) {
            // A depth is multiplied by what may be off by a rounding of 1: it must be no farther than the
            // scene is.
            for part in 0..16 / N {
                let far = load_part::<N, R>(&seen.far[packet], part).min(R::splat(reach[packet]));
                *part_mut(&mut seen.far[packet], part) = far.store();
            }
        }
        Self { tree, rays, axis, seen, open: *active, reach, types: PhantomData }
    }

    /// The mode's own test, of the lanes in `doubtful` that do not leave the triangle behind.
    #[inline(always)]
    fn decide(&self, packet: usize, part: usize, primitive: u32, doubtful: R::Mask) -> R::Mask {
        let rays = &self.rays[packet];
        let origin = load_part3::<N, R>(&rays.origin, part);
        let direction = load_part3::<N, R>(&rays.direction, part);
        let mut doubtful = doubtful;
        if M::SURE {
            // Nearly always it is what they have just left.
            let triangle = self.tree.triangle(primitive);
            doubtful = doubtful & !leave::<N, R>(triangle, &origin, &direction, self.axis);
            if !doubtful.any() {
                return doubtful;
            }
        }
        let (record, doubtful) = (self.tree.record_of(primitive), doubtful.bits());
        R::mask_from_bits(S::apart(Doubt::<R, M, N> { rays, part, record, doubtful, types: PhantomData }))
    }

    /// Takes note of a part's lanes that found something.
    #[inline(always)]
    fn close(&mut self, packet: usize, part: usize, found: u32) {
        self.open[packet] &= !(found << (part * N));
        if self.open[packet] == 0 {
            self.reach[packet] = f32::NEG_INFINITY;
        }
    }

    /// The lanes of a part that have found nothing yet.
    #[inline(always)]
    fn open_in(&self, packet: usize, part: usize) -> u32 {
        self.open[packet] >> (part * N) & ((1 << N) - 1)
    }
}

impl<S, R, T, M, const N: usize, const PARALLEL: bool> Bundle<S::F16, 1>
    for Shadows<'_, S, R, T, M, N, PARALLEL>
where
    S: Simd,
    R: Lanes<N>,
    T: Records<M>,
    M: Mode,
{
    // 2560 lost up to a sixth, 8192 as much on others.
    const PATIENCE: u32 = 4096;

    // 0.03 lost a fifth where lights are near, no limit a fifth in the power plant. Places of parallel rays have the
    // scene's units.
    const WIDEST: f32 = if PARALLEL { f32::INFINITY } else { 0.1 };

    #[inline(always)]
    fn reach(&self, _: usize) -> S::F16 {
        S::F16::load(&self.reach)
    }

    #[inline(always)]
    fn reach_of_lanes(&self) -> S::F16 {
        S::F16::load(&self.reach)
    }

    #[inline(always)]
    fn test(&mut self, _: usize, packet: usize, block: &Block, primitives: &[u32], chosen: u32) {
        let packet = packet & 15;
        for part in 0..16 / N {
            let lanes = self.open_in(packet, part);
            if lanes == 0 {
                continue;
            }
            let mut open = R::mask_from_bits(lanes);
            let [a, b] = &self.seen.place;
            let (a, b) = (load_part::<N, R>(&a[packet], part), load_part::<N, R>(&b[packet], part));
            let near = load_part::<N, R>(&self.seen.near[packet], part);
            let far = load_part::<N, R>(&self.seen.far[packet], part);
            for triangle in bits(chosen) {
                // On which sides of the edges the rays pass.
                let (mut least, mut greatest) = (R::splat(f32::INFINITY), R::splat(f32::NEG_INFINITY));
                for edge in 0..3 {
                    let side = block.side(triangle, edge, a, b);
                    least = least.min(side);
                    greatest = greatest.max(side);
                }
                let slack = block.slack_of(triangle);
                let (above, below) = (R::splat(slack), R::splat(-slack));
                let maybe_inside = open & !(least.lt(below) & above.lt(greatest));
                if !maybe_inside.any() {
                    continue;
                }

                // Whether the plane lies between the rays' ends.
                let [x, y, z, other, slack] = block.plane_of(triangle);
                let linear = R::splat(x).mul_add(a, R::splat(y).mul_add(b, R::splat(z)));
                let (other, slack) = (R::splat(other), R::splat(slack));
                let (at_near, at_far, plane) = if PARALLEL {
                    (near * other, far * other, linear)
                } else {
                    (near * linear, far * linear, other)
                };
                let maybe = maybe_inside & !(at_far.lt(plane - slack)) & !((plane + slack).lt(at_near));
                if !maybe.any() {
                    continue;
                }
                let mut found = maybe & !maybe;
                if M::SURE {
                    let inside = above.lt(least) | greatest.lt(below);
                    let between = (plane + slack).lt(at_far) & at_near.lt(plane - slack);
                    found = maybe & inside & between;
                }
                let doubtful = maybe & !found;
                if doubtful.any() {
                    found = found | self.decide(packet, part, primitives[triangle], doubtful);
                }
                open = open & !found;
                if !open.any() {
                    break;
                }
            }
            self.close(packet, part, lanes & !open.bits());
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, _: usize, packet: usize, place: usize, tmin: f32, tmax: f32) {
        let alone = Alone::<R, T, M, N> {
            tree: self.tree,
            rays: &self.rays[packet],
            open: self.open[packet],
            start: &self.seen.start[packet],
            speed: &self.seen.speed[packet],
            place,
            depths: Interval { tmin, tmax },
            types: PhantomData,
        };
        let found = S::apart(alone);
        self.open[packet] &= !found;
        if self.open[packet] == 0 {
            self.reach[packet] = f32::NEG_INFINITY;
        }
    }
}

/// Rays of a part of a packet of which it is in doubt whether they hit a triangle.
struct Doubt<'a, R, M: Mode, const N: usize> {
    rays: &'a RayPacket<16>,
    part: usize,
    record: &'a M::Record,
    /// A bit for each of them.
    doubtful: u32,
    types: PhantomData<R>,
}

impl<R: Lanes<N>, M: Mode, const N: usize> Task for Doubt<'_, R, M, N> {
    /// Those that do, by the mode's own test.
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        let Self { rays, part, record, doubtful, .. } = self;
        let origin = load_part3::<N, R>(&rays.origin, part);
        let direction = load_part3::<N, R>(&rays.direction, part);
        let test = M::Test::<N, R>::new(&origin, &direction, doubtful);
        let lanes = R::mask_from_bits(doubtful);
        let candidate = test.test(record, lanes);
        // As a packet's closest hit is taken, which is none beyond the greatest float.
        let tfar = R::splat(f32::MAX).min(load_part::<N, R>(&rays.tfar, part));
        let tnear = load_part::<N, R>(&rays.tnear, part);
        (candidate.inside & lanes & tnear.le(candidate.t) & candidate.t.le(tfar)).bits()
    }
}

/// A packet that goes on alone, as a beam has it.
struct Alone<'a, R, T, M, const N: usize> {
    tree: &'a T,
    rays: &'a RayPacket<16>,
    /// Its lanes that have found nothing yet.
    open: u32,
    /// Where its rays start, as depths, and how fast they run along the axis of depths.
    start: &'a [f32; 16],
    speed: &'a [f32; 16],
    /// The place of the upper tree below which it goes on.
    place: usize,
    /// From which depth it does, and to which.
    depths: Interval<f32>,
    types: PhantomData<(R, M)>,
}

impl<R: Lanes<N>, T: Records<M>, M: Mode, const N: usize> Task for Alone<'_, R, T, M, N> {
    /// The lanes that find something.
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        let Self { tree, rays, open, start, speed, place, depths: Interval { tmin, tmax }, .. } = self;
        let mut all_found = 0;
        for part in 0..16 / N {
            let lanes = open >> (part * N) & ((1 << N) - 1);
            if lanes == 0 {
                continue;
            }
            let of_part = rays.part::<N>(part);
            let (walk, inside) = Walk::<N, R>::new(&of_part, lanes, tree.bounds());
            let (start, speed) = (load_part::<N, R>(start, part), load_part::<N, R>(speed, part));
            let (one, other) = ((R::splat(tmin) - start) / speed, (R::splat(tmax) - start) / speed);
            let more =
                (start.abs() + R::splat(tmin.abs().max(tmax.abs()))) / speed.abs() * R::splat(ROUNDINGS);
            let mut closest = Closest::new(R::load(&of_part.tfar));
            let interval = Interval {
                tmin: (one.min(other) - more).max(inside.tmin),
                tmax: (one.max(other) + more).min(inside.tmax),
            };
            if interval.live().any() {
                let (origin, direction) = (load3(&of_part.origin), load3(&of_part.direction));
                let test = M::Test::<N, R>::new(&origin, &direction, lanes);
                let (tnear, node) = (R::load(&of_part.tnear), tree.beneath(place));
                descend::<N, R, T, M, true>(tree, &walk, &test, tnear, node, interval, &mut closest);
                all_found |= (closest.found() & lanes) << (part * N);
            }
        }
        all_found
    }
}
