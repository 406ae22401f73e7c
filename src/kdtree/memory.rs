//! How much memory a build takes: announced before it starts, and counted while it runs.

use super::build::{Reference, SPARE};
use super::lines::Line;
use super::node::Node;
use super::params::BuildParams;
use crate::geometry::triangle::Triangle;
use std::sync::atomic::Ordering::Relaxed;
use std::sync::atomic::{AtomicBool, AtomicUsize};

/// References in flight for each triangle, on average: large nodes that would cut triangles into more
/// are built one after the other.
pub(super) const IN_FLIGHT: f64 = 2.0;

/// What every thread keeps for itself, at most: a chunk on its way, bins, events.
const PER_THREAD: usize = 4 << 20;

/// The least [`BuildParams::max_duplication`] that a tree is worth building with: with fewer nodes and
/// references, leaves hold hundreds of triangles.
const LEAST_DUPLICATION: f32 = 2.0;

/// What a finished tree takes for each reference, at most, and what is in use beside it while it is finished: it is there
/// three times, in a leaf's record, in a page, and in the list that records are made from.
const FINISHED_REFERENCE: f64 = 3.0 * size_of::<u32>() as f64;

/// The same for each node, which is more.
///
/// It is there twice, the second time with its place; half of the nodes are leaves, whose records begin with a word;
/// half are inner nodes, and a tree of full treelets has eight lines (one full, seven of the lowest nodes alone) for
/// fourteen of them, which is the most; and a byte tells what fits a page.
const FINISHED_NODE: f64 = {
    let node = (2 * size_of::<Node>() + size_of::<u32>()) as f64;
    let leaf = size_of::<u32>() as f64;
    let inner = size_of::<Line>() as f64 * 8.0 / 14.0;
    node + (leaf + inner) / 2.0 + 1.0
};

/// What finishing a tree of so many nodes and references takes, the tree included.
pub(super) fn finishing_bytes(nodes: f64, references: f64) -> f64 {
    FINISHED_NODE * nodes + FINISHED_REFERENCE * references
}

/// What building takes of so many triangles that become so many nodes and references, beside what does not depend on
/// them: records of 48 bytes a triangle, and nodes and references, which are in memory twice while the parts of the
/// tree are put together.
pub(super) fn build_bytes(triangles: f64, nodes: f64, references: f64) -> f64 {
    let output = size_of::<Node>() as f64 * nodes + size_of::<u32>() as f64 * references;
    let in_flight = IN_FLIGHT * size_of::<Reference>() as f64 * triangles;
    let building = (output + output.max(in_flight)).max(finishing_bytes(nodes, references));
    size_of::<Triangle>() as f64 * triangles + building
}

impl BuildParams {
    /// The most memory in bytes that building a tree of so many triangles takes, the tree itself
    /// included, the mesh not. The builder stops splitting rather than exceed it.
    ///
    /// `max_duplication` stands for nodes and references together; nodes take more.
    pub fn peak_bytes(&self, triangles: usize) -> usize {
        let triangles = triangles as f64;
        let each = build_bytes(triangles, f64::from(self.max_duplication) * triangles, 0.0);
        let fixed =
            PER_THREAD * (1 + rayon::current_num_threads()) + finishing_bytes(SPARE as f64, 0.0) as usize;
        each as usize + fixed
    }

    /// Lowers `max_duplication` to what can be built in so many bytes.
    ///
    /// # Errors
    /// The least that a worthwhile tree takes, if that is more.
    pub fn fit(&mut self, triangles: usize, bytes: usize) -> Result<(), usize> {
        let least = self.max_duplication.min(LEAST_DUPLICATION);
        let (mut fits, mut too_many) = (least, self.max_duplication);
        let with = |max_duplication| Self { max_duplication, ..self.clone() }.peak_bytes(triangles);
        if with(too_many) <= bytes {
            return Ok(());
        }
        if with(fits) > bytes {
            return Err(with(fits));
        }
        for _ in 0..20 {
            let middle = 0.5 * (fits + too_many);
            *if with(middle) <= bytes { &mut fits } else { &mut too_many } = middle;
        }
        self.max_duplication = fits;
        Ok(())
    }
}

/// The account of a build: what its arrays hold now, and the most that they have held.
///
/// A build may be tried of which nobody knows whether it stays within some memory: if it does not, the account says
/// so from then on, no node is split any more, and what was built is thrown away.
#[derive(Debug)]
pub(super) struct Ledger {
    now: AtomicUsize,
    peak: AtomicUsize,
    limit: AtomicUsize,
    is_over: AtomicBool,
}

impl Default for Ledger {
    fn default() -> Self {
        let (now, peak, limit) = (AtomicUsize::new(0), AtomicUsize::new(0), AtomicUsize::new(usize::MAX));
        Self { now, peak, limit, is_over: AtomicBool::new(false) }
    }
}

impl Ledger {
    /// So many bytes more.
    pub fn add(&self, bytes: usize) {
        let now = self.now.fetch_add(bytes, Relaxed) + bytes;
        self.peak.fetch_max(now, Relaxed);
        if now > self.limit.load(Relaxed) {
            self.is_over.store(true, Relaxed);
        }
    }

    /// Begins something of so many bytes at most, if there is a limit. All that was held before is gone.
    pub fn begin(&self, limit: Option<usize>) {
        self.now.store(0, Relaxed);
        self.limit.store(limit.unwrap_or(usize::MAX), Relaxed);
        self.is_over.store(false, Relaxed);
    }

    /// Whether there is a limit.
    pub fn is_limited(&self) -> bool {
        self.limit.load(Relaxed) < usize::MAX
    }

    /// Whether so many bytes more would go beyond the limit.
    pub fn has_no_room(&self, bytes: usize) -> bool {
        self.now.load(Relaxed).saturating_add(bytes) > self.limit.load(Relaxed)
    }

    /// Gives up what was begun.
    pub fn give_up(&self) {
        self.is_over.store(true, Relaxed);
    }

    /// Whether what was begun is to be thrown away.
    #[inline]
    pub fn is_over(&self) -> bool {
        self.is_over.load(Relaxed)
    }

    /// So many bytes less, all of them added before.
    pub fn sub(&self, bytes: usize) {
        self.now.fetch_sub(bytes, Relaxed);
    }

    /// The most so far.
    pub fn peak(&self) -> usize {
        self.peak.load(Relaxed)
    }
}

/// What a vector occupies.
pub(super) fn bytes_of<T>(list: &Vec<T>) -> usize {
    list.capacity() * size_of::<T>()
}
