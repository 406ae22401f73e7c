//! Rays through the pools of an [`Accel`].

use super::list::List;
use super::{OfFlights, alone, trace};
use crate::error::{Error, Result};
use crate::geometry::triangle::Mode;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::{MOST, Pools};
use crate::simd::{Simd, Sixteen, Task};
use crate::traverse::Accel;
use crate::traverse::accel::Storage;
use crate::traverse::query::ResidentQuery;
use crate::traverse::records::Resident;
use crate::traverse::stream::step::Waiting;
use crate::traverse::stream::{Any, Closest};
use std::cell::RefCell;

impl Accel {
    /// Makes leaves that hold their corners ([`Pools`]), for streams, lists and rays that come one a call to go through: rays
    /// that have nothing in common are traced 1.0 to 2.6 times as fast then, and the tree takes a third to a half as much memory again.
    /// Clones share them. Hits are the same, to the bit. Nothing is done if the tree has some, as out of a scene file.
    ///
    /// # Errors
    /// Only a part of the scene is in memory, the tree has too many leaves, or the accuracy is
    /// [`Fast`](Accuracy::Fast), whose test goes its own way.
    pub fn make_pools(&self) -> Result<()> {
        if self.accuracy() == Accuracy::Fast {
            return Err(Error::option("--pools", "the fast accuracy has no use for them"));
        }
        match &self.storage {
            Storage::Cached(_) => Err(Error::option("--pools", "all of the scene has to be in memory")),
            Storage::Resident(tree) if tree.make_pools(self.chosen.run(MetAtOnce)) => Ok(()),
            Storage::Resident(_) => Err(Error::option("--pools", "the tree has too many leaves")),
        }
    }

    /// The pools if they have been made and rays can go through them.
    #[inline(always)]
    pub(in crate::traverse) fn pools(&self) -> Option<&Pools> {
        match &self.storage {
            Storage::Resident(tree) if self.accuracy() != Accuracy::Fast => tree.pools(),
            _ => None,
        }
    }

    /// The closest hit of each ray, traced with many in flight: through pools if they have been made.
    pub(in crate::traverse) fn intersect_streaming(&self, rays: &[Ray], hits: &mut [Hit]) {
        match self.pools() {
            Some(pools) => self.ask_closed(InPools { pools, rays, answers: Closest(hits) }),
            None => self.intersect_stream(rays, hits),
        }
    }

    /// Whether anything lies in each ray's interval, likewise.
    pub(in crate::traverse) fn occluded_streaming(&self, rays: &[Ray], occluded: &mut [bool]) {
        match self.pools() {
            Some(pools) => self.ask_closed(InPools { pools, rays, answers: Any(occluded) }),
            None => self.occluded_stream(rays, occluded),
        }
    }

    /// The closest hit of one ray by itself, through pools.
    #[inline(never)]
    pub(in crate::traverse) fn intersect_alone(&self, pools: &Pools, ray: &Ray) -> Hit {
        let mut hit = [Hit::MISS];
        WALKED.with_borrow_mut(|(waiting, list)| {
            self.ask_closed(Alone { pools, ray, waiting, list, answers: Closest(&mut hit) });
        });
        hit[0]
    }

    /// Whether anything lies in one ray's interval, likewise.
    #[inline(never)]
    pub(in crate::traverse) fn occluded_alone(&self, pools: &Pools, ray: &Ray) -> bool {
        let mut occluded = [false];
        WALKED.with_borrow_mut(|(waiting, list)| {
            self.ask_closed(Alone { pools, ray, waiting, list, answers: Any(&mut occluded) });
        });
        occluded[0]
    }
}

/// How many triangles a ray meets at once.
struct MetAtOnce;

impl Task for MetAtOnce {
    type Output = usize;

    #[inline(always)]
    fn run<S: Simd>(self) -> usize {
        if S::F16::HALVES_PAY { MOST / 2 } else { MOST }
    }
}

struct InPools<'a, A> {
    pools: &'a Pools,
    rays: &'a [Ray],
    answers: A,
}

impl<A: OfFlights> ResidentQuery for InPools<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        trace::<S, M, A>(tree, self.pools, self.rays, &mut self.answers);
    }
}

thread_local! {
    /// The stack of a thread's ray, and its list. (They are taken here, and not where they are used, as a closure of the library's would be
    /// compiled without the instruction set.)
    static WALKED: RefCell<(Waiting, List)> = const { RefCell::new((Waiting::new(), List::NONE)) };
}

struct Alone<'a, A> {
    pools: &'a Pools,
    ray: &'a Ray,
    waiting: &'a mut Waiting,
    list: &'a mut List,
    answers: A,
}

impl<A: OfFlights> ResidentQuery for Alone<'_, A> {
    #[inline(always)]
    fn run<S: Simd, M: Mode>(mut self, tree: &Resident<'_, M::Record>) {
        alone::trace::<S, M, A>(tree, self.pools, self.ray, self.waiting, self.list, &mut self.answers);
    }
}
