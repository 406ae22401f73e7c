//! The report, as its JSON has it.

use super::frames::{Setting, Times};
use super::participants::Participant;
use super::picture::PictureError;
use crate::geometry::Accuracy;
use crate::kdtree::BuildParams;
use crate::render::{FrameStats, Limits, Size, Tuning};
use crate::simd::Isa;
use crate::study::accuracy::Errors;
use crate::study::bench::EngineInfo;
use crate::study::bench::race::Speed;
use crate::study::rays::RayKind;
use serde::Serialize;

/// Everything that the study found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was measured, where and when.
    pub header: Header,
    /// A row for each kind of ray and each mode of each engine.
    pub rays: Vec<RayRow>,
    /// What pictures are compared with.
    pub reference: ReferencePicture,
    /// A row for each number of samples and each of raypack's modes.
    pub frames: Vec<FrameRow>,
    /// What fits the frame time that was asked for.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub within: Option<Within>,
    /// What was left out and why, a line each.
    pub notes: Vec<String>,
}

/// What was measured, where and when.
#[derive(Clone, Debug, Serialize)]
pub struct Header {
    /// The model's file or name.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// The processor's name.
    pub machine: String,
    /// Its hardware threads.
    pub hardware_threads: usize,
    /// Worker threads of every measurement.
    pub threads: usize,
    /// raypack's instruction set.
    pub isa: String,
    /// raypack's version.
    pub raypack: String,
    /// `release` or `dev`.
    pub build: &'static str,
    /// How raypack's tree was built.
    pub build_params: BuildParams,
    /// How frames were made.
    pub tuning: Tuning,
    /// The engines.
    pub engines: Vec<EngineInfo>,
    /// raypack's mode unless told otherwise.
    pub default: Accuracy,
    /// When, in UTC.
    pub date: String,
    /// What the random rays hang on.
    pub seed: u64,
    /// The camera, as `--camera` takes it.
    pub camera: String,
    /// The picture's size.
    pub size: Size,
    /// Side of the square image that ray sets come from.
    pub ray_side: u32,
    /// Rays of each kind that were held against the reference at most.
    pub oracle_rays: usize,
}

/// A mode's time and errors on one kind of ray.
#[derive(Clone, Debug, Serialize)]
pub struct RayRow {
    /// `raypack` or `embree`.
    pub engine: &'static str,
    /// `fast`, `watertight` or `exact`; `fast` or `robust` of Embree.
    pub mode: &'static str,
    /// Whether it is raypack's mode unless told otherwise.
    pub default: bool,
    /// The kernel that was quickest for it.
    pub kernel: String,
    /// The kind of ray.
    pub rays: RayKind,
    /// Worker threads.
    pub threads: usize,
    /// The engine's instruction set.
    pub isa: String,
    /// Rays in the set.
    pub count: usize,
    /// Nanoseconds a ray by the wall clock, all threads at work; median over the rounds.
    pub ns_per_ray: f64,
    /// The same in the quickest round.
    pub ns_low: f64,
    /// The same in the slowest round.
    pub ns_high: f64,
    /// Million rays a second, median over the rounds.
    pub mrays_per_s: f64,
    /// The slowest round.
    pub low: f64,
    /// The fastest round.
    pub high: f64,
    /// How many rounds.
    pub rounds: usize,
    /// Errors among the rays that were held against the reference.
    pub errors: Errors,
    /// The same for a million rays.
    pub per_million: PerMillion,
    /// Whether no other mode is both quicker and less often wrong.
    pub pareto: bool,
}

/// Errors per million rays.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PerMillion {
    /// All of them together.
    pub total: f64,
    /// Hits that were missed.
    pub missed: f64,
    /// Misses that were given as hits.
    pub false_hits: f64,
    /// Hits of another triangle than the nearest.
    pub wrong_primitive: f64,
}

/// What pictures are compared with.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct ReferencePicture {
    /// Its mode.
    pub accuracy: Accuracy,
    /// Its samples per pixel.
    pub samples: u32,
    /// How far light is followed, where effects ask for it.
    #[serde(flatten)]
    pub limits: Option<Limits>,
    /// Seconds that it took.
    pub seconds: f64,
}

/// A setting's frame time and its picture's error.
#[derive(Clone, Debug, Serialize)]
pub struct FrameRow {
    /// `raypack`.
    pub engine: &'static str,
    /// The mode.
    pub accuracy: Accuracy,
    /// Samples per pixel.
    pub samples: u32,
    /// How far light is followed, where effects ask for it.
    #[serde(flatten)]
    pub limits: Option<Limits>,
    /// Whether it is what `raypack render` does unless told otherwise.
    pub default: bool,
    /// Worker threads.
    pub threads: usize,
    /// The instruction set.
    pub isa: String,
    /// The picture's size.
    pub size: Size,
    /// Rays of a frame: camera and shadow.
    pub rays: u64,
    /// Milliseconds of a frame, median over the rounds.
    pub ms: f64,
    /// The quickest frame.
    pub ms_low: f64,
    /// The slowest frame.
    pub ms_high: f64,
    /// How many frames were timed.
    pub rounds: usize,
    /// How far the picture is from the reference.
    #[serde(flatten)]
    pub error: PictureError,
    /// Whether no other setting is quicker with an RMSE no greater, in two significant digits.
    pub pareto: bool,
}

/// What fits a frame time.
#[derive(Clone, Debug, Serialize)]
pub struct Within {
    /// The frame time that was asked for in milliseconds.
    pub budget_ms: f64,
    /// Whether anything fits.
    pub fits: bool,
    /// The most accurate setting that fits; the quickest if none does.
    pub picked: Choice,
    /// The next more accurate setting, which does not fit.
    pub next: Option<Choice>,
}

/// A setting with its frame time and its picture's error.
#[derive(Clone, Debug, Serialize)]
pub struct Choice {
    /// The mode.
    pub accuracy: Accuracy,
    /// Samples per pixel.
    pub samples: u32,
    /// How far light is followed, where effects ask for it.
    #[serde(flatten)]
    pub limits: Option<Limits>,
    /// Milliseconds of a frame in the median.
    pub ms: f64,
    /// The quickest frame.
    pub ms_low: f64,
    /// The slowest frame.
    pub ms_high: f64,
    /// How many frames were timed.
    pub frames: usize,
    /// How far the picture is from the reference.
    #[serde(flatten)]
    pub error: PictureError,
}

impl RayRow {
    pub(super) fn new(
        participant: &Participant,
        rays: RayKind,
        threads: usize,
        count: usize,
        kernel: &str,
        speed: Speed,
        errors: Errors,
    ) -> Self {
        let ns = |mrays_per_s: f64| 1e3 / mrays_per_s;
        let per_million = PerMillion {
            total: errors.per_million(errors.total()),
            missed: errors.per_million(errors.missed),
            false_hits: errors.per_million(errors.false_hits),
            wrong_primitive: errors.per_million(errors.wrong_primitive),
        };
        Self {
            engine: participant.engine.name(),
            mode: participant.mode,
            default: participant.is_default,
            kernel: kernel.into(),
            rays,
            threads,
            isa: participant.engine.isa(),
            count,
            ns_per_ray: ns(speed.median),
            ns_low: ns(speed.high),
            ns_high: ns(speed.low),
            mrays_per_s: speed.median,
            low: speed.low,
            high: speed.high,
            rounds: speed.rounds,
            errors,
            per_million,
            pareto: false,
        }
    }
}

impl FrameRow {
    pub(super) fn new(
        setting: Setting,
        isa: Isa,
        size: Size,
        stats: &FrameStats,
        times: Times,
        error: PictureError,
    ) -> Self {
        Self {
            engine: "raypack",
            accuracy: setting.accuracy,
            samples: setting.samples,
            limits: setting.limits,
            default: setting.is_default(),
            threads: stats.threads,
            isa: isa.name().into(),
            size,
            rays: stats.total.rays,
            ms: times.median * 1e3,
            ms_low: times.low * 1e3,
            ms_high: times.high * 1e3,
            rounds: times.frames,
            error,
            pareto: false,
        }
    }

    pub(super) fn setting(&self) -> Setting {
        Setting { accuracy: self.accuracy, samples: self.samples, limits: self.limits }
    }
}

impl Choice {
    /// With the times that the race gave.
    pub(super) fn raced(row: &FrameRow) -> Self {
        Self {
            accuracy: row.accuracy,
            samples: row.samples,
            limits: row.limits,
            ms: row.ms,
            ms_low: row.ms_low,
            ms_high: row.ms_high,
            frames: row.rounds,
            error: row.error,
        }
    }

    /// With times of its own.
    pub(super) fn measured(row: &FrameRow, times: Times) -> Self {
        let Times { median, low, high, frames } = times;
        Self { ms: median * 1e3, ms_low: low * 1e3, ms_high: high * 1e3, frames, ..Self::raced(row) }
    }
}

impl Report {
    /// The kinds of ray that have rows, in their order.
    pub fn kinds(&self) -> Vec<RayKind> {
        let mut kinds: Vec<RayKind> = self.rays.iter().map(|row| row.rays).collect();
        kinds.dedup();
        kinds
    }
}
