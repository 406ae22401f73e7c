//! The tree as one thread sees it, for the length of one query.

use super::Cached;
use super::layout::Array;
use super::local::Local;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::{Node, Scale, Tree};
use std::ops::Range;
use std::panic;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};

/// A tree whose blocks are fetched before a walk looks at them.
///
/// What it gives out lies in blocks that were here when they were [entered](Tree::enter), and stays there until
/// the next call that enters anything: that one may wait, and the thread leaves its epoch for that.
#[derive(Debug)]
pub struct View<'a> {
    cached: &'a Cached,
    local: Option<Box<Local>>,
    tick: u32,
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
        Self { cached, local: Some(local), tick: cached.blocks.tick.load(Ordering::Relaxed) }
    }

    #[inline(always)]
    fn local(&self) -> &Local {
        self.local.as_ref().expect("it is there until the view is dropped")
    }

    /// The blocks that hold some elements of an array.
    #[inline(always)]
    fn blocks_of<T>(&self, array: Array, elements: Range<usize>) -> Range<usize> {
        let layout = &self.cached.blocks.layout;
        let base = layout.column(array).base;
        let (first, end) = (base + elements.start * size_of::<T>(), base + elements.end * size_of::<T>());
        first >> layout.shift()..((end - 1) >> layout.shift()) + 1
    }

    /// Uses blocks; whether all are here.
    #[inline(always)]
    fn use_all(&self, blocks: Range<usize>) -> bool {
        let mut here = true;
        for block in blocks {
            here &= self.cached.blocks.words.use_in(block, self.tick);
        }
        here
    }

    /// Some elements of an array, whose blocks have been entered.
    #[inline(always)]
    fn slice<T>(&self, array: Array, elements: Range<usize>) -> &[T] {
        let column = self.cached.blocks.layout.column(array);
        assert!(elements.start <= elements.end && elements.end * size_of::<T>() <= column.bytes);
        let first = self.cached.blocks.arena.at(column.base).cast::<T>().wrapping_add(elements.start);
        // SAFETY: the elements are inside of the array, which begins at the start of a block and so is
        // aligned. They were here when their blocks were entered, this thread is still in that epoch, and
        // nobody writes to a block that is here. All of `T`'s values are plain numbers.
        unsafe { std::slice::from_raw_parts(first, elements.len()) }
    }

    /// Has some elements of an array here.
    #[inline(always)]
    fn enter_elements<T>(&self, array: Array, elements: Range<usize>) {
        let blocks = self.blocks_of::<T>(array, elements);
        self.local().looked_up(1);
        if !self.use_all(blocks.clone()) {
            let blocks: Vec<u32> = blocks.map(|block| block as u32).collect();
            self.gather(&blocks);
        }
    }

    /// Has a list of primitives here, and their triangles.
    #[inline(always)]
    fn enter_list(&self, array: Array, list: Range<usize>) {
        if list.is_empty() {
            return;
        }
        self.local().looked_up(1 + list.len() as u64);
        let mut here = self.use_all(self.blocks_of::<u32>(array, list.clone()));
        if here {
            for &primitive in self.slice::<u32>(array, list.clone()) {
                let primitive = primitive as usize;
                here &= self.use_all(self.blocks_of::<Triangle>(Array::Triangles, primitive..primitive + 1));
            }
        }
        if !here {
            self.gather_list(array, list);
        }
    }

    /// The same, where something is missing.
    #[cold]
    #[inline(never)]
    fn gather_list(&self, array: Array, list: Range<usize>) {
        let mut blocks: Vec<u32> =
            self.blocks_of::<u32>(array, list.clone()).map(|block| block as u32).collect();
        self.gather(&blocks);
        // Together with the list, which may be given up when its triangles come.
        for &primitive in self.slice::<u32>(array, list) {
            let primitive = primitive as usize;
            let triangle = self.blocks_of::<Triangle>(Array::Triangles, primitive..primitive + 1);
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
        local.reader.leave();
        local.step_aside();
        let gathered = blocks.gather(&self.cached.loaders, wanted);
        local.step_back();
        // Before they are let go of, so that the epoch protects them from then on.
        local.reader.enter();
        drop(gathered);
        local.stalled(start.elapsed());
        if blocks.has_failed() {
            panic::resume_unwind(Box::new(Unreadable));
        }
    }

    /// Some bytes of the colours, entered and copied.
    pub fn color_bytes<const N: usize>(&self, first: usize) -> [u8; N] {
        self.enter_elements::<u8>(Array::Colors, first..first + N);
        *self.slice::<u8>(Array::Colors, first..first + N).first_chunk().expect("as many as asked for")
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
        let below = inner.below() as usize;
        let pair = self.slice::<Node>(Array::Nodes, below..below + 2);
        [pair[0], pair[1]]
    }

    #[inline(always)]
    fn primitives(&self, leaf: Node) -> &[u32] {
        self.slice(Array::References, leaf.references())
    }

    #[inline(always)]
    fn upper(&self, place: usize) -> Node {
        self.cached.upper[place]
    }

    #[inline(always)]
    fn beneath(&self, place: usize) -> Node {
        let node = self.cached.beneath[place] as usize;
        self.enter_elements::<Node>(Array::Nodes, node..node + 1);
        self.slice::<Node>(Array::Nodes, node..node + 1)[0]
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        self.slice(Array::Pages, leaf.references())
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &Triangle {
        let primitive = primitive as usize;
        &self.slice(Array::Triangles, primitive..primitive + 1)[0]
    }

    #[inline(always)]
    fn enter(&self, node: Node) {
        if node.is_leaf() {
            self.enter_list(Array::References, node.references());
        } else {
            let below = node.below() as usize;
            self.enter_elements::<Node>(Array::Nodes, below..below + 2);
        }
    }

    #[inline(always)]
    fn enter_page(&self, leaf: Node) {
        self.enter_list(Array::Pages, leaf.references());
    }

    #[inline(always)]
    fn enter_triangle(&self, primitive: u32) {
        let primitive = primitive as usize;
        self.enter_elements::<Triangle>(Array::Triangles, primitive..primitive + 1);
    }
}
