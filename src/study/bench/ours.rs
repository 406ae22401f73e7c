//! raypack as an engine: a mode for every kernel, `auto`, which chooses among those for pictures as it goes, and
//! `mixed`, which chooses among those for slices of rays.
//!
//! The single-ray, the stream and the filter kernel are given rays, the packet kernels packets, each made before the clock
//! starts; the records go out in the kernel's own form. Or all are given rays in a row ([`Ours::give_slices`]).

use super::engine::{Contender, Engine, Lot, Results, collect};
use super::report::Beams;
use crate::error::Result;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::Mesh;
use crate::simd::Isa;
use crate::study::rays::RayKind;
use crate::traverse::{
    Accel, Dispatch, DispatchPool, HitPacket, Kernel, PacketWidth, RayPacket, SliceDispatch, TileCounts,
    tally,
};
use std::cell::RefCell;
use std::sync::Arc;
use std::time::Instant;

/// raypack with its tree built.
#[derive(Debug)]
pub struct Ours {
    accel: Accel,
    build_seconds: f64,
    stats: TreeStats,
    slices: bool,
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
        let stats = accel.stats();
        Self { accel, build_seconds, stats, slices: false }
    }

    /// Makes pools beside the tree; that counts as a part of the build.
    ///
    /// # Errors
    /// As [`Accel::make_pools`].
    pub fn make_pools(&mut self) -> Result<()> {
        let start = Instant::now();
        self.accel.make_pools()?;
        self.build_seconds += start.elapsed().as_secs_f64();
        Ok(())
    }

    /// Whether all kernels are given rays in a row, and give records ray by ray.
    pub fn give_slices(&mut self, slices: bool) {
        self.slices = slices;
    }

    /// Seconds that the build took.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// Figures about the tree.
    pub fn stats(&self) -> &TreeStats {
        &self.stats
    }

    /// Bytes of the tree with its triangles.
    pub fn bytes(&self) -> u64 {
        (self.stats.bytes() + self.accel.record_bytes()) as u64
    }

    /// The built tree.
    pub fn accel(&self) -> &Accel {
        &self.accel
    }

    /// What the tile kernel does with rays.
    pub fn beams(&self, kind: RayKind, rays: &[Ray]) -> Beams {
        let mut counts = TileCounts::default();
        for rays in rays.chunks(TILE * 16) {
            let Packets { packets, lanes, .. } = Packets::<16>::new(rays);
            self.accel.count_tile(&packets, &lanes, kind.any_hit(), &mut counts);
        }
        Beams { rays: kind, tiles: rays.len().div_ceil(TILE * 16), counts }
    }

    /// A mode that traces packets of `W` one by one.
    fn packets<'a, const W: usize>(
        &'a self,
        kernel: Kernel,
        lots: Arc<[PacketLot<W>]>,
    ) -> Box<dyn Contender + 'a>
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let closest = |accel: &Accel, rays: &Packets<W>, hits: &mut [HitPacket<W>]| {
            for ((packet, &lanes), out) in rays.packets.iter().zip(&rays.lanes).zip(hits) {
                *out = accel.intersect_packet(packet, lanes);
            }
        };
        let any = |accel: &Accel, rays: &Packets<W>, flags: &mut [u32]| {
            for ((packet, &lanes), out) in rays.packets.iter().zip(&rays.lanes).zip(flags) {
                *out = accel.occluded_packet(packet, lanes);
            }
        };
        Box::new(PacketRun { engine: self, mode: kernel.name(), lots, closest, any, learnt: None })
    }

    /// A mode that traces sixteen packets of 16 together, or sixty-four, as far as they are alike.
    fn tiles<'a>(&'a self, kernel: Kernel, lots: Arc<[PacketLot<16>]>) -> Box<dyn Contender + 'a> {
        let size = kernel.width() / 16;
        let closest = move |accel: &Accel, rays: &Packets<16>, hits: &mut [HitPacket<16>]| {
            for ((packets, lanes), out) in rays.tiles(size).zip(hits.chunks_mut(size)) {
                accel.intersect_tile(packets, lanes, out);
            }
        };
        let any = move |accel: &Accel, rays: &Packets<16>, flags: &mut [u32]| {
            for ((packets, lanes), out) in rays.tiles(size).zip(flags.chunks_mut(size)) {
                accel.occluded_tile(packets, lanes, out);
            }
        };
        Box::new(PacketRun { engine: self, mode: kernel.name(), lots, closest, any, learnt: None })
    }

    /// The mode that finds out which kernel is quickest. What a worker has learnt is put down after each
    /// chunk, and taken up by whoever comes next: mostly the same worker. No place is remembered from round to
    /// round: in a picture that is new they would be new, too.
    fn auto<'a>(&'a self, lots: Arc<[PacketLot<16>]>) -> Box<dyn Contender + 'a> {
        let learnt = Arc::new(DispatchPool::<Dispatch>::default());
        let (shared, of_any) = (Arc::clone(&learnt), Arc::clone(&learnt));
        let closest = move |accel: &Accel, rays: &Packets<16>, hits: &mut [HitPacket<16>]| {
            let mut dispatch = shared.take();
            for ((packets, lanes), out) in rays.tiles(FIELD).zip(hits.chunks_mut(FIELD)) {
                dispatch.intersect(accel, &[], packets, lanes, out);
            }
            shared.put(dispatch);
        };
        let any = move |accel: &Accel, rays: &Packets<16>, flags: &mut [u32]| {
            let mut dispatch = of_any.take();
            for ((packets, lanes), out) in rays.tiles(FIELD).zip(flags.chunks_mut(FIELD)) {
                dispatch.occluded(accel, &[], packets, lanes, out);
            }
            of_any.put(dispatch);
        };
        Box::new(PacketRun { engine: self, mode: AUTO, lots, closest, any, learnt: Some(learnt) })
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

    /// Modes that are given rays in the same form share them, and the memory for what they find. With memory of its own, one and the
    /// same kernel was up to a tenth slower or quicker than itself, by where that happened to lie.
    fn contenders<'a>(&'a self, rays: &[Ray], any_hit: bool) -> Vec<Box<dyn Contender + 'a>> {
        let rows: Arc<[_]> = slices(rays, any_hit).into();
        let packed = if self.slices { &[] } else { rays };
        let fours: Arc<[_]> = Packets::<4>::lots(packed, any_hit).into();
        let eights: Arc<[_]> = Packets::<8>::lots(packed, any_hit).into();
        let sixteens: Arc<[_]> = Packets::<16>::lots(packed, any_hit).into();
        let sliced = |way| -> Box<dyn Contender + 'a> {
            Box::new(SliceRun { engine: self, way, lots: Arc::clone(&rows) })
        };
        let contender = |kernel| match kernel {
            _ if self.slices => sliced(Way::Named(kernel)),
            Kernel::Single | Kernel::Stream | Kernel::Filter => sliced(Way::Named(kernel)),
            Kernel::Packet4 => self.packets(kernel, Arc::clone(&fours)),
            Kernel::Packet8 => self.packets(kernel, Arc::clone(&eights)),
            Kernel::Packet16 => self.packets(kernel, Arc::clone(&sixteens)),
            Kernel::Tile | Kernel::WideTile => self.tiles(kernel, Arc::clone(&sixteens)),
        };
        let mixed = sliced(Way::Mixed(DispatchPool::default()));
        let kernels = Kernel::ALL.into_iter().map(contender);
        // Squares of a picture are packets.
        let auto = (!self.slices).then(|| self.auto(Arc::clone(&sixteens)));
        kernels.chain(auto).chain([mixed]).collect()
    }
}

/// Rays as they are, a chunk at a time.
fn slices(rays: &[Ray], any_hit: bool) -> Vec<Lot<Vec<Ray>, Hit, bool>> {
    Lot::cut(rays, any_hit, Hit::MISS, |n| n, <[Ray]>::to_vec)
}

/// A mode that is given rays one by one.
struct SliceRun<'a> {
    engine: &'a Ours,
    way: Way,
    lots: Arc<[Lot<Vec<Ray>, Hit, bool>]>,
}

/// What traces rays that are given one by one.
enum Way {
    Named(Kernel),
    Mixed(DispatchPool<SliceDispatch>),
}

impl Contender for SliceRun<'_> {
    fn mode(&self) -> String {
        match &self.way {
            Way::Named(kernel) => kernel.name(),
            Way::Mixed(_) => MIXED,
        }
        .into()
    }

    fn build_seconds(&self) -> f64 {
        self.engine.build_seconds
    }

    fn bytes(&self) -> u64 {
        self.engine.bytes()
    }

    fn traced(&self) -> Vec<(Kernel, u64)> {
        match &self.way {
            Way::Named(_) => Vec::new(),
            Way::Mixed(learnt) => tally(learnt.look(SliceDispatch::traced)),
        }
    }

    fn fetch(&self, chunk: usize) {
        self.lots[chunk].fetch(Vec::as_slice);
    }

    fn trace(&self, chunk: usize) {
        let accel = &self.engine.accel;
        let lot = &self.lots[chunk];
        match &self.way {
            Way::Named(kernel) => lot.trace(
                |rays, hits| accel.intersect_many(*kernel, rays, hits),
                |rays, flags| accel.occluded_many(*kernel, rays, flags),
            ),
            Way::Mixed(learnt) => {
                let dispatch = RefCell::new(learnt.take());
                lot.trace(
                    |rays, hits| dispatch.borrow_mut().intersect(accel, rays, hits),
                    |rays, flags| dispatch.borrow_mut().occluded(accel, rays, flags),
                );
                learnt.put(dispatch.into_inner());
            }
        }
    }

    fn results(&self) -> Results {
        collect(&self.lots, |hits, _, all| all.extend(hits), |flags, _, all| all.extend(flags))
    }
}

/// The mode that finds out which kernel is quickest for squares of a picture.
pub const AUTO: &str = "auto";

/// The mode that finds out which kernel is quickest for slices of rays.
pub const MIXED: &str = "mixed";

/// Packets in a tile.
const TILE: usize = 16;

/// Packets that a choice is made for at once: 64 x 64 rays.
const FIELD: usize = 256;

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

    fn lots(rays: &[Ray], any_hit: bool) -> Vec<PacketLot<W>> {
        Lot::cut(rays, any_hit, HitPacket::miss(), |n| n.div_ceil(W), Self::new)
    }

    /// Packets a tile at a time, with a bit for each of their rays.
    #[inline(always)]
    fn tiles(&self, size: usize) -> impl Iterator<Item = (&[RayPacket<W>], &[u32])> {
        self.packets.chunks(size).zip(self.lanes.chunks(size))
    }
}

type PacketLot<const W: usize> = Lot<Packets<W>, HitPacket<W>, u32>;

/// A mode that takes packets of `W`, and how it traces a lot of them.
struct PacketRun<'a, const W: usize, C, A> {
    engine: &'a Ours,
    mode: &'static str,
    lots: Arc<[PacketLot<W>]>,
    closest: C,
    any: A,
    /// What workers have learnt, if it chooses.
    learnt: Option<Arc<DispatchPool<Dispatch>>>,
}

impl<const W: usize, C, A> Contender for PacketRun<'_, W, C, A>
where
    C: Fn(&Accel, &Packets<W>, &mut [HitPacket<W>]) + Sync,
    A: Fn(&Accel, &Packets<W>, &mut [u32]) + Sync,
{
    fn mode(&self) -> String {
        self.mode.into()
    }

    fn build_seconds(&self) -> f64 {
        self.engine.build_seconds
    }

    fn bytes(&self) -> u64 {
        self.engine.bytes()
    }

    fn traced(&self) -> Vec<(Kernel, u64)> {
        self.learnt.as_ref().map_or_else(Vec::new, |learnt| tally(learnt.look(Dispatch::traced)))
    }

    fn fetch(&self, chunk: usize) {
        self.lots[chunk].fetch(|rays| &rays.packets);
    }

    fn trace(&self, chunk: usize) {
        let accel = &self.engine.accel;
        self.lots[chunk].trace(
            |rays, hits| (self.closest)(accel, rays, hits),
            |rays, flags| (self.any)(accel, rays, flags),
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
