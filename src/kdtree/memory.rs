//! How much memory a build takes: announced before it starts, and counted while it runs.

use super::build::Reference;
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
        let each = record + output + output.max(in_flight);
        (each * triangles as f64) as usize + PER_THREAD * (1 + rayon::current_num_threads())
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
