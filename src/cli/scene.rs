//! What commands trace: a model and its tree, just built, or a scene file.

use super::cache_options::{CacheReport, taken_so_far};
use super::memory::{Beside, MemoryReport};
use super::model::Model;
use super::options::BuildOptions;
use super::report::{Lines, bytes, duration, grouped};
use crate::cache::{CacheOptions, Cached};
use crate::error::Result;
use crate::geometry::Accuracy;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::{Mesh, ReadReport};
use crate::scene::CachedSurface;
use crate::simd::Isa;
use crate::store::{self, Stored, is_scene};
use crate::traverse::Accel;
use serde::Serialize;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;
use tracing::info;

/// A scene made ready for tracing.
pub struct Scene {
    /// Its file's path, or what it is.
    pub name: String,
    /// Vertices of its mesh.
    pub vertices: u64,
    /// Its tree, with the instruction set chosen.
    pub accel: Accel,
    /// Figures about the tree.
    pub tree: TreeStats,
    /// Its surfaces.
    pub looks: Looks,
    /// How it came here.
    pub origin: Origin,
    /// The most bytes that the process takes with it, as far as that was asked for before its tree was built.
    pub announced: Option<usize>,
}

/// What a scene's surfaces are read from.
pub enum Looks {
    /// The model.
    Mesh(Mesh),
    /// The scene file.
    Stored(Stored),
    /// The scene file, of which a part is in memory.
    Cached(CachedSurface),
}

/// How a scene came here.
#[derive(Debug, Serialize)]
#[serde(untagged)]
pub enum Origin {
    /// A model was read or generated, and a tree built of it.
    Built {
        /// Seconds of reading or generating.
        read_seconds: f64,
        /// What the reader has to say; `None` for what was not read.
        read_report: Option<Box<ReadReport>>,
        /// Seconds of building.
        build_seconds: f64,
        /// The memory that the build took.
        build_memory: BuildMemory,
    },
    /// A scene file was opened.
    Opened {
        /// Seconds of opening, checksums included.
        open_seconds: f64,
        /// The file's length.
        file_bytes: u64,
        /// What it was made of.
        source: String,
        /// What made it.
        made_by: String,
    },
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
    vertices: u64,
    /// Least and greatest corner.
    bounds: [[f32; 3]; 2],
    #[serde(flatten)]
    origin: &'a Origin,
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
    /// Bytes of pools, if they were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pool_bytes: Option<usize>,
}

impl<'a> SceneReport<'a> {
    /// The same with how many leaves triangles are in.
    pub fn with_duplication(mut self, histogram: &'a [usize]) -> Self {
        self.tree.duplication_histogram = Some(histogram);
        self
    }
}

impl Scene {
    /// Reads a model and builds its tree, or opens a scene file.
    ///
    /// # Errors
    /// As [`Model::read`], [`Model::build`] or [`Scene::open`].
    pub fn prepare(path: &Path, options: &BuildOptions, params: &BuildParams, isa: Isa) -> Result<Self> {
        if is_scene(path) {
            Self::open(&store::File::open(path)?, isa)
        } else {
            Model::read(path)?.build(options, params, isa)
        }
    }

    /// The same, where `--memory` is for everything that the process takes.
    ///
    /// # Errors
    /// Likewise, or everything takes more.
    pub fn prepare_beside(
        path: &Path,
        options: &BuildOptions,
        params: &BuildParams,
        isa: Isa,
        beside: &Beside<'_>,
    ) -> Result<Self> {
        let Some(limit) = options.limit()?.filter(|_| !is_scene(path)) else {
            return Self::prepare(path, options, params, isa);
        };
        beside.check(path, params, limit)?;
        Model::read(path)?.build_beside(params, isa, limit, beside)
    }

    /// The scene in a scene file.
    ///
    /// # Errors
    /// The file is damaged where tree or surfaces lie.
    pub fn open(file: &store::File, isa: Isa) -> Result<Self> {
        let start = Instant::now();
        let accel = Accel::of_tree(file.tree()?).with_isa(isa);
        let looks = Looks::Stored(file.stored()?);
        let tree = accel.stats();
        Ok(Self::of_file(file, accel, tree, looks, start.elapsed().as_secs_f64()))
    }

    /// The scene in a scene file, of which a part is in memory: all that the process takes is to stay within
    /// `memory`, with `beside` for what is still to come, while `threads` are at work.
    ///
    /// # Errors
    /// The file is damaged where it is read now, or the memory is too little.
    pub fn open_within(
        file: &store::File,
        options: &CacheOptions,
        [memory, beside]: [usize; 2],
        threads: usize,
        isa: Isa,
    ) -> Result<Self> {
        /// What the same command takes in one run and not in another: pages of libraries and of the allocator.
        const RUNS_DIFFER: usize = 1 << 20;
        /// What comes beside all that is counted, and was not there when it was: the pages of the process's own code
        /// that render and write pictures, which are some 2 MiB, and what the allocator keeps.
        const TO_COME: usize = 4 << 20;
        let start = Instant::now();
        let beside = beside + taken_so_far() + TO_COME;
        let open = |beside| Cached::open(file, options, memory, beside, threads);
        // The least memory that a refusal names is to do in the next run.
        let cached = Arc::new(open(beside).or_else(|_| open(beside + RUNS_DIFFER))?);
        let accel = Accel::of_cached(Arc::clone(&cached)).with_isa(isa);
        let looks = Looks::Cached(CachedSurface::new(cached, file)?);
        Ok(Self::of_file(file, accel, file.meta().stats.clone(), looks, start.elapsed().as_secs_f64()))
    }

    fn of_file(file: &store::File, accel: Accel, tree: TreeStats, looks: Looks, open_seconds: f64) -> Self {
        info!("opened {} in {}", file.path().display(), duration(open_seconds));
        let meta = file.meta();
        Self {
            name: file.path().display().to_string(),
            vertices: meta.vertices,
            tree,
            accel,
            looks,
            origin: Origin::Opened {
                open_seconds,
                file_bytes: file.bytes(),
                source: meta.source.clone(),
                made_by: meta.engine.clone(),
            },
            announced: None,
        }
    }

    /// Does something that traces. What of the scene cannot be read meanwhile is an error.
    ///
    /// # Errors
    /// The scene file cannot be read.
    pub fn reading<R>(&self, work: impl FnOnce() -> R) -> Result<R> {
        match self.accel.cached() {
            Some(cached) => cached.or_error(work),
            None => Ok(work()),
        }
    }

    /// The mesh that it was built of; `None` for a scene file.
    pub fn mesh(&self) -> Option<&Mesh> {
        match &self.looks {
            Looks::Mesh(mesh) => Some(mesh),
            Looks::Stored(_) | Looks::Cached(_) => None,
        }
    }

    /// Seconds of opening a scene file; none for what was built.
    pub fn open_seconds(&self) -> f64 {
        match &self.origin {
            Origin::Opened { open_seconds, .. } => *open_seconds,
            Origin::Built { .. } => 0.0,
        }
    }

    /// What there is to say in the end about the memory given and taken; and about the cache, if a part of the scene is in
    /// memory.
    ///
    /// # Errors
    /// The memory given is no size.
    pub fn memory_report(&self, options: &BuildOptions) -> Result<(MemoryReport, Option<CacheReport>)> {
        let memory = MemoryReport::new(options, self.announced)?;
        let cache = self.accel.cached().map(|cached| CacheReport::new(memory, cached));
        Ok((memory, cache))
    }

    /// The report's part about model and tree.
    pub fn report(&self) -> SceneReport<'_> {
        let bounds = self.accel.bounds();
        SceneReport {
            model: &self.name,
            triangles: self.tree.triangles,
            vertices: self.vertices,
            bounds: [bounds.min.to_array(), bounds.max.to_array()],
            origin: &self.origin,
            tree: TreeReport {
                stats: &self.tree,
                duplication_histogram: None,
                pool_bytes: self.pool_bytes(),
            },
        }
    }

    /// Bytes of pools, if there are any that rays go through.
    pub fn pool_bytes(&self) -> Option<usize> {
        Some(self.accel.pool_bytes()).filter(|&bytes| bytes > 0 && self.accel.accuracy() != Accuracy::Fast)
    }

    /// The same in words.
    pub fn describe(&self, lines: &mut Lines) {
        lines.add("model", &self.name);
        describe_size(lines, self.tree.triangles as u64, self.vertices);
        match &self.origin {
            Origin::Built { read_seconds, read_report, build_seconds, build_memory } => {
                lines.add(if read_report.is_some() { "read" } else { "generated" }, duration(*read_seconds));
                let summary = read_report.as_deref().map(ReadReport::summary).unwrap_or_default();
                if !summary.is_empty() {
                    lines.add("repaired", summary);
                }
                build_memory.describe(lines, *build_seconds);
            }
            Origin::Opened { open_seconds, file_bytes, source, made_by } => {
                let (time, size) = (duration(*open_seconds), bytes(*file_bytes));
                lines.add("opened", format!("{time}; {size}, made of {source} by {made_by}"));
            }
        }
        describe_tree(lines, &self.tree);
        if let Some(pools) = self.pool_bytes() {
            describe_pools(lines, pools, self.tree.triangles);
        }
    }
}

impl BuildMemory {
    /// A line about a build that took so many seconds.
    pub fn describe(&self, lines: &mut Lines, seconds: f64) {
        let resident = self.resident.map(|rise| format!(", the process rose by {}", bytes(rise)));
        lines.add(
            "build",
            format!(
                "{}; {} of memory at most, of {} announced{}",
                duration(seconds),
                bytes(self.counted as u64),
                bytes(self.announced as u64),
                resident.unwrap_or_default()
            ),
        );
    }
}

/// A line about a mesh's size.
pub fn describe_size(lines: &mut Lines, triangles: u64, vertices: u64) {
    lines.add("triangles", format!("{} with {} vertices", grouped(triangles), grouped(vertices)));
}

/// A line about pools of so many bytes.
pub fn describe_pools(lines: &mut Lines, pools: usize, triangles: usize) {
    let each = pools as f64 / triangles as f64;
    lines.add("pools", format!("{}, {each:.1} bytes per triangle", bytes(pools as u64)));
}

/// A line about a tree.
pub fn describe_tree(lines: &mut Lines, tree: &TreeStats) {
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
