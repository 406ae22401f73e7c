//! The kernel that is quickest for the rays at hand.
//!
//! Where triangles are larger than pixels, a square's rays go best together in a beam; where they are
//! smaller, packet by packet; and where each ray of a packet meets triangles of its own, in smaller
//! packets, unless a register holds a whole one. Pictures hold all of that. How quick a kernel is hangs on the model, the view, the machine and
//! its instruction set, and nothing that could be known beforehand tells it as well as having tried: so a
//! [`Dispatch`] times what it does, square by square, and does what was quickest nearby, or, in a picture that is not the
//! first of its kind, at that [place](Places). Only time hangs on the choice: hits are the same, bit for bit.
//!
//! It is chosen up to three times. A *lot* of four squares may go as lists of rays; if it does not, as one wide beam, where squares go
//! best as beams. Lists are compared with beams by what lots have cost either way, wide beams with squares by what the same
//! lots have cost both ways ([`duel`]). If a lot does neither, each of its squares is chosen for by itself, as triangles as small as pixels
//! want it. Of some lots at once, a *field*, all go as one list that are left when a list's turn comes.
//!
//! What a choice costs counts where rays take 10 ns. So where squares go best as beams, or there is next to nothing to be met, and
//! nothing else is to be tried, a lot's squares are timed together.

mod asked;
mod choice;
mod duel;
mod learnt;
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
use asked::{Any, Asked, Closest};
use choice::Choice;
use learnt::Learnt;

/// The kernels that it chooses among for a square of sixteen packets.
const WAYS: [Kernel; 3] = [Kernel::Tile, Kernel::Packet16, Kernel::Packet8];

/// The first of them.
const BEAM: usize = 0;

/// What it chooses among for a lot of such squares: lists, or beams; and then, a wide beam, or each square by itself, of which there are
/// two, too.
const LISTS_OR_BEAMS: usize = 2;

/// The first of each.
const LISTS: usize = 0;
const WIDE: usize = 0;

/// Packets of a lot. More than that are a field.
const LOT: usize = 4 * PACKETS;

/// Packets that go as one list, at most: as many as it holds.
const LIST: usize = Kernel::Filter.width() / 16;

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
    closest: Learnt,
    any: Learnt,
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
        self.closest.field::<Closest>(accel, Asked { places, rays, active, answers: hits });
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
        self.any.field::<Any>(accel, Asked { places, rays, active, answers: occluded });
    }

    /// The kernels that are thought to be quickest at the moment: for closest hits, and for any hit.
    pub fn quickest(&self) -> [Kernel; 2] {
        [self.closest.quickest(), self.any.quickest()]
    }

    /// Kernels, and how many rays each has traced. One may be there more than once; rays that went two ways, to compare these, count with
    /// either.
    pub fn traced(&self) -> impl Iterator<Item = (Kernel, u64)> + use<> {
        let [Traced(closest), Traced(any)] = [self.closest.beams.traced, self.any.beams.traced];
        Kernel::ALL.into_iter().zip(closest).chain(Kernel::ALL.into_iter().zip(any))
    }

    /// Whether rays that look for closest hits go as lists at the moment, which are the quicker the more of them go at once.
    pub fn looks_in_lists(&self) -> bool {
        self.closest.go_as_lists()
    }
}

/// How many rays each kernel has traced.
#[derive(Clone, Copy, Debug, Default)]
struct Traced([u64; Kernel::ALL.len()]);

impl Traced {
    /// So many more.
    const fn add(&mut self, kernel: Kernel, rays: usize) {
        self.0[kernel as usize] += rays as u64;
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

#[cfg(test)]
mod tests;
