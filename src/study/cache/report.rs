//! What flights through caches took.

use super::{FrameTable, Paper, Shape, Trial};
use crate::cache::policy::Replacement;
use crate::cache::{CacheOptions, CacheStats, Cached, Loading, Prefetch};
use crate::geometry::Accuracy;
use crate::render::quantile;
use serde::Serialize;

/// A frame.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct FrameRow {
    /// Wall-clock time.
    pub seconds: f64,
    /// All rays.
    pub rays: u64,
    /// The time that half of the tiles stayed below, in seconds, waiting included.
    pub tile_p50: f64,
    /// The time that 99 % of the tiles stayed below.
    pub tile_p99: f64,
    /// What the cache did.
    pub cache: CacheStats,
}

/// A flight.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// The share of the data that may be in memory; 1 for the resident scene.
    pub budget: f64,
    /// Bytes that the scene may take; 0 for the resident scene.
    pub memory_bytes: usize,
    /// Which block makes room; `None` for the resident scene.
    pub policy: Option<Replacement>,
    /// Who reads.
    pub loading: Option<Loading>,
    /// What the cache is like; `None` for the resident scene.
    pub shape: Option<Shape>,
    /// All that was chosen about it.
    pub cache: Option<CacheOptions>,
    /// Whether the cache held what the same flight had left.
    pub warm: bool,
    /// All rays of all frames in their time.
    pub rays_per_s: f64,
    /// The slowest and the fastest frame in seconds.
    pub frame_seconds: [f64; 2],
    /// The time that half of the frames stayed below, in seconds.
    pub frame_p50: f64,
    /// The time that 99 % of them stayed below: of a hundred or fewer, the slowest one's.
    pub frame_p99: f64,
    /// The share of uses that did not wait for their block.
    pub hit_ratio: f64,
    /// Uses of blocks, counted once for each tile.
    pub uses: u64,
    /// Blocks that were read.
    pub loads: u64,
    /// Blocks that the best of all policies would have had to read, for these uses.
    pub minimum: u64,
    /// Blocks that the cache holds, those that are pinned or on their way out left aside.
    pub held: usize,
    /// Bytes that were read.
    pub bytes_read: u64,
    /// Blocks that came before they were needed.
    pub prefetched: u64,
    /// Those that were needed then; in a warm row, they may have come in the flight before.
    pub prefetched_used: u64,
    /// Those that made room before anybody needed them, likewise.
    pub prefetched_unused: u64,
    /// Seconds that threads waited, added up.
    pub stalled: f64,
    /// The share of the time in which a loader had nothing to do.
    pub loader_idle: f64,
    /// The time that half of the tiles of all frames stayed below, in seconds, waiting included.
    pub tile_p50: f64,
    /// The time that 99 % of them stayed below.
    pub tile_p99: f64,
    /// The frames in order.
    pub frames: Vec<FrameRow>,
}

impl Row {
    /// A flight through a scene that is all in memory, half and 99 % of whose tiles stayed below these seconds.
    pub fn resident(frames: Vec<FrameRow>, [tile_p50, tile_p99]: [f64; 2]) -> Self {
        let seconds: f64 = frames.iter().map(|frame| frame.seconds).sum();
        let sum = |of: fn(&CacheStats) -> u64| frames.iter().map(|frame| of(&frame.cache)).sum::<u64>();
        let (uses, misses) = (sum(|c| c.uses), sum(|c| c.misses));
        let all = CacheStats { uses, misses, ..CacheStats::default() };
        let mut times: Vec<f32> = frames.iter().map(|frame| frame.seconds as f32).collect();
        let [frame_p50, frame_p99] = [0.5, 0.99].map(|share| quantile(&mut times, share));
        let rays: u64 = frames.iter().map(|frame| frame.rays).sum();
        let extreme = |pick: fn(f64, f64) -> f64, start| frames.iter().map(|f| f.seconds).fold(start, pick);
        Self {
            budget: 1.0,
            memory_bytes: 0,
            policy: None,
            loading: None,
            shape: None,
            cache: None,
            warm: true,
            rays_per_s: rays as f64 / seconds,
            frame_seconds: [extreme(f64::max, 0.0), extreme(f64::min, f64::INFINITY)],
            frame_p50,
            frame_p99,
            hit_ratio: all.hit_ratio(),
            uses,
            loads: sum(|c| c.loads),
            minimum: 0,
            held: 0,
            bytes_read: sum(|c| c.bytes_read),
            prefetched: sum(|c| c.prefetched),
            prefetched_used: sum(|c| c.prefetched_used),
            prefetched_unused: sum(|c| c.prefetched_unused),
            stalled: frames.iter().map(|frame| frame.cache.stalled).sum(),
            loader_idle: 0.0,
            tile_p50,
            tile_p99,
            frames,
        }
    }

    /// A flight through a cache.
    pub fn cached(
        trial: &Trial,
        warm: bool,
        memory_bytes: usize,
        cached: &Cached,
        (frames, tiles): (Vec<FrameRow>, [f64; 2]),
        minimum: u64,
    ) -> Self {
        let seconds: f64 = frames.iter().map(|frame| frame.seconds).sum();
        let loading: f64 = frames.iter().map(|frame| frame.cache.loading).sum();
        let loader_idle = match trial.options.loading {
            Loading::Synchronous => 0.0,
            Loading::Asynchronous { loaders } => 1.0 - loading / (seconds * loaders as f64),
        };
        Self {
            budget: trial.budget,
            memory_bytes,
            policy: Some(trial.options.policy),
            loading: Some(trial.options.loading),
            shape: Some(trial.shape),
            cache: Some(trial.options),
            warm,
            minimum,
            held: cached.plan().held(),
            loader_idle,
            ..Self::resident(frames, tiles)
        }
    }

    /// Which blocks came before they were needed.
    pub fn prefetch(&self) -> Prefetch {
        self.cache.map_or(Prefetch::Off, |cache| cache.prefetch)
    }

    /// In a few words.
    pub fn name(&self) -> String {
        let Some(loading) = self.loading else { return "resident".into() };
        let loading = loading.name(self.prefetch());
        let policy = self.policy.map_or("", Replacement::name);
        let pass = if self.warm { "warm" } else { "cold" };
        format!("{:.0} % {policy} {loading} {pass}", self.budget * 100.0)
    }
}

/// All flights.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The scene file.
    pub scene: String,
    /// Its triangles.
    pub triangles: u64,
    /// Bytes of what comes in blocks: what budgets are shares of.
    pub data_bytes: u64,
    /// Bytes of the file.
    pub file_bytes: u64,
    /// The size of frames.
    pub size: String,
    /// Frames of the path.
    pub frames: usize,
    /// Degrees from one to the next.
    pub step_degrees: f64,
    /// Warm flights; the last is reported.
    pub warm_flights: u32,
    /// Whether there are shadow rays.
    pub shadows: bool,
    /// Whether reads went past the system's own memory of the file.
    pub direct: bool,
    /// Threads at work.
    pub threads: usize,
    /// The instruction set.
    pub isa: &'static str,
    /// How hits were decided.
    pub accuracy: Accuracy,
    /// The machine's processor.
    pub processor: String,
    /// The engine's version.
    pub raypack: &'static str,
    /// The engine's build: `release` or `dev`.
    pub build: &'static str,
    /// When it was, in UTC.
    pub date: String,
    /// The resident scene's, and the caches'.
    pub rows: Vec<Row>,
    /// The caches' rays a second by frame.
    pub tables: Vec<FrameTable>,
    /// What all this is compared with.
    pub paper: Paper,
    /// The file that has what was measured elsewhere, if one was given.
    pub beside: Option<String>,
}
