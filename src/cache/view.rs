//! The tree as one thread sees it, for the length of one query.

use super::Cached;
use super::blocks::Blocks;
use super::layout::{Array, Column};
use super::local::Local;
use super::words::Words;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::{Node, Scale, Tree};
use crate::simd::prefetch;
use std::ops::Range;
use std::panic;
use std::time::{Duration, Instant};

/// A tree whose blocks are fetched before a walk looks at them.
///
/// What it gives out lies in blocks that were here when they were [entered](Tree::enter), and stays there until
/// the next call that enters anything: that one may wait, and the thread leaves its epoch for that.
#[derive(Debug)]
pub struct View<'a> {
    cached: &'a Cached,
    words: &'a Words,
    nodes: Part<Node>,
    references: Part<u32>,
    pages: Part<u32>,
    triangles: Part<Triangle>,
    shift: u32,
    tick: u32,
    local: Option<Box<Local>>,
}

/// An array, found with few loads.
#[derive(Clone, Copy, Debug)]
struct Part<T> {
    first: *const T,
    count: usize,
    /// Its first byte in the arena.
    base: usize,
}

impl<T> Part<T> {
    #[inline(always)]
    fn new(blocks: &Blocks, array: Array) -> Self {
        let Column { base, bytes } = blocks.layout.column(array);
        Self { first: blocks.arena.at(base).cast(), count: bytes / size_of::<T>(), base }
    }

    /// The blocks that hold some elements.
    #[inline(always)]
    fn blocks(&self, elements: Range<usize>, shift: u32) -> Range<usize> {
        let first = self.base + elements.start * size_of::<T>();
        let end = self.base + elements.end * size_of::<T>();
        first >> shift..((end - 1) >> shift) + 1
    }
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
            nodes: Part::new(blocks, Array::Nodes),
            references: Part::new(blocks, Array::References),
            pages: Part::new(blocks, Array::Pages),
            triangles: Part::new(blocks, Array::Triangles),
            shift: blocks.layout.shift(),
            tick: blocks.tick(),
            local: Some(local),
        }
    }

    fn local(&self) -> &Local {
        self.local.as_ref().expect("it is there until the view is dropped")
    }

    /// Uses blocks; whether all are here.
    #[inline(always)]
    fn use_all(&self, blocks: Range<usize>) -> bool {
        let mut here = true;
        for block in blocks {
            here &= self.words.use_in(block, self.tick);
        }
        here
    }

    /// Some elements of an array, whose blocks have been entered.
    #[inline(always)]
    fn slice<T>(&self, part: &Part<T>, elements: Range<usize>) -> &[T] {
        assert!(elements.start <= elements.end && elements.end <= part.count);
        // SAFETY: the elements are inside of the array, which begins at the start of a block and so is
        // aligned. They were here when their blocks were entered, this thread is still in that epoch, and
        // nobody writes to a block that is here. All of `T`'s values are plain numbers.
        unsafe { std::slice::from_raw_parts(part.first.wrapping_add(elements.start), elements.len()) }
    }

    /// Has some elements of an array here.
    #[inline(always)]
    fn enter_elements<T>(&self, part: &Part<T>, elements: Range<usize>) {
        let blocks = part.blocks(elements, self.shift);
        if !self.use_all(blocks.clone()) {
            self.gather_range(blocks);
        }
    }

    #[cold]
    #[inline(never)]
    fn gather_range(&self, blocks: Range<usize>) {
        let blocks: Vec<u32> = blocks.map(|block| block as u32).collect();
        self.gather(&blocks);
    }

    /// Has a list of primitives here, and their triangles.
    #[inline(always)]
    fn enter_list(&self, part: &Part<u32>, list: Range<usize>) {
        if list.is_empty() {
            return;
        }
        let (local, name) = (self.local(), part.base + list.start * size_of::<u32>());
        if !local.known.has(name, local.epoch(), self.tick) {
            self.look_at_list(part, list);
            // By now it is whole, and the epoch may be another.
            local.known.add(name, local.epoch(), self.tick);
        }
    }

    /// The same, word by word.
    #[inline(never)]
    fn look_at_list(&self, part: &Part<u32>, list: Range<usize>) {
        let mut here = self.use_all(part.blocks(list.clone(), self.shift));
        if here {
            let mut last = 0..0;
            for &primitive in self.slice(part, list.clone()) {
                let primitive = primitive as usize;
                // The kernel reads it next: 2 to 3 % of a frame's time.
                prefetch(self.triangles.first.wrapping_add(primitive));
                let blocks = self.triangles.blocks(primitive..primitive + 1, self.shift);
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

    /// Some bytes of an array, entered and copied. Panics if they are out of range.
    pub fn bytes<const N: usize>(&self, array: Array, first: usize) -> [u8; N] {
        let part: Part<u8> = Part::new(&self.cached.blocks, array);
        assert!(first + N <= part.count, "{} has {} bytes", array.name(), part.count);
        self.enter_elements(&part, first..first + N);
        *self.slice(&part, first..first + N).first_chunk().expect("as many as asked for")
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
        let pair = self.slice(&self.nodes, below..below + 2);
        [pair[0], pair[1]]
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
        self.enter_elements(&self.nodes, node..node + 1);
        self.slice(&self.nodes, node..node + 1)[0]
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        self.slice(&self.pages, leaf.references())
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &Triangle {
        let primitive = primitive as usize;
        &self.slice(&self.triangles, primitive..primitive + 1)[0]
    }

    #[inline(always)]
    fn enter(&self, node: Node) {
        if node.is_leaf() {
            self.enter_list(&self.references, node.references());
        } else {
            let below = node.below() as usize;
            self.enter_elements(&self.nodes, below..below + 2);
        }
    }

    #[inline(always)]
    fn enter_page(&self, leaf: Node) {
        self.enter_list(&self.pages, leaf.references());
    }

    #[inline(always)]
    fn enter_triangle(&self, primitive: u32) {
        let primitive = primitive as usize;
        self.enter_elements(&self.triangles, primitive..primitive + 1);
    }
}
