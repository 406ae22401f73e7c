//! How much memory a build takes: announced before it starts, and counted while it runs.

use super::build::{Reference, SPARE};
use super::lines::Line;
use super::node::Node;
use super::params::BuildParams;
use crate::geometry::triangle::Triangle;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

/// References in flight for each triangle, on average: large nodes that would cut triangles into more
/// are built one after the other.
pub(super) const IN_FLIGHT: f64 = 2.0;

/// What every thread keeps for itself, at most: a chunk on its way, bins, events.
const PER_THREAD: usize = 4 << 20;

/// The least [`BuildParams::max_duplication`] that a tree is worth building with: with fewer nodes and
/// references, leaves hold hundreds of triangles.
const LEAST_DUPLICATION: f32 = 2.0;

/// What a finished tree takes for each node or reference, at most, and what is in use beside it while it is
/// finished.
///
/// A reference is there three times: in a leaf's record, in a page, and in the list that records are made
/// from. A node is there twice, the second time with its place; half of the nodes are leaves, whose
/// records begin with a word; half are inner nodes, and a tree of full treelets has eight lines (one full,
/// seven of the lowest nodes alone) for fourteen of them, which is the most; and a byte tells what fits a
/// page.
fn finished_bytes() -> f64 {
    let reference = 3.0 * size_of::<u32>() as f64;
    let node = (2 * size_of::<Node>() + size_of::<u32>()) as f64;
    let leaf = size_of::<u32>() as f64;
    let inner = size_of::<Line>() as f64 * 8.0 / 14.0;
    (node + (leaf + inner) / 2.0 + 1.0).max(reference)
}

impl BuildParams {
    /// The most memory in bytes that building a tree of so many triangles takes, the tree itself
    /// included, the mesh not. The builder stops splitting rather than exceed it.
    ///
    /// The tree is made of records of 48 bytes a triangle and of nodes and references, for which
    /// `max_duplication` stands; these are in memory twice while the parts of the tree are put together.
    pub fn peak_bytes(&self, triangles: usize) -> usize {
        let record = size_of::<Triangle>() as f64;
        let output = size_of::<Node>() as f64 * f64::from(self.max_duplication);
        let in_flight = IN_FLIGHT * size_of::<Reference>() as f64;
        let finished = finished_bytes() * f64::from(self.max_duplication);
        let each = record + (output + output.max(in_flight)).max(finished);
        let fixed =
            PER_THREAD * (1 + rayon::current_num_threads()) + (finished_bytes() * SPARE as f64) as usize;
        (each * triangles as f64) as usize + fixed
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
#[derive(Debug, Default)]
pub(super) struct Ledger {
    now: AtomicUsize,
    peak: AtomicUsize,
}

impl Ledger {
    /// So many bytes more.
    pub fn add(&self, bytes: usize) {
        let before = self.now.fetch_add(bytes, Relaxed);
        self.peak.fetch_max(before + bytes, Relaxed);
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
