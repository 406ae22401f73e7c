//! How a scene is held that is not all in memory.

use super::memory::MemoryReport;
use super::report::{Lines, bytes, counted, grouped};
use super::scene::Scene;
use crate::cache::policy::Replacement;
use crate::cache::{CacheOptions, CacheStats, Cached, Loading, PartStats, Prefetch};
use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::simd::Isa;
use crate::store;
use crate::study::cache::Nodes;
use crate::study::resident;
use serde::Serialize;
use std::path::Path;

/// `--policy`, `--block` and so on: what becomes of `--memory` with a scene file.
#[derive(Clone, Debug, clap::Args)]
#[command(next_help_heading = "Scene files within --memory")]
pub struct CacheArgs {
    /// Which block makes room for another: fifo, lru, frequency, decaying, clock, sieve or s3-fifo
    #[arg(long, value_name = "NAME", default_value = Replacement::default().name())]
    policy: String,
    /// Who reads: async (threads of their own, while other tiles go on) or sync (who needs a block waits for it)
    #[arg(long, value_name = "async|sync", default_value = "async")]
    loading: String,
    /// A cache of its own for nodes: the part (0.01 to 0.99) of the memory that it has, and its policy, if that is another
    /// one than --policy
    #[arg(long, value_name = "PART[:POLICY]")]
    nodes: Option<String>,
    #[command(flatten)]
    shape: ShapeArgs,
    #[command(flatten)]
    reading: ReadingArgs,
}

/// What caches are like, whatever their policy.
#[derive(Clone, Debug, clap::Args)]
struct ShapeArgs {
    /// Bytes of a block: a power of two from 512 to 65536
    #[arg(long, value_name = "BYTES", default_value_t = CacheOptions::default().block)]
    block: usize,
    /// Blocks that a set holds: more of them keep what is used better and take longer to choose from
    #[arg(long, value_name = "N", default_value_t = CacheOptions::default().ways)]
    ways: usize,
    /// Locks that sets share
    #[arg(long, value_name = "N", default_value_t = CacheOptions::default().stripes)]
    stripes: usize,
}

/// How blocks are read.
#[derive(Clone, Debug, clap::Args)]
pub struct ReadingArgs {
    /// Reads at a time, with loading async: as many threads read what those who need it leave to them
    #[arg(long, value_name = "N", default_value_t = Loading::LOADERS)]
    loaders: usize,
    /// Read past the system's own memory of the file, so that a read takes what the disk takes (Linux)
    #[arg(long)]
    direct: bool,
}

impl CacheArgs {
    /// The options, checked, with these blocks coming before they are needed, if that was asked for.
    ///
    /// # Errors
    /// One makes no sense.
    pub fn options(&self, prefetch: Option<Prefetch>) -> Result<CacheOptions> {
        let loading = self.reading.loading(&self.loading)?;
        let prefetch = match prefetch {
            Some(prefetch) if loading.loaders() == 0 && prefetch != Prefetch::Off => {
                let message =
                    "blocks come before they are needed only with --loading async; choose that, or off";
                return Err(Error::option("--prefetch", message));
            }
            asked => asked.unwrap_or_default(),
        };
        let policy = self.policy.parse()?;
        let nodes = self.nodes.as_deref().map(str::parse::<Nodes>).transpose()?;
        let ShapeArgs { block, ways, stripes } = self.shape;
        let nodes = nodes.map(|nodes| nodes.beside(policy));
        let direct = self.reading.direct();
        let options = CacheOptions { block, ways, stripes, policy, nodes, loading, prefetch, direct };
        options.check()?;
        Ok(options)
    }
}

/// Memory of a thread that traces: the touched part of its stack, and what it has in work.
pub const BYTES_PER_WORKER: usize = 256 << 10;

/// What a scene of which a part is in memory is opened for.
#[derive(Clone, Copy, Debug)]
pub struct Within {
    /// The bytes that the process may take.
    pub memory: usize,
    /// How hits will be decided.
    pub accuracy: Accuracy,
    /// Threads that will be at work.
    pub threads: usize,
    /// What they will trace with.
    pub isa: Isa,
    /// Which blocks come before they are needed, if that was asked for.
    pub prefetch: Option<Prefetch>,
}

impl CacheArgs {
    /// Opens a scene file of which a part will be in memory. `beside` says how many bytes the command will take for
    /// the scene, beside its threads; it is told their number, of which some will wait.
    ///
    /// # Errors
    /// An option makes no sense, the file is damaged where it is read now, or the memory is too little.
    pub fn open(
        &self,
        path: &Path,
        within: Within,
        beside: impl FnOnce(&store::File, usize) -> usize,
    ) -> Result<Scene> {
        let Within { memory, accuracy, threads, isa, prefetch } = within;
        if accuracy == Accuracy::Fast {
            let message = "fast keeps a record of every triangle beside the tree, for which --memory has no room; \
                           choose watertight or exact";
            return Err(Error::option("--accuracy", message));
        }
        let options = self.options(prefetch)?;
        let file = store::File::open(path)?;
        let workers = options.loading.workers(threads);
        let beside = beside(&file, workers).saturating_add(workers * BYTES_PER_WORKER);
        Scene::open_within(&file, &options, [memory, beside], threads, isa)
    }
}

impl ReadingArgs {
    /// Whether reads go past the system's own memory of the file.
    pub fn direct(&self) -> bool {
        self.direct
    }

    /// `sync` or `async`.
    ///
    /// # Errors
    /// It is neither.
    pub fn loading(&self, name: &str) -> Result<Loading> {
        match name {
            "async" => Ok(Loading::Asynchronous { loaders: self.loaders }),
            "sync" => Ok(Loading::Synchronous),
            _ => Err(Error::option("--loading", format!("\"{name}\" is neither async nor sync"))),
        }
    }
}

/// What a report says about a scene that is not all in memory.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CacheReport {
    /// The memory that the process might take, and did.
    #[serde(flatten)]
    pub memory: MemoryReport,
    /// The most that blocks took of that.
    pub peak_blocks: usize,
    /// Bytes of all blocks of the scene.
    pub data: usize,
    /// How blocks were held.
    pub options: CacheOptions,
    /// The share of uses that did not wait for their block.
    pub hit_ratio: f64,
    /// What the cache did.
    #[serde(flatten)]
    pub stats: CacheStats,
    /// That of the nodes and that of the leaves, if they are two.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub caches: Option<[OneCache; 2]>,
}

/// What one of two caches did.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct OneCache {
    /// What is in it: `nodes`, or `leaves` with their triangles.
    pub of: &'static str,
    /// Which block makes room for another.
    pub policy: Replacement,
    /// The most bytes of blocks that it holds, beside those that are pinned or on their way out.
    pub bytes: usize,
    /// The share of uses that did not wait for their block.
    pub hit_ratio: f64,
    /// What it did.
    #[serde(flatten)]
    pub stats: PartStats,
}

impl CacheReport {
    /// What there is to say at the end.
    pub fn new(memory: MemoryReport, cached: &Cached) -> Self {
        let (stats, parts) = cached.take_stats_by_cache();
        let options = *cached.options();
        let caches = parts.zip(options.nodes).map(|([nodes, leaves], (_, policy))| {
            let mut sizes = cached.cache_bytes();
            [("nodes", policy, nodes), ("leaves", options.policy, leaves)].map(|(of, policy, stats)| {
                let bytes = sizes.next().unwrap_or_default();
                OneCache { of, policy, bytes, hit_ratio: stats.hit_ratio(), stats }
            })
        });
        Self {
            memory,
            peak_blocks: cached.memory_bytes()[1],
            data: cached.data_bytes(),
            options,
            hit_ratio: stats.hit_ratio(),
            stats,
            caches,
        }
    }

    /// The same in words.
    pub fn describe(&self, lines: &mut Lines) {
        let [blocks, data] = [self.peak_blocks, self.data].map(|n| bytes(n as u64));
        self.memory.describe(lines, &format!("; blocks {blocks} of {data}"));
        let CacheOptions { policy, block, loading, .. } = self.options;
        let who = match loading {
            Loading::Synchronous => "read by who needs them".into(),
            Loading::Asynchronous { loaders } => format!("read by {}", counted(loaders as u64, "loader")),
        };
        lines.add("cache", format!("{policy}, blocks of {}, {who}", bytes(block as u64)));
        let CacheStats { loads, bytes_read, stalled, prefetched, prefetched_used, prefetched_unused, .. } =
            self.stats;
        lines.add(
            "",
            format!(
                "{:.2} % of uses hit, {} blocks ({}) read, threads waited {stalled:.2} s",
                self.hit_ratio * 100.0,
                grouped(loads),
                bytes(bytes_read),
            ),
        );
        for OneCache { of, policy, bytes: size, hit_ratio, stats } in self.caches.iter().flatten() {
            lines.add(
                "",
                format!(
                    "{of}: {policy} in {}, {:.2} % of uses hit, {} blocks ({}) read",
                    bytes(*size as u64),
                    hit_ratio * 100.0,
                    grouped(stats.loads),
                    bytes(stats.bytes_read),
                ),
            );
        }
        if prefetched > 0 {
            let [all, used, unused] = [prefetched, prefetched_used, prefetched_unused].map(grouped);
            lines.add(
                "",
                format!("{all} blocks came before they were needed: {used} used, {unused} given up unused"),
            );
        }
    }
}

/// What there is to say in the end about the memory, and about the cache if there was one.
pub fn describe_memory(lines: &mut Lines, memory: &MemoryReport, cache: Option<&CacheReport>) {
    match cache {
        Some(cache) => cache.describe(lines),
        None => memory.describe(lines, ""),
    }
}

/// Bytes that a process has taken before it opens a scene, where the system says.
pub fn taken_so_far() -> usize {
    // What a small program takes, if the system does not say.
    resident::now().map_or(24 << 20, |bytes| bytes as usize)
}
