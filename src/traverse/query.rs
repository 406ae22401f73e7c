//! What is asked of a tree, in whichever mode and on whichever instruction set was chosen.

use super::lanes::{HitPacket, RayPacket};
use super::packet;
use super::records::{Records, Resident};
use super::tile::{self, PACKETS, TileCounts};
use super::width::PacketWidth;
use crate::geometry::triangle::Mode;
use crate::simd::{Simd, Task};
use std::marker::PhantomData;

/// A call of a kernel.
pub trait Query {
    /// What it gives.
    type Output;

    /// Calls the kernel. Always inlined.
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) -> Self::Output;
}

/// A query in a mode, to be run on an instruction set.
pub struct InMode<'a, Q, M, T> {
    query: Q,
    tree: &'a T,
    mode: PhantomData<M>,
}

impl<'a, Q: Query, M: Mode, T: Records<M>> InMode<'a, Q, M, T> {
    pub fn new(query: Q, tree: &'a T) -> Self {
        Self { query, tree, mode: PhantomData }
    }
}

impl<Q: Query, M: Mode, T: Records<M>> Task for InMode<'_, Q, M, T> {
    type Output = Q::Output;

    #[inline(always)]
    fn run<S: Simd>(self) -> Q::Output {
        self.query.run::<S, M, T>(self.tree)
    }
}

/// A call of a kernel that knows no scene but one that is all in memory.
pub trait ResidentQuery {
    /// Calls the kernel. Always inlined.
    fn run<S: Simd, M: Mode>(self, tree: &Resident<'_, M::Record>);
}

/// Such a query in a mode, to be run on an instruction set.
pub struct ResidentInMode<'a, Q, M: Mode> {
    pub query: Q,
    pub tree: Resident<'a, M::Record>,
}

impl<Q: ResidentQuery, M: Mode> Task for ResidentInMode<'_, Q, M> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        self.query.run::<S, M>(&self.tree);
    }
}

/// The closest hits of packets' lanes in `active`, packet by packet. In a scene that is in memory in part, all of them
/// look through one view.
pub struct IntersectPackets<'a, const W: usize> {
    pub rays: &'a [RayPacket<W>],
    pub active: &'a [u32],
    pub hits: &'a mut [HitPacket<W>],
}

impl<const W: usize> Query for IntersectPackets<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) {
        let Self { rays, active, hits } = self;
        for ((rays, &active), hits) in rays.iter().zip(active).zip(hits) {
            *hits =
                packet::intersect::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>, _, M>(tree, rays, active);
        }
    }
}

/// The lanes in `active` of packets that hit anything, likewise.
pub struct OccludedPackets<'a, const W: usize> {
    pub rays: &'a [RayPacket<W>],
    pub active: &'a [u32],
    pub found: &'a mut [u32],
}

impl<const W: usize> Query for OccludedPackets<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = ();

    #[inline(always)]
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) {
        let Self { rays, active, found } = self;
        for ((rays, &active), found) in rays.iter().zip(active).zip(found) {
            // Of shadow rays, whole packets may have nothing to ask.
            *found = match active {
                0 => 0,
                _ => packet::occluded::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>, _, M>(
                    tree, rays, active,
                ),
            };
        }
    }
}

/// The closest hits of the lanes of `K` squares' packets that are part of a beam; the other lanes.
pub struct IntersectTile<'a, const K: usize> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [[u32; PACKETS]; K],
    pub hits: &'a mut [HitPacket<16>],
}

impl<const K: usize> Query for IntersectTile<'_, K> {
    type Output = [[u32; PACKETS]; K];

    #[inline(always)]
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) -> [[u32; PACKETS]; K] {
        let Self { rays, active, hits } = self;
        tile::intersect::<S, _, M, _, K>(tree, rays, active, hits, &mut ())
    }
}

/// The lanes of a tile that hit anything, of those that are part of a beam, added to `found`; the other lanes.
pub struct OccludedTile<'a> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [u32; PACKETS],
    pub found: &'a mut [u32],
}

impl Query for OccludedTile<'_> {
    type Output = [u32; PACKETS];

    #[inline(always)]
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) -> [u32; PACKETS] {
        let Self { rays, active, found } = self;
        tile::occluded::<S, _, M, _>(tree, rays, active, found, &mut ())
    }
}

/// What the tile kernel does with a tile; the lanes that are part of no beam.
pub struct CountTile<'a> {
    pub rays: &'a [RayPacket<16>],
    pub active: &'a [u32; PACKETS],
    pub any_hit: bool,
    pub counts: &'a mut TileCounts,
}

impl Query for CountTile<'_> {
    type Output = [u32; PACKETS];

    #[inline(always)]
    fn run<S: Simd, M: Mode, T: Records<M>>(self, tree: &T) -> [u32; PACKETS] {
        let Self { rays, active, any_hit, counts } = self;
        if any_hit {
            let found = &mut [0; PACKETS][..rays.len()];
            tile::occluded::<S, _, M, _>(tree, rays, active, found, counts)
        } else {
            let hits = &mut [const { HitPacket::miss() }; PACKETS][..rays.len()];
            let [left] = tile::intersect::<S, _, M, _, 1>(tree, rays, &[*active], hits, counts);
            left
        }
    }
}
