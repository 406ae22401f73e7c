//! Lists of rays through an [`Accel`].

use super::{ByEights, trace};
use crate::geometry::triangle::Mode;
use crate::geometry::{Hit, Ray};
use crate::simd::Simd;
use crate::traverse::accel::lanes_of;
use crate::traverse::query::ResidentQuery;
use crate::traverse::records::Resident;
use crate::traverse::stream::{Any, Closest};
use crate::traverse::tile::{PACKETS, WIDE};
use crate::traverse::{Accel, RayPacket};
use glam::Vec3;

impl Accel {
    /// The closest hit of each ray, by lists of rays.
    pub(in crate::traverse) fn intersect_filtered(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.ask_all_in_memory(Filter { rays, answers: Closest(hits) });
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_filtered(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.ask_all_in_memory(Filter { rays, answers: Any(occluded) });
    }

    /// A bit for each lane set in `active` in whose interval anything lies, packet by packet, for as many packets as a wide
    /// beam has. Panics if there are more.
    pub(in crate::traverse) fn occluded_lists(
        &self,
        rays: &[RayPacket<16>],
        active: &[u32],
        occluded: &mut [u32],
    ) {
        const MOST: usize = WIDE * PACKETS * 16;
        assert!(rays.len() <= WIDE * PACKETS, "at most {} packets", WIDE * PACKETS);
        let mut all = [const { Ray::new(Vec3::ZERO, Vec3::ZERO) }; MOST];
        let mut places = [(0, 0); MOST];
        let mut count = 0;
        for (packet, (rays, &active)) in rays.iter().zip(active).enumerate() {
            let mut lanes = active & lanes_of(16);
            while lanes != 0 {
                let lane = lanes.trailing_zeros() as usize;
                lanes &= lanes - 1;
                (all[count], places[count]) = (rays.get(lane), (packet, lane));
                count += 1;
            }
        }
        let mut found = [false; MOST];
        self.occluded_filtered(&all[..count], &mut found[..count]);
        occluded.fill(0);
        for (&(packet, lane), found) in places.iter().zip(found).take(count) {
            occluded[packet] |= u32::from(found) << lane;
        }
    }
}

struct Filter<'a, A> {
    rays: &'a [Ray],
    answers: A,
}

impl<A: ByEights> ResidentQuery for Filter<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        trace::<S, M, A>(tree, self.rays, &mut self.answers);
    }
}
