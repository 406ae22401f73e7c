//! Streams of rays through an [`Accel`].

use super::{Any, Closest, OneByOne, trace};
use crate::geometry::triangle::Mode;
use crate::geometry::{Hit, Ray};
use crate::simd::Simd;
use crate::traverse::Accel;
use crate::traverse::query::ResidentQuery;
use crate::traverse::records::Resident;

impl Accel {
    /// The closest hit of each ray, traced with many in flight.
    pub(in crate::traverse) fn intersect_stream(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.ask_all_in_memory(Stream { rays, answers: Closest(hits) });
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_stream(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.ask_all_in_memory(Stream { rays, answers: Any(occluded) });
    }
}

struct Stream<'a, A> {
    rays: &'a [Ray],
    answers: A,
}

impl<A: OneByOne> ResidentQuery for Stream<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        trace::<S, M, A>(tree, self.rays, &mut self.answers);
    }
}
