//! What a cache did.

use super::sync::{AtomicU64, Ordering};
use crossbeam::utils::CachePadded;
use serde::Serialize;
use std::time::Duration;

/// Counts of a cache's work, since it was opened or they were last taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct CacheStats {
    /// Uses of blocks: a tile that needs a block again and again uses it once. Neighbouring lists of
    /// triangles that are known to be here with all their blocks count as one. None, where all blocks are here and stay.
    pub uses: u64,
    /// Blocks that were waited for.
    pub misses: u64,
    /// Blocks that were read.
    pub loads: u64,
    /// Bytes that were read.
    pub bytes_read: u64,
    /// Blocks that made room.
    pub evictions: u64,
    /// Blocks that came ahead of need; those of them that were read are in `loads` as well.
    pub prefetched: u64,
    /// Blocks that had come ahead of need, perhaps before the counts were last taken, and were needed then.
    pub prefetched_used: u64,
    /// Blocks that had come ahead of need, likewise, and made room before anybody needed them.
    pub prefetched_unused: u64,
    /// Seconds that threads waited for blocks, added up.
    pub stalled: f64,
    /// Seconds that loaders read, added up.
    pub loading: f64,
}

impl CacheStats {
    /// The share of uses that did not wait for their block.
    pub fn hit_ratio(&self) -> f64 {
        hit_ratio(self.uses, self.misses)
    }
}

/// What can have a cache of its own: nodes, and what leaves need.
pub const PARTS: usize = 2;

/// Counts of the nodes' part of a cache's work, or of the leaves' part, since they were last taken.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct PartStats {
    /// Uses of blocks: see [`CacheStats::uses`].
    pub uses: u64,
    /// Blocks that were waited for.
    pub misses: u64,
    /// Blocks that were read.
    pub loads: u64,
    /// Bytes that were read.
    pub bytes_read: u64,
    /// Blocks that made room.
    pub evictions: u64,
}

impl PartStats {
    /// The share of uses that did not wait for their block.
    pub fn hit_ratio(&self) -> f64 {
        hit_ratio(self.uses, self.misses)
    }
}

fn hit_ratio(uses: u64, misses: u64) -> f64 {
    // Who waits for two blocks may miss one of them twice.
    if uses == 0 { 1.0 } else { (1.0 - misses as f64 / uses as f64).max(0.0) }
}

/// The same, while it is counted. Each in a line of the processor's caches: threads that wait count some of them, and
/// loaders others.
#[derive(Debug, Default)]
pub struct PartCounters {
    pub misses: CachePadded<AtomicU64>,
    pub loads: CachePadded<AtomicU64>,
    pub bytes_read: CachePadded<AtomicU64>,
    pub evictions: CachePadded<AtomicU64>,
}

/// What a cache did, while it is counted.
#[derive(Debug, Default)]
pub struct Counters {
    /// Of nodes, and of what leaves need.
    pub parts: [PartCounters; PARTS],
    pub prefetched: CachePadded<AtomicU64>,
    pub stalled_ns: CachePadded<AtomicU64>,
    pub loading_ns: CachePadded<AtomicU64>,
}

/// Adds to a counter.
pub fn add(counter: &AtomicU64, n: u64) {
    counter.fetch_add(n, Ordering::Relaxed);
}

/// Nanoseconds.
pub fn nanos(time: Duration) -> u64 {
    u64::try_from(time.as_nanos()).unwrap_or(u64::MAX)
}

impl Counters {
    /// The counts so far, of all and by part, beside so many uses, and so many blocks that came ahead of need and were
    /// used, and went unused; begins again from 0. Those have to be taken before: no block is among them that is not
    /// counted here.
    pub fn take(
        &self,
        uses: [u64; PARTS],
        [prefetched_used, prefetched_unused]: [u64; 2],
    ) -> (CacheStats, [PartStats; PARTS]) {
        let take = |counter: &AtomicU64| counter.swap(0, Ordering::Relaxed);
        let mut parts = self.parts.each_ref().map(|part| PartStats {
            uses: 0,
            misses: take(&part.misses),
            loads: take(&part.loads),
            bytes_read: take(&part.bytes_read),
            evictions: take(&part.evictions),
        });
        parts.iter_mut().zip(uses).for_each(|(part, uses)| part.uses = uses);
        let sum = |of: fn(&PartStats) -> u64| parts.iter().map(of).sum();
        let all = CacheStats {
            uses: sum(|part| part.uses),
            misses: sum(|part| part.misses),
            loads: sum(|part| part.loads),
            bytes_read: sum(|part| part.bytes_read),
            evictions: sum(|part| part.evictions),
            prefetched: take(&self.prefetched),
            prefetched_used,
            prefetched_unused,
            stalled: take(&self.stalled_ns) as f64 * 1e-9,
            loading: take(&self.loading_ns) as f64 * 1e-9,
        };
        (all, parts)
    }
}
