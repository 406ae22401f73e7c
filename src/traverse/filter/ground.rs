//! What lists go through on their way to triangles: the lines of a tree and its leaves, or nodes of boxes and pools.

use super::boxes;
use super::cut;
use super::leaf::SIFTED;
use super::lists::{Entries, Heads, List};
use super::lot::Lot;
use super::pool;
use crate::geometry::triangle::Mode;
use crate::kdtree::{Chunk, Exit, KdTree, Way};
use crate::simd::{Dense, Eight, Sixteen, prefetch};
use crate::traverse::pool::ways::Ways;
use crate::traverse::records::Resident;
use std::hint::select_unpredictable;

/// Inner places that lists are cut at, and leaves.
pub trait Ground {
    /// Lists of so many rays, or fewer, go through a leaf ray by ray.
    const FEW: u32;

    /// Whether a place is a leaf.
    fn is_leaf(&self, place: i32) -> bool;

    /// Fetches what tells what is in a place. (Any number may be one.)
    fn fetch(&self, place: i32);

    /// Takes a list of one ray through an inner place, and puts what comes out on the stack, the nearest on top.
    fn take_one<F: Eight>(&self, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List);

    /// The same of a longer list, of rays that run into an octant, `W` at a time.
    fn cut<const W: usize, L: Dense<W>, F: Eight>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    );

    /// The triangles of the leaf that a list is in, up to [`SIFTED`] at a time.
    fn leaf<'a>(&'a self, list: &'a List) -> impl Iterator<Item = &'a [u32]> + Clone;

    /// Tests those against the rays of a list one by one. Who has no [`FEW`](Self::FEW) is not asked.
    #[inline(always)]
    fn test_few<L: Sixteen, M: Mode, const ANY: bool>(
        &self,
        _resident: &Resident<'_, M::Record>,
        _lot: &mut Lot,
        _entries: &Entries,
        _list: &List,
    ) {
    }
}

/// The lines of a tree, whose leaves name their triangles.
pub struct OfLines<'a>(pub &'a KdTree);

impl Ground for OfLines<'_> {
    const FEW: u32 = 0;

    #[inline(always)]
    fn is_leaf(&self, place: i32) -> bool {
        Exit(place).is_leaf()
    }

    #[inline(always)]
    fn fetch(&self, place: i32) {
        let exit = Exit(place);
        let line = self.0.lines().as_ptr().wrapping_add(exit.line()).cast::<u32>();
        let record = self.0.references().as_ptr().wrapping_add(exit.record());
        prefetch(select_unpredictable(exit.is_leaf(), record, line));
    }

    #[inline(always)]
    fn take_one<F: Eight>(&self, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List) {
        cut::take_one::<F>(&self.0.lines()[Exit(list.exit).line()], lot, entries, heads, list);
    }

    #[inline(always)]
    fn cut<const W: usize, L: Dense<W>, F: Eight>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        cut::cut::<W, L, F>(&self.0.lines()[Exit(list.exit).line()], octant, lot, entries, heads, list);
    }

    #[inline(always)]
    fn leaf<'a>(&'a self, list: &'a List) -> impl Iterator<Item = &'a [u32]> + Clone {
        let words = &self.0.references()[Exit(list.exit).record()..];
        words[1..][..words[0] as usize].chunks(SIFTED)
    }
}

/// Nodes of boxes, and pools.
pub struct OfBoxes<'a>(pub Ways<'a>);

impl OfBoxes<'_> {
    /// The chunks of the pool that a list is in.
    #[inline(always)]
    fn chunks(&self, list: &List) -> Chunks<'_> {
        Chunks { words: self.0.words, next: Way(list.exit).word() }
    }
}

/// The chunks of a pool.
#[derive(Clone)]
pub struct Chunks<'a> {
    words: &'a [u32],
    /// The first word of the next one, or 0.
    next: usize,
}

impl<'a> Iterator for Chunks<'a> {
    type Item = Chunk<'a>;

    #[inline(always)]
    fn next(&mut self) -> Option<Chunk<'a>> {
        if self.next == 0 {
            return None;
        }
        let chunk = Chunk::at(self.words, self.next);
        self.next = if chunk.next() == 0 { 0 } else { self.next + chunk.next() };
        Some(chunk)
    }
}

/// A chunk's triangles.
#[inline(always)]
fn primitives(chunk: Chunk<'_>) -> &[u32] {
    &bytemuck::cast_ref::<[i32; SIFTED], [u32; SIFTED]>(chunk.ids())[..chunk.count().min(SIFTED)]
}

impl Ground for OfBoxes<'_> {
    const FEW: u32 = 2;

    #[inline(always)]
    fn is_leaf(&self, place: i32) -> bool {
        Way(place).is_pool()
    }

    #[inline(always)]
    fn fetch(&self, place: i32) {
        self.0.fetch(place);
    }

    #[inline(always)]
    fn take_one<F: Eight>(&self, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List) {
        boxes::take_one::<F>(&self.0.nodes[Way(list.exit).node()], lot, entries, heads, list);
    }

    #[inline(always)]
    fn cut<const W: usize, L: Dense<W>, F: Eight>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        boxes::cut::<W, L>(&self.0.nodes[Way(list.exit).node()], octant, lot, entries, heads, list);
    }

    #[inline(always)]
    fn leaf<'a>(&'a self, list: &'a List) -> impl Iterator<Item = &'a [u32]> + Clone {
        self.chunks(list).map(primitives)
    }

    #[inline(always)]
    fn test_few<L: Sixteen, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        lot: &mut Lot,
        entries: &Entries,
        list: &List,
    ) {
        for at in list.at..list.at + list.len {
            pool::test_one::<L, M, ANY>(resident, lot, entries, at as usize, self.chunks(list));
        }
    }
}
