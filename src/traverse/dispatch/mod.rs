//! The kernel that is quickest for the rays at hand.
//!
//! Where triangles are larger than pixels, a square's rays go best together in a beam; where they are
//! smaller, packet by packet; and where each ray of a packet meets triangles of its own, in smaller
//! packets, unless a register holds a whole one. Pictures hold all of that. How quick a kernel is hangs on the model, the view, the machine and
//! its instruction set, and nothing that could be known beforehand tells it as well as having tried: so a
//! [`Dispatch`] times what it does, square by square, and does what was quickest nearby, or, in a picture that is not the
//! first of its kind, at that [place](Places). Only time hangs on the choice: hits are the same, bit for bit.
//!
//! It is chosen twice. Four squares may go as one wide beam where squares go best as beams, or, for any hit, as lists of rays
//! where they do not: which is better is learnt from what a *lot* of four has cost either way. If they do neither, each of
//! them is chosen for by itself, as triangles as small as pixels want it. Where lots go as lists, up to four lots may be one list.
//!
//! What a choice costs counts where rays take 10 ns. So where squares go best as beams, or there is next to nothing to be met, and
//! nothing else is to be tried, a lot's squares are timed together.

mod choice;
mod places;
mod pool;
mod slices;

pub use pool::DispatchPool;
pub use slices::{ScatteredDispatch, SliceDispatch};

/// What squares of a picture have cost, for [`Dispatch`].
pub type Places = places::Places<{ WAYS.len() }>;
/// One of [`Places`].
pub type Place<'a> = places::Place<'a, { WAYS.len() }>;

use super::accel::Accel;
use super::kernel::Kernel;
use super::lanes::{HitPacket, RayPacket};
use super::stopwatch::Stopwatch;
use super::tile::PACKETS;
use crate::simd::Isa;
use choice::Choice;
use places::Costs;

/// The kernels that it chooses among for a square of sixteen packets.
const WAYS: [Kernel; 3] = [Kernel::Tile, Kernel::Packet16, Kernel::Packet8];

/// The first of them.
const BEAM: usize = 0;

/// What it chooses among for a lot of such squares: a wide beam (lists, for any hit), or each square by itself. Kernels that
/// are named here stand for what is done.
const LOT_WAYS: [Kernel; 2] = [Kernel::WideTile, Kernel::Tile];
const ANY_LOT_WAYS: [Kernel; 2] = [Kernel::Filter, Kernel::Tile];

/// What a lot costs beside what is timed, as a logarithm: lots that go one way and another by turns find neither the code nor what
/// it works with at hand. Where each other lot of the statue's camera rays went wide, all took 1.085 times as long as small beams,
/// where wide ones alone take 1.055 times.
const BESIDE: [f32; LOT_WAYS.len()] = [0.08, 0.0];

/// The first of each.
const WIDE: usize = 0;
const LISTS: usize = 0;

/// Packets of a lot. More than that are a *field*, which for any hit may go as one list.
const LOT: usize = 4 * PACKETS;

/// What is used where memory is short. Beams need the upper tree's pages and packets the full tree's leaves:
/// who uses both needs both in memory. On a power plant of which 16 % were in memory, packets alone read 28 %
/// fewer blocks and were a fifth faster.
const FRUGAL: usize = 1;

/// Fewer rays than this say nothing about a kernel: reading the clock takes as long.
const LEAST_RAYS: usize = 64;

/// What one worker has learnt about which kernel is quickest: for closest hits, and for any hit.
///
/// It is meant for rays that come in the order of a picture, each square's together, one `Dispatch` for
/// each kind of ray and each thread.
#[derive(Clone, Copy, Debug)]
pub struct Dispatch {
    lots: Choice<{ LOT_WAYS.len() }>,
    any_lots: Choice<{ ANY_LOT_WAYS.len() }>,
    closest: Choice<{ WAYS.len() }>,
    any: Choice<{ WAYS.len() }>,
    /// Logarithm of the least that lists have taken for a ray.
    least_by_lists: Option<f32>,
}

impl Default for Dispatch {
    fn default() -> Self {
        Self {
            lots: Choice::of_all_places(BESIDE),
            any_lots: Choice::default(),
            closest: Choice::default(),
            any: Choice::default(),
            least_by_lists: None,
        }
    }
}

impl Dispatch {
    /// As [`Accel::intersect_packet`] for each of some packets, by the kernel that is quickest at these places, one for each sixteen
    /// packets; of squares that have none nothing is known.
    pub fn intersect(
        &mut self,
        accel: &Accel,
        places: &[Place<'_>],
        rays: &[RayPacket<16>],
        active: &[u32],
        hits: &mut [HitPacket<16>],
    ) {
        leave_out_halves(accel, &WAYS, &mut self.closest);
        for lot in (Asked { places, rays, active, answers: hits }).lots() {
            self.intersect_lot(accel, lot);
        }
    }

    /// The same for one lot.
    fn intersect_lot(&mut self, accel: &Accel, lot: Asked<'_, '_, HitPacket<16>>) {
        let Self { lots, closest, .. } = self;
        // Where packets are quicker than beams, wide ones are out of the question.
        let packets_were_quicker =
            |place: &Place<'_>| place.closest.is_some_and(|costs| costs.is_slower(BEAM));
        let in_beams = closest.quickest() == BEAM && !lot.places.iter().any(packets_were_quicker);
        if !lot.is_chosen_for(accel, closest) || !in_beams {
            return Self::squares(closest, accel, lot);
        }
        let taken = timed(accel, &LOT_WAYS, lots, None, lot.count(), |kernel| match kernel {
            Kernel::WideTile => accel.intersect_tile(lot.rays, lot.active, lot.answers),
            _ => Self::squares(closest, accel, lot),
        });
        if let Some((WIDE, cost)) = taken {
            closest.pass(cost);
        }
    }

    /// The same, square by square.
    fn squares(choice: &mut Choice<{ WAYS.len() }>, accel: &Accel, lot: Asked<'_, '_, HitPacket<16>>) {
        let places = lot.places.iter().map(|place| place.closest);
        by_squares(choice, accel, places, lot, |kernel, rays, active, hits| match kernel {
            Kernel::Tile => accel.intersect_tile(rays, active, hits),
            Kernel::Packet8 => accel.intersect_halves(rays, active, hits),
            _ => accel.intersect_packets(rays, active, hits),
        });
    }

    /// As [`Accel::occluded_packet`] for each, likewise.
    pub fn occluded(
        &mut self,
        accel: &Accel,
        places: &[Place<'_>],
        rays: &[RayPacket<16>],
        active: &[u32],
        occluded: &mut [u32],
    ) {
        leave_out_halves(accel, &WAYS, &mut self.any);
        // Longer lists are quicker than short ones. Where all lots are thought to go as lists, they are one.
        let Self { any_lots, any, .. } = self;
        let field = Asked { places, rays, active, answers: occluded };
        let (lots, count) = (rays.len().div_ceil(LOT), field.count());
        let may_be_one = lots > 1 && field.is_chosen_for(accel, any) && count >= LEAST_RAYS;
        let in_lists = may_be_one && go_as_lists(any_lots);
        if in_lists && any_lots.settles_on(LISTS, lots) {
            let trace = || accel.occluded_lists(rays, active, field.answers);
            if let Some(cost) = recorded(accel, any_lots, LISTS, count, trace) {
                self.passed_as_lists(cost);
            }
            return;
        }
        for lot in field.lots() {
            self.occluded_lot(accel, lot);
        }
    }

    /// Takes note of what a ray took where lists did, logarithm of nanoseconds.
    fn passed_as_lists(&mut self, cost: f32) {
        self.any.pass(cost);
        self.least_by_lists = Some(self.least_by_lists.map_or(cost, |least| least.min(cost)));
    }

    /// The same for one lot.
    fn occluded_lot(&mut self, accel: &Accel, lot: Asked<'_, '_, u32>) {
        let Self { any_lots, any, least_by_lists, .. } = self;
        // Where beams are quicker than packets, they are quicker than lists, unless it has turned out otherwise. And rays that run
        // through little are not worth a list's trouble, which costs something even where they meet nothing.
        let is_cheap = any_lots.quickest() != LISTS && least_by_lists.is_some_and(|least| any.last() < least);
        let in_beams = any.quickest() == BEAM && !go_as_lists(any_lots);
        if !lot.is_chosen_for(accel, any) || in_beams || is_cheap {
            Self::occluded_squares(any, accel, lot);
            return any_lots.pass(any.last());
        }
        let taken = timed(accel, &ANY_LOT_WAYS, any_lots, None, lot.count(), |kernel| match kernel {
            Kernel::Filter => accel.occluded_lists(lot.rays, lot.active, lot.answers),
            _ => Self::occluded_squares(any, accel, lot),
        });
        if let Some((LISTS, cost)) = taken {
            self.passed_as_lists(cost);
        }
    }

    /// The same, square by square.
    fn occluded_squares(choice: &mut Choice<{ WAYS.len() }>, accel: &Accel, lot: Asked<'_, '_, u32>) {
        let places = lot.places.iter().map(|place| place.any);
        by_squares(choice, accel, places, lot, |kernel, rays, active, found| match kernel {
            Kernel::Tile => accel.occluded_tile(rays, active, found),
            Kernel::Packet8 => accel.occluded_halves(rays, active, found),
            _ => accel.occluded_packets(rays, active, found),
        });
    }

    /// The kernels that are thought to be quickest at the moment: for closest hits, and for any hit.
    pub fn quickest(&self) -> [Kernel; 2] {
        let (closest, any) = (WAYS[self.closest.quickest()], WAYS[self.any.quickest()]);
        let of_lots = |kernel, lots: &Choice<2>, ways: [Kernel; 2]| {
            if lots.is_beginning() || ways[lots.quickest()] == Kernel::Tile { kernel } else { ways[0] }
        };
        [
            if closest == Kernel::Tile { of_lots(closest, &self.lots, LOT_WAYS) } else { closest },
            if any == Kernel::Tile { any } else { of_lots(any, &self.any_lots, ANY_LOT_WAYS) },
        ]
    }
}

/// Packets that something is asked of: a field, a lot, or less.
struct Asked<'a, 'p, A> {
    /// What is known of the places of their squares, which may be less than all.
    places: &'a [Place<'p>],
    rays: &'a [RayPacket<16>],
    /// A bit for each lane in which there is a ray.
    active: &'a [u32],
    /// The room for what they answer.
    answers: &'a mut [A],
}

impl<'a, 'p, A> Asked<'a, 'p, A> {
    /// Its lots, one after the other.
    fn lots(self) -> impl Iterator<Item = Self> {
        let Self { places, rays, active, answers } = self;
        let places = places.chunks(LOT / PACKETS).chain(std::iter::repeat(&[] as &[_]));
        let lots = rays.chunks(LOT).zip(active.chunks(LOT)).zip(answers.chunks_mut(LOT)).zip(places);
        lots.map(|(((rays, active), answers), places)| Self { places, rays, active, answers })
    }

    /// The number of rays.
    fn count(&self) -> usize {
        count(self.active)
    }

    /// Whether it is a lot that is chosen for at once. A scene that is in memory in part has neither wide beams nor lists,
    /// and the first squares are for getting to know the other kernels.
    fn is_chosen_for(&self, accel: &Accel, squares: &Choice<{ WAYS.len() }>) -> bool {
        self.rays.len() > PACKETS && accel.cached().is_none() && !squares.is_beginning()
    }
}

/// Leaves out packets of 8 where a register holds sixteen rays. They never are the quickest there, and were tried for nothing.
fn leave_out_halves<const N: usize>(accel: &Accel, ways: &[Kernel; N], choice: &mut Choice<N>) {
    if accel.isa() == Isa::Avx512
        && let Some(halves) = ways.iter().position(|&way| way == Kernel::Packet8)
    {
        choice.leave_out(halves);
    }
}

/// Whether lists have turned out to be quicker for lots.
fn go_as_lists(any_lots: &Choice<{ ANY_LOT_WAYS.len() }>) -> bool {
    !any_lots.is_beginning() && any_lots.quickest() == LISTS
}

/// Has packets traced square by square, each by the kernel that is quickest at its place; `trace` writes a square's answers.
#[inline(always)]
fn by_squares<'a, A>(
    choice: &mut Choice<{ WAYS.len() }>,
    accel: &Accel,
    places: impl Iterator<Item = Option<&'a Costs<{ WAYS.len() }>>> + Clone,
    lot: Asked<'_, '_, A>,
    trace: impl Fn(Kernel, &[RayPacket<16>], &[u32], &mut [A]),
) {
    let (squares, count_of_all) = (lot.rays.len().div_ceil(PACKETS), lot.count());
    let may_go_together = lot.is_chosen_for(accel, choice) && count_of_all >= LEAST_RAYS;
    let together = if may_go_together { way_of_all(choice, places.clone(), squares) } else { None };
    let Asked { rays, active, answers, .. } = lot;
    let squares = rays.chunks(PACKETS).zip(active.chunks(PACKETS)).zip(answers.chunks_mut(PACKETS));
    if let Some(way) = together {
        let trace_all =
            || squares.for_each(|((rays, active), answers)| trace(WAYS[way], rays, active, answers));
        recorded(accel, choice, way, count_of_all, trace_all);
        return;
    }
    for (((rays, active), answers), place) in squares.zip(places.chain(std::iter::repeat(None))) {
        timed(accel, &WAYS, choice, place, count(active), |kernel| trace(kernel, rays, active, answers));
    }
}

/// The way that all of a lot's squares go, with nothing to be learnt of any by itself: as beams, or, where there is next to nothing,
/// whichever way.
fn way_of_all<'a>(
    choice: &mut Choice<{ WAYS.len() }>,
    places: impl Iterator<Item = Option<&'a Costs<{ WAYS.len() }>>> + Clone,
    squares: usize,
) -> Option<usize> {
    if places.clone().flatten().next().is_none() {
        let way = if choice.is_cheapest() { choice.quickest() } else { BEAM };
        return choice.settles_on(way, squares).then_some(way);
    }
    let go_best = |costs: &Costs<{ WAYS.len() }>| costs.known()[BEAM].is_some() && !costs.is_slower(BEAM);
    (places.flatten().all(go_best) && choice.settles_there()).then_some(BEAM)
}

/// Has a kernel trace so many rays of a place, and takes note of how long that took. Gives the way, and the logarithm of the
/// nanoseconds that a ray took, if note was taken.
#[inline(always)]
fn timed<const N: usize>(
    accel: &Accel,
    ways: &[Kernel; N],
    choice: &mut Choice<N>,
    place: Option<&Costs<N>>,
    rays: usize,
    trace: impl FnOnce(Kernel),
) -> Option<(usize, f32)> {
    if accel.cached().is_some_and(|cached| cached.is_short()) {
        trace(ways[FRUGAL]);
        return None;
    }
    if rays < LEAST_RAYS {
        trace(ways[choice.quickest()]);
        return None;
    }
    let way = match place {
        Some(costs) => choice.next_at(&costs.known()),
        None => choice.next(),
    };
    let cost = recorded(accel, choice, way, rays, || trace(ways[way]))?;
    if let Some(costs) = place {
        costs.record(way, cost);
    }
    Some((way, cost))
}

/// Has a way trace so many rays, and takes note of how long that took.
#[inline(always)]
fn recorded<const N: usize>(
    accel: &Accel,
    choice: &mut Choice<N>,
    way: usize,
    rays: usize,
    trace: impl FnOnce(),
) -> Option<f32> {
    let start = Stopwatch::start(accel);
    trace();
    choice.record(way, rays, start.elapsed(accel))
}

/// The lanes in which there are rays.
fn count(active: &[u32]) -> usize {
    active.iter().map(|lanes| lanes.count_ones() as usize).sum()
}

#[cfg(test)]
mod tests;
