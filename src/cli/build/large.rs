//! A scene file of a model that is larger than the memory given.

use super::super::options::BuildOptions;
use super::super::progress::{Bar, watch};
use super::super::report::{bytes, duration};
use super::super::scene::BuildMemory;
use super::{Args, ModelReport};
use crate::error::{Error, Result};
use crate::files::folder_of;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::spooled::{self, SpooledMesh};
use crate::stage::Stage;
use crate::store::large::{self, Built, Progress};
use crate::store::{self, Written, is_scene};
use crate::study::resident;
use std::path::Path;
use std::time::Instant;
use tracing::info;

/// What the process takes beside all that is counted: its own code, threads, what an allocator keeps.
const PROCESS: usize = 32 << 20;

/// What was built.
pub struct Large {
    pub model: ModelReport,
    pub tree: TreeStats,
    pub seconds: f64,
    pub memory: BuildMemory,
    pub parts: usize,
    pub written: Written,
}

/// Whether a model is to be built piece by piece: it is one that can be, and with its tree it is larger than
/// the memory given.
pub fn is_called_for(
    models: &[impl AsRef<Path>],
    options: &BuildOptions,
    params: &BuildParams,
) -> Result<bool> {
    let (Some(limit), [model]) = (options.limit()?, models) else { return Ok(false) };
    let model = model.as_ref();
    let announced =
        if is_scene(model) { Some(store::File::open(model)?.announced()) } else { spooled::announced(model) };
    let Some(announced) = announced else { return Ok(false) };
    let (mesh, tree) = (announced.mesh_bytes() as usize, params.peak_bytes(announced.triangles as usize));
    let in_memory = mesh.saturating_add(tree).saturating_add(PROCESS);
    Ok(in_memory > limit)
}

/// Reads the model, builds its tree and writes the scene file within the memory given.
pub fn build(args: &Args, params: &BuildParams, limit: usize) -> Result<Large> {
    let path = &args.models[0];
    let name = path.display().to_string();
    let folder = folder_of(&args.output);
    let start = Instant::now();
    let (mesh, mut read_report) = if is_scene(path) {
        (store::File::open(path)?.spooled_mesh(folder)?, None)
    } else {
        Stage::Reading.begin();
        let bar = Bar::new("reading");
        let (mesh, report) = spooled::read(path, folder, &|part| bar.set(f64::from(part)))?;
        (mesh, Some(report))
    };
    let read_seconds = start.elapsed().as_secs_f64();
    info!("read {name} in {}, to files", duration(read_seconds));

    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    let (built, seconds, memory) = build_mesh(&args.output, &mesh, params, limit, &name)?;
    if let Some(report) = &mut read_report {
        report.zero_area_triangles = built.zero_area_triangles;
    }
    Ok(Large {
        model: ModelReport { model: name, triangles, vertices, read_seconds, read_report },
        tree: built.stats,
        seconds,
        memory,
        parts: built.parts,
        written: built.written,
    })
}

/// Builds the tree of a mesh in files and writes the scene file within the memory given; the seconds of that, and
/// what memory it took. `source` says what the mesh was made of.
pub fn build_mesh(
    output: &Path,
    mesh: &SpooledMesh,
    params: &BuildParams,
    limit: usize,
    source: &str,
) -> Result<(Built, f64, BuildMemory)> {
    let triangles = mesh.triangles.len();
    let least = large::least_bytes(params, triangles) + PROCESS;
    if least > limit {
        let message = format!(
            "building {triangles} triangles piece by piece takes {}: give {}MiB",
            bytes(least as u64),
            least.div_ceil(1 << 20)
        );
        return Err(Error::option("--memory", message));
    }
    let start = Instant::now();
    let progress = Progress::default();
    let work = || large::build(output, mesh, params, limit - PROCESS, source, &progress);
    let built = watch("building", || progress.fraction(), work)?;
    let memory = BuildMemory { announced: limit, counted: built.peak, resident: resident::peak() };
    Ok((built, start.elapsed().as_secs_f64(), memory))
}
