//! Scene files of meshes that lie in files: what [`write()`](super::write()) does, within so much memory.
//!
//! The mesh's sections and its triangles' records go into the scene file first. From there the tree's builder
//! ([`crate::kdtree::outer`]) reads the records; its arrays grow in files beside, and become sections when all
//! of the tree is known. What the file holds is, section by section, what the other way writes, but for the
//! order of the sections and for `build_peak` in `meta`.
//!
//! Beside the scene file there is room needed for the mesh in files, for the arrays (some 36 bytes a triangle) and
//! for references (32 bytes each), all of which vanish, whatever happens.

mod arrays;
mod shelf;
mod surfaces;

use super::checksum::BLOCK;
use super::meta::{ColorMeta, ENGINE, Meta};
use super::out::Out;
use super::pictures;
use super::section::Kind;
use super::writer::{Written, missing};
use crate::error::{Error, Result};
use crate::files::{folder_of, write_or};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::outer::{self, Array, Job, Outline, Triangles};
use crate::kdtree::{BuildParams, BuildProgress, Scale, TreeStats};
use crate::mesh::spooled::{SpooledColors, SpooledMesh};
use crate::spool::Spooled;
use crate::stage::Stage;
use arrays::Arrays;
use shelf::FileShelf;
use std::fs::File;
use std::io::{self, BufWriter};
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// What was built and written.
#[derive(Debug)]
pub struct Built {
    /// The file.
    pub written: Written,
    /// Its tree.
    pub stats: TreeStats,
    /// The most bytes that the tree's builder held.
    pub peak: usize,
    /// In how many parts the tree was built.
    pub parts: usize,
    /// Triangles whose corners lie on one line.
    pub zero_area_triangles: u64,
}

/// How far a build has come; safe to read from another thread.
#[derive(Debug, Default)]
pub struct Progress {
    tree: BuildProgress,
    /// Of the work on surfaces and sections, in millionths.
    rest: AtomicU64,
}

impl Progress {
    /// A part of 1.
    pub fn fraction(&self) -> f64 {
        0.7 * self.tree.fraction() + 0.3e-6 * self.rest.load(Relaxed) as f64
    }

    fn set(&self, part: f64) {
        self.rest.store((part * 1e6) as u64, Relaxed);
    }
}

/// What a build takes beside the builder's arrays: lists on their way to and from files.
const BESIDE: usize = 16 << 20;

/// The least memory in bytes that [`build`] takes with these settings, for a mesh of so many triangles.
pub fn least_bytes(params: &BuildParams, triangles: usize) -> usize {
    params.least_outer_bytes() + beside(triangles)
}

/// What is in memory beside the tree's builder: lists on their way, and checksums of the file.
fn beside(triangles: usize) -> usize {
    /// More than files have.
    const BYTES_PER_TRIANGLE: usize = 200;
    BESIDE + triangles * BYTES_PER_TRIANGLE / BLOCK * size_of::<u32>()
}

/// Builds a scene file of a mesh within so many bytes of memory. `source` says in words what the mesh was made
/// of. As with [`write()`](super::write()), there is a whole file in the end, or what was there before.
///
/// # Errors
/// [`Error::Write`], [`Error::Read`], or as [`outer::build`].
pub fn build(
    path: &Path,
    mesh: &SpooledMesh,
    params: &BuildParams,
    memory: usize,
    source: &str,
    progress: &Progress,
) -> Result<Built> {
    params.check()?;
    let folder = folder_of(path);
    let cannot = |source: io::Error| Error::Write { path: path.into(), source };
    write_or(path, |file| {
        let mut out = Out::new(file, &|_| ()).map_err(cannot)?;
        let scale = Scale::of_bounds(&mesh.bounds);
        Stage::Surfaces.begin();
        let surfaces =
            surfaces::write(&mut out, mesh, scale, &|part| progress.set(0.5 * part)).map_err(cannot)?;

        let records = Records {
            list: Spooled::in_file(
                Arc::new(read_side(&mut out).map_err(cannot)?),
                surfaces.records,
                mesh.triangles.len(),
            ),
            path,
        };
        let shelf = FileShelf::new(folder, path)?;
        let mut arrays = Arrays::new(folder, path)?;
        let job = Job {
            triangles: &records,
            bounds: surfaces.bounds,
            params,
            memory: memory.saturating_sub(beside(mesh.triangles.len())),
            shelf: &shelf,
            progress: Some(&progress.tree),
        };
        let outline = outer::build(&job, &mut arrays)?;
        drop(shelf);

        Stage::Writing.begin();
        out.resume().map_err(cannot)?;
        write_tree(&mut out, arrays, &outline, progress).map_err(cannot)?;
        let Outline { stats, largest_page, spread, peak, parts, .. } = outline;
        let Aabb { min, max } = surfaces.bounds;
        let meta = Meta {
            engine: ENGINE.into(),
            source: source.into(),
            triangles: mesh.triangles.len() as u64,
            vertices: mesh.positions.len() as u64,
            bounds: [min.to_array(), max.to_array()],
            scale_exponent: scale.exponent(),
            params: params.clone(),
            build_peak: peak,
            largest_leaf: stats.largest_leaf,
            largest_page,
            spread,
            stats: stats.clone(),
            pools: None,
            colors: color_meta(&mesh.colors),
            uses: surfaces.uses,
            attributes: mesh.attributes.is_some(),
            normals: surfaces.normals,
            images: pictures::write(&mut out, &mesh.images).map_err(cannot)?,
        };
        let missing_images = missing(&mesh.images, &meta.images);
        let meta = serde_json::to_vec_pretty(&meta).expect("it is plain data");
        out.section(Kind::Meta, &meta).map_err(cannot)?;
        let written = Written { missing_images, ..out.finish().map_err(cannot)? };
        progress.set(1.0);
        Ok(Built { written, stats, peak, parts, zero_area_triangles: surfaces.zero_area })
    })
}

/// The file that is being written, to be read where it is written.
fn read_side(out: &mut Out<'_, &mut BufWriter<File>>) -> io::Result<File> {
    out.flushed()?.get_ref().try_clone()
}

/// Makes sections of a tree's arrays.
fn write_tree(
    out: &mut Out<'_, &mut BufWriter<File>>,
    arrays: Arrays<'_>,
    outline: &Outline,
    progress: &Progress,
) -> io::Result<()> {
    const KINDS: [(Array, Kind); 6] = [
        (Array::Nodes, Kind::Nodes),
        (Array::References, Kind::References),
        (Array::Upper, Kind::Upper),
        (Array::Beneath, Kind::Beneath),
        (Array::Pages, Kind::Pages),
        (Array::Lines, Kind::Lines),
    ];
    let lists = arrays.finish()?;
    for (done, ((array, kind), list)) in KINDS.into_iter().zip(lists).enumerate() {
        out.begin(kind)?;
        if array == Array::Lines {
            let lines = Spooled::in_file(list.file(), 0, list.len() / kind.element());
            outline
                .plan
                .each(|first, into| lines.read(first, into), |lines| out.put(bytemuck::cast_slice(lines)))?;
        } else {
            list.each(|_, bytes| out.put(bytes))?;
        }
        out.end()?;
        progress.set(0.5 + 0.5 * (done + 1) as f64 / KINDS.len() as f64);
    }
    Ok(())
}

fn color_meta(colors: &SpooledColors) -> ColorMeta {
    match colors {
        SpooledColors::Uniform(color) => ColorMeta::Uniform { color: color.to_array() },
        SpooledColors::PerTriangle(_) => ColorMeta::PerTriangle,
        SpooledColors::PerVertex(_) => ColorMeta::PerVertex,
        SpooledColors::PerMaterial { materials, .. } => {
            ColorMeta::PerMaterial { materials: materials.clone() }
        }
    }
}

/// The triangles' records, in the scene file.
struct Records<'a> {
    list: Spooled<Triangle>,
    path: &'a Path,
}

impl Triangles for Records<'_> {
    fn count(&self) -> usize {
        self.list.len()
    }

    fn read(&self, first: usize, into: &mut [Triangle]) -> Result<()> {
        self.list.read(first, into).map_err(|source| Error::Read { path: self.path.into(), source })
    }
}
