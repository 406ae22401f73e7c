//! The bench's report, as its JSON has it.

use super::agreement::Agreement;
use crate::geometry::Accuracy;
use crate::study::rays::RayKind;
use crate::traverse::TileCounts;
use serde::Serialize;

/// Everything that a bench found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was measured, where and when.
    pub header: Header,
    /// A row for each engine, mode, kind of ray and number of threads.
    pub rows: Vec<Row>,
    /// Where the modes went that choose among raypack's kernels.
    pub choices: Vec<Choices>,
    /// What raypack's beams did with each kind of ray that made any.
    pub beams: Vec<Beams>,
    /// How the engines' answers compare.
    pub agreements: Vec<Agreement>,
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
    /// raypack's instruction set.
    pub isa: String,
    /// raypack's version.
    pub raypack: String,
    /// How raypack decided hits.
    pub accuracy: Accuracy,
    /// `release` or `dev`.
    pub build: &'static str,
    /// The engines.
    pub engines: Vec<EngineInfo>,
    /// When, in UTC.
    pub date: String,
    /// What the random rays hang on.
    pub seed: u64,
    /// The camera, as `--camera` takes it.
    pub camera: String,
    /// Width and height of the camera's image.
    pub size: u32,
    /// Whether all of raypack's kernels were given rays in a row.
    pub slices: bool,
    /// Whether raypack kept pools beside its tree, counted with it.
    pub pools: bool,
    /// The point light.
    pub light: [f32; 3],
}

/// An engine's version and instruction set.
#[derive(Clone, Debug, Serialize)]
pub struct EngineInfo {
    /// Its name.
    pub name: &'static str,
    /// Its version.
    pub version: String,
    /// Its instruction set.
    pub isa: String,
}

/// A mode's speed.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// `raypack`, `embree` or `obvhs`.
    pub engine: &'static str,
    /// The mode's name.
    pub mode: String,
    /// The kind of ray.
    pub rays: RayKind,
    /// Worker threads.
    pub threads: usize,
    /// The engine's instruction set.
    pub isa: String,
    /// How raypack decided hits; rivals have no such modes, or have them in the mode's name.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<Accuracy>,
    /// Million rays a second, median over the rounds.
    pub mrays_per_s: f64,
    /// The slowest round.
    pub low: f64,
    /// The fastest round.
    pub high: f64,
    /// How many rounds.
    pub rounds: usize,
    /// Rays in the set.
    pub count: usize,
    /// How many of them hit.
    pub hits: usize,
    /// Seconds that building the mode's tree took.
    pub build_seconds: f64,
    /// Bytes that the mode's tree holds.
    pub bytes: u64,
}

/// What a mode chose that chooses among raypack's kernels.
#[derive(Clone, Debug, Serialize)]
pub struct Choices {
    /// The kind of ray.
    pub rays: RayKind,
    /// The mode's name.
    pub mode: String,
    /// Kernels that it took, and how many rays each has traced in all: by any number of threads, rounds that were not timed among
    /// them. Rays that went two ways, to compare these, count with either.
    pub kernels: Vec<Share>,
}

/// Rays that went to a kernel.
#[derive(Clone, Debug, Serialize)]
pub struct Share {
    /// The kernel's name.
    pub kernel: &'static str,
    /// How many rays.
    pub rays: u64,
}

/// What raypack's tile kernel did with a set of rays, counted in a run of its own.
#[derive(Clone, Debug, Serialize)]
pub struct Beams {
    /// The kind of ray.
    pub rays: RayKind,
    /// Tiles of up to 256 rays.
    pub tiles: usize,
    /// The counts of all of them.
    pub counts: TileCounts,
}

impl Report {
    /// The fastest mode of an engine for a kind of ray and a number of threads.
    pub fn best(&self, engine: &str, rays: RayKind, threads: usize) -> Option<&Row> {
        self.rows
            .iter()
            .filter(|r| r.engine == engine && r.rays == rays && r.threads == threads)
            .max_by(|a, b| a.mrays_per_s.total_cmp(&b.mrays_per_s))
    }

    /// The kinds of ray and numbers of threads that have rows, in their order.
    pub fn races(&self) -> Vec<(RayKind, usize)> {
        let mut races = Vec::new();
        for row in &self.rows {
            if !races.contains(&(row.rays, row.threads)) {
                races.push((row.rays, row.threads));
            }
        }
        races
    }
}
