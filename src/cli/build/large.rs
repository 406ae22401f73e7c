//! A scene file of a model that is larger than the memory given.

use super::super::options::BuildOptions;
use super::super::progress::{Bar, watch};
use super::super::report::{bytes, duration};
use super::super::scene::BuildMemory;
use super::{Args, ModelReport};
use crate::error::{Error, Result};
use crate::files::folder_of;
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::spooled;
use crate::store::Written;
use crate::store::large::{self, Progress};
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
    let Some(announced) = spooled::announced(model.as_ref()) else { return Ok(false) };
    let (mesh, tree) = (announced.mesh_bytes() as usize, params.peak_bytes(announced.triangles as usize));
    let in_memory = mesh.saturating_add(tree).saturating_add(PROCESS);
    Ok(in_memory > limit)
}

/// Reads the model, builds its tree and writes the scene file within the memory given.
pub fn build(args: &Args, params: &BuildParams, limit: usize) -> Result<Large> {
    let path = &args.models[0];
    let name = path.display().to_string();
    let start = Instant::now();
    let bar = Bar::new("reading");
    let (mesh, mut report) = spooled::read(path, folder_of(&args.output), &|part| bar.set(f64::from(part)))?;
    drop(bar);
    let read_seconds = start.elapsed().as_secs_f64();
    info!("read {name} in {}, to files", duration(read_seconds));

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
    let work = || large::build(&args.output, &mesh, params, limit - PROCESS, &name, &progress);
    let built = watch("building", || progress.fraction(), work)?;
    let seconds = start.elapsed().as_secs_f64();
    report.zero_area_triangles = built.zero_area_triangles;
    Ok(Large {
        model: ModelReport {
            model: name,
            triangles,
            vertices: mesh.positions.len(),
            read_seconds,
            read_report: Some(report),
        },
        tree: built.stats,
        seconds,
        memory: BuildMemory { announced: limit, counted: built.peak, resident: resident::peak() },
        parts: built.parts,
        written: built.written,
    })
}
