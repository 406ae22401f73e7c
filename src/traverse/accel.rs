//! A mesh made ready for tracing, and the calls that trace.

use super::lanes::{HitPacket, RayPacket, lanes_of};
use super::query::{CountTile, InMode, IntersectTile, OccludedTile, Query, ResidentInMode, ResidentQuery};
use super::records::Resident;
use super::sieve::{Sieve, Sifted};
use super::tile::{PACKETS, TileCounts, WIDE};
use super::width::PacketWidth;
use crate::cache::Cached;
use crate::error::Result;
use crate::geometry::triangle::fast::Projected;
use crate::geometry::triangle::{Exact, Fast, Watertight};
use crate::geometry::{Aabb, Accuracy, Hit, Ray};
use crate::kdtree::{BuildParams, BuildProgress, KdTree, Pools, TreeStats};
use crate::mesh::Mesh;
use crate::simd::{Chosen, Isa, run_portable};
use rayon::prelude::*;
use std::slice::{from_mut, from_ref};
use std::sync::Arc;

/// A mesh made ready for tracing: its tree, and the instruction set to trace with.
///
/// Shared freely between threads: tracing changes nothing. Clones share the tree, so that it can be traced
/// with several instruction sets and accuracies side by side.
#[derive(Clone, Debug)]
pub struct Accel {
    pub(super) storage: Storage,
    pub(super) chosen: Chosen,
    pub(super) accuracy: Accuracy,
    /// The fast test's records, empty until that mode is chosen.
    pub(super) projected: Arc<[Projected]>,
}

/// Where the tree is.
#[derive(Clone, Debug)]
pub(super) enum Storage {
    /// All in memory.
    Resident(Arc<KdTree>),
    /// Some of it in memory.
    Cached(Arc<Cached>),
}

impl Accel {
    /// Builds the tree of a mesh. Primitive ids of hits are indices into `mesh.triangles`.
    ///
    /// # Errors
    /// As [`KdTree::build`].
    pub fn build(mesh: &Mesh, params: &BuildParams) -> Result<Self> {
        Ok(Self::of_tree(KdTree::build(mesh, params, None)?))
    }

    /// The same, with progress to be read from another thread.
    ///
    /// # Errors
    /// As [`KdTree::build`].
    pub fn build_with_progress(mesh: &Mesh, params: &BuildParams, progress: &BuildProgress) -> Result<Self> {
        Ok(Self::of_tree(KdTree::build(mesh, params, Some(progress))?))
    }

    /// Wraps a tree, to be traced with the best instruction set that the machine has.
    pub fn of_tree(tree: KdTree) -> Self {
        Self::of_storage(Storage::Resident(Arc::new(tree)))
    }

    /// Wraps a scene of which only a part is in memory. It is traced by packets and tiles, not by streams,
    /// and not with [`Accuracy::Fast`], which keeps records beside the tree.
    pub fn of_cached(cached: Arc<Cached>) -> Self {
        Self::of_storage(Storage::Cached(cached))
    }

    fn of_storage(storage: Storage) -> Self {
        Self { storage, chosen: Chosen::best(), accuracy: Accuracy::default(), projected: Arc::default() }
    }

    /// The same, traced with another instruction set. Panics if this machine lacks it.
    pub fn with_isa(mut self, isa: Isa) -> Self {
        self.set_isa(isa);
        self
    }

    /// Chooses the instruction set. Panics if this machine lacks it.
    pub fn set_isa(&mut self, isa: Isa) {
        self.chosen = Chosen::new(isa).unwrap_or_else(|| panic!("this machine has no {isa}"));
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.chosen.isa()
    }

    /// The same, traced with another accuracy.
    pub fn with_accuracy(mut self, accuracy: Accuracy) -> Self {
        self.set_accuracy(accuracy);
        self
    }

    /// Chooses the accuracy. The first choice of [`Accuracy::Fast`] makes that test's records, 44
    /// bytes a triangle, which stay. Panics for that choice if the scene is not all in memory.
    pub fn set_accuracy(&mut self, accuracy: Accuracy) {
        if accuracy == Accuracy::Fast && self.projected.is_empty() {
            let records =
                self.tree().triangles().par_iter().map(|triangle| Projected::new(&triangle.corners));
            self.projected = records.collect::<Vec<_>>().into();
        }
        self.accuracy = accuracy;
    }

    /// The instruction set that kernels run on, for work beside them.
    pub(crate) const fn chosen(&self) -> Chosen {
        self.chosen
    }

    /// Bytes of what is kept beside the tree: for [`Accuracy::Fast`], and for [pools](Self::make_pools).
    pub fn record_bytes(&self) -> usize {
        size_of_val(&self.projected[..]) + self.pool_bytes()
    }

    /// Bytes of pools, if they have been made.
    pub fn pool_bytes(&self) -> usize {
        match &self.storage {
            Storage::Resident(tree) => tree.pools().map_or(0, Pools::bytes),
            Storage::Cached(_) => 0,
        }
    }

    /// The accuracy in use.
    pub fn accuracy(&self) -> Accuracy {
        self.accuracy
    }

    /// The tree. Panics if it is not all in memory.
    pub fn tree(&self) -> &KdTree {
        match &self.storage {
            Storage::Resident(tree) => tree,
            Storage::Cached(_) => panic!("only a part of the scene is in memory"),
        }
    }

    /// The scene that is in memory in part, if it is one.
    pub fn cached(&self) -> Option<&Arc<Cached>> {
        match &self.storage {
            Storage::Resident(_) => None,
            Storage::Cached(cached) => Some(cached),
        }
    }

    /// The box around all triangles.
    pub fn bounds(&self) -> Aabb {
        match &self.storage {
            Storage::Resident(tree) => tree.mesh_bounds(),
            Storage::Cached(cached) => cached.mesh_bounds(),
        }
    }

    /// Figures about the tree. Walks all of it, and panics if it is not all in memory.
    pub fn stats(&self) -> TreeStats {
        self.tree().stats()
    }

    /// Has a kernel called in the chosen mode, on the chosen instruction set.
    #[inline(always)]
    pub(super) fn ask<Q: Query>(&self, query: Q) -> Q::Output {
        match &self.storage {
            Storage::Resident(_) => self.ask_resident(query),
            Storage::Cached(cached) => self.ask_cached(cached, query),
        }
    }

    /// The same for a scene that is all in memory. Panics if it is not.
    #[inline(always)]
    pub(super) fn ask_resident<Q: Query>(&self, query: Q) -> Q::Output {
        self.ask_tree(self.tree(), query)
    }

    #[inline(always)]
    fn ask_tree<Q: Query>(&self, tree: &KdTree, query: Q) -> Q::Output {
        let triangles = Resident { tree, records: tree.triangles() };
        match self.accuracy {
            Accuracy::Fast => {
                let projected = Resident { tree, records: &self.projected };
                self.chosen.run(InMode::<_, Fast, _>::new(query, &projected))
            }
            Accuracy::Watertight => self.chosen.run(InMode::<_, Watertight, _>::new(query, &triangles)),
            Accuracy::Exact => self.chosen.run(InMode::<_, Exact, _>::new(query, &triangles)),
        }
    }

    /// Has a kernel called that knows no other scene than one that is all in memory. Panics if it is not.
    pub(super) fn ask_all_in_memory<Q: ResidentQuery>(&self, query: Q) {
        if self.accuracy == Accuracy::Fast {
            let tree = Resident { tree: self.tree(), records: &self.projected };
            self.chosen.run(ResidentInMode::<Q, Fast> { query, tree });
        } else {
            self.ask_closed(query);
        }
    }

    /// The same for one that knows no fast mode. Panics in that mode, too.
    pub(super) fn ask_closed<Q: ResidentQuery>(&self, query: Q) {
        let tree = self.tree();
        let tree = Resident { tree, records: tree.triangles() };
        match self.accuracy {
            Accuracy::Fast => panic!("the fast mode has none of this"),
            Accuracy::Watertight => self.chosen.run(ResidentInMode::<Q, Watertight> { query, tree }),
            Accuracy::Exact => self.chosen.run(ResidentInMode::<Q, Exact> { query, tree }),
        }
    }

    /// Has a kernel called for a scene that is all in memory and whose triangles have holes. Panics if it is not.
    #[inline(always)]
    pub(super) fn ask_sifted<Q: Query>(&self, sieve: &dyn Sieve, query: Q) -> Q::Output {
        let tree = self.tree();
        let triangles = Sifted { resident: Resident { tree, records: tree.triangles() }, sieve };
        match self.accuracy {
            Accuracy::Fast => {
                let projected = Sifted { resident: Resident { tree, records: &self.projected }, sieve };
                self.chosen.run(InMode::<_, Fast, _>::new(query, &projected))
            }
            Accuracy::Watertight => self.chosen.run(InMode::<_, Watertight, _>::new(query, &triangles)),
            Accuracy::Exact => self.chosen.run(InMode::<_, Exact, _>::new(query, &triangles)),
        }
    }

    /// The same for a scene that is in memory in part.
    fn ask_cached<Q: Query>(&self, cached: &Cached, query: Q) -> Q::Output {
        let tree = cached.view();
        if let Some(tree) = tree.whole() {
            return self.ask_tree(tree, query);
        }
        match self.accuracy {
            Accuracy::Watertight => self.chosen.run(InMode::<_, Watertight, _>::new(query, &tree)),
            Accuracy::Exact => self.chosen.run(InMode::<_, Exact, _>::new(query, &tree)),
            Accuracy::Fast => unreachable!("`set_accuracy` does not take it"),
        }
    }

    /// The closest hit of one ray.
    pub fn intersect(&self, ray: &Ray) -> Hit {
        match self.pools() {
            Some(pools) => self.intersect_alone(pools, ray),
            None => self.intersect_packet(&RayPacket::<1>::of_slice(&[*ray]), 1).get(0),
        }
    }

    /// Whether anything lies in one ray's interval.
    pub fn occluded(&self, ray: &Ray) -> bool {
        match self.pools() {
            Some(pools) => self.occluded_alone(pools, ray),
            None => self.occluded_packet(&RayPacket::<1>::of_slice(&[*ray]), 1) == 1,
        }
    }

    /// The closest hits of the lanes whose bit is set in `active`; the others come out as misses.
    #[inline]
    pub fn intersect_packet<const W: usize>(&self, rays: &RayPacket<W>, active: u32) -> HitPacket<W>
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let mut hits = [HitPacket::miss()];
        PacketWidth::intersect(self, from_ref(rays), &[active & lanes_of(W)], &mut hits);
        let [hits] = hits;
        hits
    }

    /// The same for packets that follow one another: quicker than one by one in a scene of which a part is in memory.
    /// Panics if there are not as many of all, or a bit is set in `active` beyond `W`.
    pub fn intersect_packets<const W: usize>(
        &self,
        rays: &[RayPacket<W>],
        active: &[u32],
        hits: &mut [HitPacket<W>],
    ) where
        RayPacket<W>: PacketWidth<W>,
    {
        check_packets::<W>(rays.len(), active, hits.len());
        PacketWidth::intersect(self, rays, active, hits);
    }

    /// A bit for each lane set in `active` in whose interval anything lies.
    #[inline]
    pub fn occluded_packet<const W: usize>(&self, rays: &RayPacket<W>, active: u32) -> u32
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let mut found = 0;
        PacketWidth::occluded(self, from_ref(rays), &[active & lanes_of(W)], from_mut(&mut found));
        found
    }

    /// The same for packets that follow one another, as [`intersect_packets`](Self::intersect_packets).
    pub fn occluded_packets<const W: usize>(&self, rays: &[RayPacket<W>], active: &[u32], found: &mut [u32])
    where
        RayPacket<W>: PacketWidth<W>,
    {
        check_packets::<W>(rays.len(), active, found.len());
        PacketWidth::occluded(self, rays, active, found);
    }

    /// [`intersect_packets`](Self::intersect_packets), each in two packets of 8: quicker where rays part.
    pub fn intersect_halves(&self, rays: &[RayPacket<16>], active: &[u32], hits: &mut [HitPacket<16>]) {
        check_packets::<16>(rays.len(), active, hits.len());
        for ((rays, active), hits) in
            rays.chunks(PACKETS).zip(active.chunks(PACKETS)).zip(hits.chunks_mut(PACKETS))
        {
            let (halves, lanes) = halves_of(rays, active);
            let mut found = [const { HitPacket::miss() }; 2 * PACKETS];
            let count = 2 * rays.len();
            PacketWidth::intersect(self, &halves[..count], &lanes[..count], &mut found[..count]);
            for (hits, [first, second]) in hits.iter_mut().zip(found.as_chunks().0) {
                hits.set_part(0, first, lanes_of(8));
                hits.set_part(1, second, lanes_of(8));
            }
        }
    }

    /// [`occluded_packets`](Self::occluded_packets), each in two packets of 8.
    pub fn occluded_halves(&self, rays: &[RayPacket<16>], active: &[u32], occluded: &mut [u32]) {
        check_packets::<16>(rays.len(), active, occluded.len());
        for ((rays, active), occluded) in
            rays.chunks(PACKETS).zip(active.chunks(PACKETS)).zip(occluded.chunks_mut(PACKETS))
        {
            let (halves, lanes) = halves_of(rays, active);
            let mut found = [0; 2 * PACKETS];
            let count = 2 * rays.len();
            PacketWidth::occluded(self, &halves[..count], &lanes[..count], &mut found[..count]);
            for (occluded, [first, second]) in occluded.iter_mut().zip(found.as_chunks().0) {
                *occluded = first | second << 8;
            }
        }
    }

    /// The closest hits of up to 64 packets that share their origin, as squares of a picture do; the
    /// lanes whose bit is not set in `active` come out as misses. What is too unlike to go together is
    /// traced packet by packet. Panics if there are more than 64 packets, or not as many `active`
    /// and `hits`.
    ///
    /// More than sixteen are a wide beam if the scene is all in memory, and otherwise go sixteen at a time. Each
    /// sixteen of them should be neighbours, and so should each four: squares of a picture in Morton order.
    pub fn intersect_tile(&self, rays: &[RayPacket<16>], active: &[u32], hits: &mut [HitPacket<16>]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        let lanes = tile_lanes::<WIDE>(rays, active);
        let mut left = lanes;
        if rays.len() > PACKETS && self.cached().is_none() {
            left = self.ask_resident(IntersectTile { rays, active: &lanes, hits: &mut *hits });
        }
        let squares = rays.chunks(PACKETS).zip(hits.chunks_mut(PACKETS));
        for ((rays, hits), (lanes, left)) in squares.zip(lanes.iter().zip(left)) {
            self.intersect_square(rays, lanes, left, hits);
        }
    }

    /// The closest hits of the lanes that are `left` of up to sixteen packets; misses in those that are not in `lanes`.
    fn intersect_square(
        &self,
        rays: &[RayPacket<16>],
        lanes: &[u32; PACKETS],
        mut left: [u32; PACKETS],
        hits: &mut [HitPacket<16>],
    ) {
        if left != [0; PACKETS] {
            [left] = self.ask(IntersectTile { rays, active: &[left], hits: &mut *hits });
        }
        for (((rays, &active), left), hits) in rays.iter().zip(lanes).zip(left).zip(hits) {
            // Beams have written the lanes that were part of them, and no others.
            if left != 0 {
                hits.set_part(0, &self.intersect_packet(rays, left), left);
            }
            let absent = lanes_of(16) & !active;
            if absent != 0 {
                hits.set_part(0, &HitPacket::<16>::miss(), absent);
            }
        }
    }

    /// Adds up what [`intersect_tile`](Self::intersect_tile) does with these rays, or, with `any_hit`,
    /// what [`occluded_tile`](Self::occluded_tile) does, in watertight mode. Counted on the portable instruction set,
    /// whichever is chosen: the others, whose culling rounds otherwise, would all be compiled for counting alone. (AVX2 counted the
    /// same in the conference room and on the armadillo, to the last one.) Panics if the scene is not all in memory.
    pub fn count_tile(&self, rays: &[RayPacket<16>], active: &[u32], any_hit: bool, counts: &mut TileCounts) {
        let [lanes] = tile_lanes::<1>(rays, active);
        let query = CountTile { rays, active: &lanes, any_hit, counts: &mut *counts };
        let tree = self.tree();
        let triangles = Resident { tree, records: tree.triangles() };
        let left = run_portable(InMode::<_, Watertight, _>::new(query, &triangles));
        counts.beams += u64::from(left != lanes);
    }

    /// A bit for each lane set in `active` in whose interval anything lies, packet by packet. Rays go
    /// together if they start at one point, or run toward one and no farther (it need not be named), or
    /// are parallel; otherwise as [`intersect_tile`](Self::intersect_tile). More than sixteen packets go sixteen at a
    /// time.
    pub fn occluded_tile(&self, rays: &[RayPacket<16>], active: &[u32], occluded: &mut [u32]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        let lanes = tile_lanes::<WIDE>(rays, active);
        occluded.fill(0);
        let squares = rays.chunks(PACKETS).zip(occluded.chunks_mut(PACKETS));
        for ((rays, occluded), lanes) in squares.zip(&lanes) {
            let left = self.ask(OccludedTile { rays, active: lanes, found: &mut *occluded });
            for ((rays, left), occluded) in rays.iter().zip(left).zip(occluded) {
                if left != 0 {
                    *occluded |= self.occluded_packet(rays, left);
                }
            }
        }
    }
}

/// Panics if there are not as many packets, lanes and answers, or there are lanes beyond `W`.
fn check_packets<const W: usize>(rays: usize, active: &[u32], answers: usize) {
    assert!(rays == active.len() && rays == answers, "as many lanes and answers as packets");
    assert!(active.iter().all(|lanes| lanes & !lanes_of(W) == 0), "no lanes beyond {W}");
}

/// Up to a tile's packets in halves, and the lanes of each.
fn halves_of(rays: &[RayPacket<16>], active: &[u32]) -> ([RayPacket<8>; 2 * PACKETS], [u32; 2 * PACKETS]) {
    let mut halves = [const { RayPacket::empty() }; 2 * PACKETS];
    let mut lanes = [0; 2 * PACKETS];
    let places = halves.as_chunks_mut::<2>().0.iter_mut().zip(lanes.as_chunks_mut::<2>().0);
    for ((rays, active), (halves, lanes)) in rays.iter().zip(active).zip(places) {
        *halves = [rays.part(0), rays.part(1)];
        *lanes = [active & lanes_of(8), active >> 8];
    }
    (halves, lanes)
}

/// The lanes that count of a tile's packets, in `K` squares of sixteen: none in packets that are not there. Panics if
/// there are too many packets, or not as many of both.
fn tile_lanes<const K: usize>(rays: &[RayPacket<16>], active: &[u32]) -> [[u32; PACKETS]; K] {
    assert!(rays.len() <= K * PACKETS, "at most {} packets", K * PACKETS);
    assert_eq!(rays.len(), active.len(), "as many lanes as packets");
    let mut lanes = [[0; PACKETS]; K];
    for (lanes, active) in lanes.as_flattened_mut().iter_mut().zip(active) {
        *lanes = active & lanes_of(16);
    }
    lanes
}
