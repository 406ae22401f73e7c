//! From a model's name to a tree: read or generated, and built.

use super::options::BuildOptions;
use super::progress::{Bar, watch};
use super::report::{Lines, bytes, duration, grouped};
use crate::error::Result;
use crate::kdtree::{BuildParams, BuildProgress, TreeStats};
use crate::mesh::generate::plant;
use crate::mesh::{self, Mesh, ReadReport};
use crate::simd::Isa;
use crate::study::resident::Resident;
use crate::traverse::Accel;
use serde::Serialize;
use std::path::Path;
use std::time::Instant;
use tracing::info;

/// A mesh and where it came from.
#[derive(Debug)]
pub struct Model {
    /// Its file's path, or what it is.
    pub name: String,
    /// The mesh.
    pub mesh: Mesh,
    /// What the reader has to say; `None` for what was not read.
    pub report: Option<ReadReport>,
    /// The time that it took to read or generate.
    pub seconds: f64,
}

impl Model {
    /// Reads a model's file.
    pub fn read(path: &Path) -> Result<Self> {
        let start = Instant::now();
        let bar = Bar::new("reading");
        let loaded = mesh::read_with_progress(path, &|fraction| bar.set(f64::from(fraction)))?;
        let seconds = start.elapsed().as_secs_f64();
        info!("read {} in {}", path.display(), duration(seconds));
        let name = path.display().to_string();
        Ok(Self { name, mesh: loaded.mesh, report: Some(loaded.report), seconds })
    }

    /// The scene that is rendered when none is named.
    pub fn demo() -> Self {
        let start = Instant::now();
        let mesh = plant::demo();
        let seconds = start.elapsed().as_secs_f64();
        Self { name: "process plant (built-in demo)".into(), mesh, report: None, seconds }
    }

    /// Builds its tree.
    ///
    /// # Errors
    /// As [`KdTree::build`](crate::kdtree::KdTree::build), or the memory that is given does not do.
    pub fn build(self, options: &BuildOptions, params: &BuildParams, isa: Isa) -> Result<Scene> {
        let mut params = params.clone();
        options.fit(&self.mesh, &mut params)?;
        let announced = params.peak_bytes(self.mesh.triangles.len());
        info!("the build will take {} at most", bytes(announced as u64));
        let resident = Resident::start();
        let start = Instant::now();
        let progress = BuildProgress::default();
        let accel = watch(
            "building",
            || progress.fraction(),
            || Accel::build_with_progress(&self.mesh, &params, &progress),
        )?;
        let build_seconds = start.elapsed().as_secs_f64();
        info!("built the tree in {}", duration(build_seconds));
        let resident = resident.and_then(|resident| resident.rise());
        let memory = BuildMemory { announced, counted: accel.tree().build_peak(), resident };
        let tree = accel.stats();
        Ok(Scene { memory, model: self, accel: accel.with_isa(isa), tree, build_seconds })
    }
}

/// A model made ready for tracing.
pub struct Scene {
    /// The model.
    pub model: Model,
    /// Its tree, with the instruction set chosen.
    pub accel: Accel,
    /// Figures about the tree.
    pub tree: TreeStats,
    /// The time that the build took.
    pub build_seconds: f64,
    /// The memory that the build took.
    pub memory: BuildMemory,
}

/// Bytes that a build took beside the mesh, the tree among them.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct BuildMemory {
    /// The most that it could have taken, as was known beforehand.
    pub announced: usize,
    /// The most that its arrays held.
    pub counted: usize,
    /// How far the process's memory has risen, where the system says.
    pub resident: Option<u64>,
}

/// What reports say about a scene.
#[derive(Debug, Serialize)]
pub struct SceneReport<'a> {
    model: &'a str,
    triangles: usize,
    vertices: usize,
    /// Least and greatest corner.
    bounds: [[f32; 3]; 2],
    read_seconds: f64,
    read_report: Option<&'a ReadReport>,
    build_seconds: f64,
    build_memory: BuildMemory,
    tree: TreeReport<'a>,
}

/// The figures about a tree.
#[derive(Debug, Serialize)]
struct TreeReport<'a> {
    #[serde(flatten)]
    stats: &'a TreeStats,
    /// [`KdTree::duplication`](crate::kdtree::KdTree::duplication), where it was counted.
    #[serde(skip_serializing_if = "Option::is_none")]
    duplication_histogram: Option<&'a [usize]>,
}

impl<'a> SceneReport<'a> {
    /// The same with how many leaves triangles are in.
    pub fn with_duplication(mut self, histogram: &'a [usize]) -> Self {
        self.tree.duplication_histogram = Some(histogram);
        self
    }
}

impl Scene {
    /// The report's part about model and tree.
    pub fn report(&self) -> SceneReport<'_> {
        let (Model { name, mesh, report, seconds }, bounds) = (&self.model, self.accel.bounds());
        SceneReport {
            model: name,
            triangles: mesh.triangles.len(),
            vertices: mesh.positions.len(),
            bounds: [bounds.min.to_array(), bounds.max.to_array()],
            read_seconds: *seconds,
            read_report: report.as_ref(),
            build_seconds: self.build_seconds,
            build_memory: self.memory,
            tree: TreeReport { stats: &self.tree, duplication_histogram: None },
        }
    }

    /// The same in words.
    pub fn describe(&self, lines: &mut Lines) {
        let Model { name, mesh, report, seconds } = &self.model;
        lines.add("model", name);
        let [triangles, vertices] = [mesh.triangles.len(), mesh.positions.len()].map(|n| grouped(n as u64));
        lines.add("triangles", format!("{triangles} with {vertices} vertices"));
        lines.add(if report.is_some() { "read" } else { "generated" }, duration(*seconds));
        let summary = report.as_ref().map(ReadReport::summary).unwrap_or_default();
        if !summary.is_empty() {
            lines.add("repaired", summary);
        }
        let BuildMemory { announced, counted, resident } = self.memory;
        let resident = resident.map(|rise| format!(", the process rose by {}", bytes(rise)));
        lines.add(
            "build",
            format!(
                "{}; {} of memory at most, of {} announced{}",
                duration(self.build_seconds),
                bytes(counted as u64),
                bytes(announced as u64),
                resident.unwrap_or_default()
            ),
        );
        let tree = &self.tree;
        lines.add(
            "tree",
            format!(
                "{} nodes, {} leaves, {:.2} references per triangle, depth {}, SAH cost {:.1}, {}, {:.1} bytes per triangle",
                grouped(tree.nodes as u64),
                grouped(tree.leaves as u64),
                tree.references_per_triangle,
                tree.depth,
                tree.sah_cost,
                bytes(tree.bytes() as u64),
                tree.bytes_per_triangle,
            ),
        );
    }
}
