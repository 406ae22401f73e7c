//! From a model's name to a mesh, and to a tree.

use super::memory::Beside;
use super::options::BuildOptions;
use super::progress::{Bar, watch};
use super::report::{bytes, duration};
use super::scene::{BuildMemory, Looks, Origin, Scene};
use crate::error::{Error, Result};
use crate::kdtree::{BuildParams, BuildProgress};
use crate::mesh::generate::plant;
use crate::mesh::{self, Mesh, ReadReport};
use crate::simd::Isa;
use crate::stage::Stage;
use crate::store::{self, is_scene};
use crate::study::resident::Resident;
use crate::traverse::Accel;
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
    /// What the reader has to say; `None` for what came from no model's file.
    pub report: Option<ReadReport>,
    /// The time that it took to read or generate.
    pub seconds: f64,
}

impl Model {
    /// Reads a model's file, or the mesh in a scene file.
    pub fn read(path: &Path) -> Result<Self> {
        let start = Instant::now();
        let (mesh, report) = if is_scene(path) {
            (store::File::open(path)?.mesh()?, None)
        } else {
            Stage::Reading.begin();
            let bar = Bar::new("reading");
            let loaded = mesh::read_with_progress(path, &|fraction| bar.set(f64::from(fraction)));
            let loaded = loaded.map_err(or_scene)?;
            (loaded.mesh, Some(loaded.report))
        };
        let seconds = start.elapsed().as_secs_f64();
        info!("read {} in {}", path.display(), duration(seconds));
        Ok(Self { name: path.display().to_string(), mesh, report, seconds })
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
        self.build_fitting(&params, isa)
    }

    /// The same, where the memory given is for everything that the process takes.
    ///
    /// # Errors
    /// Likewise.
    pub fn build_beside(
        self,
        params: &BuildParams,
        isa: Isa,
        limit: usize,
        beside: &Beside<'_>,
    ) -> Result<Scene> {
        let mut params = params.clone();
        let announced = beside.fit(&self.mesh, &mut params, limit)?;
        info!(
            "all will take {} at most, with max_duplication {:.2}",
            bytes(announced as u64),
            params.max_duplication
        );
        Ok(Scene { announced: Some(announced), ..self.build_fitting(&params, isa)? })
    }

    /// The same, with parameters that fit.
    fn build_fitting(self, params: &BuildParams, isa: Isa) -> Result<Scene> {
        let announced = params.peak_bytes(self.mesh.triangles.len());
        info!("the build will take {} at most", bytes(announced as u64));
        let resident = Resident::start();
        let start = Instant::now();
        let progress = BuildProgress::default();
        Stage::Building.begin();
        let accel = watch(
            "building",
            || progress.fraction(),
            || Accel::build_with_progress(&self.mesh, params, &progress),
        )?;
        let build_seconds = start.elapsed().as_secs_f64();
        info!("built the tree in {}", duration(build_seconds));
        let resident = resident.and_then(|resident| resident.rise());
        let build_memory = BuildMemory { announced, counted: accel.tree().build_peak(), resident };
        let tree = accel.stats();
        Ok(Scene {
            name: self.name,
            vertices: self.mesh.positions.len() as u64,
            accel: accel.with_isa(isa),
            tree,
            looks: Looks::Mesh(self.mesh),
            origin: Origin::Built {
                read_seconds: self.seconds,
                read_report: self.report.map(Box::new),
                build_seconds,
                build_memory,
            },
            announced: None,
        })
    }
}

/// The same error; what kind of file is understood includes scene files.
fn or_scene(error: Error) -> Error {
    match error {
        Error::UnknownFormat { path, .. } => {
            let expected = "a model is a .obj, .ply, .stl, .gltf or .glb file, or a .rpk scene file";
            Error::UnknownFormat { path, expected }
        }
        other => other,
    }
}
