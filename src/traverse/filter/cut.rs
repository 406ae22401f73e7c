//! A list at a line of the tree: three levels at once.
//!
//! All rays of a list run into one octant. So of the two cells beside a plane all come to the same one first, and the eight
//! exits have one order for all of them. As many rays at a time as a register holds are cut at the seven planes, walls
//! included (`walk.rs` says why they are thick): each exit gets the rays of which something is left after the three walls
//! on the way to it.

use super::lists::{Entries, Heads, List};
use super::lot::{Crossing, Lot};
use crate::kdtree::Line;
use crate::simd::{Dense, Eight, Mask};
use crate::traverse::stream::step::{ORDERS, take};

/// A line as rays see it that run into an octant: in the order in which they come to its exits, the farthest first.
///
/// Planes stand in the order of a walk that takes the far half first: the root's; then of each half its own, and those of
/// its two quarters.
struct Seen {
    planes: [f32; 8],
    /// The planes' axes.
    axes: [i32; 8],
    exits: [i32; 8],
    /// The exits that lead anywhere.
    leads: u32,
}

impl Seen {
    #[inline(always)]
    fn new<L: Eight>(line: &Line, octant: usize) -> Self {
        let exits = L::ids_load(&line.exits);
        // Where rays run down, by place.
        let signs = &SIGNS[octant & 7];
        let down = L::of_fours([signs; 2]).pick_in_fours(exits).lt(L::splat(0.0)).bits() & 0xff;
        let planes = L::ids_widen(&PLANES[down as usize]);
        // The lanes of a stream's exits are in the order that is wanted here.
        let ordered = L::ids_pick(exits, L::ids_widen(&ORDERS[down as usize]));
        // An exit that leads nowhere has nothing but an axis in it.
        let leads = L::ids_less(L::ids(3), ordered) | L::ids_less(ordered, L::ids(0));
        Self {
            planes: L::load(&line.planes).pick(planes).store(),
            axes: L::ids_store(L::ids_and(L::ids_pick(exits, planes), L::ids(3))),
            exits: L::ids_store(ordered),
            leads: leads.bits(),
        }
    }
}

/// A number of the sign that directions of an octant have along each axis.
static SIGNS: [[f32; 4]; 8] = {
    let mut signs = [[1.0; 4]; 8];
    let mut octant = 0;
    while octant < 8 {
        let mut axis = 0;
        while axis < 3 {
            if octant >> axis & 1 == 1 {
                signs[octant][axis] = -1.0;
            }
            axis += 1;
        }
        octant += 1;
    }
    signs
};

/// Places of planes in the order of [`Seen`], by the set of places whose planes rays cross downward.
static PLANES: [[u16; 8]; 256] = {
    let mut planes = [[0; 8]; 256];
    let mut down = 0;
    while down < 256 {
        // 0 is the far half or quarter, that above its plane if rays run up through it; 1 the near one.
        let mut half = 0;
        while half < 2 {
            let first = 4 * (down & 1 ^ 1 ^ half);
            planes[down][1 + 3 * half] = (first + 1) as u16;
            let mut quarter = 0;
            while quarter < 2 {
                let second = down >> (first + 1) & 1 ^ 1 ^ quarter;
                planes[down][2 + 3 * half + quarter] = (first + 2 + second) as u16;
                quarter += 1;
            }
            half += 1;
        }
        down += 1;
    }
    planes
};

/// Cuts a list at a line, and puts what comes out on the stack, the nearest on top.
#[inline(always)]
pub fn cut<const W: usize, L: Dense<W>, F: Eight>(
    line: &Line,
    octant: usize,
    lot: &Lot,
    entries: &mut Entries,
    heads: &mut Heads,
    list: &List,
) {
    let seen = Seen::new::<F>(line, octant);
    let (at, len) = (list.at as usize, list.len as usize);
    if len <= W {
        // All are in registers, and what comes out takes their place.
        let (words, tmax) = entries.load::<W, L>(at);
        let crossing = lot.crossing::<W, L>(words);
        let words = L::ids_of(words);
        let tmin = L::of_tagged(words);
        let tmax = crossing.closest.min(tmax);
        let live = tmin.le(tmax).bits() & present(len);
        if live == 0 {
            return;
        }
        let mut few = Few { words, live, next: at, entries, heads };
        seen.all(&crossing, (tmin, tmax), &mut few);
        return;
    }

    // A place for each exit, behind the list.
    let begin = list.behind();
    let mut next = begin;
    let mut done = 0;
    while done < len {
        let (words, tmax) = entries.load::<W, L>(at + done);
        let crossing = lot.crossing::<W, L>(words);
        let words = L::ids_of(words);
        let tmin = L::of_tagged(words);
        let tmax = crossing.closest.min(tmax);
        let live = tmin.le(tmax).bits() & present((len - done).min(W));
        let mut many = Many { words, live, next: &mut next, entries };
        seen.all(&crossing, (tmin, tmax), &mut many);
        done += W;
    }
    for order in 0..8 {
        heads.push(seen.exits[order], begin[order], next[order] - begin[order]);
    }
}

/// Takes a list of one ray through a line: its planes and exits have the lanes then, as in a stream.
#[inline(always)]
pub fn take_one<L: Eight>(line: &Line, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List) {
    let at = list.at as usize;
    let (word, tmin, tmax) = entries.one(at);
    let (planes, closest) = lot.planes::<L>(word, line);
    let tmax = L::splat(tmax).min(L::splat(closest));
    let taken = take::<L>(line, &planes, 0, L::splat(tmin), tmax);
    entries.write_each(at, taken.bits, word, taken.tmin, taken.tmax);
    heads.push_each::<L>(taken.exits, taken.bits, at);
}

/// The first so many lanes.
#[inline(always)]
pub const fn present(count: usize) -> u32 {
    ((1u64 << count) - 1) as u32
}

/// Who takes the rays at the exits, the farthest first.
trait Take<const W: usize, L: Dense<W>> {
    fn take(&mut self, order: usize, seen: &Seen, part: (L, L));
}

/// Rays that fit into a register: lists one behind the other.
struct Few<'a, const W: usize, L: Dense<W>> {
    words: L::Ids,
    live: u32,
    next: usize,
    entries: &'a mut Entries,
    heads: &'a mut Heads,
}

impl<const W: usize, L: Dense<W>> Take<W, L> for Few<'_, W, L> {
    #[inline(always)]
    fn take(&mut self, order: usize, seen: &Seen, (tmin, tmax): (L, L)) {
        let bits = tmin.le(tmax).bits() & self.live & seen.leads(order);
        let count = bits.count_ones() as usize;
        self.entries.write::<W, L>(self.next, bits, tmin.tag(self.words), tmax);
        self.heads.push(seen.exits[order], self.next, count);
        self.next += count;
    }
}

/// Some of the rays of a longer list: each exit's has a place of its own.
struct Many<'a, const W: usize, L: Dense<W>> {
    words: L::Ids,
    live: u32,
    next: &'a mut [usize; 8],
    entries: &'a mut Entries,
}

impl<const W: usize, L: Dense<W>> Take<W, L> for Many<'_, W, L> {
    #[inline(always)]
    fn take(&mut self, order: usize, seen: &Seen, (tmin, tmax): (L, L)) {
        let bits = tmin.le(tmax).bits() & self.live & seen.leads(order);
        self.entries.write::<W, L>(self.next[order], bits, tmin.tag(self.words), tmax);
        self.next[order] += bits.count_ones() as usize;
    }
}

impl Seen {
    /// All bits if an exit leads anywhere.
    #[inline(always)]
    const fn leads(&self, order: usize) -> u32 {
        (self.leads >> order & 1).wrapping_neg()
    }

    /// Cuts rays at the seven planes. (No loops: they would not be unrolled.)
    #[inline(always)]
    fn all<const W: usize, L: Dense<W>>(&self, rays: &Crossing<L>, part: (L, L), to: &mut impl Take<W, L>) {
        let wall = self.wall(0, rays);
        self.half(rays, 0, far(part, wall), to);
        self.half(rays, 1, near(part, wall), to);
    }

    /// The far half of the exits, or the near one.
    #[inline(always)]
    fn half<const W: usize, L: Dense<W>>(
        &self,
        rays: &Crossing<L>,
        half: usize,
        part: (L, L),
        to: &mut impl Take<W, L>,
    ) {
        let wall = self.wall(1 + 3 * half, rays);
        self.quarter(rays, 2 * half, far(part, wall), to);
        self.quarter(rays, 2 * half + 1, near(part, wall), to);
    }

    /// A quarter.
    #[inline(always)]
    fn quarter<const W: usize, L: Dense<W>>(
        &self,
        rays: &Crossing<L>,
        quarter: usize,
        part: (L, L),
        to: &mut impl Take<W, L>,
    ) {
        let wall = self.wall(2 + quarter + quarter / 2, rays);
        to.take(2 * quarter, self, far(part, wall));
        to.take(2 * quarter + 1, self, near(part, wall));
    }

    /// Where rays enter the wall of a plane, and where they leave it.
    #[inline(always)]
    fn wall<const W: usize, L: Dense<W>>(&self, plane: usize, rays: &Crossing<L>) -> (L, L) {
        let axis = (self.axes[plane] as usize).min(2);
        let t = (L::splat(self.planes[plane]) - rays.origin[axis]) * rays.inverse[axis];
        (t - rays.margin[axis], t + rays.margin[axis])
    }
}

/// What is left of intervals behind a wall.
#[inline(always)]
fn far<const W: usize, L: Dense<W>>((tmin, tmax): (L, L), (enters, _): (L, L)) -> (L, L) {
    (enters.max(tmin), tmax)
}

/// What is left of intervals before a wall.
#[inline(always)]
fn near<const W: usize, L: Dense<W>>((tmin, tmax): (L, L), (_, leaves): (L, L)) -> (L, L) {
    (tmin, leaves.min(tmax))
}
