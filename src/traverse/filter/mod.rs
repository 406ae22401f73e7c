//! The filter kernel: lists of rays, filtered down the tree.
//!
//! Rays that bounce off what a picture's square shows run everywhere, and no two of them alike: packets fall apart. But of
//! thousands of them, many visit the same lines and leaves of the tree, most of these by eight rays and more
//! (`docs/incoherent.md`). So here it is not rays that walk: a *list* of rays is at a line of the tree, and is cut into
//! one for each of its eight exits (ray stream filtering: Wald, Gribble, Boulos & Kensler 2007; with an order of its own for
//! each octant: Barringer & Akenine-Möller 2014; Fuetterling, Lojewski, Pfreundt & Ebert 2015). Lists are always dense:
//! whatever rays do, registers are full as long as a list is longer than they are.
//!
//! 1. [`Lot`]: up to [`LOT`] rays are made ready, and parted by octant, so that all rays of a list come to the same one of
//!    two cells first.
//! 2. [`cut`](cut::cut): the list on top of the stack is cut at a line of the tree, as many rays at a time as a register
//!    holds. The lists that come out go on the stack, the nearest exit's on top. A list of one ray goes through a line as
//!    in a stream.
//! 3. [`leaf`]: in a leaf, triangles are sifted, and those that a ray may hit tested, against as many rays of the list at once.
//!    Octants take turns, so that what a list needs is fetched while others have theirs.
//! 4. What rays have found shortens them; rays that nothing is left of drop out of lists as these are cut.
//!
//! What lists go through is their [`ground`]. Where [`Pools`](crate::kdtree::Pools) have been made it is nodes of eight
//! boxes, to which a list is put one box after the other ([`boxes`]), and pools ([`pool`]). There the mode's test is not asked
//! on the way: what a ray may hit is kept among the lot's [`candidates`] until the lot has ended, as in a
//! [stream](crate::traverse::pool), so that no triangle's record is fetched before.
//!
//! Cells have thick walls as in `walk.rs`, a leaf's triangles go through the mode's own test, and the least
//! `(t, primitive id)` counts: hits are those of the packet kernels, bit for bit. Rays that are not
//! ordinary (`range.rs`) are left to the packet kernel.

mod accel;
mod answers;
mod boxes;
mod candidates;
mod cut;
mod ground;
mod leaf;
mod lists;
mod lot;
mod pool;

use super::closest::NONE;
use super::pool::answers::Pairs;
use super::records::Resident;
use super::source::Source;
use crate::geometry::triangle::Mode;
use crate::kdtree::Tree;
use crate::simd::Simd;
use answers::BySixteens;
use candidates::Candidates;
use ground::{Ground, Rays};
use lists::{Entries, Heads};
use lot::{LOT, Lot};
use pool::Seen;
use std::cell::Cell;
use std::ops::Range;

/// What a worker's lots need, too large to be made anew for each call.
struct Room {
    rays: Rays,
    entries: Entries,
    /// The lists of each octant.
    heads: [Heads; 8],
}

thread_local! {
    static ROOM: Cell<Option<Box<Room>>> = const { Cell::new(None) };
}

/// Traces rays through some ground and gives an answer for each.
#[inline(always)]
fn trace<S: Simd, M: Mode, G: Ground, A: BySixteens>(
    resident: &Resident<'_, M::Record>,
    ground: &G,
    rays: Source<'_>,
    answers: &mut A,
) {
    // Taken out, not borrowed: a closure would be compiled without the instruction set.
    let mut boxed = match ROOM.take() {
        Some(room) => room,
        None => Box::new(Room {
            rays: Rays { lot: Lot::new(), candidates: Candidates::default(), seen: Seen::NOTHING },
            entries: Entries::new(),
            heads: [const { Heads::new() }; 8],
        }),
    };
    let room = &mut *boxed;
    let mut pairs = Pairs::NONE;
    let is_scaled = !resident.scale().is_none();
    let sixteens = rays.places().div_ceil(16);
    for first in (0..sixteens).step_by(LOT / 16) {
        let sixteens = first..sixteens.min(first + LOT / 16);
        if is_scaled {
            room.rays.lot.leave(rays, sixteens.clone());
        } else {
            let (lot, bounds) = (&mut room.rays.lot, resident.bounds());
            match (G::SHEARS, A::ANY) {
                (true, true) => lot.prepare::<S::F16, true, true>(rays, sixteens.clone(), bounds),
                (true, false) => lot.prepare::<S::F16, true, false>(rays, sixteens.clone(), bounds),
                (false, _) => lot.prepare::<S::F16, false, false>(rays, sixteens.clone(), bounds),
            }
            let at = At { resident, rays, place: 16 * first };
            if A::ANY {
                walk::<S, M, G, true>(&at, ground, room);
            } else {
                walk::<S, M, G, false>(&at, ground, room);
            }
        }
        give::<S, M, A>(resident, rays, sixteens, &mut room.rays, &mut pairs, answers);
    }
    answers.finish::<S, M>(resident, rays, &mut pairs);
    ROOM.set(Some(boxed));
}

/// Where a lot is: the tree, all rays, and the place of the lot's first.
struct At<'a, R> {
    resident: &'a Resident<'a, R>,
    rays: Source<'a>,
    place: usize,
}

impl Rays {
    /// Asks the mode's own test of all that may be hit.
    fn settle<M: Mode, const ANY: bool>(&mut self, at: &At<'_, M::Record>) {
        self.candidates.settle::<M, ANY>(at.resident, at.rays, at.place, &mut self.lot);
    }
}

/// Walks the tree with the rays of a lot.
///
/// Octants take turns, a list each, so that what a list needs of memory can be fetched while the others have theirs.
#[inline(always)]
fn walk<S: Simd, M: Mode, G: Ground, const ANY: bool>(at: &At<'_, M::Record>, ground: &G, room: &mut Room) {
    let Room { rays, entries, heads } = room;
    let resident = at.resident;
    let (mut waiting, mut fetched) = (0u32, 0u32);
    let mut begin = 0;
    for octant in 0..8 {
        let of_octant = rays.lot.octant(octant);
        let ids = of_octant.ids();
        heads[octant].push(0, begin, ids.len());
        begin = entries.begin(ids, (!G::SHEARS).then_some(of_octant.tmax()), begin);
        waiting |= u32::from(!ids.is_empty()) << octant;
    }
    while waiting != 0 {
        let mut turn = waiting;
        while turn != 0 {
            let octant = turn.trailing_zeros() as usize & 7;
            turn &= turn - 1;
            let heads = &mut heads[octant];
            let Some(list) = heads.pop() else {
                waiting &= !(1 << octant);
                continue;
            };
            // Sixteen lanes for lists that fill more than half of them.
            let wide = S::NATIVE == 16 && list.len > 8;
            if !ground.is_leaf(list.exit) {
                let lot = &rays.lot;
                if list.len == 1 {
                    ground.take_one::<S::F8, ANY>(lot, entries, heads, &list);
                } else if S::NATIVE == 16 && list.len <= G::SEVERAL {
                    ground.cut_few::<S::F16, ANY>(octant, lot, entries, heads, &list);
                } else if wide {
                    ground.cut::<16, S::F16, S::F8, ANY>(octant, lot, entries, heads, &list);
                } else {
                    ground.cut::<8, S::F8, S::F8, ANY>(octant, lot, entries, heads, &list);
                }
                ground.fetch(heads.top());
            } else if G::FETCHES && fetched >> octant & 1 == 0 {
                ground.fetch_triangles(resident, &list);
                heads.keep();
                fetched |= 1 << octant;
            } else {
                if list.len <= G::FEW {
                    ground.meet_few::<S::F16, M, ANY>(rays, entries, &list);
                } else if wide {
                    ground.meet::<16, S::F16, M, ANY>(resident, rays, entries, &list);
                } else {
                    ground.meet::<8, S::F8, M, ANY>(resident, rays, entries, &list);
                }
                ground.fetch(heads.top());
                fetched &= !(1 << octant);
                if rays.candidates.are_many() {
                    rays.settle::<M, ANY>(at);
                }
            }
        }
    }
}

/// Gives the answers of a lot's rays, those of some sixteens, but for pairs of rays and triangles that wait.
#[inline(always)]
fn give<S: Simd, M: Mode, A: BySixteens>(
    resident: &Resident<'_, M::Record>,
    rays: Source<'_>,
    sixteens: Range<usize>,
    Rays { lot, candidates, .. }: &mut Rays,
    pairs: &mut Pairs,
    answers: &mut A,
) {
    let (place, triangles) = (16 * sixteens.start, resident.tree.triangles());
    for (of_lot, sixteen) in sixteens.enumerate() {
        if A::ANY {
            answers.give(sixteen, lot.done(of_lot));
        } else {
            answers.give(sixteen, 0);
            let (mut found, mut places) = (0, [0; 16]);
            let primitives = lot.primitives(of_lot);
            for lane in 0..16 {
                places[lane] = (16 * sixteen + lane) as i32;
                found |= u32::from(primitives[lane] != NONE) << lane;
            }
            pairs.put::<S::F16>(&places, &primitives, found, triangles);
            answers.answer_if_many::<S, M>(resident, rays, pairs);
        }
        let mut odd = lot.odd(of_lot);
        while odd != 0 {
            let lane = odd.trailing_zeros() as usize & 15;
            odd &= odd - 1;
            let place = 16 * sixteen + lane;
            answers.odd::<M>(resident, place, &rays.ray(place));
        }
    }
    for row in 0..candidates.rows() {
        let (places, primitives, bits) = candidates.row::<S::F16>(row, lot, place);
        pairs.put::<S::F16>(&places, primitives, bits, triangles);
        answers.answer_if_many::<S, M>(resident, rays, pairs);
    }
    candidates.clear();
}

#[cfg(test)]
mod tests;
