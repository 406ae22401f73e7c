//! Lists of rays through an [`Accel`].

use super::answers::{BySixteens, Found, Hits};
use super::ground::{OfBoxes, OfLines};
use super::trace;
use crate::geometry::triangle::Mode;
use crate::geometry::{Hit, Ray};
use crate::kdtree::Pools;
use crate::simd::Simd;
use crate::traverse::pool::ways::Ways;
use crate::traverse::query::ResidentQuery;
use crate::traverse::records::Resident;
use crate::traverse::source::Source;
use crate::traverse::{Accel, HitPacket, RayPacket};

impl Accel {
    /// The closest hit of each ray, by lists of rays.
    pub(in crate::traverse) fn intersect_filtered(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.ask_lists(Source::Slice(rays), Hits::Rays(hits));
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_filtered(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.ask_lists(Source::Slice(rays), Found::Rays(occluded));
    }

    /// The closest hits of the lanes whose bit is set in `active`, packet by packet; the others come out as misses.
    pub(in crate::traverse) fn intersect_lists(
        &self,
        rays: &[RayPacket<16>],
        active: &[u32],
        hits: &mut [HitPacket<16>],
    ) {
        assert!(rays.len() == active.len() && rays.len() == hits.len(), "as many lanes as packets");
        self.ask_lists(Source::Packets(rays, active), Hits::Lanes(hits));
    }

    /// A bit for each lane set in `active` in whose interval anything lies, packet by packet.
    pub(in crate::traverse) fn occluded_lists(
        &self,
        rays: &[RayPacket<16>],
        active: &[u32],
        occluded: &mut [u32],
    ) {
        assert!(rays.len() == active.len() && rays.len() == occluded.len(), "as many lanes as packets");
        occluded.fill(0);
        self.ask_lists(Source::Packets(rays, active), Found::Lanes(occluded));
    }

    /// Has lists answered: through boxes and pools if they have been made.
    fn ask_lists(&self, rays: Source<'_>, answers: impl BySixteens) {
        match self.pools() {
            Some(pools) => self.ask_closed(InBoxes { pools, rays, answers }),
            None => self.ask_all_in_memory(Filter { rays, answers }),
        }
    }
}

struct Filter<'a, A> {
    rays: Source<'a>,
    answers: A,
}

impl<A: BySixteens> ResidentQuery for Filter<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        trace::<S, M, _, A>(tree, &OfLines(tree.tree), self.rays, &mut self.answers);
    }
}

struct InBoxes<'a, A> {
    pools: &'a Pools,
    rays: Source<'a>,
    answers: A,
}

impl<A: BySixteens> ResidentQuery for InBoxes<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        trace::<S, M, _, A>(tree, &OfBoxes(Ways::new(self.pools)), self.rays, &mut self.answers);
    }
}
