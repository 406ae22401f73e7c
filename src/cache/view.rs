//! The tree as one thread sees it, for the length of one query.

use super::Cached;
use super::layout::Array;
use super::local::Local;
use super::part::Part;
use super::slots::Slots;
use super::words::Words;
use crate::geometry::Aabb;
use crate::geometry::triangle::{Corners, Triangle};
use crate::kdtree::{KdTree, Node, Scale, Tree};
use crate::simd::prefetch;
use std::cell::Cell;
use std::ops::Range;
use std::panic;
use std::time::{Duration, Instant};

/// A tree whose blocks are fetched before a walk looks at them.
///
/// What it gives out lies in blocks that were here when they were [entered](Tree::enter_leaf), and stays there until
/// the next call that enters anything: that one may wait, and the thread leaves its epoch for that.
#[derive(Debug)]
pub struct View<'a> {
    cached: &'a Cached,
    words: &'a Words,
    slots: &'a Slots,
    nodes: Part<Node>,
    references: Part<u32>,
    pages: Part<u32>,
    triangles: Part<Triangle>,
    /// Of these, shading asks for a few bytes at a time.
    colors: Part<u8>,
    surfaces: Part<u8>,
    /// Whether all blocks lie in memory as they do in their arrays: see [`Slots`].
    in_order: Cell<bool>,
    /// Whether all of them are here, and stay.
    is_whole: bool,
    shift: u32,
    tick: u32,
    local: Option<Box<Local>>,
}

/// What unwinds through the kernels when a block cannot be read.
#[derive(Debug)]
pub struct Unreadable;

impl<'a> View<'a> {
    /// Begins a use.
    #[inline]
    pub fn new(cached: &'a Cached) -> Self {
        let mut local = Local::take(&cached.blocks);
        local.begin();
        let blocks = &*cached.blocks;
        Self {
            cached,
            words: &blocks.words,
            slots: &blocks.slots,
            nodes: Part::new(blocks, Array::Nodes),
            references: Part::new(blocks, Array::References),
            pages: Part::new(blocks, Array::Pages),
            triangles: Part::new(blocks, Array::Triangles),
            colors: Part::new(blocks, Array::Colors),
            surfaces: Part::new(blocks, Array::Surfaces),
            // In its epoch by now.
            in_order: Cell::new(blocks.slots.are_in_order()),
            is_whole: blocks.is_whole(),
            shift: blocks.layout.shift(),
            tick: blocks.tick(),
            local: Some(local),
        }
    }

    /// The tree, if it is all in memory: then kernels need not ask this view for anything.
    #[inline(always)]
    pub(crate) fn whole(&self) -> Option<&KdTree> {
        // This view stays in its epoch, where nothing is waited for.
        self.is_whole.then(|| self.cached.whole())
    }

    fn local(&self) -> &Local {
        self.local.as_ref().expect("it is there until the view is dropped")
    }

    /// Uses blocks; whether all are here.
    #[inline(always)]
    fn use_all(&self, blocks: Range<usize>) -> bool {
        let mut here = true;
        for block in blocks {
            here &= self.words.use_in(block, self.tick, &self.local().notes);
        }
        here
    }

    /// Where a byte lies whose block is here.
    #[inline(always)]
    fn at(&self, byte: usize) -> *const u8 {
        let into = byte & ((1 << self.shift) - 1);
        self.slots.at(byte >> self.shift).wrapping_add(into)
    }

    /// Where some elements of an array lie, all together, whose blocks are here.
    #[inline(always)]
    fn find<T>(&self, part: &Part<T>, elements: Range<usize>) -> *const u8 {
        let start = elements.start;
        let bytes = part.bytes(elements);
        let block = bytes.start >> self.shift;
        if block != (bytes.end - 1) >> self.shift {
            return self.put_together(bytes);
        }
        part.keep(block << self.shift, self.slots.at(block));
        part.place(start)
    }

    /// A copy of bytes of several blocks.
    #[cold]
    #[inline(never)]
    fn put_together(&self, bytes: Range<usize>) -> *const u8 {
        let whole = self.local().scraps.room(bytes.len());
        self.copy(bytes, whole);
        whole
    }

    /// Copies bytes of any blocks that are here to where there is room for them.
    fn copy(&self, mut bytes: Range<usize>, mut to: *mut u8) {
        while !bytes.is_empty() {
            let count = ((1 << self.shift) - (bytes.start & ((1 << self.shift) - 1))).min(bytes.len());
            // SAFETY: these lie in one block, and every block has memory; there is room for all of them.
            unsafe { to.copy_from_nonoverlapping(self.at(bytes.start), count) };
            to = to.wrapping_add(count);
            bytes.start += count;
        }
    }

    /// Some elements of an array, whose blocks have been entered.
    #[inline(always)]
    fn slice<T>(&self, part: &Part<T>, elements: Range<usize>) -> &[T] {
        if elements.is_empty() {
            return &[];
        }
        let (start, count) = (elements.start, elements.len());
        let first = if self.in_order.get() {
            part.check(elements);
            part.place(start)
        } else if part.is_in_last(start, count) {
            part.place(start)
        } else {
            self.find(part, elements)
        };
        // SAFETY: so many elements lie there, aligned, as every array begins at the start of a block. They were here
        // when their blocks were entered, this thread is still in that epoch, and nobody writes to a block that is
        // here; or they are this thread's own copy. All of `T`'s values are plain numbers.
        unsafe { std::slice::from_raw_parts(first.cast(), count) }
    }

    /// So many elements of an array, likewise.
    #[inline(always)]
    fn array<T, const N: usize>(&self, part: &Part<T>, first: usize) -> &[T; N] {
        let place = if self.in_order.get() {
            part.check(first..first + N);
            part.place(first).cast()
        } else {
            match part.in_last(first) {
                Some(place) => place,
                None => self.find(part, first..first + N).cast(),
            }
        };
        // SAFETY: as in `slice`.
        unsafe { &*place }
    }

    /// Has some elements of an array here, and says where they are.
    ///
    /// Calls are out of the way and said to be rare, so that a kernel keeps its vectors in registers past them: with
    /// one in the midst of a walk, packets took an eighth longer.
    #[inline(always)]
    fn enter_elements<T, const N: usize>(&self, part: &Part<T>, first: usize) -> *const [T; N] {
        // No closures: they would be functions of their own, without the kernel's instruction set.
        if let Some(place) = part.in_last(first) {
            return place;
        }
        let blocks = part.blocks(first..first + N, self.shift);
        let last = blocks.end - 1;
        let is_one = blocks.start == last;
        if !is_one || !self.words.was_used_in(last, self.tick) {
            self.enter_blocks(blocks);
        }
        if self.in_order.get() {
            // Their place hangs on nothing: it is not waited for.
            part.keep_in_order(last << self.shift);
            return part.place(first).cast();
        }
        part.keep(last << self.shift, self.slots.at(last));
        if is_one { part.place(first).cast() } else { self.put_together(part.bytes(first..first + N)).cast() }
    }

    #[cold]
    #[inline(never)]
    fn enter_blocks(&self, blocks: Range<usize>) {
        if !self.use_all(blocks.clone()) {
            let blocks: Vec<u32> = blocks.map(|block| block as u32).collect();
            self.gather(&blocks);
        }
    }

    /// Takes back what was put together.
    #[inline(always)]
    fn forget_copies(&self) {
        // SAFETY: what a view has given out is looked at until something is entered, and no longer.
        unsafe { self.local().scraps.clear() };
    }

    /// Has a list of primitives here, and their triangles.
    #[inline(always)]
    fn enter_list(&self, part: &Part<u32>, list: Range<usize>) {
        if list.is_empty() {
            return;
        }
        self.forget_copies();
        let (known, name) = (self.local().known(), part.base / size_of::<u32>() + list.start);
        // If blocks had to come, they may bear an earlier tick: it is known the next time.
        if !known.has(name, self.tick) && self.look_at_list(part, list) {
            known.add(name, self.tick);
        }
    }

    /// The same, word by word; whether all was here, and is marked now.
    #[cold]
    #[inline(never)]
    fn look_at_list(&self, part: &Part<u32>, list: Range<usize>) -> bool {
        let mut here = self.use_all(part.blocks(list.clone(), self.shift));
        if here {
            let mut last = 0..0;
            for &primitive in self.slice(part, list.clone()) {
                let primitive = primitive as usize;
                // The kernel reads it next: 2 to 3 % of a frame's time.
                let blocks = self.triangles.blocks(primitive..primitive + 1, self.shift);
                prefetch(self.at(self.triangles.base + primitive * size_of::<Triangle>()));
                // Triangles that follow one another lie mostly in one block.
                if blocks != last {
                    here &= self.use_all(blocks.clone());
                    last = blocks;
                }
            }
        }
        if !here {
            self.gather_list(part, list);
        }
        here
    }

    /// The same, where something is missing.
    #[cold]
    #[inline(never)]
    fn gather_list(&self, part: &Part<u32>, list: Range<usize>) {
        let mut blocks: Vec<u32> = part.blocks(list.clone(), self.shift).map(|block| block as u32).collect();
        self.gather(&blocks);
        // Together with the list, which may be given up when its triangles come.
        for &primitive in self.slice(part, list) {
            let primitive = primitive as usize;
            let triangle = self.triangles.blocks(primitive..primitive + 1, self.shift);
            blocks.extend(triangle.map(|block| block as u32));
        }
        blocks.sort_unstable();
        blocks.dedup();
        self.gather(&blocks);
    }

    /// Has blocks come and waits for them. Unwinds if one cannot be read.
    #[cold]
    #[inline(never)]
    fn gather(&self, wanted: &[u32]) {
        let (blocks, local) = (&self.cached.blocks, self.local());
        let start = Instant::now();
        // From here on, what was here may go. Of lists, `known` knows.
        self.nodes.forget();
        self.references.forget();
        self.pages.forget();
        self.triangles.forget();
        self.colors.forget();
        self.surfaces.forget();
        local.leave();
        let mut is_aside = false;
        let gathered = blocks.gather(&self.cached.loaders, wanted, || {
            local.step_aside();
            is_aside = true;
        });
        if is_aside {
            local.step_back();
        }
        // Before they are let go of, so that the epoch protects them from then on.
        local.enter();
        self.in_order.set(self.in_order.get() && self.slots.are_in_order());
        local.stalled(start.elapsed());
        match gathered {
            Ok(gathered) => drop(gathered),
            Err(late) => panic::resume_unwind(Box::new(late)),
        }
        if blocks.has_failed() {
            panic::resume_unwind(Box::new(Unreadable));
        }
    }

    /// Some elements of an array if all of them are here; the blocks that are not go to `lacking`. No use.
    fn peek<T>(&self, part: &Part<T>, elements: Range<usize>, lacking: &mut Vec<u32>) -> Option<&[T]> {
        let mut here = true;
        for block in part.blocks(elements.clone(), self.shift) {
            if !self.words.is_here(block) {
                here = false;
                // Neighbours lie in the same block more often than not.
                if lacking.last() != Some(&(block as u32)) {
                    lacking.push(block as u32);
                }
            }
        }
        here.then(|| self.slice(part, elements))
    }

    /// A node of the full tree if it is here: see [`peek`](Self::peek).
    pub(super) fn peek_node(&self, place: usize, lacking: &mut Vec<u32>) -> Option<Node> {
        self.peek(&self.nodes, place..place + 1, lacking).map(|node| node[0])
    }

    /// The blocks that a leaf's or a page's list lacks, or if that is here, its triangles, until `lacking` has `most`.
    pub(super) fn peek_list(&self, leaf: Node, is_page: bool, lacking: &mut Vec<u32>, most: usize) {
        let list = leaf.references();
        if list.is_empty() {
            return;
        }
        let part = if is_page { &self.pages } else { &self.references };
        let Some(primitives) = self.peek(part, list, lacking) else { return };
        for &primitive in primitives {
            if lacking.len() >= most {
                break;
            }
            let primitive = primitive as usize;
            self.peek(&self.triangles, primitive..primitive + 1, lacking);
        }
    }

    /// A triangle's corners, entered. Panics if there is no such triangle.
    #[inline(always)]
    pub fn corners_of(&self, primitive: u32) -> &Corners {
        let primitive = primitive as usize;
        assert!(primitive < self.triangles.count, "there are {} triangles", self.triangles.count);
        if self.is_whole {
            // SAFETY: as in `slice`: all blocks are here, at their homes.
            return unsafe { &(*self.triangles.place(primitive).cast::<Triangle>()).corners };
        }
        self.forget_copies();
        // SAFETY: as in `slice`.
        let [triangle]: &[Triangle; 1] = unsafe { &*self.enter_elements(&self.triangles, primitive) };
        &triangle.corners
    }

    /// Some bytes of the colours or the surfaces, entered and copied. Panics if they are out of range, or of another
    /// array.
    #[inline(always)]
    pub fn bytes<const N: usize>(&self, array: Array, first: usize) -> [u8; N] {
        let part = match array {
            Array::Colors => &self.colors,
            Array::Surfaces => &self.surfaces,
            other => unreachable!("{} are no bytes", other.name()),
        };
        assert!(first + N <= part.count, "{} has {} bytes", array.name(), part.count);
        if self.is_whole {
            // SAFETY: as in `slice`: all blocks are here, at their homes.
            return unsafe { *part.place(first).cast() };
        }
        // SAFETY: as in `slice`.
        unsafe { *self.enter_elements(part, first) }
    }

    /// All that this thread has waited so far.
    pub fn stalled(&self) -> Duration {
        self.local().stalled_so_far()
    }
}

impl Drop for View<'_> {
    #[inline]
    fn drop(&mut self) {
        if let Some(mut local) = self.local.take() {
            local.end();
            local.put();
        }
    }
}

impl Tree for View<'_> {
    #[inline(always)]
    fn scale(&self) -> Scale {
        self.cached.scale
    }

    #[inline(always)]
    fn bounds(&self) -> &Aabb {
        &self.cached.bounds
    }

    #[inline(always)]
    fn root(&self) -> Node {
        self.cached.root
    }

    #[inline(always)]
    fn children(&self, inner: Node) -> [Node; 2] {
        // SAFETY: as in `slice`.
        unsafe { *self.enter_elements(&self.nodes, inner.below() as usize) }
    }

    #[inline(always)]
    fn primitives(&self, leaf: Node) -> &[u32] {
        self.slice(&self.references, leaf.references())
    }

    #[inline(always)]
    fn upper(&self, place: usize) -> Node {
        self.cached.upper[place]
    }

    #[inline(always)]
    fn beneath(&self, place: usize) -> Node {
        let node = self.cached.beneath[place] as usize;
        // SAFETY: as in `slice`.
        let [node] = unsafe { *self.enter_elements::<_, 1>(&self.nodes, node) };
        node
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        self.slice(&self.pages, leaf.references())
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &Triangle {
        &self.array::<_, 1>(&self.triangles, primitive as usize)[0]
    }

    #[inline(always)]
    fn enter_leaf(&self, leaf: Node) {
        self.enter_list(&self.references, leaf.references());
    }

    #[inline(always)]
    fn enter_page(&self, leaf: Node) {
        self.enter_list(&self.pages, leaf.references());
    }

    #[inline(always)]
    fn enter_triangle(&self, primitive: u32) {
        self.forget_copies();
        let _: *const [Triangle; 1] = self.enter_elements(&self.triangles, primitive as usize);
    }
}
