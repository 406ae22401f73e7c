//! Packets, and what is asked of them.

use super::{PACKETS, Place, WAYS};
use crate::traverse::accel::Accel;
use crate::traverse::dispatch::choice::Choice;
use crate::traverse::dispatch::places::Costs;
use crate::traverse::kernel::Kernel;
use crate::traverse::lanes::{HitPacket, RayPacket};

/// Has a kernel answer something of packets' lanes, packet by packet.
type Trace<A> = fn(&Accel, &[RayPacket<16>], &[u32], &mut [A]);

/// The kernels that answer it.
pub struct Kernels<A> {
    lists: Trace<A>,
    /// Up to four squares: more than one are a wide beam, if there are any.
    beam: Trace<A>,
    /// Packets of 8, two for each.
    halves: Trace<A>,
    packets: Trace<A>,
}

/// What can be asked of packets.
pub trait Question {
    /// What a packet answers.
    type Answer;

    const KERNELS: Kernels<Self::Answer>;

    /// Whether there are wide beams that answer it.
    const HAS_WIDE_BEAMS: bool;

    /// Whether lists may be the quickest.
    fn may_go_as_lists(accel: &Accel) -> bool;

    /// What is known of a place.
    fn costs<'a>(place: &Place<'a>) -> Option<&'a Costs<{ WAYS.len() }>>;

    /// Has a kernel answer it.
    #[inline(always)]
    fn trace(
        kernel: Kernel,
        accel: &Accel,
        rays: &[RayPacket<16>],
        active: &[u32],
        answers: &mut [Self::Answer],
    ) {
        let Kernels { lists, beam, halves, packets } = Self::KERNELS;
        let trace = match kernel {
            Kernel::Filter => lists,
            Kernel::Tile | Kernel::WideTile => beam,
            Kernel::Packet8 => halves,
            _ => packets,
        };
        trace(accel, rays, active, answers);
    }
}

/// Which hit is the closest.
pub struct Closest;

impl Question for Closest {
    type Answer = HitPacket<16>;

    const KERNELS: Kernels<Self::Answer> = Kernels {
        lists: Accel::intersect_lists,
        beam: Accel::intersect_tile,
        halves: Accel::intersect_halves,
        packets: Accel::intersect_packets::<16>,
    };

    const HAS_WIDE_BEAMS: bool = true;

    /// Through the tree they never are: camera rays take 1.3 times as long as by the best kernel, and more (`docs/coherent.md`).
    #[inline(always)]
    fn may_go_as_lists(accel: &Accel) -> bool {
        accel.pools().is_some()
    }

    #[inline(always)]
    fn costs<'a>(place: &Place<'a>) -> Option<&'a Costs<{ WAYS.len() }>> {
        place.closest
    }
}

/// Whether there is any hit.
pub struct Any;

impl Question for Any {
    type Answer = u32;

    const KERNELS: Kernels<Self::Answer> = Kernels {
        lists: Accel::occluded_lists,
        beam: Accel::occluded_tile,
        halves: Accel::occluded_halves,
        packets: Accel::occluded_packets::<16>,
    };

    const HAS_WIDE_BEAMS: bool = false;

    #[inline(always)]
    fn may_go_as_lists(_: &Accel) -> bool {
        true
    }

    #[inline(always)]
    fn costs<'a>(place: &Place<'a>) -> Option<&'a Costs<{ WAYS.len() }>> {
        place.any
    }
}

/// Packets that something is asked of: a field, a lot, or less.
pub struct Asked<'a, 'p, A> {
    /// What is known of the places of their squares, which may be less than all.
    pub places: &'a [Place<'p>],
    pub rays: &'a [RayPacket<16>],
    /// A bit for each lane in which there is a ray.
    pub active: &'a [u32],
    /// The room for what they answer.
    pub answers: &'a mut [A],
}

impl<'a, 'p, A> Asked<'a, 'p, A> {
    /// The same once more, to be answered before this is.
    pub fn again(&mut self) -> Asked<'_, 'p, A> {
        let Self { places, rays, active, ref mut answers } = *self;
        Asked { places, rays, active, answers }
    }

    /// The first `count` packets, whole squares, or as many as there are; and what is left.
    pub fn split(self, count: usize) -> (Self, Self) {
        let Self { places, rays, active, answers } = self;
        let (places, places_left) = places.split_at(places.len().min(count / PACKETS));
        let count = rays.len().min(count);
        let (rays, rays_left) = rays.split_at(count);
        let (active, active_left) = active.split_at(count);
        let (answers, answers_left) = answers.split_at_mut(count);
        let first = Self { places, rays, active, answers };
        (first, Self { places: places_left, rays: rays_left, active: active_left, answers: answers_left })
    }

    /// Its squares: packets, lanes and answers of each.
    pub fn squares(self) -> impl Iterator<Item = (&'a [RayPacket<16>], &'a [u32], &'a mut [A])> {
        let Self { rays, active, answers, .. } = self;
        let squares = rays.chunks(PACKETS).zip(active.chunks(PACKETS)).zip(answers.chunks_mut(PACKETS));
        squares.map(|((rays, active), answers)| (rays, active, answers))
    }

    /// The number of rays.
    pub fn count(&self) -> usize {
        count(self.active)
    }

    /// Whether it is a lot that is chosen for at once. A scene that is in memory in part has neither wide beams nor lists,
    /// and the first squares are for getting to know the other kernels.
    pub fn is_chosen_for(&self, accel: &Accel, squares: &Choice<{ WAYS.len() }>) -> bool {
        self.rays.len() > PACKETS && accel.cached().is_none() && !squares.is_beginning()
    }

    /// Has a kernel answer it all.
    #[inline(always)]
    pub fn trace<Q: Question<Answer = A>>(self, accel: &Accel, kernel: Kernel) {
        Q::trace(kernel, accel, self.rays, self.active, self.answers);
    }
}

/// The lanes in which there are rays.
pub fn count(active: &[u32]) -> usize {
    active.iter().map(|lanes| lanes.count_ones() as usize).sum()
}
