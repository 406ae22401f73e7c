//! A scene file of models that are larger than the memory given.

use super::super::options::BuildOptions;
use super::super::progress::{Bar, watch};
use super::super::report::{bytes, duration};
use super::super::scene::BuildMemory;
use super::{Args, ModelReport, names};
use crate::error::{Error, Result};
use crate::files::folder_of;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::ReadReport;
use crate::mesh::spooled::{self, Announced, SpooledMesh};
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
    pub models: Vec<ModelReport>,
    pub triangles: usize,
    pub vertices: usize,
    pub tree: TreeStats,
    pub seconds: f64,
    pub memory: BuildMemory,
    pub parts: usize,
    pub written: Written,
}

/// Whether models are to be built piece by piece: they can be, and all of them with their tree are larger than the memory
/// given.
///
/// # Errors
/// They are, and the memory given is too little for that, too; nothing has been read then.
pub fn is_called_for(
    models: &[impl AsRef<Path>],
    options: &BuildOptions,
    params: &BuildParams,
) -> Result<bool> {
    let Some(limit) = options.limit()? else { return Ok(false) };
    let mut all = Announced::default();
    for model in models {
        let model = model.as_ref();
        let announced = if is_scene(model) {
            Some(store::File::open(model)?.announced())
        } else {
            spooled::announced(model)
        };
        let Some(announced) = announced else { return Ok(false) };
        all = all.and(announced);
    }
    let (mesh, tree) = (all.mesh_bytes() as usize, params.peak_bytes(all.triangles as usize));
    let in_memory = mesh.saturating_add(tree).saturating_add(PROCESS);
    if in_memory > limit {
        check_limit(params, all.triangles as usize, limit)?;
    }
    Ok(in_memory > limit)
}

/// Whether a tree of so many triangles can be built piece by piece within the memory given.
///
/// # Errors
/// It cannot: how much it takes.
fn check_limit(params: &BuildParams, triangles: usize, limit: usize) -> Result<()> {
    let least = large::least_bytes(params, triangles) + PROCESS;
    if least > limit {
        let message = format!(
            "building {triangles} triangles piece by piece takes {}: give {}MiB",
            bytes(least as u64),
            least.div_ceil(1 << 20)
        );
        return Err(Error::option("--memory", message));
    }
    Ok(())
}

/// Reads the models, builds their tree and writes the scene file within the memory given.
pub fn build(args: &Args, params: &BuildParams, limit: usize) -> Result<Large> {
    let folder = folder_of(&args.output);
    let (mut meshes, mut models) = (Vec::new(), Vec::new());
    for path in &args.models {
        let (mesh, mut model) = read(path, folder)?;
        if args.models.len() > 1
            && let Some(report) = &mut model.read_report
        {
            report.zero_area_triangles = zero_area(&mesh, folder)?;
        }
        meshes.push(mesh);
        models.push(model);
    }
    let mesh = match <[SpooledMesh; 1]>::try_from(meshes) {
        Ok([mesh]) => mesh,
        Err(several) => SpooledMesh::join(several, folder)?,
    };
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    let (built, seconds, memory) = build_mesh(&args.output, &mesh, params, limit, &names(&models))?;
    if let [ModelReport { read_report: Some(report), .. }] = &mut models[..] {
        // Of one model, it has been counted on the way.
        report.zero_area_triangles = built.zero_area_triangles;
    }
    Ok(Large {
        models,
        triangles,
        vertices,
        tree: built.stats,
        seconds,
        memory,
        parts: built.parts,
        written: built.written,
    })
}

/// Reads a model to files in `folder`.
fn read(path: &Path, folder: &Path) -> Result<(SpooledMesh, ModelReport)> {
    let start = Instant::now();
    let (mesh, read_report): (_, Option<ReadReport>) = if is_scene(path) {
        (store::File::open(path)?.spooled_mesh(folder)?, None)
    } else {
        Stage::Reading.begin();
        let bar = Bar::new("reading");
        let (mesh, report) = spooled::read(path, folder, &|part| bar.set(f64::from(part)))?;
        (mesh, Some(report))
    };
    let read_seconds = start.elapsed().as_secs_f64();
    let model = path.display().to_string();
    info!("read {model} in {}, to files", duration(read_seconds));
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    Ok((mesh, ModelReport { model, triangles, vertices, read_seconds, read_report }))
}

/// How many triangles of a mesh in files in `folder` have no area.
fn zero_area(mesh: &SpooledMesh, folder: &Path) -> Result<u64> {
    mesh.zero_area_triangles().map_err(|source| Error::Read { path: folder.into(), source })
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
    check_limit(params, mesh.triangles.len(), limit)?;
    let start = Instant::now();
    let progress = Progress::default();
    let work = || large::build(output, mesh, params, limit - PROCESS, source, &progress);
    let built = watch("building", || progress.fraction(), work)?;
    let memory = BuildMemory { announced: limit, counted: built.peak, resident: resident::peak() };
    Ok((built, start.elapsed().as_secs_f64(), memory))
}
