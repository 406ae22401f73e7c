//! What flights through caches took, as tables and as JSON.

use super::{FrameTable, Paper, Trial};
use crate::cache::policy::Replacement;
use crate::cache::{CacheOptions, CacheStats, Cached, Loading, Prefetch};
use crate::geometry::Accuracy;
use crate::study::text::{figure, grid, grouped};
use serde::Serialize;
use std::fmt;

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
    /// All else about the cache.
    pub cache: Option<CacheOptions>,
    /// Whether the cache held what the same flight had left.
    pub warm: bool,
    /// All rays of all frames in their time.
    pub rays_per_s: f64,
    /// The slowest and the fastest frame in seconds.
    pub frame_seconds: [f64; 2],
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
    /// Tiles' times: of half of them, and of 99 %, the middle frame's.
    pub tile_p50: f64,
    /// The same.
    pub tile_p99: f64,
    /// The frames in order.
    pub frames: Vec<FrameRow>,
}

impl Row {
    /// A flight through a scene that is all in memory.
    pub fn resident(frames: Vec<FrameRow>) -> Self {
        let seconds: f64 = frames.iter().map(|frame| frame.seconds).sum();
        let sum = |of: fn(&CacheStats) -> u64| frames.iter().map(|frame| of(&frame.cache)).sum::<u64>();
        let (uses, misses) = (sum(|c| c.uses), sum(|c| c.misses));
        let all = CacheStats { uses, misses, ..CacheStats::default() };
        let middle = |of: fn(&FrameRow) -> f64| {
            let mut times: Vec<f64> = frames.iter().map(of).collect();
            times.sort_by(f64::total_cmp);
            times.get(times.len() / 2).copied().unwrap_or_default()
        };
        let rays: u64 = frames.iter().map(|frame| frame.rays).sum();
        let extreme = |pick: fn(f64, f64) -> f64, start| frames.iter().map(|f| f.seconds).fold(start, pick);
        Self {
            budget: 1.0,
            memory_bytes: 0,
            policy: None,
            loading: None,
            cache: None,
            warm: true,
            rays_per_s: rays as f64 / seconds,
            frame_seconds: [extreme(f64::max, 0.0), extreme(f64::min, f64::INFINITY)],
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
            tile_p50: middle(|frame| frame.tile_p50),
            tile_p99: middle(|frame| frame.tile_p99),
            frames,
        }
    }

    /// A flight through a cache.
    pub fn cached(
        trial: &Trial,
        warm: bool,
        memory_bytes: usize,
        cached: &Cached,
        frames: Vec<FrameRow>,
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
            cache: Some(trial.options),
            warm,
            minimum,
            held: cached.plan().held(),
            loader_idle,
            ..Self::resident(frames)
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
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(
            f,
            "{}: {} triangles, {:.1} MB of data in blocks (file {:.1} MB)",
            self.scene,
            grouped(self.triangles),
            self.data_bytes as f64 * 1e-6,
            self.file_bytes as f64 * 1e-6
        )?;
        writeln!(
            f,
            "{} frames of {}, {} degrees apart, {}{}; {} threads, {}, {}, {}, raypack {} ({} build), {}",
            self.frames,
            self.size,
            self.step_degrees,
            if self.shadows { "camera and shadow rays" } else { "camera rays" },
            match self.warm_flights {
                1 => String::new(),
                flights => format!(", warm after {flights} flights"),
            },
            self.threads,
            self.isa,
            self.accuracy,
            self.processor,
            self.raypack,
            self.build,
            self.date
        )?;
        let how = if self.direct {
            "past the system's memory: what a read takes is what the disk takes"
        } else {
            "through the system's memory: the file may be there already, and a read then takes microseconds"
        };
        writeln!(f, "reads go {how}\n")?;
        let resident = self.rows.first().map_or(1.0, |row| row.rays_per_s);
        let head = [
            "in memory",
            "policy",
            "loading",
            "pass",
            "Mrays/s",
            "of resident",
            "x paper",
            "hits %",
            "blocks read",
            "least",
            "MB read",
            "ahead",
            "used %",
            "stalled s",
            "loaders idle %",
            "tile ms p50",
            "p99",
            "frame ms",
        ];
        let mut lines = vec![head.map(String::from).to_vec()];
        for row in &self.rows {
            let of = |cached: String| if row.policy.is_some() { cached } else { "-".into() };
            lines.push(vec![
                format!("{:.0} %", row.budget * 100.0),
                row.policy.map_or("resident", Replacement::name).into(),
                row.loading.map_or("-", |loading| loading.name(row.prefetch())).into(),
                if row.warm { "warm" } else { "cold" }.into(),
                figure(row.rays_per_s * 1e-6),
                format!("{:.2}", row.rays_per_s / resident),
                format!("{:.0}", row.rays_per_s / self.paper.rays_per_s[1]),
                of(format!("{:.2}", row.hit_ratio * 100.0)),
                of(row.loads.to_string()),
                of(row.minimum.to_string()),
                of(format!("{:.1}", row.bytes_read as f64 * 1e-6)),
                if row.prefetch() != Prefetch::Off { row.prefetched.to_string() } else { "-".into() },
                match row.prefetched_used + row.prefetched_unused {
                    0 => "-".into(),
                    known => format!("{:.0}", 100.0 * row.prefetched_used as f64 / known as f64),
                },
                of(format!("{:.2}", row.stalled)),
                of(format!("{:.0}", row.loader_idle * 100.0)),
                format!("{:.2}", row.tile_p50 * 1e3),
                format!("{:.2}", row.tile_p99 * 1e3),
                format!("{:.1}-{:.1}", row.frame_seconds[1] * 1e3, row.frame_seconds[0] * 1e3),
            ]);
        }
        f.write_str(&grid(&lines))?;
        writeln!(
            f,
            "\nleast: what the policy that knows the future would have read (Belady's MIN, on the uses of that \
             flight)\nahead: blocks that came before they were needed; used: of those whose fate is known, how \
             many were needed then\nx paper: of the {:.0} thousand rays/s that the paper's fastest cache reached",
            self.paper.rays_per_s[1] * 1e-3
        )?;
        self.tables.iter().try_for_each(|table| write!(f, "\n{table}"))?;
        write!(f, "\n{}", self.paper)
    }
}
