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
//! boxes, to which a list is put one box after the other ([`boxes`]), and pools, whose triangles a list meets as those of
//! other leaves, and one or two rays sixteen at a time ([`pool`]).
//!
//! Cells have thick walls as in `walk.rs`, a leaf's triangles go through the mode's own test, and the least
//! `(t, primitive id)` counts: hits are those of the packet kernels, bit for bit. Rays that are not
//! ordinary (`range.rs`) are left to the packet kernel.

mod accel;
mod boxes;
mod cut;
mod ground;
mod leaf;
mod lists;
mod lot;
mod pool;
mod source;

use super::closest::{Closest, Normals};
use super::records::Resident;
use super::stream::{self, Answers};
use super::walk::load3;
use crate::geometry::triangle::{Mode, Test};
use crate::kdtree::Tree;
use crate::simd::{Eight, Simd};
use ground::Ground;
use lists::{Entries, Heads};
use lot::{LOT, Lot};
use source::Source;
use std::cell::Cell;
use std::ops::Range;

/// What is asked of each ray, eight answers at a time.
pub trait ByEights: Answers {
    /// What the rays in the places from number `8 * eight` on have found.
    fn found_by_eight<L: Eight, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        eight: usize,
        closest: &Closest<8, L>,
    );
}

impl ByEights for stream::Closest<'_> {
    #[inline(always)]
    fn found_by_eight<L: Eight, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        eight: usize,
        closest: &Closest<8, L>,
    ) {
        let (rays, _) = rays.eight(eight);
        let test = M::Test::<8, L>::new(&load3(&rays.origin), &load3(&rays.direction), closest.found());
        let found = closest.records::<Resident<'_, M::Record>, M>(tree, Some(&test), &mut Normals::new());
        for (lane, hit) in self.0[8 * eight..].iter_mut().take(8).enumerate() {
            *hit = found.get(lane);
        }
    }
}

/// What a worker's lots need, too large to be made anew for each call.
struct Room {
    lot: Lot,
    entries: Entries,
    /// The lists of each octant.
    heads: [Heads; 8],
}

thread_local! {
    static ROOM: Cell<Option<Box<Room>>> = const { Cell::new(None) };
}

/// Traces rays through some ground and gives an answer for each.
#[inline(always)]
fn trace<S: Simd, M: Mode, G: Ground, A: ByEights>(
    resident: &Resident<'_, M::Record>,
    ground: &G,
    rays: Source<'_>,
    answers: &mut A,
) {
    // Taken out, not borrowed: a closure would be compiled without the instruction set.
    let mut boxed = match ROOM.take() {
        Some(room) => room,
        None => {
            Box::new(Room { lot: Lot::new(), entries: Entries::new(), heads: [const { Heads::new() }; 8] })
        }
    };
    let room = &mut *boxed;
    let is_scaled = !resident.scale().is_none();
    let eights = rays.places().div_ceil(8);
    for first in (0..eights).step_by(LOT / 8) {
        let eights = first..eights.min(first + LOT / 8);
        if is_scaled {
            room.lot.leave(rays, eights.clone());
        } else {
            room.lot.prepare::<S::F8>(rays, eights.clone(), resident.bounds());
            if A::ANY {
                walk::<S, M, G, true>(resident, ground, room);
            } else {
                walk::<S, M, G, false>(resident, ground, room);
            }
        }
        give::<S, M, A>(resident, rays, eights, &room.lot, answers);
    }
    ROOM.set(Some(boxed));
}

/// Walks the tree with the rays of a lot.
///
/// Octants take turns, a list each, so that what a list needs of memory can be fetched while the others have theirs.
#[inline(always)]
fn walk<S: Simd, M: Mode, G: Ground, const ANY: bool>(
    resident: &Resident<'_, M::Record>,
    ground: &G,
    room: &mut Room,
) {
    let Room { lot, entries, heads } = room;
    let (mut waiting, mut fetched) = (0u32, 0u32);
    let mut at = 0;
    for octant in 0..8 {
        let rays = lot.octant(octant);
        heads[octant].push(0, at, rays.len());
        at = entries.begin(rays, lot, at);
        waiting |= u32::from(!rays.is_empty()) << octant;
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
                if list.len == 1 {
                    ground.take_one::<S::F8>(lot, entries, heads, &list);
                } else if wide {
                    ground.cut::<16, S::F16, S::F8>(octant, lot, entries, heads, &list);
                } else {
                    ground.cut::<8, S::F8, S::F8>(octant, lot, entries, heads, &list);
                }
                ground.fetch(heads.top());
            } else if fetched >> octant & 1 == 0 {
                if list.len > G::FEW {
                    leaf::fetch(resident, ground.leaf(&list));
                }
                heads.keep();
                fetched |= 1 << octant;
            } else {
                if list.len <= G::FEW {
                    ground.test_few::<S::F16, M, ANY>(resident, lot, entries, &list);
                } else if wide {
                    leaf::test::<16, S::F16, M, ANY>(resident, lot, entries, &list, ground.leaf(&list));
                } else {
                    leaf::test::<8, S::F8, M, ANY>(resident, lot, entries, &list, ground.leaf(&list));
                }
                ground.fetch(heads.top());
                fetched &= !(1 << octant);
            }
        }
    }
}

/// Gives the answers of a lot's rays, those of some eights.
#[inline(always)]
fn give<S: Simd, M: Mode, A: ByEights>(
    resident: &Resident<'_, M::Record>,
    rays: Source<'_>,
    eights: Range<usize>,
    lot: &Lot,
    answers: &mut A,
) {
    for (of_lot, eight) in eights.enumerate() {
        answers.found_by_eight::<S::F8, M>(resident, rays, eight, &lot.closest::<S::F8>(of_lot));
        let mut odd = lot.odd(of_lot);
        while odd != 0 {
            let lane = odd.trailing_zeros() as usize & 7;
            odd &= odd - 1;
            let place = 8 * eight + lane;
            answers.odd::<M>(resident, place, &rays.ray(place));
        }
    }
}

#[cfg(test)]
mod tests;
