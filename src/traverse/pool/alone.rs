//! One ray through the pools, with nobody else in flight.
//!
//! At each node and at each chunk it does what it does in a [stream](super); only, it waits for each. So what counts here is how
//! few steps there are, and boxes make them few. In the end the mode's own test is asked of the one or two triangles that
//! are left on its list, one by one.

use super::answers::OfFlights;
use super::flight::{Finds, Flight};
use super::step::{Slabs, step};
use crate::geometry::Ray;
use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::Pooled;
use crate::kdtree::{Pools, Tree, Way};
use crate::simd::Simd;
use crate::traverse::ready::Ready;
use crate::traverse::records::Resident;
use crate::traverse::stream::step::{END, Waiting};
use crate::traverse::stream::with_stacks;

/// Traces a ray, and gives an answer for ray 0.
#[inline(always)]
pub fn trace<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    ray: &Ray,
    answers: &mut A,
) {
    let (origin, direction) = (ray.origin.to_array(), ray.direction.to_array());
    let ready = Ready::<f32>::new::<1>(&origin, &direction, ray.tnear, ray.tfar, resident.tree.bounds());
    if ready.ordinary == 0 || !resident.tree.scale().is_none() {
        answers.odd::<M>(resident, 0, ray);
    } else if ready.flies == 0 {
        answers.missed(0);
    } else {
        let slabs = Slabs::new(&origin, &ready.inverse, &ready.margin);
        let mut flight = Flight::NONE;
        flight.begin(slabs, Pooled::new(&origin, &direction), ready.closest, ray, 0);
        with_stacks(
            #[inline(always)]
            |[waiting, ..]| {
                if walk::<S, M, A>(resident, pools, ray, &mut flight, waiting) {
                    answers.hits(0);
                } else {
                    answers.decide::<M>(resident, ray, &flight);
                }
            },
        );
    }
}

/// Goes all the way, and lists what may be hit. Says whether anything is for certain, where that is enough.
#[inline(always)]
fn walk<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    ray: &Ray,
    flight: &mut Flight,
    waiting: &mut Waiting,
) -> bool {
    let (mut top, mut way) = (waiting.begin(), Way::ROOT);
    loop {
        if !way.is_pool() {
            let Flight { slabs, tnear, tfar, .. } = flight;
            (top, way) = step::<S::F8>(pools.nodes(), slabs, waiting, (top, way), *tnear, *tfar);
        } else if way.0 == END {
            return false;
        } else {
            let Finds { possible, certain, next } =
                flight.look::<S::F16, M>(pools.words(), way.word(), A::ANY);
            if A::ANY && certain {
                return true;
            }
            waiting.exits[top] = way.further(next).0;
            top -= usize::from(next == 0);
            if possible {
                if flight.is_full() {
                    flight.settle::<M>(resident.records, ray);
                }
                top = waiting.reached::<S::F8>(top, flight.tfar);
            }
            way = Way(waiting.exits[top]);
        }
    }
}
