//! A scene of which only a part is in memory.
//!
//! The upper tree is resident (a hundredth of the data). Nodes, lists of primitives, triangles and what shading asks
//! about them lie in a file and come in *blocks* when a walk is about to look at them: the kernels say so beforehand
//! ([`Tree::children`](crate::kdtree::Tree::children), [`Tree::enter_leaf`](crate::kdtree::Tree::enter_leaf)), and a
//! [`View`] of the tree sees to it that the blocks are here.
//! For a resident tree that call is empty: the kernels are compiled for each. Where there is room for all blocks and all
//! have come, a tree is resident.
//!
//! ```text
//! kernel -- enter --> words: here? ---- yes --> go on (one load for each block)
//!                       | no
//!                       v
//!                  leave the epoch
//!                  quota: may I pin so many?
//!                  directory (a stripe's lock): pin, ask;  what must go is declared gone, and retired
//!                  does the system have it in memory? then copy it, check, arrive
//!                  else step aside ------------------------> another thread traces meanwhile
//!                  room? read, check, arrive               (one block by itself, others by loaders)
//!                  wait; step back
//!                  enter an epoch, unpin
//! ```
//!
//! | file | what |
//! |---|---|
//! | `layout` | which byte of which array is in which block |
//! | `slots` | memory for blocks that are here, and which of it is whose |
//! | `words` | a word for each block: here? used when, how often? |
//! | `epoch`, `retired` | who still reads, so that memory is not freed under him, and what waits for that |
//! | `eras` | how long what a thread has seen holds |
//! | `directory`, `policy/` | sets of blocks behind striped locks, and which block makes room |
//! | `deadline` | when threads stop waiting |
//! | `quota`, `gate` | how many blocks may be pinned, how many threads be at work |
//! | `requests`, `loaders` | what loaders are asked for: first what is needed, then what may be needed soon |
//! | `ahead`, `beside`, `glance` | blocks that come before they are needed, and which ones that may be |
//! | `gather` | having blocks here that a walk needs all at once |
//! | `blocks`, `room` | all of these at work: loading, giving up; memory for what comes |
//! | `local`, `known`, `scraps` | a thread's state, what it has seen, what it has put together |
//! | `part`, `view` | an array and the tree as a thread sees them |
//! | `whole`, `in_homes` | where there is room for all blocks and all have come: a tree like any other |
//! | `plan`, `sync` | how the memory is divided; what threads share |
//! | `source`, `pieces`, `file`, `at_once` | where blocks come from |
//!
//! **Waiting is a thread's.** More threads than processors take part; one that waits for a block keeps its
//! tile on its stack and lets another have its place. So the kernels need not be cut into pieces that can be
//! suspended, and no state of a ray is ever put away or begun anew.
//!
//! **Errors.** A block that cannot be read, or is not what was written, unwinds through the kernels of all
//! threads that need it and becomes an error of the frame: [`Cached::or_error`].

mod ahead;
mod at_once;
mod beside;
mod blocks;
mod deadline;
mod directory;
mod epoch;
mod eras;
mod file;
mod gate;
mod gather;
mod glance;
mod in_homes;
mod known;
mod layout;
mod loaders;
mod local;
mod part;
mod pieces;
mod plan;
pub mod policy;
mod quota;
mod requests;
mod retired;
mod room;
mod scraps;
mod slots;
mod source;
mod stats;
mod sync;
mod view;
mod whole;
mod words;

pub(crate) use glance::Glance;
pub use layout::Array;
pub use plan::{CacheOptions, Loading, Plan, Prefetch};
pub use source::Source;
pub use stats::{CacheStats, PartStats};
pub use view::View;

use crate::column::Column;
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::kdtree::{KdTree, Node, SPREAD_BLOCKS, Scale};
use blocks::Blocks;
use gather::Late;
use in_homes::InHomes;
use known::Known;
use layout::Layout;
use loaders::Loaders;
use local::Local;
use scraps::Scraps;
use std::mem;
use std::panic::{self, AssertUnwindSafe};
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use std::time::{Duration, Instant};
use view::Unreadable;

/// What is always in memory of a scene.
#[derive(Debug)]
pub struct Resident {
    /// What the tree's coordinates are multiplied by.
    pub scale: Scale,
    /// The box around all triangles.
    pub bounds: Aabb,
    /// The full tree's root.
    pub root: Node,
    /// The upper tree.
    pub upper: Vec<Node>,
    /// The full tree's nodes at the same places.
    pub beneath: Vec<u32>,
    /// Bytes of the [arrays](Array) that come in blocks.
    pub bytes: [usize; Array::ALL.len()],
    /// The most blocks that a page or a leaf takes, by their size: see [`KdTree::spread`](
    /// crate::kdtree::KdTree::spread).
    pub spread: [usize; SPREAD_BLOCKS.len()],
}

/// A scene whose blocks come when they are needed.
#[derive(Debug)]
pub struct Cached {
    scale: Scale,
    bounds: Aabb,
    root: Node,
    upper: Column<Node>,
    beneath: Column<u32>,
    /// The tree in the blocks' homes, where there is room for all.
    in_homes: Option<InHomes>,
    options: CacheOptions,
    plan: Plan,
    /// Whether the last frame had to give blocks up.
    was_short: AtomicBool,
    /// How often threads waited in the last frame; more than ever before the first.
    waited: AtomicU32,
    /// When the last frame began.
    begun: Mutex<Instant>,
    blocks: Arc<Blocks>,
    loaders: Loaders,
}

/// More waits than a frame has, and some may come on top of them.
const MANY: u32 = u32::MAX / 2;

impl Cached {
    /// A scene of which up to `memory` bytes of blocks are in memory at a time, for `threads` at work.
    ///
    /// # Errors
    /// An option makes no sense, the memory is too little ([`Error::Option`] of `--memory` in terms of what
    /// `resident` and the blocks take together, `beside` included), or the system gives no address space.
    pub fn new(
        resident: Resident,
        source: Box<dyn Source>,
        options: &CacheOptions,
        memory: usize,
        beside: usize,
        threads: usize,
    ) -> Result<Self> {
        options.check()?;
        let layout = Layout::new(resident.bytes, options.block);
        let most = most_blocks(&resident.spread, options.block).clamp(2, layout.blocks().max(2));
        let workers = options.loading.workers(threads);
        let reading = pieces::most_bytes(options.block);
        let own = |memory| {
            let knowing = threads * Known::bytes(Known::lines(memory, threads));
            // A thread that walks may look at a surface meanwhile.
            // But it reads one block at a time.
            knowing + 2 * workers * Scraps::BYTES + (workers + options.loading.loaders()) * reading
        };
        let overhead = Blocks::overhead(layout.blocks()) + resident.upper.len() * 12 + beside;
        let each = options.block + Blocks::OVERHEAD_HERE;
        let blocks = memory.saturating_sub(overhead + own(memory)) / each;
        // More than would ever be used is left to the system.
        let blocks = blocks.min(2 * layout.blocks() + Plan::least(options, most));
        let plan = Plan::new(options, blocks, most, workers, threads);
        let Some(plan) = plan else {
            let needed = |memory| overhead + own(memory) + Plan::least(options, most) * each;
            // With more memory, threads have a little more of their own.
            let mut least = needed(0);
            while needed(least) > least {
                least = needed(least);
            }
            let message = format!(
                "{} is too little for this scene: it takes at least {} with blocks of {} bytes",
                mebibytes(memory),
                mebibytes(least),
                options.block,
            );
            return Err(Error::option("--memory", message));
        };
        let system = |source| Error::Missing {
            what: "address space, or threads for loaders".into(),
            remedy: format!("the system said: {source}"),
        };
        let (blocks, loaders) = Blocks::new(layout, source, options, &plan, threads).map_err(system)?;
        let Resident { scale, bounds, root, upper, beneath, .. } = resident;
        // Before the first frame, everything has still to come.
        blocks.waits.store(MANY, Ordering::Relaxed);
        let (was_short, waited) = (AtomicBool::new(false), AtomicU32::new(MANY));
        let options = *options;
        let (upper, beneath) = (Arc::new(upper), Arc::new(beneath));
        let in_homes = InHomes::new(&blocks, &upper, &beneath, bounds, scale);
        let (upper, beneath) = (upper.into(), beneath.into());
        Ok(Self {
            scale,
            bounds,
            root,
            upper,
            beneath,
            in_homes,
            options,
            plan,
            was_short,
            waited,
            begun: Mutex::new(Instant::now()),
            blocks,
            loaders,
        })
    }

    /// The tree of a scene that is [whole](Blocks::is_whole), for who is in an epoch in which it is.
    fn whole(&self) -> &KdTree {
        self.in_homes.as_ref().expect("it has homes").tree()
    }

    /// Whether there is room for all blocks, so that none ever has to go.
    pub fn holds_all(&self) -> bool {
        self.blocks.holds_all()
    }

    /// Has all blocks come that are not here, where there is room for all. Uses nothing, and waits for no other thread.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn fill(&self) -> Result<()> {
        if !self.blocks.holds_all() {
            return Ok(());
        }
        self.blocks.whole.begin_anew();
        while self.blocks.load_rest()? > 0 {}
        Ok(())
    }

    /// Whether all blocks were here when the last frame began: then it was traced as scenes are that are all in memory, and
    /// no uses were counted.
    pub fn is_whole(&self) -> bool {
        self.blocks.is_whole()
    }

    /// What was chosen.
    pub fn options(&self) -> &CacheOptions {
        &self.options
    }

    /// How the memory is divided.
    pub fn plan(&self) -> &Plan {
        &self.plan
    }

    /// The same box in the mesh's coordinates.
    pub fn mesh_bounds(&self) -> Aabb {
        self.scale.undo_bounds(&self.bounds)
    }

    /// What the tree's coordinates are multiplied by.
    pub fn scale(&self) -> Scale {
        self.scale
    }

    /// Bytes of all blocks.
    pub fn data_bytes(&self) -> usize {
        self.blocks.layout.bytes()
    }

    /// Bytes of the blocks that are in memory, and the most that were.
    pub fn memory_bytes(&self) -> [usize; 2] {
        self.blocks.committed_bytes()
    }

    /// Threads that should trace so that `threads` are at work when some wait. After a frame in which hardly
    /// anything had to be waited for, no more than these: who is not there need not be waited for either.
    pub fn workers(&self, threads: usize) -> usize {
        /// So many waits in a frame are soon over.
        const FEW: u32 = 16;
        let is_calm = self.waited.load(Ordering::Relaxed) < FEW;
        if is_calm { threads } else { self.options.loading.workers(threads) }
    }

    /// Begins a frame. Where there is room for all, blocks may come before they are needed, and half of them have come, the
    /// others follow by and by.
    pub fn begin_frame(&self) {
        self.was_short.store(self.blocks.begin_frame(), Ordering::Relaxed);
        let since =
            mem::replace(&mut *self.begun.lock().unwrap_or_else(PoisonError::into_inner), Instant::now());
        let waited = self.blocks.waits.swap(0, Ordering::Relaxed);
        self.waited.store(waited, Ordering::Relaxed);
        self.blocks.ahead.begin_frame();
        let brings_others = self.options.prefetch != Prefetch::Off;
        if !self.blocks.look_whether_whole() && brings_others && self.blocks.lacks_few() {
            self.blocks.allow_rest(since.elapsed().as_secs_f64());
            self.loaders.rest();
        }
    }

    /// Whether it pays to look ahead: blocks may come before they are needed, and some had to be waited for, in
    /// this frame or in the one before.
    pub(crate) fn looks_ahead(&self) -> bool {
        self.options.prefetch == Prefetch::Ahead && self.blocks.ahead.pays()
    }

    /// Looks at the tree as far as it is here, to ask for what is not.
    pub(crate) fn glance(&self) -> Glance<'_> {
        Glance::new(self)
    }

    /// Whether more than a few blocks have had to go, in this frame or in the one before: then it pays to need few of them.
    pub fn is_short(&self) -> bool {
        self.was_short.load(Ordering::Relaxed) || self.blocks.is_short()
    }

    /// The tree as this thread sees it, for one query.
    #[inline]
    pub fn view(&self) -> View<'_> {
        View::new(self)
    }

    /// Begins a square, when it is this thread's turn. Queries within it are cheaper. The turn lasts until the
    /// thread waits for a block, or ends.
    pub(crate) fn session(&self) -> Session<'_> {
        let mut local = Local::take(&self.blocks);
        local.begin_at_gate();
        local.put();
        self.blocks.sessions.fetch_add(1, Ordering::Relaxed);
        Session { cached: self }
    }

    /// All that this thread has waited for blocks so far.
    pub fn stalled(&self) -> Duration {
        self.view().stalled()
    }

    /// Runs something that reads the scene, on any number of threads.
    ///
    /// # Errors
    /// A block could not be read meanwhile.
    pub fn or_error<R>(&self, run: impl FnOnce() -> R) -> Result<R> {
        // Nothing that a kernel leaves behind is used again.
        match panic::catch_unwind(AssertUnwindSafe(run)) {
            Ok(done) => Ok(done),
            Err(payload) if payload.is::<Unreadable>() => {
                Err(self.blocks.take_failure().expect("who unwinds says why"))
            }
            Err(payload) => panic::resume_unwind(payload),
        }
    }

    /// Has threads wait for blocks until then and no longer: see [`in_time`](Self::in_time).
    pub fn set_deadline(&self, deadline: Option<Instant>) {
        self.blocks.deadline.set(deadline);
    }

    /// Whether there is a deadline that has passed.
    pub fn is_late(&self) -> bool {
        self.blocks.deadline.has_passed()
    }

    /// Runs something on this thread that reads the scene; `None` if the deadline passes while it waits for a
    /// block. What it had asked for still comes.
    pub fn in_time<R>(&self, run: impl FnOnce() -> R) -> Option<R> {
        if self.is_late() {
            return None;
        }
        match panic::catch_unwind(AssertUnwindSafe(run)) {
            Ok(done) => Some(done),
            Err(payload) if payload.is::<Late>() => None,
            Err(payload) => panic::resume_unwind(payload),
        }
    }

    /// The upper tree, which is always here: see [`Tree::upper`](crate::kdtree::Tree::upper).
    pub fn upper(&self) -> &[Node] {
        &self.upper
    }

    /// The box around all triangles, in the tree's coordinates.
    pub fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    /// What the cache did since the last call.
    pub fn take_stats(&self) -> CacheStats {
        self.blocks.take_stats()
    }

    /// The same; and where nodes have a cache of their own, what that one did and what the leaves' did.
    pub fn take_stats_by_cache(&self) -> (CacheStats, Option<[PartStats; 2]>) {
        let (all, parts) = self.blocks.take_stats_by_part();
        (all, self.options.nodes.map(|_| parts))
    }

    /// The most bytes of blocks that each cache holds, beside those that are pinned or on their way out: one, or the
    /// nodes' and the leaves'.
    pub fn cache_bytes(&self) -> impl Iterator<Item = usize> {
        self.plan.shapes.iter().flatten().map(|shape| shape.blocks() * self.options.block)
    }

    /// From now on, takes note of uses, or no longer does.
    pub fn trace_uses(&self, on: bool) {
        self.blocks.trace_uses(on);
    }

    /// The blocks that were used since the last call, each once a tile, in about the order of use; where all of them
    /// can be in memory, each once.
    pub fn take_uses(&self) -> Vec<u32> {
        self.blocks.words.take_trace()
    }

    /// Forgets all that is not in use at the moment.
    pub fn clear(&self) {
        self.loaders.forget_ahead();
        self.blocks.clear();
        self.blocks.waits.store(MANY, Ordering::Relaxed);
    }
}

impl Drop for Cached {
    fn drop(&mut self) {
        // What this thread keeps for its next use would keep the memory.
        drop(Local::take(&self.blocks));
    }
}

/// A square's time.
#[must_use]
#[derive(Debug)]
pub(crate) struct Session<'a> {
    cached: &'a Cached,
}

impl Drop for Session<'_> {
    fn drop(&mut self) {
        let mut local = Local::take(&self.cached.blocks);
        local.end();
        local.put();
    }
}

/// The most blocks that a page or a leaf takes.
fn most_blocks(spread: &[usize; SPREAD_BLOCKS.len()], block: usize) -> usize {
    match SPREAD_BLOCKS.iter().position(|&size| size == block) {
        Some(size) => spread[size],
        // Each of the smallest that were counted is so many.
        None => spread[0] * SPREAD_BLOCKS[0].div_ceil(block),
    }
}

/// Bytes as messages tell them, rounded up.
fn mebibytes(bytes: usize) -> String {
    format!("{} MiB", bytes.div_ceil(1 << 20))
}

#[cfg(test)]
mod stress;
#[cfg(test)]
mod tests;
