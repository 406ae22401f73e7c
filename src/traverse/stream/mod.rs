//! The stream kernel: many rays in flight, each alone (a *wavefront*).
//!
//! Incoherent rays have nothing to share, and one by one they spend their time waiting for memory and on
//! branches that nobody can foresee. Here some thirty rays are on their way at once. Each round does one
//! piece of work for each: a line of the tree ([`step`](step::step), three levels), or eight triangles of a leaf
//! ([`leaf`]). Rays that need the same work wait in one set, so that no branch depends on what a ray meets; and what
//! a ray needs in its next round is fetched while the others have theirs.
//!
//! ```text
//!          +---------+---------------------------------------+
//!          v         v                    nothing            |
//! start -> lines -> leaves -> triangles ---------> (next in the leaf or on the stack) -> end: the next ray starts
//!  fetch:  line     record    triangles --> hits --->^
//! ```
//!
//! Rays that found something in their triangles have a set of their own too: with a branch for each eight and one for
//! each longer leaf instead, rays took 1.05 to 1.27 times as long. Sets are words of bits, which stay in registers: lists
//! of numbers took 1.05 to 1.09 times as long.
//!
//! Before all that, [`group`] takes eight rays at a time to where they start, and through the leaf there.
//!
//! Cells have thick walls as in `walk.rs`, a leaf's triangles go through the mode's own test, and the least
//! `(t, primitive id)` counts: hits are those of the packet kernels, bit for bit. Rays that are not
//! ordinary (`range.rs`) are left to the packet kernel.

mod accel;
mod flight;
mod group;
mod leaf;
pub mod step;

use super::lanes::RayPacket;
use super::packet;
use super::records::Resident;
use crate::geometry::triangle::{self, Mode, Test};
use crate::geometry::{Hit, Ray};
use crate::kdtree::{Exit, KdTree, Tree};
use crate::simd::{Simd, prefetch};
use flight::{Flight, NONE};
pub use group::Group;
use std::cell::Cell;
use std::hint::select_unpredictable;
use step::{END, Waiting, step};

/// Rays in flight. What is known of so many and the tops of their stacks stay in the first cache; with 64, rays
/// were 3 to 12 % slower in four models, with 24 they were as quick.
pub const IN_FLIGHT: usize = 32;

/// What is asked of each ray.
pub trait Answers {
    /// Whether any hit will do.
    const ANY: bool;

    /// A ray that the packet kernel has to trace.
    fn odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, number: usize, ray: &Ray);

    /// Rays that it has to trace all.
    #[cold]
    #[inline(never)]
    fn all_odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, rays: &[Ray]) {
        for (number, ray) in rays.iter().enumerate() {
            self.odd::<M>(tree, number, ray);
        }
    }
}

/// The same where each ray has its answer by itself.
pub trait OneByOne: Answers {
    /// A ray's answer: the closest hit that was found, or any.
    fn found<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, flight: &Flight<M::Alone>);

    /// A ray that hits nothing.
    fn missed(&mut self, ray: usize);
}

/// Records of closest hits.
pub struct Closest<'a>(pub &'a mut [Hit]);

impl Answers for Closest<'_> {
    const ANY: bool = false;

    #[cold]
    #[inline(never)]
    fn odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, number: usize, ray: &Ray) {
        let rays = RayPacket::of_slice(&[*ray]);
        self.0[number] = packet::intersect::<1, f32, _, M>(tree, &rays, 1).get(0);
    }
}

impl OneByOne for Closest<'_> {
    #[inline(always)]
    fn found<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, flight: &Flight<M::Alone>) {
        let record = &tree.records[flight.primitive as usize];
        let [u, v] = flight.test.weigh(record, true);
        let [u, v] = M::Alone::weights(record, u, v);
        // A zero is given out without a sign.
        self.0[flight.ray as usize] = Hit {
            t: flight.tfar + 0.0,
            u: u + 0.0,
            v: v + 0.0,
            primitive: flight.primitive,
            normal: triangle::normal(tree.corners(flight.primitive)),
        };
    }

    #[inline(always)]
    fn missed(&mut self, ray: usize) {
        self.0[ray] = Hit::MISS;
    }
}

/// Whether rays hit anything.
pub struct Any<'a>(pub &'a mut [bool]);

impl Answers for Any<'_> {
    const ANY: bool = true;

    #[cold]
    #[inline(never)]
    fn odd<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, number: usize, ray: &Ray) {
        let rays = RayPacket::of_slice(&[*ray]);
        self.0[number] = packet::occluded::<1, f32, _, M>(tree, &rays, 1) == 1;
    }
}

impl OneByOne for Any<'_> {
    #[inline(always)]
    fn found<M: Mode>(&mut self, _tree: &Resident<'_, M::Record>, flight: &Flight<M::Alone>) {
        self.0[flight.ray as usize] = true;
    }

    #[inline(always)]
    fn missed(&mut self, ray: usize) {
        self.0[ray] = false;
    }
}

/// Some of the rays in flight, a bit for each: those that wait for the same work. It stays in a register.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Set(u32);

const _: () = assert!(IN_FLIGHT == u32::BITS as usize);

impl Set {
    pub const NONE: Self = Self(0);
    pub const ALL: Self = Self(u32::MAX);

    /// Puts a ray there if it is to be there.
    #[inline(always)]
    pub fn put_if(&mut self, flight: usize, wanted: bool) {
        self.0 |= u32::from(wanted) << (flight % IN_FLIGHT);
    }

    /// Takes out the first that is there.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<usize> {
        let first = (self.0 != 0).then(|| self.0.trailing_zeros() as usize % IN_FLIGHT);
        self.0 &= self.0.wrapping_sub(1);
        first
    }

    /// What is there and not in another.
    #[inline(always)]
    pub const fn without(self, other: Self) -> Self {
        Self(self.0 & !other.0)
    }

    #[inline(always)]
    pub const fn len(self) -> usize {
        self.0.count_ones() as usize
    }
}

/// What a ray goes on with.
struct Ways {
    lines: Set,
    leaves: Set,
    ended: Set,
}

impl Ways {
    /// Sends a ray to the exit that it takes, if it goes on at all, and fetches what it will need.
    #[inline(always)]
    fn route(&mut self, tree: &KdTree, flight: usize, exit: i32, goes_on: bool) {
        let ended = exit == END;
        let exit = Exit(exit);
        self.lines.put_if(flight, !exit.is_leaf() & goes_on);
        self.leaves.put_if(flight, exit.is_leaf() & !ended & goes_on);
        self.ended.put_if(flight, ended & goes_on);
        let line = tree.lines().as_ptr().wrapping_add(exit.line()).cast::<u32>();
        let record = tree.references().as_ptr().wrapping_add(exit.record());
        prefetch(select_unpredictable(exit.is_leaf(), record, line));
    }
}

thread_local! {
    /// The stacks of the rays in flight, too large to be made anew for each call.
    static STACKS: Cell<Vec<Waiting>> = const { Cell::new(Vec::new()) };
}

/// Traces rays and gives an answer for each.
#[inline(always)]
pub fn trace<S: Simd, M: Mode, A: OneByOne>(
    resident: &Resident<'_, M::Record>,
    rays: &[Ray],
    answers: &mut A,
) {
    with_stacks(
        #[inline(always)]
        |stacks| fly::<S, M, A>(resident, rays, answers, stacks),
    );
}

/// Has something done with the thread's stacks.
#[inline(always)]
pub fn with_stacks(fly: impl FnOnce(&mut [Waiting; IN_FLIGHT])) {
    // Taken out, not borrowed: a closure of the library's would be compiled without the instruction set.
    let mut stacks = STACKS.take();
    stacks.resize_with(IN_FLIGHT, Waiting::new);
    fly(stacks.first_chunk_mut().expect("as many as rays"));
    STACKS.set(stacks);
}

#[inline(always)]
fn fly<S: Simd, M: Mode, A: OneByOne>(
    resident: &Resident<'_, M::Record>,
    rays: &[Ray],
    answers: &mut A,
    stacks: &mut [Waiting; IN_FLIGHT],
) {
    let Resident { tree, records } = *resident;
    if !tree.scale().is_none() {
        answers.all_odd::<M>(resident, rays);
        return;
    }
    let lines = tree.lines();
    let mut flights: Vec<Flight<M::Alone>> = Vec::with_capacity(IN_FLIGHT);
    let mut ways = Ways { lines: Set::NONE, leaves: Set::NONE, ended: Set::NONE };
    let (mut triangles, mut hits) = (Set::NONE, Set::NONE);
    let mut free = Set::ALL;
    let mut ahead = 0;
    let mut group = Group::new();
    loop {
        // New rays in the place of those that have ended, eight at a time.
        while ahead < rays.len() && free.len() >= 8 {
            let eight = &rays[ahead..rays.len().min(ahead + 8)];
            group.prepare::<S::F8>(eight, tree.bounds(), lines);
            if A::ANY {
                group.test_leaf::<S::F8, M, true>(resident);
            } else {
                group.test_leaf::<S::F8, M, false>(resident);
            }
            for (lane, ray) in eight.iter().enumerate() {
                let number = ahead + lane;
                if group.odd >> lane & 1 == 1 {
                    answers.odd::<M>(resident, number, ray);
                } else if group.flies >> lane & 1 == 0 {
                    answers.missed(number);
                } else {
                    let k = free.pop().expect("as many as rays");
                    let flight = group.start(lane, ray, number, &mut stacks[k]);
                    ways.route(tree, k, stacks[k].exits[flight.top as usize], true);
                    if flights.is_empty() {
                        // The others are written over before they are looked at.
                        flights.resize(IN_FLIGHT, flight);
                    }
                    flights[k] = flight;
                }
            }
            ahead += eight.len();
        }
        // (Fixed in length, so that no ray's number has to be checked.)
        let Some(flights) = flights.first_chunk_mut::<IN_FLIGHT>().filter(|_| free != Set::ALL) else {
            return;
        };

        // Triangles. Where nothing is found, a ray goes on with the next ones of its leaf, or if that was all, with what
        // is next on its stack.
        while let Some(k) = triangles.pop() {
            let (flight, waiting) = (&mut flights[k], &stacks[k]);
            flight.sift::<S::F8>(records);
            let (found, goes_on) = (flight.leaf.has_found(), flight.leaf.goes_on());
            hits.put_if(k, found);
            flight.top -= u32::from(!found & !goes_on);
            ways.route(tree, k, waiting.exits[flight.top as usize], !found);
        }

        // Hits.
        while let Some(k) = hits.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            let ends = flight.settle::<S::F8>(records) & A::ANY;
            let mut top = flight.top as usize;
            if ends | !flight.leaf.goes_on() {
                top = waiting.reached::<S::F8>(select_unpredictable(ends, 0, top - 1), flight.tfar);
            }
            flight.top = top as u32;
            ways.route(tree, k, waiting.exits[top], true);
        }

        // Rays that have ended.
        while let Some(k) = ways.ended.pop() {
            let flight = &flights[k];
            if flight.primitive == NONE {
                answers.missed(flight.ray as usize);
            } else {
                answers.found::<M>(resident, flight);
            }
            free.put_if(k, true);
        }

        // Leaves whose records are here.
        while let Some(k) = ways.leaves.pop() {
            let flight = &mut flights[k];
            let exit = Exit(stacks[k].exits[flight.top as usize]);
            flight.leaf.fetch::<S::F8, _>(tree.references(), exit.record(), records);
            triangles.put_if(k, true);
        }

        // Lines. Those who go on with a line are there again in the next round.
        let mut here = std::mem::replace(&mut ways.lines, Set::NONE);
        while let Some(k) = here.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            let top = flight.top as usize;
            let top = step::<S::F8>(lines, &flight.crossing, waiting, top, flight.tfar);
            flight.top = top as u32;
            ways.route(tree, k, waiting.exits[top], true);
        }
    }
}
