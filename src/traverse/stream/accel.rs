//! Streams of rays through an [`Accel`].

use super::{Answers, Any, Closest, trace};
use crate::geometry::triangle::{Exact, Fast, Mode, Watertight};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::simd::{Simd, Task};
use crate::traverse::Accel;
use crate::traverse::records::Resident;

impl Accel {
    /// The closest hit of each ray, traced with many in flight.
    pub(in crate::traverse) fn intersect_stream(&self, rays: &[Ray], hits: &mut [Hit]) {
        self.stream(rays, Closest(hits));
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_stream(&self, rays: &[Ray], occluded: &mut [bool]) {
        self.stream(rays, Any(occluded));
    }

    fn stream<A: Answers>(&self, rays: &[Ray], answers: A) {
        let tree = self.tree();
        let triangles = Resident { tree, records: tree.triangles() };
        match self.accuracy {
            Accuracy::Fast => {
                let tree = Resident { tree, records: &self.projected };
                self.chosen.run(Stream::<Fast, A> { tree, rays, answers });
            }
            Accuracy::Watertight => {
                self.chosen.run(Stream::<Watertight, A> { tree: triangles, rays, answers });
            }
            Accuracy::Exact => self.chosen.run(Stream::<Exact, A> { tree: triangles, rays, answers }),
        }
    }
}

struct Stream<'a, M: Mode, A> {
    tree: Resident<'a, M::Record>,
    rays: &'a [Ray],
    answers: A,
}

impl<M: Mode, A: Answers> Task for Stream<'_, M, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self) {
        // Rays have numbers of 32 bits.
        trace::<S, M, A>(&self.tree, self.rays, &mut self.answers);
    }
}
