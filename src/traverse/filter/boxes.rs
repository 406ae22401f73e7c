//! A list at a node of eight boxes.
//!
//! All rays of a list run into one octant. So the boxes have one order for all of them, and near faces are on one side. As many
//! rays at a time as a register holds are put to the boxes one by one, the farthest first, thick faces and all
//! ([`pool::step`](crate::traverse::pool::step) says how thick), and each box gets the rays that enter it before they leave it.
//! (A ray by itself meets all eight at once.)
//!
//! A box that a ray enters lies in the one that it came from, so an interval begins where the last box was entered; where it
//! ends is not kept, as nobody asks. Of rays that ask for any hit nobody asks where they enter a box, either: nothing that they
//! find makes them shorter.

use super::cut::present;
use super::lists::{Entries, Heads, List};
use super::lot::{Crossing, Lot};
use crate::kdtree::Boxes;
use crate::simd::{Dense, Eight, Lanes, Mask, Sixteen};
use crate::traverse::pool::step::{Met, Spread, meet, thick};

/// Rays of a list as boxes see them.
struct Seen<const W: usize, L: Lanes<W>> {
    /// Their words in the list.
    words: L::Ids,
    /// Those of which something is left.
    live: L::Mask,
    /// 1 / direction.
    inverse: [L; 3],
    /// What is added for near faces, and for far ones.
    near: [L; 3],
    far: [L; 3],
    /// Where each begins, and where it ends.
    tmin: L,
    closest: L,
}

impl<const W: usize, L: Dense<W>> Seen<W, L> {
    /// The rays of up to `W` entries.
    #[inline(always)]
    fn new<const ANY: bool>(lot: &Lot, entries: &Entries, at: usize, count: usize) -> Self {
        let words = entries.words(at);
        let crossing = lot.crossing::<W, L>(words);
        Self::of::<ANY>(crossing, L::ids_of(words), present(count.min(W)))
    }

    /// Those that are there of some rays with such words.
    #[inline(always)]
    fn of<const ANY: bool>(crossing: Crossing<L>, words: L::Ids, present: u32) -> Self {
        let tmin = if ANY { crossing.begin } else { L::of_tagged(words) };
        let ([mut near, mut far], closest) = ([[tmin; 3]; 2], crossing.closest);
        for axis in 0..3 {
            [near[axis], far[axis]] =
                thick(crossing.origin[axis], crossing.inverse[axis], crossing.margin[axis]);
        }
        let live = tmin.le(closest) & L::mask_from_bits(present);
        Self { words, live, inverse: crossing.inverse, near, far, tmin, closest }
    }

    /// The rays that go into a box, and where they enter it.
    #[inline(always)]
    fn meet(&self, node: &Boxes, octant: usize, lane: usize) -> (u32, L) {
        let (mut near, mut far) = (self.near, self.far);
        for axis in 0..3 {
            let (down, faces) = (octant >> axis & 1, &node.faces[axis]);
            (near[axis], far[axis]) = (L::splat(faces[down][lane]), L::splat(faces[down ^ 1][lane]));
        }
        self.between(&near, &far)
    }

    /// The rays that go in between near faces and far ones of their own, and where.
    #[inline(always)]
    fn between(&self, near: &[L; 3], far: &[L; 3]) -> (u32, L) {
        let (mut enters, mut leaves) = (self.tmin, self.closest);
        for axis in 0..3 {
            let first = near[axis].mul_add(self.inverse[axis], self.near[axis]);
            let last = far[axis].mul_add(self.inverse[axis], self.far[axis]);
            // (`max` and `min` keep a NaN that stands on their right.)
            (enters, leaves) = (first.max(enters), last.min(leaves));
        }
        ((enters.le(leaves) & self.live).bits(), enters)
    }
}

/// Writes the entries of rays whose bits are set, which enter a box there.
#[inline(always)]
fn write<const W: usize, L: Dense<W>, const ANY: bool>(
    entries: &mut Entries,
    at: usize,
    bits: u32,
    words: L::Ids,
    enters: L,
) {
    entries.write_starts::<W, L>(at, bits, if ANY { words } else { enters.tag(words) });
}

/// Has a list meet a node's boxes, and puts what comes out on the stack, the nearest on top.
#[inline(always)]
pub fn cut<const W: usize, L: Dense<W>, const ANY: bool>(
    node: &Boxes,
    octant: usize,
    lot: &Lot,
    entries: &mut Entries,
    heads: &mut Heads,
    list: &List,
) {
    let (at, len) = (list.at as usize, list.len as usize);
    let lanes = node.lanes(octant);
    if len <= W {
        // All are in registers, and what comes out takes their place.
        let seen = Seen::<W, L>::new::<ANY>(lot, entries, at, len);
        let mut next = at;
        for &lane in &lanes {
            let (bits, enters) = seen.meet(node, octant, lane);
            let count = bits.count_ones() as usize;
            write::<W, L, ANY>(entries, next, bits, seen.words, enters);
            heads.push(node.ways[lane], next, count);
            next += count;
        }
        return;
    }

    // A place for each box, behind the list.
    let begin = list.behind();
    let mut next = begin;
    for done in (0..len).step_by(W) {
        let seen = Seen::<W, L>::new::<ANY>(lot, entries, at + done, len - done);
        if !seen.live.any() {
            continue;
        }
        for (place, &lane) in lanes.iter().enumerate() {
            let (bits, enters) = seen.meet(node, octant, lane);
            write::<W, L, ANY>(entries, next[place], bits, seen.words, enters);
            next[place] += bits.count_ones() as usize;
        }
    }
    for (place, &lane) in lanes.iter().enumerate() {
        heads.push(node.ways[lane], begin[place], next[place] - begin[place]);
    }
}

/// Takes a list of up to four rays through a node: of sixteen lanes, each four hold what all rays are to one of the boxes.
///
/// ```text
/// lane    0   1   2   3   4   5   6   7   8         15
///       +---+---+---+---+---+---+---+---+-----  -----+
/// ray   | 0 | 1 | 2 | 3 | 0 | 1 | 2 | 3 | 0 ...      |      box by box, so that what is closed up is
/// box   |   farthest    |  next to it   |            |      one list behind the other
///       +---------------+---------------+-----  -----+
/// ```
#[inline(always)]
pub fn cut_few<L: Sixteen, const ANY: bool>(
    node: &Boxes,
    octant: usize,
    lot: &Lot,
    entries: &mut Entries,
    heads: &mut Heads,
    list: &List,
) {
    let at = list.at as usize;
    let words: &[i32; 4] = entries.words(at);
    let crossing = lot.crossing_of_four::<L>(words);
    let words = L::ids_of_four(words);
    let present = 0x1111 * present(list.len as usize);
    let seen = Seen::<16, L>::of::<ANY>(crossing, words, present);
    let order = L::Half::ids_nibbles(node.orders[octant & 7]);
    let lanes = node.lanes(octant);
    let mut next = at;
    for half in 0..2 {
        let places = L::ids_spread(order, half);
        let (mut near, mut far) = (seen.near, seen.far);
        for axis in 0..3 {
            let (down, faces) = (octant >> axis & 1, &node.faces[axis]);
            near[axis] = L::of_half(L::Half::load(&faces[down])).pick(places);
            far[axis] = L::of_half(L::Half::load(&faces[down ^ 1])).pick(places);
        }
        let (bits, enters) = seen.between(&near, &far);
        write::<16, L, ANY>(entries, next, bits, words, enters);
        for place in 0..4 {
            let count = (bits >> (4 * place) & 15).count_ones() as usize;
            heads.push(node.ways[lanes[4 * half + place]], next, count);
            next += count;
        }
    }
}

/// Takes a ray of a list by itself through a node: its boxes have the lanes then, as in a stream.
#[inline(always)]
pub fn take_one<L: Eight, const ANY: bool>(
    node: &Boxes,
    lot: &Lot,
    entries: &mut Entries,
    heads: &mut Heads,
    list: &List,
) {
    let at = list.at as usize;
    let (word, tmin, _) = entries.one(at);
    let (slabs, closest) = lot.slabs(word);
    let tmin = if ANY { lot.begin(word) } else { tmin };
    let Met { ways, enters, bits, .. } =
        meet(node, &Spread::<L>::new(&slabs), L::splat(tmin), L::splat(closest), false);
    if ANY {
        entries.write_one(at, word);
    } else {
        entries.write_starts::<8, L>(at, bits, enters.tag(L::ids(word)));
    }
    heads.push_each::<L>(ways, bits, at);
}
