//! The pool kernel: many rays in flight, each alone, over leaves that hold their corners.
//!
//! As the [stream kernel](super::stream) it has some thirty rays on their way at once, and each round does one piece of
//! work for each: a line of the tree, or a chunk of up to sixteen triangles ([`crate::kdtree::Pools`]). What it does not do is
//! to ask the mode's test of each triangle: what a ray may hit is kept ([`flight`]), and in the end the test is asked of the
//! one or two triangles that are left, sixteen of them at a time ([`answers`]).
//!
//! ```text
//!          +---------+-------------------------------+
//!          v         v               nothing         |
//! start -> lines -> leaves -> chunks --------> (next of the leaf or on the stack) -> end -> answers: the next ray starts
//!  fetch:  line     chunk        \-> found --------->^                              records
//! ```
//!
//! Hits are those of the other kernels, to the bit. Only the modes whose test is told ahead by
//! [`Pooled`](crate::geometry::triangle::pooled::Pooled) have this kernel: watertight and exact.

mod accel;
mod answers;
mod flight;

use super::records::Resident;
use super::stream::step::{END, Waiting, step};
use super::stream::{Group, IN_FLIGHT, Set, with_stacks};
use crate::geometry::Ray;
use crate::geometry::triangle::Mode;
use crate::kdtree::{Exit, Line, Pools, Tree};
use crate::simd::{Simd, prefetch};
use answers::{Pairs, Told};
use flight::{Finds, Flight};
use std::hint::select_unpredictable;

/// Where rays go on.
struct Ways<'a> {
    lines: &'a [Line],
    words: &'a [u32],
}

impl Ways<'_> {
    /// Fetches what a ray will need that takes an exit, and says whether that is a leaf, or the end.
    #[inline(always)]
    fn fetch(&self, exit: i32) -> bool {
        let exit = Exit(exit);
        let line = self.lines.as_ptr().wrapping_add(exit.line()).cast::<u32>();
        let chunk = self.words.as_ptr().wrapping_add(exit.record());
        prefetch(select_unpredictable(exit.is_leaf(), chunk, line));
        exit.is_leaf()
    }

    /// Fetches the lines that a chunk lies in, or most of them.
    #[inline(always)]
    fn fetch_chunk(&self, first: usize) {
        for line in 0..CHUNK_LINES {
            prefetch(self.words.as_ptr().wrapping_add(first + LINE * line));
        }
    }
}

/// Words in a line of the cache, and lines that most chunks lie in.
const LINE: usize = 16;
const CHUNK_LINES: usize = 4;

/// Traces rays and gives an answer for each.
#[inline(always)]
fn trace<S: Simd, M: Mode, A: Told>(
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
fn fly<S: Simd, M: Mode, A: Told>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    rays: &[Ray],
    answers: &mut A,
    stacks: &mut [Waiting; IN_FLIGHT],
) {
    let Resident { tree, records } = *resident;
    if !tree.scale().is_none() {
        for (number, ray) in rays.iter().enumerate() {
            answers.odd::<M>(resident, number, ray);
        }
        return;
    }
    let (lines, words) = (pools.lines(), pools.words());
    let mut flights: Vec<Flight> = Vec::with_capacity(IN_FLIGHT);
    let ways = Ways { lines, words };
    // Rays that wait for the same: those that are at a line; at a leaf, or their end; at a chunk; that found something;
    // that hit something, where any hit will do.
    let (mut at_line, mut at_leaf, mut at_chunk) = (Set::NONE, Set::NONE, Set::NONE);
    let (mut found, mut hit) = (Set::NONE, Set::NONE);
    let mut pairs = Pairs::NONE;
    let mut free = Set::ALL;
    let mut ahead = 0;
    let mut group = Group::new();
    loop {
        // New rays in the place of those that have ended, eight at a time.
        while ahead < rays.len() && free.len() >= 8 {
            let eight = &rays[ahead..rays.len().min(ahead + 8)];
            group.prepare::<S::F8>(eight, tree.bounds(), lines);
            for (lane, ray) in eight.iter().enumerate() {
                let number = ahead + lane;
                if group.odd >> lane & 1 == 1 {
                    answers.odd::<M>(resident, number, ray);
                } else if group.flies >> lane & 1 == 0 {
                    answers.misses(number);
                } else {
                    let k = free.pop().expect("as many as rays");
                    let flight = Flight::new(group.begin(lane, &mut stacks[k]), ray, number);
                    let is_leaf = ways.fetch(stacks[k].exits[flight.top as usize]);
                    at_leaf.put_if(k, is_leaf);
                    at_line.put_if(k, !is_leaf);
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
            answers.finish::<S, M>(resident, rays, &mut pairs);
            return;
        };

        // Chunks. Where nothing is found, a ray goes on with the next one of its leaf, or if that was all, with what
        // is next on its stack.
        while let Some(k) = at_chunk.pop() {
            let (flight, waiting) = (&mut flights[k], &stacks[k]);
            let Finds { possible, certain } = flight.look::<S::F16, M>(words);
            let ends = A::ANY & certain;
            flight.top -= u32::from(!possible & !flight.goes_on());
            let is_leaf = ways.fetch(waiting.exits[flight.top as usize]);
            at_leaf.put_if(k, is_leaf & !possible);
            at_line.put_if(k, !is_leaf & !possible);
            found.put_if(k, possible & !ends);
            if A::ANY {
                hit.put_if(k, ends);
            }
        }

        // Those who found something, and may be nearer to their ends.
        while let Some(k) = found.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            if flight.is_full() {
                flight.settle::<M>(records, &rays[flight.ray as usize]);
            }
            if !flight.goes_on() {
                flight.top = waiting.reached::<S::F8>(flight.top as usize - 1, flight.tfar) as u32;
            }
            let is_leaf = ways.fetch(waiting.exits[flight.top as usize]);
            at_leaf.put_if(k, is_leaf);
            at_line.put_if(k, !is_leaf);
        }
        while let Some(k) = hit.pop() {
            answers.hits(flights[k].ray as usize);
            free.put_if(k, true);
        }

        // Leaves whose chunks are on their way, and rays that have ended.
        while let Some(k) = at_leaf.pop() {
            let flight = &mut flights[k];
            let exit = stacks[k].exits[flight.top as usize];
            if exit == END {
                answers.end::<S, M>(resident, rays, flight, &mut pairs);
                free.put_if(k, true);
                continue;
            }
            let record = Exit(exit).record() as u32;
            flight.chunk = select_unpredictable(flight.goes_on(), flight.chunk + flight.next, record);
            flight.next = 0;
            ways.fetch_chunk(flight.chunk as usize);
            at_chunk.put_if(k, true);
        }

        // Lines. Those who go on with a line are there again in the next round.
        let mut here = at_line;
        while let Some(k) = here.pop() {
            let (flight, waiting) = (&mut flights[k], &mut stacks[k]);
            let top = flight.top as usize;
            let top = step::<S::F8>(lines, &flight.crossing, waiting, top, flight.tfar);
            flight.top = top as u32;
            at_leaf.put_if(k, ways.fetch(waiting.exits[top]));
        }
        at_line = at_line.without(at_leaf);
    }
}
