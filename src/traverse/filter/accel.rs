//! Lists of rays through an [`Accel`].

use super::{Answers, Any, Nearest, trace};
use crate::geometry::triangle::{Exact, Fast, Mode, Watertight};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::simd::{Simd, Task};
use crate::traverse::accel::lanes_of;
use crate::traverse::records::Resident;
use crate::traverse::{Accel, RayPacket};
use glam::Vec3;

impl Accel {
    /// The closest hit of each ray, by lists of rays.
    pub(in crate::traverse) fn intersect_filtered(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.filter(rays, Nearest(hits));
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_filtered(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.filter(rays, Any(occluded));
    }

    /// A bit for each lane set in `active` in whose interval anything lies, packet by packet, for up to 64 packets.
    pub(in crate::traverse) fn occluded_lists(
        &self,
        rays: &[RayPacket<16>],
        active: &[u32],
        occluded: &mut [u32],
    ) {
        assert!(rays.len() <= 64, "at most 64 packets");
        let mut all = [const { Ray::new(Vec3::ZERO, Vec3::ZERO) }; 1024];
        let mut places = [(0, 0); 1024];
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
        let mut found = [false; 1024];
        self.occluded_filtered(&all[..count], &mut found[..count]);
        occluded.fill(0);
        for (&(packet, lane), found) in places.iter().zip(found).take(count) {
            occluded[packet] |= u32::from(found) << lane;
        }
    }

    fn filter<A: Answers>(&self, rays: &[Ray], answers: A) {
        let tree = self.tree();
        let triangles = Resident { tree, records: tree.triangles() };
        match self.accuracy {
            Accuracy::Fast => {
                let tree = Resident { tree, records: &self.projected };
                self.chosen.run(Filter::<Fast, A> { tree, rays, answers });
            }
            Accuracy::Watertight => {
                self.chosen.run(Filter::<Watertight, A> { tree: triangles, rays, answers });
            }
            Accuracy::Exact => self.chosen.run(Filter::<Exact, A> { tree: triangles, rays, answers }),
        }
    }
}

struct Filter<'a, M: Mode, A> {
    tree: Resident<'a, M::Record>,
    rays: &'a [Ray],
    answers: A,
}

impl<M: Mode, A: Answers> Task for Filter<'_, M, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self) {
        trace::<S, M, A>(&self.tree, self.rays, &mut self.answers);
    }
}
