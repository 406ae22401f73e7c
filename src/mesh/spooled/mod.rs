//! Meshes in files, for who cannot have them in memory.
//!
//! A PLY, OBJ or STL file is read from its beginning to its end, a glTF file's buffers primitive by primitive, and what
//! they hold goes to files on the way (`whole`); checking it is some passes over these (`check`). What comes out is the
//! mesh that [`read`](super::read()) gives, triangle by triangle.

mod behind;
mod check;
mod join;
mod whole;

use super::lists::InFiles;
use super::read::{Format, map};
use super::{Attributes, Colors, Image, Material, Mesh, ReadReport, gltf, obj, ply, stl};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::spool::{Spool, Spooled};
use crate::stage::Stage;
use behind::Behind;
pub(super) use behind::{in_small_pages, let_go};
use bytemuck::Pod;
use check::{Fault, check};
use glam::Vec3;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;
pub(super) use whole::Whole;

/// A [`Mesh`] whose arrays lie in files.
#[derive(Debug)]
pub struct SpooledMesh {
    /// Vertex positions, all finite.
    pub positions: Spooled<Vec3>,
    /// Three vertices for each triangle.
    pub triangles: Spooled<[u32; 3]>,
    /// What colour the triangles have.
    pub colors: SpooledColors,
    /// Texture coordinates and normals by triangle, if the model has any.
    pub attributes: Option<Spooled<Attributes>>,
    /// The pictures that materials' maps name.
    pub images: Vec<Image>,
    /// The box around all vertices.
    pub bounds: Aabb,
}

/// [`Colors`] that lie in files.
#[derive(Debug)]
pub enum SpooledColors {
    /// One colour for everything.
    Uniform(Vec3),
    /// One sRGB-encoded colour a triangle.
    PerTriangle(Spooled<[u8; 3]>),
    /// One sRGB-encoded colour a vertex.
    PerVertex(Spooled<[u8; 3]>),
    /// Named materials, and for each triangle an index into them.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
        /// One index a triangle.
        of_triangle: Spooled<u32>,
    },
}

impl SpooledMesh {
    /// A copy of a mesh, in files in `folder`, which vanish with it.
    ///
    /// # Errors
    /// There is no room.
    pub fn of_mesh(mesh: &Mesh, folder: &Path) -> io::Result<Self> {
        let colors = match &mesh.colors {
            Colors::Uniform(color) => SpooledColors::Uniform(*color),
            Colors::PerTriangle(colors) => SpooledColors::PerTriangle(spooled(colors, folder)?),
            Colors::PerVertex(colors) => SpooledColors::PerVertex(spooled(colors, folder)?),
            Colors::PerMaterial { materials, of_triangle } => SpooledColors::PerMaterial {
                materials: materials.clone(),
                of_triangle: spooled(of_triangle, folder)?,
            },
        };
        let attributes = (!mesh.attributes.is_empty()).then(|| spooled(&mesh.attributes, folder));
        Ok(Self {
            positions: spooled(&mesh.positions, folder)?,
            triangles: spooled(&mesh.triangles, folder)?,
            colors,
            attributes: attributes.transpose()?,
            images: mesh.images.clone(),
            bounds: mesh.bounds(),
        })
    }

    /// A copy in memory.
    ///
    /// # Errors
    /// The files cannot be read.
    pub fn to_mesh(&self) -> io::Result<Mesh> {
        let colors = match &self.colors {
            SpooledColors::Uniform(color) => Colors::Uniform(*color),
            SpooledColors::PerTriangle(colors) => Colors::PerTriangle(colors.to_vec()?),
            SpooledColors::PerVertex(colors) => Colors::PerVertex(colors.to_vec()?),
            SpooledColors::PerMaterial { materials, of_triangle } => {
                Colors::PerMaterial { materials: materials.clone(), of_triangle: of_triangle.to_vec()? }
            }
        };
        Ok(Mesh {
            positions: self.positions.to_vec()?,
            triangles: self.triangles.to_vec()?,
            colors,
            attributes: self.attributes.as_ref().map_or(Ok(Vec::new()), Spooled::to_vec)?,
            images: self.images.clone(),
        })
    }
}

/// A list in a file.
fn spooled<T: Pod>(list: &[T], folder: &Path) -> io::Result<Spooled<T>> {
    let mut spool = Spool::new(folder)?;
    spool.extend_from_slice(list);
    spool.finish()
}

/// What is known of a model before it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Announced {
    /// Vertices in the file.
    pub vertices: u64,
    /// Triangles; a polygon of a PLY file counts as one, and strips as many as there may be at most.
    pub triangles: u64,
    /// Whether triangles may have texture coordinates or normals.
    pub attributes: bool,
}

impl Announced {
    /// Both models together.
    pub fn and(self, other: Self) -> Self {
        Self {
            vertices: self.vertices.saturating_add(other.vertices),
            triangles: self.triangles.saturating_add(other.triangles),
            attributes: self.attributes || other.attributes,
        }
    }

    /// About how many bytes its mesh takes in memory.
    pub fn mesh_bytes(&self) -> u64 {
        /// An index of a material, or a colour.
        const COLOR: u64 = 4;
        let attributes = if self.attributes { size_of::<Attributes>() as u64 } else { 0 };
        let triangle = size_of::<[u32; 3]>() as u64 + COLOR + attributes;
        let vertices = self.vertices.saturating_mul(size_of::<Vec3>() as u64);
        vertices.saturating_add(self.triangles.saturating_mul(triangle))
    }
}

/// How much a PLY or binary STL file announces in its header, and a glTF file in its JSON, and how much is in an OBJ or
/// ASCII STL file, which is looked through for that; `None` for what cannot be read.
pub fn announced(path: &Path) -> Option<Announced> {
    match Format::of(path).ok()? {
        Format::Ply => {
            /// Headers are shorter.
            const BEGINNING: u64 = 1 << 16;
            let mut bytes = Vec::new();
            let file = File::open(path).ok()?;
            let size = file.metadata().ok()?.len();
            file.take(BEGINNING).read_to_end(&mut bytes).ok()?;
            ply::announced(&bytes, size)
        }
        Format::Obj => {
            let bytes = map(path).ok()?;
            let behind = Behind::new(&bytes);
            Some(obj::count(&bytes, &|part| behind.release(part)))
        }
        Format::Stl => {
            let bytes = map(path).ok()?;
            let behind = Behind::new(&bytes);
            stl::announced(&bytes, &|part| behind.release(part))
        }
        Format::Gltf => gltf::count(&map(path).ok()?),
    }
}

/// Reads a model to files in `folder`, which vanish with the mesh. `progress` is told now and then what part (0 to 1) is
/// behind. Takes a bit and a half for each vertex, some megabytes, and an OBJ or glTF file's materials; of a glTF file,
/// all of its JSON; of an STL file, a bit and a half for each corner, and some ten megabytes more.
///
/// # Errors
/// As [`read`](super::read()), or there is no room in `folder`.
pub fn read(path: &Path, folder: &Path, progress: &dyn Fn(f32)) -> Result<(SpooledMesh, ReadReport)> {
    let malformed = |message: String| Error::malformed(path, message);
    let format = Format::of(path)?;
    let bytes = map(path).map_err(|source| Error::Read { path: path.into(), source })?;
    let lists = InFiles::new(folder);
    let mut report = ReadReport::default();
    let behind = Behind::new(&bytes);
    // Welding an STL file's corners takes longer than reading them.
    let reading = if matches!(format, Format::Stl) { 0.2 } else { 0.7 };
    let told = |part: f32| {
        behind.release(part);
        progress(reading * part);
    };
    let whole = match format {
        Format::Ply => {
            let raw = ply::parse_to(&lists, &bytes, &mut report, &told).map_err(malformed)?;
            Whole::of_ply(raw, &lists, &mut report)
        }
        Format::Obj => {
            let raw = obj::parse_to(&lists, &bytes, path, &mut report, &told).map_err(malformed)?;
            Whole::of_obj(raw, &lists)
        }
        Format::Gltf => {
            in_small_pages(&bytes);
            let let_go = || let_go(&bytes, 0..bytes.len());
            let told = |part: f32| progress(reading * part);
            let raw = gltf::parse_to(&lists, &bytes, path, &mut report, &told, Some(&let_go));
            Whole::of_gltf(raw.map_err(malformed)?)
        }
        Format::Stl => {
            let raw = stl::parse_to(&lists, &bytes, &mut report, &told).map_err(malformed)?;
            Whole::of_stl(raw, &lists, &|part| progress(reading + (0.7 - reading) * part))
        }
    };
    drop(bytes);
    let whole = whole.map_err(|source| Error::Write { path: folder.into(), source })?;
    let mesh = whole.checked(&lists, path, &mut report, &|part| progress(0.7 + 0.3 * part))?;
    Ok((mesh, report))
}

impl Whole {
    /// The mesh that it is, by the policy of [`check`](super::check). `path` is what errors name.
    pub(super) fn checked(
        self,
        lists: &InFiles,
        path: &Path,
        report: &mut ReadReport,
        progress: &dyn Fn(f32),
    ) -> Result<SpooledMesh> {
        let (vertices, faces) = (self.positions.len(), self.triangles.len());
        Stage::Checking.begin();
        check(self, lists.folder(), report, progress).map_err(|fault| match fault {
            Fault::Io(source) => Error::Write { path: lists.folder().into(), source },
            Fault::Unusable(unusable) => Error::malformed(path, unusable.message(vertices, faces)),
        })
    }
}
