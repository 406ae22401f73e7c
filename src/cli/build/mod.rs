//! `raypack build MODEL... -o scene.rpk`: models to one scene file.

pub mod large;

use super::model::Model;
use super::options::{BuildOptions, PoolsOption};
use super::outputs::same_file;
use super::progress::Bar;
use super::report::{ENGINE, Engine, Json, Lines, bytes, counted, duration};
use super::scene::{BuildMemory, Origin, Scene, describe_pools, describe_size, describe_tree};
use crate::error::{Error, Result};
use crate::files::check_writable;
use crate::geometry::Accuracy;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::{Mesh, ReadReport};
use crate::simd::Isa;
use crate::store::{Section, Written, is_scene, write};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Build a scene file of models, which every command then opens at once
///
/// The file holds the mesh with its colours and the tree: opening it reads and builds nothing. Several models
/// become one scene. Primitive ids run on from model to model in the order in which they are named.
///
/// With --pools, the file holds pools too, and every command that traces what it opens goes through them.
///
/// With --memory, models that are larger than that, with their tree, are read and built piece by piece: the same scene, in
/// more time. What waits for its turn lies in files beside the scene file, and goes with the command.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The models: .obj, .ply, .stl, .gltf or .glb, or .rpk scene files, whose trees are built anew
    #[arg(required = true, value_name = "MODEL")]
    models: Vec<PathBuf>,
    /// The scene file: .rpk
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    pools: PoolsOption,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    engine: Engine,
    models: &'a [ModelReport],
    triangles: usize,
    vertices: u64,
    /// Of a tree that was built in parts, until all is on the disk.
    build_seconds: f64,
    build_memory: BuildMemory,
    /// In how many parts the tree was built, if it was.
    #[serde(skip_serializing_if = "Option::is_none")]
    parts: Option<usize>,
    build_params: &'a BuildParams,
    tree: &'a TreeStats,
    /// Bytes of pools, if they were made.
    #[serde(skip_serializing_if = "Option::is_none")]
    pool_bytes: Option<usize>,
    /// Seconds of checksums and of writing, until all is on the disk; `None` if that went along with building.
    write_seconds: Option<f64>,
    file: &'a Path,
    bytes: u64,
    sections: &'a [Section],
    /// Pictures that could not be read, and what is wrong with them.
    #[serde(skip_serializing_if = "<[String]>::is_empty")]
    missing_images: &'a [String],
}

/// What was read of a model.
#[derive(Debug, Serialize)]
pub struct ModelReport {
    model: String,
    triangles: usize,
    vertices: usize,
    read_seconds: f64,
    /// What the reader has to say; `None` for a scene file.
    read_report: Option<ReadReport>,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let isa = Isa::from_env()?;
    let profile = args.build.profile()?;
    args.check_output()?;
    args.json.check()?;
    args.pools.check(&args.build, Accuracy::default())?;

    if let Some(limit) = args.build.limit()?
        && large::is_called_for(&args.models, &args.build, &profile.build)?
    {
        let large = large::build(args, &profile.build, limit)?;
        let report = Report {
            engine: ENGINE,
            triangles: large.triangles,
            vertices: large.vertices as u64,
            models: &large.models,
            build_seconds: large.seconds,
            build_memory: large.memory,
            parts: Some(large.parts),
            build_params: &profile.build,
            tree: &large.tree,
            pool_bytes: None,
            write_seconds: None,
            file: &args.output,
            bytes: large.written.bytes,
            sections: &large.written.sections,
            missing_images: &large.written.missing_images,
        };
        return args.json.give(&text(&report), &report);
    }

    let (model, models) = read(&args.models)?;
    let source = model.name.clone();
    let scene = model.build(&args.build, &profile.build, isa)?;
    args.pools.make(&scene.accel)?;
    let start = Instant::now();
    let written = args.write(&scene, &source)?;
    let write_seconds = start.elapsed().as_secs_f64();

    let (build_seconds, build_memory) = match scene.origin {
        Origin::Built { build_seconds, build_memory, .. } => (build_seconds, build_memory),
        Origin::Opened { .. } => unreachable!("it was built"),
    };
    let report = Report {
        engine: ENGINE,
        models: &models,
        triangles: scene.tree.triangles,
        vertices: scene.vertices,
        build_seconds,
        build_memory,
        parts: None,
        build_params: scene.accel.tree().params(),
        tree: &scene.tree,
        pool_bytes: scene.pool_bytes(),
        write_seconds: Some(write_seconds),
        file: &args.output,
        bytes: written.bytes,
        sections: &written.sections,
        missing_images: &written.missing_images,
    };
    args.json.give(&text(&report), &report)
}

/// Reads models and makes them one.
fn read(paths: &[PathBuf]) -> Result<(Model, Vec<ModelReport>)> {
    let (mut meshes, mut reports) = (Vec::new(), Vec::new());
    for path in paths {
        let model = Model::read(path)?;
        reports.push(ModelReport {
            model: model.name,
            triangles: model.mesh.triangles.len(),
            vertices: model.mesh.positions.len(),
            read_seconds: model.seconds,
            read_report: model.report,
        });
        meshes.push(model.mesh);
    }
    let seconds = reports.iter().map(|report| report.read_seconds).sum();
    let model = Model { name: names(&reports), mesh: Mesh::join(meshes)?, report: None, seconds };
    Ok((model, reports))
}

/// What several models are called together.
fn names(models: &[ModelReport]) -> String {
    let names: Vec<&str> = models.iter().map(|model| &*model.model).collect();
    names.join(", ")
}

impl Args {
    /// Finds out before any work whether the scene file can be written, and is not one of the other files.
    fn check_output(&self) -> Result<()> {
        if !is_scene(&self.output) {
            let expected = "a scene file is written as .rpk";
            return Err(Error::UnknownFormat { path: self.output.clone(), expected });
        }
        let others = self.models.iter().map(PathBuf::as_path).chain(self.json.file());
        if others.into_iter().any(|other| same_file(&self.output, other)) {
            let message =
                format!("{} is named twice; give each file a name of its own", self.output.display());
            return Err(Error::option("--output", message));
        }
        check_writable(&self.output)
    }

    fn write(&self, scene: &Scene, source: &str) -> Result<Written> {
        let mesh = scene.mesh().expect("it was built of a mesh");
        let bar = Bar::new("writing");
        write(&self.output, mesh, scene.accel.tree(), source, &|part| bar.set(part))
    }
}

fn text(report: &Report<'_>) -> String {
    let mut lines = Lines::default();
    for model in report.models {
        lines.add("model", &model.model);
        if report.models.len() > 1 {
            describe_size(&mut lines, model.triangles as u64, model.vertices as u64);
        }
        lines.add("read", duration(model.read_seconds));
        let summary = model.read_report.as_ref().map(ReadReport::summary).unwrap_or_default();
        if !summary.is_empty() {
            lines.add("repaired", summary);
        }
    }
    if report.models.len() > 1 {
        lines.add("scene", counted(report.models.len() as u64, "model"));
    }
    describe_size(&mut lines, report.triangles as u64, report.vertices);
    match report.parts {
        None => report.build_memory.describe(&mut lines, report.build_seconds),
        Some(parts) => describe_parts(&mut lines, report.build_seconds, report.build_memory, parts),
    }
    describe_tree(&mut lines, report.tree);
    if let Some(pools) = report.pool_bytes {
        describe_pools(&mut lines, pools, report.triangles);
    }
    let time = report.write_seconds.map(|seconds| format!(", in {}", duration(seconds))).unwrap_or_default();
    for image in report.missing_images {
        lines.add("missing", image);
    }
    lines.add("wrote", format!("{}, {}{time}", report.file.display(), bytes(report.bytes)));
    lines.text().to_owned()
}

/// What is said of a tree that was built in parts, in so many seconds.
pub fn describe_parts(lines: &mut Lines, seconds: f64, memory: BuildMemory, parts: usize) {
    let BuildMemory { announced, counted: held, resident } = memory;
    let resident = resident.map(|peak| format!(", the process {} at most", bytes(peak))).unwrap_or_default();
    lines.add(
        "built",
        format!(
            "in {}, in {}; the builder held {}{resident}, of {} given",
            duration(seconds),
            counted(parts as u64, "part"),
            bytes(held as u64),
            bytes(announced as u64)
        ),
    );
}
