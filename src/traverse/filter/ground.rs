//! What lists go through on their way to triangles: the lines of a tree and its leaves, or nodes of boxes and pools.

use super::candidates::Candidates;
use super::leaf::{self, SIFTED};
use super::lists::{Entries, Heads, List};
use super::lot::Lot;
use super::pool::{self, Seen};
use super::{boxes, cut};
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

    /// Lists of so many rays, or fewer, have a way of their own through an inner place.
    const SEVERAL: u32 = 0;

    /// Whether [shears](crate::geometry::triangle::pooled::shears) are kept of rays in place of directions, and nobody asks where they
    /// end inside of the scene's bounds.
    const SHEARS: bool;

    /// Whether a leaf's triangles are fetched a turn before a list meets them.
    const FETCHES: bool;

    /// Whether a place is a leaf.
    fn is_leaf(&self, place: i32) -> bool;

    /// Fetches what tells what is in a place. (Any number may be one.)
    fn fetch(&self, place: i32);

    /// Takes a list of one ray through an inner place, and puts what comes out on the stack, the nearest on top.
    fn take_one<F: Eight, const ANY: bool>(
        &self,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    );

    /// The same of a longer list, of rays that run into an octant, `W` at a time.
    fn cut<const W: usize, L: Dense<W>, F: Eight, const ANY: bool>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    );

    /// The same of a list of [several](Self::SEVERAL) rays, where sixteen lanes are one register.
    #[inline(always)]
    fn cut_few<L: Sixteen, const ANY: bool>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        self.cut::<8, L::Half, L::Half, ANY>(octant, lot, entries, heads, list);
    }

    /// Fetches the triangles of the leaf that a list is in.
    fn fetch_triangles<R>(&self, resident: &Resident<'_, R>, list: &List);

    /// Has the rays of a list meet the triangles of the leaf that it is in, `W` rays at a time.
    fn meet<const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        rays: &mut Rays,
        entries: &Entries,
        list: &List,
    );

    /// The same ray by ray.
    fn meet_few<L: Sixteen, M: Mode, const ANY: bool>(&self, rays: &mut Rays, entries: &Entries, list: &List);
}

/// A lot's rays, what they may hit, and how some of them see the triangles of a chunk.
pub struct Rays {
    pub lot: Lot,
    pub candidates: Candidates,
    pub seen: Seen,
}

/// The lines of a tree, whose leaves name their triangles.
pub struct OfLines<'a>(pub &'a KdTree);

impl OfLines<'_> {
    /// The triangles of a leaf, up to [`SIFTED`] at a time.
    #[inline(always)]
    fn triangles(&self, list: &List) -> impl Iterator<Item = &[u32]> + Clone {
        let words = &self.0.references()[Exit(list.exit).record()..];
        words[1..][..words[0] as usize].chunks(SIFTED)
    }
}

impl Ground for OfLines<'_> {
    const FEW: u32 = 0;
    const SHEARS: bool = false;
    const FETCHES: bool = true;

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
    fn take_one<F: Eight, const ANY: bool>(
        &self,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        cut::take_one::<F>(&self.0.lines()[Exit(list.exit).line()], lot, entries, heads, list);
    }

    #[inline(always)]
    fn cut<const W: usize, L: Dense<W>, F: Eight, const ANY: bool>(
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
    fn fetch_triangles<R>(&self, resident: &Resident<'_, R>, list: &List) {
        leaf::fetch(resident, self.triangles(list));
    }

    #[inline(always)]
    fn meet<const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        rays: &mut Rays,
        entries: &Entries,
        list: &List,
    ) {
        leaf::test::<W, L, M, ANY>(resident, &mut rays.lot, entries, list, self.triangles(list));
    }

    #[inline(always)]
    fn meet_few<L: Sixteen, M: Mode, const ANY: bool>(&self, _: &mut Rays, _: &Entries, _: &List) {}
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

impl Ground for OfBoxes<'_> {
    const FEW: u32 = 3;
    const SEVERAL: u32 = 4;
    const SHEARS: bool = true;
    const FETCHES: bool = false;

    #[inline(always)]
    fn is_leaf(&self, place: i32) -> bool {
        Way(place).is_pool()
    }

    #[inline(always)]
    fn fetch(&self, place: i32) {
        self.0.fetch(place);
    }

    #[inline(always)]
    fn take_one<F: Eight, const ANY: bool>(
        &self,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        boxes::take_one::<F, ANY>(&self.0.nodes[Way(list.exit).node()], lot, entries, heads, list);
    }

    #[inline(always)]
    fn cut<const W: usize, L: Dense<W>, F: Eight, const ANY: bool>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        boxes::cut::<W, L, ANY>(&self.0.nodes[Way(list.exit).node()], octant, lot, entries, heads, list);
    }

    #[inline(always)]
    fn cut_few<L: Sixteen, const ANY: bool>(
        &self,
        octant: usize,
        lot: &Lot,
        entries: &mut Entries,
        heads: &mut Heads,
        list: &List,
    ) {
        let node = &self.0.nodes[Way(list.exit).node()];
        boxes::cut_few::<L, ANY>(node, octant, lot, entries, heads, list);
    }

    #[inline(always)]
    fn fetch_triangles<R>(&self, _: &Resident<'_, R>, _: &List) {}

    #[inline(always)]
    fn meet<const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
        &self,
        _: &Resident<'_, M::Record>,
        Rays { lot, candidates, seen }: &mut Rays,
        entries: &Entries,
        list: &List,
    ) {
        pool::meet::<W, L, M, ANY>(lot, entries, list, self.chunks(list), candidates, seen);
    }

    #[inline(always)]
    fn meet_few<L: Sixteen, M: Mode, const ANY: bool>(
        &self,
        Rays { lot, candidates, .. }: &mut Rays,
        entries: &Entries,
        list: &List,
    ) {
        for at in list.at..list.at + list.len {
            pool::meet_one::<L, M, ANY>(lot, entries, at as usize, self.chunks(list), candidates);
        }
    }
}
