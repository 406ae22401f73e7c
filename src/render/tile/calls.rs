//! How the packets of a square, a lot or a field of pixels are traced.

use super::{BATCH, LOT, LOTS, SQUARE, SQUARES};
use crate::geometry::{Hit, Ray};
use crate::traverse::{Accel, Dispatch, HitPacket, Kernel, PacketWidth, Place, RayPacket};

/// Answers, packet by packet, what was asked of their lanes at the places of their squares.
type Call<const W: usize, A> = fn(&mut Dispatch, &Accel, &[Place<'_>], &[RayPacket<W>], &[u32], &mut [A]);

/// How a square's packets are traced. What was learnt from the squares before is there for those who can
/// use it.
pub struct Calls<const W: usize> {
    /// Side of the square of pixels whose packets come at once: [`SQUARE`] or [`LOT`].
    pub side: u32,
    /// So many such squares, to the right and down, have their shadow rays traced at once, and camera rays that go as lists: 1 or
    /// [`LOTS`].
    pub lots: u32,
    /// The closest hits of the lanes given with each packet.
    pub intersect: Call<W, HitPacket<W>>,
    /// Which of those lanes hit anything.
    pub occluded: Call<W, u32>,
}

impl<const W: usize> Calls<W>
where
    RayPacket<W>: PacketWidth<W>,
{
    /// The same in tiles of such a side, where there may be no room for so many lots.
    pub fn within(self, tile: u32) -> Self {
        Self { lots: self.lots.min(tile.div_ceil(self.side)), ..self }
    }

    /// Packet by packet.
    pub const PACKETS: Self = Self {
        side: SQUARE,
        lots: 1,
        intersect: |_, accel, _, rays, active, hits| accel.intersect_packets(rays, active, hits),
        occluded: |_, accel, _, rays, active, occluded| accel.occluded_packets(rays, active, occluded),
    };
}

impl Calls<1> {
    /// All rays of a square in one stream.
    pub const STREAM: Self = Self {
        side: SQUARE,
        lots: 1,
        intersect: |_, accel, _, rays, active, hits| {
            intersect_each(accel, Kernel::Stream, rays, active, hits)
        },
        occluded: |_, accel, _, rays, active, found| {
            occluded_each(accel, Kernel::Stream, rays, active, found)
        },
    };

    /// All rays of a lot in lists.
    pub const LISTS: Self = Self {
        side: LOT,
        lots: 1,
        intersect: |_, accel, _, rays, active, hits| {
            intersect_each(accel, Kernel::Filter, rays, active, hits)
        },
        occluded: |_, accel, _, rays, active, found| {
            occluded_each(accel, Kernel::Filter, rays, active, found)
        },
    };
}

/// Traces rays one by one, as the kernel sees it.
fn intersect_each(
    accel: &Accel,
    kernel: Kernel,
    rays: &[RayPacket<1>],
    active: &[u32],
    hits: &mut [HitPacket<1>],
) {
    let mut found = [Hit::MISS; SQUARES * BATCH];
    let found = &mut found[..rays.len()];
    accel.intersect_many(kernel, &unpacked(rays, active)[..rays.len()], found);
    for (packet, hit) in hits.iter_mut().zip(found) {
        *packet = HitPacket::of_hit(hit);
    }
}

/// The same for any hit.
fn occluded_each(accel: &Accel, kernel: Kernel, rays: &[RayPacket<1>], active: &[u32], occluded: &mut [u32]) {
    let mut found = [false; SQUARES * BATCH];
    let found = &mut found[..rays.len()];
    accel.occluded_many(kernel, &unpacked(rays, active)[..rays.len()], found);
    for (lanes, &found) in occluded.iter_mut().zip(&*found) {
        *lanes = u32::from(found);
    }
}

/// Rays one by one; those that do not count look for nothing.
fn unpacked(rays: &[RayPacket<1>], active: &[u32]) -> [Ray; SQUARES * BATCH] {
    let mut all = [RayPacket::<1>::empty().get(0); SQUARES * BATCH];
    for ((ray, packet), &active) in all.iter_mut().zip(rays).zip(active) {
        if active != 0 {
            *ray = packet.get(0);
        }
    }
    all
}

impl Calls<16> {
    /// All rays of a square together where that is quicker.
    pub const TILES: Self =
        Self { side: SQUARE, lots: 1, intersect: Dispatch::intersect, occluded: Dispatch::occluded };

    /// All rays of a lot, likewise, and shadow rays and lists of more than one.
    pub const LOTS: Self = Self { side: LOT, lots: LOTS, ..Self::TILES };
}
