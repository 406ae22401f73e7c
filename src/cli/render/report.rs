//! What `render` reports: the scene, the machine's part, and what each frame cost.

use crate::cli::cache_options::{CacheReport, describe_memory};
use crate::cli::looks::callers;
use crate::cli::memory::MemoryReport;
use crate::cli::report::{ENGINE, Engine, Lines, counted, duration, grouped};
use crate::cli::scene::{Scene, SceneReport};
use crate::geometry::Accuracy;
use crate::render::{EffectCosts, FirstStats, FrameStats, RayCount, RenderSettings, Size};
use crate::scene::Camera;
use crate::scene::effects::Call;
use crate::traverse::Kernel;
use serde::Serialize;
use std::fmt::Write as _;
use std::path::PathBuf;

/// One rendered frame.
#[derive(Debug, Serialize)]
pub struct Shot {
    /// Where its picture is.
    pub file: PathBuf,
    /// The camera.
    pub camera: Camera,
    /// What it cost.
    #[serde(flatten)]
    pub stats: FrameStats,
    /// What there was before it was complete.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub first: Option<FirstShot>,
}

/// A picture that was there before the frame was complete.
#[derive(Debug, Serialize)]
pub struct FirstShot {
    /// Where it is.
    pub file: PathBuf,
    /// When, and how much of it.
    #[serde(flatten)]
    pub stats: FirstStats,
}

/// Everything there is to say.
#[derive(Debug, Serialize)]
pub struct Report<'a> {
    engine: Engine,
    #[serde(flatten)]
    scene: SceneReport<'a>,
    profile: &'a str,
    isa: &'static str,
    accuracy: Accuracy,
    packet: usize,
    tile: u32,
    threads: usize,
    pinned: usize,
    size: Size,
    samples: u32,
    shadows: bool,
    /// Rays and times of all frames together.
    camera: RayCount,
    shadow: RayCount,
    total: RayCount,
    /// All effects, whether they ran, and what called for them.
    effects: &'a [Call],
    /// What those that ran cost, of all frames together.
    #[serde(skip_serializing_if = "EffectCosts::is_empty")]
    costs: EffectCosts,
    /// Seconds of shading beside them, if the plain renderer did not do.
    #[serde(skip_serializing_if = "Option::is_none")]
    shading_seconds: Option<f64>,
    /// The memory that was given, and the most that was taken.
    memory: MemoryReport,
    /// Of a scene that is not all in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    cache: Option<CacheReport>,
    frames: Vec<Shot>,
}

impl<'a> Report<'a> {
    /// Gathers it. There must be at least one frame.
    pub fn new(
        scene: &'a Scene,
        settings: &RenderSettings,
        profile: &'a str,
        frames: Vec<Shot>,
        (memory, cache): (MemoryReport, Option<CacheReport>),
        effects: &'a [Call],
    ) -> Self {
        let sum = |kind: fn(&FrameStats) -> RayCount| {
            let counts = frames.iter().map(|shot| kind(&shot.stats));
            let (rays, seconds) =
                counts.fold((0, 0.0), |(rays, seconds), count| (rays + count.rays, seconds + count.seconds));
            RayCount::of(rays, seconds)
        };
        let costs = frames.iter().fold(EffectCosts::default(), |costs, shot| costs.and(&shot.stats.costs));
        let (shadow, total) = (sum(|stats| stats.shadow), sum(|stats| stats.total));
        let shading_seconds = (!costs.is_empty()).then(|| costs.shading());
        let costs = if costs.is_empty() { EffectCosts::plain(shadow, total.seconds) } else { costs };
        Self {
            engine: ENGINE,
            scene: scene.report(),
            profile,
            isa: scene.accel.isa().name(),
            accuracy: scene.accel.accuracy(),
            packet: settings.tuning.packet.width(),
            tile: settings.tuning.tile,
            threads: frames[0].stats.threads,
            pinned: frames[0].stats.pinned,
            size: settings.size,
            samples: settings.samples,
            shadows: settings.shadows,
            camera: sum(|stats| stats.camera),
            shadow,
            total,
            effects,
            shading_seconds,
            costs,
            memory,
            cache,
            frames,
        }
    }

    /// The same in words.
    pub fn text(&self, scene: &Scene) -> String {
        let mut lines = Lines::default();
        scene.describe(&mut lines);
        lines.add("camera", self.frames[0].camera.to_string());
        let mut samples = counted(u64::from(self.samples), "sample");
        let taken = self.frames.iter().map(|shot| shot.stats.samples).sum::<f64>() / self.frames.len() as f64;
        if taken < f64::from(self.samples) - 0.05 {
            samples = format!("{taken:.1} of {samples}");
        }
        let shadows = if self.shadows { ", shadows" } else { "" };
        lines.add("picture", format!("{}, {samples} per pixel{shadows}", self.size));
        let Engine { version, build } = ENGINE;
        let pinned = match self.pinned {
            0 => "not pinned".into(),
            all if all == self.threads => "pinned".into(),
            some => format!("{some} pinned"),
        };
        let packets = Kernel::of_width(self.packet).map_or("", Kernel::rays);
        lines.add(
            "engine",
            format!(
                "raypack {version} ({build}), {}, {}, {packets}, tiles of {}x{}, {} ({pinned})",
                self.isa,
                self.accuracy,
                self.tile,
                self.tile,
                counted(self.threads as u64, "thread"),
            ),
        );
        if cfg!(debug_assertions) {
            lines.add("warning", "a debug build traces slowly; use cargo run --release");
        }
        for (kind, count) in [("camera", self.camera), ("shadow", self.shadow)] {
            if count.rays > 0 {
                lines.add(kind, rays(&count));
            }
        }
        self.describe_effects(&mut lines);
        lines.add("total", format!("{}, shading included", rays(&self.total)));
        if let Some(words) = firsts(&self.frames) {
            lines.add("first", words);
        }
        let mut text = lines.text().to_owned();
        match &self.frames[..] {
            [still] => writeln!(text, "{:<10} {}", "wrote", still.file.display()).expect("into a string"),
            path => text.push_str(&frame_table(path)),
        }
        let mut end = Lines::default();
        describe_memory(&mut end, &self.memory, self.cache.as_ref());
        text + end.text()
    }
}

impl Report<'_> {
    /// A line for each effect that ran: its rays or uses, its time, its part of the frame, and what called for it.
    fn describe_effects(&self, lines: &mut Lines) {
        let frame = self.total.seconds;
        let shading = self.costs.shading();
        if shading > 0.0 {
            lines.add("shading", format!("{}, {:.1} %", duration(shading), 100.0 * shading / frame));
        }
        for (effect, cost) in self.costs.iter() {
            let (count, share) = (grouped(cost.count()), 100.0 * cost.share);
            let cost = format!("{count} {}, {}, {share:.1} %", effect.unit(), duration(cost.seconds));
            let call = self.effects.iter().find(|call| call.name == effect).expect("all are there");
            lines.add("effect", format!("{effect:<18} {cost}; {}", callers(call)));
        }
    }
}

/// When first pictures were there, and what was missing in them.
fn firsts(shots: &[Shot]) -> Option<String> {
    let firsts: Vec<&FirstShot> = shots.iter().filter_map(|shot| shot.first.as_ref()).collect();
    let greatest =
        |of: fn(&FirstStats) -> f64| firsts.iter().map(|first| of(&first.stats)).fold(0.0, f64::max);
    let (latest, stand_ins) = (greatest(|stats| stats.seconds), greatest(|stats| stats.stand_ins));
    let boxes = format!("{:.1} % of the pixels drawn as boxes", stand_ins * 100.0);
    match firsts[..] {
        [] => None,
        [first] => Some(format!("in {}, {boxes}: {}", duration(latest), first.file.display())),
        _ => Some(format!("pictures in {} at most, {boxes} at most", duration(latest))),
    }
}

/// `1,234 rays in 5.6 ms: 0.22 M/s`.
fn rays(count: &RayCount) -> String {
    let RayCount { rays, seconds, rays_per_s } = *count;
    format!("{} rays in {}: {} M/s", grouped(rays), duration(seconds), millions(rays_per_s))
}

fn millions(rays_per_s: f64) -> String {
    format!("{:.2}", rays_per_s * 1e-6)
}

/// A line for each frame, and what they have in common.
fn frame_table(shots: &[Shot]) -> String {
    let mut text = String::from("\nframe   time ms   camera M/s   shadow M/s   total M/s   file\n");
    for (number, Shot { file, stats, .. }) in shots.iter().enumerate() {
        let [camera, shadow, total] =
            [stats.camera, stats.shadow, stats.total].map(|count| millions(count.rays_per_s));
        writeln!(
            text,
            "{number:>5} {:>9.2} {camera:>12} {shadow:>12} {total:>11}   {}",
            stats.seconds * 1e3,
            file.display()
        )
        .expect("into a string");
    }
    let mut times: Vec<f64> = shots.iter().map(|shot| shot.stats.seconds * 1e3).collect();
    times.sort_by(f64::total_cmp);
    let mean = times.iter().sum::<f64>() / times.len() as f64;
    writeln!(
        text,
        "\n{:<10} {}, mean {mean:.2} ms, median {:.2} ms, {:.2} to {:.2} ms; {:.1} frames per second",
        "frames",
        times.len(),
        times[times.len() / 2],
        times[0],
        times[times.len() - 1],
        1e3 / mean,
    )
    .expect("into a string");
    text
}
