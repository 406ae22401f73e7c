//! The pool kernel: many rays in flight, each alone, over leaves that hold their corners.
//!
//! As the [stream kernel](super::stream) it has some thirty rays on their way at once, and each round does one piece of
//! work for each: a node of eight boxes ([`step`]), or a chunk of up to sixteen triangles ([`crate::kdtree::Pools`]). What it does
//! not do is to ask the mode's test of each triangle: what a ray may hit is kept ([`list`]), and in the end the test is
//! asked of the one or two triangles that are left, sixteen of them at a time ([`answers`]).
//!
//! ```text
//!          +-------+----------------------------------+
//!          v       v              nothing             |
//! start -> nodes, chunks --------------------> (the pool's next chunk, or what is next on the stack) -> end -> answers:
//!  fetch:  node   chunk  \-> found: shortened ------>^                                              records  the next starts
//! ```
//!
//! A ray that comes by itself goes through the same nodes and chunks, with nobody else in flight ([`alone`]).
//!
//! Hits are those of the other kernels, to the bit. Only the modes whose test is told ahead by
//! [`Pooled`](crate::geometry::triangle::pooled::Pooled) have this kernel: watertight and exact.

mod accel;
mod alone;
pub mod answers;
mod flight;
mod list;
mod prepared;
mod start;
pub mod step;
pub mod ways;

use super::records::Resident;
use super::source::Source;
use super::stream::step::{END, Waiting};
use super::stream::{IN_FLIGHT, Set, with_stacks};
use crate::geometry::Ray;
use crate::geometry::triangle::Mode;
use crate::kdtree::{Pools, Tree, Way};
use crate::simd::Simd;
use answers::{OfFlights, Pairs};
use flight::{Finds, Flight};
use start::Starts;
use step::step;
use ways::Ways;

/// Traces rays and gives an answer for each.
#[inline(always)]
fn trace<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    rays: &[Ray],
    answers: &mut A,
) {
    with_stacks(
        #[inline(always)]
        |stacks| fly::<S, M, A>(resident, pools, rays, answers, stacks),
    );
}

#[inline(always)]
fn fly<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    rays: &[Ray],
    answers: &mut A,
    stacks: &mut [Waiting; IN_FLIGHT],
) {
    let Resident { tree, records } = *resident;
    if !tree.scale().is_none() {
        answers.all_odd::<M>(resident, rays);
        return;
    }
    let mut flights = [Flight::NONE; IN_FLIGHT];
    let ways = Ways::new(pools);
    // Rays that wait for the same: those that are at a node; at a chunk, or their end; that found something; that hit
    // something, where any hit will do.
    let (mut at_node, mut at_chunk, mut more_chunks) = (Set::NONE, Set::NONE, Set::NONE);
    let (mut found, mut hit) = (Set::NONE, Set::NONE);
    let mut pairs = Pairs::NONE;
    let mut free = Set::ALL;
    let mut ahead = 0;
    loop {
        // New rays in the place of those that have ended, eight at a time.
        while ahead < rays.len() && free.len() >= 8 {
            let eight = &rays[ahead..rays.len().min(ahead + 8)];
            let starts = Starts::new::<S::F8>(eight, tree.bounds());
            for (lane, ray) in eight.iter().enumerate() {
                let number = ahead + lane;
                if starts.odd >> lane & 1 == 1 {
                    answers.odd::<M>(resident, number, ray);
                } else if starts.flies >> lane & 1 == 0 {
                    answers.missed(number);
                } else {
                    let k = free.pop().expect("as many as rays");
                    let pooled = starts.pooled(lane, &ray.origin.to_array());
                    flights[k].begin(starts.slabs(lane), pooled, starts.tfar(lane), ray, number);
                    stacks[k].begin();
                    at_node.put_if(k, true);
                }
            }
            ahead += eight.len();
        }
        if free == Set::ALL {
            answers.finish::<S, M>(resident, Source::Slice(rays), &mut pairs);
            return;
        }

        // Chunks, whose words are here by now, and rays that have ended. Where nothing is found, a ray goes on with the next
        // chunk of its pool, or with what is next on its stack.
        while let Some(k) = at_chunk.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            let top = flight.top as usize;
            let way = Way(waiting.exits[top]);
            if way.0 == END {
                answers.end::<S, M>(resident, Source::Slice(rays), flight, &mut pairs);
                free.put_if(k, true);
                continue;
            }
            let Finds { possible, certain, next } = flight.look::<S::F16, M>(ways.words, way.word(), A::ANY);
            waiting.exits[top] = way.further(next).0;
            flight.top -= u32::from(next == 0);
            let ends = A::ANY & certain;
            let is_pool = ways.fetch(waiting.exits[flight.top as usize]);
            more_chunks.put_if(k, is_pool & !possible);
            at_node.put_if(k, !is_pool & !possible);
            found.put_if(k, possible & !ends);
            if A::ANY {
                hit.put_if(k, ends);
            }
        }

        // Those who found something, and may be nearer to their ends.
        while let Some(k) = found.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            if flight.list.is_full() {
                flight.settle::<M>(records, &rays[flight.ray as usize]);
            }
            if !A::ANY {
                flight.top = waiting.reached::<S::F8>(flight.top as usize, flight.tfar) as u32;
            }
            let is_pool = ways.fetch(waiting.exits[flight.top as usize]);
            more_chunks.put_if(k, is_pool);
            at_node.put_if(k, !is_pool);
        }
        while let Some(k) = hit.pop() {
            answers.hits(flights[k].ray as usize);
            free.put_if(k, true);
        }

        // Nodes. Those who go on with a node are there again in the next round.
        at_chunk = std::mem::replace(&mut more_chunks, Set::NONE);
        let mut here = at_node;
        while let Some(k) = here.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            let top = flight.top as usize;
            let at = (top, Way(waiting.exits[top]));
            let Flight { slabs, tnear, tfar, .. } = flight;
            let (top, way) = step::<S::F8>(ways.nodes, slabs, waiting, at, *tnear, *tfar, A::ANY);
            flight.top = top as u32;
            at_chunk.put_if(k, ways.fetch(way.0));
        }
        at_node = at_node.without(at_chunk);
    }
}
