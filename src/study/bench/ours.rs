//! raypack as an engine: a mode for every kernel.
//!
//! The single-ray kernel is given rays, the packet kernels packets, each made before the clock starts; the
//! records go out in the kernel's own form.

use super::engine::{Contender, Engine, Lot, Results, collect};
use crate::error::Result;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use crate::simd::Isa;
use crate::traverse::{Accel, HitPacket, Kernel, PacketWidth, RayPacket};
use std::time::Instant;

/// raypack with its tree built.
#[derive(Debug)]
pub struct Ours {
    accel: Accel,
    build_seconds: f64,
    bytes: u64,
}

impl Ours {
    /// Builds the tree.
    ///
    /// # Errors
    /// Nothing can be built from the mesh.
    pub fn new(mesh: &Mesh, params: &BuildParams, isa: Isa, accuracy: Accuracy) -> Result<Self> {
        let start = Instant::now();
        let accel = Accel::build(mesh, params)?.with_isa(isa).with_accuracy(accuracy);
        let build_seconds = start.elapsed().as_secs_f64();
        Ok(Self::of_accel(accel, build_seconds))
    }

    /// The same with a tree that has been built, in so many seconds.
    pub fn of_accel(accel: Accel, build_seconds: f64) -> Self {
        let bytes = (accel.stats().bytes() + accel.record_bytes()) as u64;
        Self { accel, build_seconds, bytes }
    }

    /// Seconds that the build took.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// The built tree.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    fn packets<'a, const W: usize>(&'a self, rays: &[Ray], any_hit: bool) -> Box<dyn Contender + 'a>
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let lots = Lot::cut(rays, any_hit, HitPacket::miss(), |n| n.div_ceil(W), Packets::<W>::new);
        Box::new(PacketRun { engine: self, lots })
    }
}

impl Engine for Ours {
    fn name(&self) -> &'static str {
        "raypack"
    }

    fn version(&self) -> String {
        env!("CARGO_PKG_VERSION").into()
    }

    fn isa(&self) -> String {
        self.accel.isa().name().into()
    }

    fn accuracy(&self) -> Option<Accuracy> {
        Some(self.accel.accuracy())
    }

    /// Every kernel is reported: how far the kernels lie apart is what a reader wants to see.
    fn qualifies(&self) -> bool {
        false
    }

    fn contenders<'a>(&'a self, rays: &[Ray], any_hit: bool) -> Vec<Box<dyn Contender + 'a>> {
        let contender = |kernel| match kernel {
            Kernel::Single => {
                let lots = Lot::cut(rays, any_hit, Hit::MISS, |n| n, <[Ray]>::to_vec);
                Box::new(SingleRun { engine: self, lots })
            }
            Kernel::Packet4 => self.packets::<4>(rays, any_hit),
            Kernel::Packet8 => self.packets::<8>(rays, any_hit),
            Kernel::Packet16 => self.packets::<16>(rays, any_hit),
            Kernel::Tile => {
                let lots = Lot::cut(rays, any_hit, HitPacket::miss(), |n| n.div_ceil(16), Packets::new);
                Box::new(TileRun { engine: self, lots })
            }
        };
        Kernel::ALL.map(contender).into()
    }
}

struct SingleRun<'a> {
    engine: &'a Ours,
    lots: Vec<Lot<Vec<Ray>, Hit, bool>>,
}

impl Contender for SingleRun<'_> {
    fn mode(&self) -> String {
        Kernel::Single.name().into()
    }

    fn build_seconds(&self) -> f64 {
        self.engine.build_seconds
    }

    fn bytes(&self) -> u64 {
        self.engine.bytes
    }

    fn trace(&self, chunk: usize) {
        let accel = &self.engine.accel;
        self.lots[chunk].trace(
            |rays, hits| accel.intersect_many(Kernel::Single, rays, hits),
            |rays, flags| accel.occluded_many(Kernel::Single, rays, flags),
        );
    }

    fn results(&self) -> Results {
        collect(&self.lots, |hits, _, all| all.extend(hits), |flags, _, all| all.extend(flags))
    }
}

/// Packets in a tile.
const TILE: usize = 16;

/// Packets of `W`, all full but perhaps the last.
struct Packets<const W: usize> {
    packets: Vec<RayPacket<W>>,
    /// A bit for each ray of a packet.
    lanes: Vec<u32>,
    rays: usize,
}

impl<const W: usize> Packets<W> {
    fn new(rays: &[Ray]) -> Self {
        Self {
            packets: rays.chunks(W).map(RayPacket::of_slice).collect(),
            lanes: rays.chunks(W).map(|rays| (1 << rays.len()) - 1).collect(),
            rays: rays.len(),
        }
    }

    /// Each packet with a bit for each of its rays.
    #[inline(always)]
    fn with_lanes(&self) -> impl Iterator<Item = (&RayPacket<W>, u32)> {
        self.packets.iter().zip(self.lanes.iter().copied())
    }

    /// Packets a tile at a time, with a bit for each of their rays.
    #[inline(always)]
    fn tiles(&self) -> impl Iterator<Item = (&[RayPacket<W>], &[u32])> {
        self.packets.chunks(TILE).zip(self.lanes.chunks(TILE))
    }
}

/// Packets of 16 that are traced in tiles, as far as they are alike.
struct TileRun<'a> {
    engine: &'a Ours,
    lots: Vec<Lot<Packets<16>, HitPacket<16>, u32>>,
}

impl Contender for TileRun<'_> {
    fn mode(&self) -> String {
        Kernel::Tile.name().into()
    }

    fn build_seconds(&self) -> f64 {
        self.engine.build_seconds
    }

    fn bytes(&self) -> u64 {
        self.engine.bytes
    }

    fn trace(&self, chunk: usize) {
        let accel = &self.engine.accel;
        self.lots[chunk].trace(
            |rays, hits| {
                for ((packets, lanes), out) in rays.tiles().zip(hits.chunks_mut(TILE)) {
                    accel.intersect_tile(packets, lanes, out);
                }
            },
            |rays, flags| {
                for ((packets, lanes), out) in rays.tiles().zip(flags.chunks_mut(TILE)) {
                    accel.occluded_tile(packets, lanes, out);
                }
            },
        );
    }

    fn results(&self) -> Results {
        collect(
            &self.lots,
            |packets, rays, all| all.extend((0..rays.rays).map(|i| packets[i / 16].get(i % 16))),
            |packets, rays, all| all.extend((0..rays.rays).map(|i| packets[i / 16] >> (i % 16) & 1 == 1)),
        )
    }
}

struct PacketRun<'a, const W: usize> {
    engine: &'a Ours,
    lots: Vec<Lot<Packets<W>, HitPacket<W>, u32>>,
}

impl<const W: usize> Contender for PacketRun<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    fn mode(&self) -> String {
        Kernel::of_width(W).map_or("packet", Kernel::name).into()
    }

    fn build_seconds(&self) -> f64 {
        self.engine.build_seconds
    }

    fn bytes(&self) -> u64 {
        self.engine.bytes
    }

    fn trace(&self, chunk: usize) {
        let accel = &self.engine.accel;
        self.lots[chunk].trace(
            |rays, hits| {
                for ((packet, lanes), out) in rays.with_lanes().zip(hits) {
                    *out = accel.intersect_packet(packet, lanes);
                }
            },
            |rays, flags| {
                for ((packet, lanes), out) in rays.with_lanes().zip(flags) {
                    *out = accel.occluded_packet(packet, lanes);
                }
            },
        );
    }

    fn results(&self) -> Results {
        collect(
            &self.lots,
            |packets, rays, all| all.extend((0..rays.rays).map(|i| packets[i / W].get(i % W))),
            |packets, rays, all| all.extend((0..rays.rays).map(|i| packets[i / W] >> (i % W) & 1 == 1)),
        )
    }
}
