//! Rays of a beam that ask for any hit.
//!
//! Their answer is one bit. So a triangle that some ray passes through by more than an error bound, at
//! a depth that is within the ray's interval by more than that, is enough, whatever the mode's own test
//! would compute; and one that it misses by more is none. Only rays in doubt are put to that test, from
//! their own origins: those that graze an edge, and those that meet the triangle, or start near it and do not leave it for certain.

use super::beam::PACKETS;
use super::bundle::{Bundle, ROUNDINGS};
use super::form::Seen;
use super::outline::Block;
use super::pairs::Pairs;
use crate::geometry::triangle::{Mode, Test, leave};
use crate::simd::{Lanes, Mask, Simd, Task};
use crate::traverse::closest::Closest;
use crate::traverse::lanes::RayPacket;
use crate::traverse::packet::descend;
use crate::traverse::records::Records;
use crate::traverse::walk::{Interval, Walk, load3};
use std::marker::PhantomData;

/// A square's packets, whose rays stand in sixteen lanes each.
pub struct Shadows<'a, S: Simd, T, M, const PARALLEL: bool> {
    tree: &'a T,
    rays: &'a [RayPacket<16>],
    /// The axis along which all rays run fastest.
    axis: usize,
    seen: &'a Seen,
    /// The lanes of each packet that have found nothing yet.
    pub open: [u32; PACKETS],
    /// The depth beyond which no ray of a packet looks for anything.
    reach: S::F16,
    /// The packets of which no ray looks for anything any more.
    closed: u32,
    doubts: Doubts,
    types: PhantomData<(S, M)>,
}

impl<'a, S: Simd, T: Records<M>, M: Mode, const PARALLEL: bool> Shadows<'a, S, T, M, PARALLEL> {
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
        let ends = interval.tmax.store();
        for packet in 0..rays.len().min(PACKETS) {
            // A depth is multiplied by what may be off by a rounding of 1: it must be no farther than the
            // scene is.
            let far = &mut seen.far[packet];
            *far = S::F16::load(far).min(S::F16::splat(ends[packet])).store();
        }
        Self {
            tree,
            rays,
            axis,
            seen,
            open: *active,
            reach: interval.tmax,
            closed: 0,
            doubts: Doubts::none(),
            types: PhantomData,
        }
    }

    /// The mode's own test, of the lanes in `doubtful` that do not leave the triangle behind.
    #[inline(always)]
    fn decide(
        &self,
        packet: usize,
        primitive: u32,
        doubtful: <S::F16 as Lanes<16>>::Mask,
    ) -> <S::F16 as Lanes<16>>::Mask {
        let rays = &self.rays[packet];
        let mut doubtful = doubtful;
        if M::SURE {
            // Nearly always it is what they have just left.
            let (origin, direction) = (load3(&rays.origin), load3(&rays.direction));
            let triangle = self.tree.triangle(primitive);
            doubtful = doubtful & !leave::<16, S::F16>(triangle, &origin, &direction, self.axis);
            if !doubtful.any() {
                return doubtful;
            }
        }
        let (record, doubtful) = (self.tree.record_of(primitive), doubtful.bits());
        S::F16::mask_from_bits(S::apart(Doubt::<M> { rays, record, doubtful }))
    }

    /// Takes note of a packet's lanes that found something.
    #[inline(always)]
    fn close(&mut self, packet: usize, found: u32) {
        self.open[packet] &= !found;
        self.closed |= u32::from(self.open[packet] == 0) << packet;
    }
}

impl<S: Simd, T: Records<M>, M: Mode, const PARALLEL: bool> Bundle<S::F16, 1>
    for Shadows<'_, S, T, M, PARALLEL>
{
    // 2560 lost up to a sixth, 8192 as much on others.
    const PATIENCE: u32 = 4096;

    // From the root: 0.77 of the rate on the armadillo, 0.93 in sponza and on the bunny, 0.95 to 1.02 elsewhere (AVX-512,
    // Zen 4, eight views).
    const TAKES_UP_THE_REST: bool = true;

    // 0.03 lost a fifth where lights are near, no limit a fifth in the power plant. Places of parallel rays have the
    // scene's units.
    const WIDEST: f32 = if PARALLEL { f32::INFINITY } else { 0.1 };

    #[inline(always)]
    fn reach(&self, _: usize) -> S::F16 {
        let closed = S::F16::mask_from_bits(self.closed);
        S::F16::select(closed, S::F16::splat(f32::NEG_INFINITY), self.reach)
    }

    #[inline(always)]
    fn reach_of_lanes(&self) -> S::F16 {
        self.reach(0)
    }

    #[inline(always)]
    fn test(&mut self, _: usize, pairs: &Pairs, block: &Block, primitives: &[u32]) {
        self.doubts.count = 0;
        for (packet, triangle) in pairs.iter() {
            let open = self.open[packet];
            if open == 0 {
                continue;
            }
            let [a, b] = &self.seen.place;
            let (a, b) = (S::F16::load(&a[packet]), S::F16::load(&b[packet]));
            let (near, far) = (S::F16::load(&self.seen.near[packet]), S::F16::load(&self.seen.far[packet]));

            // On which sides of the edges the rays pass.
            let (mut least, mut greatest) = (S::F16::splat(f32::INFINITY), S::F16::splat(f32::NEG_INFINITY));
            for edge in 0..3 {
                let side = block.side(triangle, edge, a, b);
                least = least.min(side);
                greatest = greatest.max(side);
            }
            let slack = block.placed.slack[triangle];
            let (above, below) = (S::F16::splat(slack), S::F16::splat(-slack));
            let outside = least.lt(below) & above.lt(greatest);

            // Whether the plane lies between the rays' ends.
            let [x, y, z, other, slack] = block.plane_of(triangle);
            let linear = S::F16::splat(x).mul_add(a, S::F16::splat(y).mul_add(b, S::F16::splat(z)));
            let (other, slack) = (S::F16::splat(other), S::F16::splat(slack));
            let (at_near, at_far, plane) = if PARALLEL {
                (near * other, far * other, linear)
            } else {
                (near * linear, far * linear, other)
            };
            let (nearest, farthest) = (plane - slack, plane + slack);
            let never = outside | at_far.lt(nearest) | farthest.lt(at_near);
            let maybe = open & !never.bits();
            let mut found = 0;
            if M::SURE {
                let inside = above.lt(least) | greatest.lt(below);
                let between = farthest.lt(at_far) & at_near.lt(nearest);
                found = maybe & (inside & between).bits();
            }
            self.close(packet, found);
            self.doubts.note(packet, triangle, maybe & !found);
        }

        // What is in doubt still.
        for place in 0..self.doubts.count {
            let (packet, triangle, lanes) = self.doubts.at(place);
            let doubtful = lanes & self.open[packet];
            if doubtful != 0 {
                let found = self.decide(packet, primitives[triangle], S::F16::mask_from_bits(doubtful));
                self.close(packet, found.bits());
            }
        }
    }

    #[inline(always)]
    fn go_alone(&mut self, _: usize, packet: usize, place: usize, tmin: f32, tmax: f32) {
        if self.open[packet] == 0 {
            return;
        }
        let found = S::apart(Alone::<T, M> {
            tree: self.tree,
            rays: &self.rays[packet],
            open: self.open[packet],
            start: &self.seen.start[packet],
            speed: &self.seen.speed[packet],
            place,
            depths: Interval { tmin, tmax },
            mode: PhantomData,
        });
        self.close(packet, found);
    }
}

/// What is in doubt of packets' rays, pair by pair, until all of a block's pairs have been looked at: many a ray turns out to
/// hit something else for certain by then. And whether there is any doubt is what nobody can foresee: so nothing branches
/// on it before.
struct Doubts {
    /// Packets and triangles.
    pairs: [[u8; 2]; Pairs::MOST],
    /// A bit for each ray that is in doubt.
    lanes: [u32; Pairs::MOST],
    count: usize,
}

impl Doubts {
    const fn none() -> Self {
        Self { pairs: [[0; 2]; Pairs::MOST], lanes: [0; Pairs::MOST], count: 0 }
    }

    /// Takes note of one of a block's pairs, none of which comes twice, if there are rays in doubt.
    #[inline(always)]
    fn note(&mut self, packet: usize, triangle: usize, lanes: u32) {
        let place = self.count % Pairs::MOST;
        (self.pairs[place], self.lanes[place]) = ([packet as u8, triangle as u8], lanes);
        self.count += usize::from(lanes != 0);
    }

    /// A packet, a triangle, and the packet's rays.
    #[inline(always)]
    fn at(&self, place: usize) -> (usize, usize, u32) {
        let place = place % Pairs::MOST;
        let [packet, triangle] = self.pairs[place].map(usize::from);
        (packet & 15, triangle & 15, self.lanes[place])
    }
}

/// Rays of a packet of which it is in doubt whether they hit a triangle.
struct Doubt<'a, M: Mode> {
    rays: &'a RayPacket<16>,
    record: &'a M::Record,
    /// A bit for each of them.
    doubtful: u32,
}

impl<M: Mode> Task for Doubt<'_, M> {
    /// Those that do, by the mode's own test.
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        let Self { rays, record, doubtful } = self;
        let test = M::Test::<16, S::F16>::new(&load3(&rays.origin), &load3(&rays.direction), doubtful);
        let lanes = S::F16::mask_from_bits(doubtful);
        let candidate = test.test(record, lanes);
        // As a packet's closest hit is taken, which is none beyond the greatest float.
        let tfar = S::F16::splat(f32::MAX).min(S::F16::load(&rays.tfar));
        let tnear = S::F16::load(&rays.tnear);
        (candidate.inside & lanes & tnear.le(candidate.t) & candidate.t.le(tfar)).bits()
    }
}

/// A packet that goes on alone, as a beam has it.
struct Alone<'a, T, M> {
    tree: &'a T,
    rays: &'a RayPacket<16>,
    /// Its lanes that have found nothing yet, of which there are some.
    open: u32,
    /// Where its rays start, as depths, and how fast they run along the axis of depths.
    start: &'a [f32; 16],
    speed: &'a [f32; 16],
    /// The place of the upper tree below which it goes on.
    place: usize,
    /// From which depth it does, and to which.
    depths: Interval<f32>,
    mode: PhantomData<M>,
}

impl<T: Records<M>, M: Mode> Task for Alone<'_, T, M> {
    /// The lanes that find something.
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        let Self { tree, rays, open, start, speed, place, depths: Interval { tmin, tmax }, .. } = self;
        let (walk, inside) = Walk::<16, S::F16>::new(rays, open, tree.bounds());
        let (start, speed) = (S::F16::load(start), S::F16::load(speed));
        let (one, other) = ((S::F16::splat(tmin) - start) / speed, (S::F16::splat(tmax) - start) / speed);
        let more = (start.abs() + S::F16::splat(tmin.abs().max(tmax.abs()))) / speed.abs()
            * S::F16::splat(ROUNDINGS);
        let interval = Interval {
            tmin: (one.min(other) - more).max(inside.tmin),
            tmax: (one.max(other) + more).min(inside.tmax),
        };
        if !interval.live().any() {
            return 0;
        }
        let test = M::Test::<16, S::F16>::new(&load3(&rays.origin), &load3(&rays.direction), open);
        let mut closest = Closest::new(S::F16::load(&rays.tfar));
        let (tnear, node) = (S::F16::load(&rays.tnear), tree.beneath(place));
        descend::<16, S::F16, T, M, true>(tree, &walk, &test, tnear, node, interval, &mut closest);
        closest.found() & open
    }
}
