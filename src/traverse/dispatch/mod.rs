//! The kernel that is quickest for the rays at hand.
//!
//! Where triangles are larger than pixels, a square's rays go best together in a beam; where they are
//! smaller, packet by packet; and where each ray of a packet meets triangles of its own, in smaller
//! packets. Pictures hold all of that. How quick a kernel is hangs on the model, the view, the machine and
//! its instruction set, and nothing that could be known beforehand tells it as well as having tried: so a
//! [`Dispatch`] times what it does, square by square, and does what was quickest nearby, or, in a picture that is not the
//! first of its kind, at that [place](Places). Only time hangs on the choice: hits are the same, bit for bit.

mod choice;
mod places;
mod pool;
mod slices;

pub use pool::DispatchPool;
pub use slices::SliceDispatch;

/// What squares of a picture have cost, for [`Dispatch`].
pub type Places = places::Places<{ WAYS.len() }>;
/// One of [`Places`].
pub type Place<'a> = places::Place<'a, { WAYS.len() }>;

use super::accel::Accel;
use super::kernel::Kernel;
use super::lanes::{HitPacket, RayPacket};
use super::stopwatch::Stopwatch;
use choice::Choice;
use places::Costs;

/// The kernels that it chooses among.
const WAYS: [Kernel; 3] = [Kernel::Tile, Kernel::Packet16, Kernel::Packet8];

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
#[derive(Clone, Copy, Debug, Default)]
pub struct Dispatch {
    closest: Choice<{ WAYS.len() }>,
    any: Choice<{ WAYS.len() }>,
}

impl Dispatch {
    /// As [`Accel::intersect_tile`], by the kernel that is quickest at a place.
    pub fn intersect(
        &mut self,
        accel: &Accel,
        place: Place<'_>,
        rays: &[RayPacket<16>],
        active: &[u32],
        hits: &mut [HitPacket<16>],
    ) {
        timed(accel, &WAYS, &mut self.closest, place.closest, count(active), |kernel| match kernel {
            Kernel::Tile => accel.intersect_tile(rays, active, hits),
            Kernel::Packet8 => accel.intersect_halves(rays, active, hits),
            _ => accel.intersect_packets(rays, active, hits),
        });
    }

    /// As [`Accel::occluded_tile`], by the kernel that is quickest at a place.
    pub fn occluded(
        &mut self,
        accel: &Accel,
        place: Place<'_>,
        rays: &[RayPacket<16>],
        active: &[u32],
        occluded: &mut [u32],
    ) {
        timed(accel, &WAYS, &mut self.any, place.any, count(active), |kernel| match kernel {
            Kernel::Tile => accel.occluded_tile(rays, active, occluded),
            Kernel::Packet8 => accel.occluded_halves(rays, active, occluded),
            _ => accel.occluded_packets(rays, active, occluded),
        });
    }

    /// The kernels that are thought to be quickest at the moment: for closest hits, and for any hit.
    pub fn quickest(&self) -> [Kernel; 2] {
        [WAYS[self.closest.quickest()], WAYS[self.any.quickest()]]
    }
}

/// Has a kernel trace so many rays of a place, and takes note of how long that took.
#[inline(always)]
fn timed<const N: usize>(
    accel: &Accel,
    ways: &[Kernel; N],
    choice: &mut Choice<N>,
    place: Option<&Costs<N>>,
    rays: usize,
    trace: impl FnOnce(Kernel),
) -> usize {
    if accel.cached().is_some_and(|cached| cached.is_short()) {
        trace(ways[FRUGAL]);
        return FRUGAL;
    }
    if rays < LEAST_RAYS {
        let way = choice.quickest();
        trace(ways[way]);
        return way;
    }
    let way = match place {
        Some(costs) => choice.next_at(&costs.known()),
        None => choice.next(),
    };
    let start = Stopwatch::start(accel);
    trace(ways[way]);
    let cost = choice.record(way, rays as u64, start.elapsed(accel));
    if let (Some(costs), Some(cost)) = (place, cost) {
        costs.record(way, cost);
    }
    way
}

/// The lanes in which there are rays.
fn count(active: &[u32]) -> usize {
    active.iter().map(|lanes| lanes.count_ones() as usize).sum()
}
