//! What lists go through on their way to triangles: the lines of a tree and its leaves, or nodes of boxes and pools.

use super::boxes;
use super::cut;
use super::leaf::{self, SIFTED};
use super::lists::{Entries, Heads, List};
use super::lot::Lot;
use super::pool;
use crate::geometry::triangle::Mode;
use crate::kdtree::{Chunk, Exit, KdTree, Pools, Way};
use crate::simd::{Simd, prefetch};
use crate::traverse::records::Resident;
use std::hint::select_unpredictable;

/// Inner places that lists are cut at, and leaves.
pub trait Ground {
    /// Whether a list's place is a leaf.
    fn is_leaf(&self, place: i32) -> bool;

    /// Fetches what tells what is in a place. (Any number may be one.)
    fn fetch(&self, place: i32);

    /// Fetches the triangles of the leaf that a list is in.
    fn fetch_leaf<R>(&self, resident: &Resident<'_, R>, list: &List);

    /// Cuts a list at a place of rays that run into an octant, and puts what comes out on the stack, the nearest on top.
    fn cut<S: Simd>(&self, octant: usize, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List);

    /// Tests the triangles of a leaf against the rays of a list.
    fn test<S: Simd, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        lot: &mut Lot,
        entries: &Entries,
        list: &List,
    );
}

/// Whether sixteen lanes do better than eight: for lists that fill more than half of them.
#[inline(always)]
fn is_wide<S: Simd>(list: &List) -> bool {
    S::NATIVE == 16 && list.len > 8
}

/// The lines of a tree, whose leaves name their triangles.
pub struct OfLines<'a>(pub &'a KdTree);

impl<'a> OfLines<'a> {
    /// The triangles of the leaf that a list is in.
    #[inline(always)]
    fn leaf(&self, list: &List) -> impl Iterator<Item = &'a [u32]> + Clone + use<'a> {
        let words = &self.0.references()[Exit(list.exit).record()..];
        words[1..][..words[0] as usize].chunks(SIFTED)
    }
}

impl Ground for OfLines<'_> {
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
    fn fetch_leaf<R>(&self, resident: &Resident<'_, R>, list: &List) {
        leaf::fetch(resident, self.leaf(list));
    }

    #[inline(always)]
    fn cut<S: Simd>(&self, octant: usize, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List) {
        let line = &self.0.lines()[Exit(list.exit).line()];
        if list.len == 1 {
            cut::take_one::<S::F8>(line, lot, entries, heads, list);
        } else if is_wide::<S>(list) {
            cut::cut::<16, S::F16, S::F8>(line, octant, lot, entries, heads, list);
        } else {
            cut::cut::<8, S::F8, S::F8>(line, octant, lot, entries, heads, list);
        }
    }

    #[inline(always)]
    fn test<S: Simd, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        lot: &mut Lot,
        entries: &Entries,
        list: &List,
    ) {
        if is_wide::<S>(list) {
            leaf::test::<16, S::F16, M, ANY>(resident, lot, entries, list, self.leaf(list));
        } else {
            leaf::test::<8, S::F8, M, ANY>(resident, lot, entries, list, self.leaf(list));
        }
    }
}

/// Nodes of boxes, and pools.
pub struct OfBoxes<'a>(pub &'a Pools);

/// Rays of a list, or fewer, that meet a pool one by one, sixteen triangles at a time.
const FEW: u32 = 2;

/// Words in a line of the cache, and lines that a node has, and most chunks lie in.
const LINE: usize = 16;
const FETCHED: usize = 4;

/// The triangles of a pool, chunk by chunk.
#[derive(Clone)]
pub struct Chunks<'a> {
    words: &'a [u32],
    /// The first word of the next chunk, or 0.
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

impl<'a> OfBoxes<'a> {
    /// The chunks of the pool that a list is in.
    #[inline(always)]
    fn chunks(&self, list: &List) -> Chunks<'a> {
        Chunks { words: self.0.words(), next: Way(list.exit).word() }
    }
}

/// A chunk's triangles.
#[inline(always)]
fn primitives<'a>(chunk: Chunk<'a>) -> &'a [u32] {
    &bytemuck::cast_ref::<[i32; SIFTED], [u32; SIFTED]>(chunk.ids())[..chunk.count().min(SIFTED)]
}

impl Ground for OfBoxes<'_> {
    #[inline(always)]
    fn is_leaf(&self, place: i32) -> bool {
        Way(place).is_pool()
    }

    #[inline(always)]
    fn fetch(&self, place: i32) {
        let way = Way(place);
        let node = self.0.nodes().as_ptr().wrapping_add(way.node()).cast::<u32>();
        let chunk = self.0.words().as_ptr().wrapping_add(way.word());
        let first = select_unpredictable(way.is_pool(), chunk, node);
        for line in 0..FETCHED {
            prefetch(first.wrapping_add(LINE * line));
        }
    }

    #[inline(always)]
    fn fetch_leaf<R>(&self, resident: &Resident<'_, R>, list: &List) {
        if list.len > FEW {
            leaf::fetch(resident, self.chunks(list).map(primitives));
        }
    }

    #[inline(always)]
    fn cut<S: Simd>(&self, octant: usize, lot: &Lot, entries: &mut Entries, heads: &mut Heads, list: &List) {
        let node = &self.0.nodes()[Way(list.exit).node()];
        if list.len == 1 {
            boxes::take_one::<S::F8>(node, lot, entries, heads, list.at as usize);
        } else if is_wide::<S>(list) {
            boxes::cut::<16, S::F16>(node, octant, lot, entries, heads, list);
        } else {
            boxes::cut::<8, S::F8>(node, octant, lot, entries, heads, list);
        }
    }

    #[inline(always)]
    fn test<S: Simd, M: Mode, const ANY: bool>(
        &self,
        resident: &Resident<'_, M::Record>,
        lot: &mut Lot,
        entries: &Entries,
        list: &List,
    ) {
        let leaf = self.chunks(list).map(primitives);
        if list.len <= FEW {
            for ray in 0..list.len {
                pool::test_one::<S::F16, M, ANY>(
                    resident,
                    lot,
                    entries,
                    (list.at + ray) as usize,
                    self.chunks(list),
                );
            }
        } else if is_wide::<S>(list) {
            leaf::test::<16, S::F16, M, ANY>(resident, lot, entries, list, leaf);
        } else {
            leaf::test::<8, S::F8, M, ANY>(resident, lot, entries, list, leaf);
        }
    }
}
