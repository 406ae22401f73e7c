//! What is asked of a tree, in whichever mode and on whichever instruction set was chosen.

use super::lanes::{HitPacket, PacketWidth, RayPacket};
use super::packet;
use super::tile::{self, PACKETS, TileCounts};
use crate::geometry::triangle::Mode;
use crate::kdtree::KdTree;
use crate::simd::{Simd, Task};

/// A call of a kernel.
pub trait Query {
    /// What it gives.
    type Output;

    /// Calls the kernel. `records` holds what the mode keeps of each triangle. Always inlined.
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> Self::Output;
}

/// A query in a mode, to be run on an instruction set.
pub struct InMode<'a, Q, M: Mode> {
    pub query: Q,
    pub tree: &'a KdTree,
    pub records: &'a [M::Record],
}

impl<Q: Query, M: Mode> Task for InMode<'_, Q, M> {
    type Output = Q::Output;

    #[inline(always)]
    fn run<S: Simd>(self) -> Q::Output {
        self.query.run::<S, M>(self.tree, self.records)
    }
}

/// The closest hits of a packet's lanes in `active`.
pub struct IntersectPacket<'a, const W: usize> {
    pub rays: &'a RayPacket<W>,
    pub active: u32,
}

impl<const W: usize> Query for IntersectPacket<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = HitPacket<W>;

    #[inline(always)]
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> HitPacket<W> {
        let Self { rays, active } = self;
        packet::intersect::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>, _, M>(tree, records, rays, active)
    }
}

/// The lanes in `active` of a packet that hit anything.
pub struct OccludedPacket<'a, const W: usize> {
    pub rays: &'a RayPacket<W>,
    pub active: u32,
}

impl<const W: usize> Query for OccludedPacket<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> u32 {
        let Self { rays, active } = self;
        packet::occluded::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>, _, M>(tree, records, rays, active)
    }
}

/// The closest hits of a tile, if it is a beam.
pub struct IntersectTile<'a> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [u32; PACKETS],
    pub hits: &'a mut [HitPacket<16>],
}

impl Query for IntersectTile<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> bool {
        let Self { rays, active, hits } = self;
        tile::intersect::<S, _, M, _>(tree, records, rays, active, hits, &mut ())
    }
}

/// The lanes of a tile that hit anything, if it is a beam.
pub struct OccludedTile<'a> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [u32; PACKETS],
    pub found: &'a mut [u32],
}

impl Query for OccludedTile<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> bool {
        let Self { rays, active, found } = self;
        tile::occluded::<S, _, M, _>(tree, records, rays, active, found, &mut ())
    }
}

/// What the tile kernel does with a tile; whether it is a beam.
pub struct CountTile<'a> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [u32; PACKETS],
    pub any_hit: bool,
    pub counts: &'a mut TileCounts,
}

impl Query for CountTile<'_> {
    type Output = bool;

    #[inline(always)]
    fn run<S: Simd, M: Mode>(self, tree: &KdTree, records: &[M::Record]) -> bool {
        let Self { rays, active, any_hit, counts } = self;
        if any_hit {
            let found = &mut [0; PACKETS][..rays.len()];
            tile::occluded::<S, _, M, _>(tree, records, rays, active, found, counts)
        } else {
            let hits = &mut [const { HitPacket::miss() }; PACKETS][..rays.len()];
            tile::intersect::<S, _, M, _>(tree, records, rays, active, hits, counts)
        }
    }
}
