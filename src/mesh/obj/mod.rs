//! Wavefront OBJ with its MTL files.
//!
//! The reader is our own. `tobj`, the best-kept crate, was used first. It makes several vertices of one that is used
//! in several groups, it has no way to put what it reads into files, and it misreads or panics on files that are
//! common: an error names no line, vertex colours shift where only some vertices have them, a tab after a keyword is
//! fatal, so is one Latin-1 letter in a comment, and `Kd 0.5` or a texture index out of range can make it panic. It is
//! the judge in the tests.
//!
//! `reader` takes the file line by line, to lists in memory or in files; `vertices` and `corners` are what it fills.
//! Normals and texture coordinates are a triangle's: a vertex stays one, whatever its faces say of it. `mtl` reads
//! the lines of MTL files, and `material` says what they mean.
//!
//! Polygons become fans around their first corner. That is right for convex polygons and for
//! concave ones that the first corner sees whole; others come out with overlapping triangles, as
//! in most readers. A triangle's colour is that of its vertices if the file has vertex colours
//! (`v x y z r g b`), otherwise its material's `Kd`, taken as linear light. Of materials with pictures, or through
//! which light goes, or that mirror or give off light, none is given up for vertex colours: these are left out then,
//! and counted. Smoothing groups say nothing that normals do not; a file without normals is drawn flat.

mod corners;
mod images;
mod library;
mod lines;
mod material;
mod mtl;
mod reader;
mod texture;
mod vertices;

use super::color::{self, Colors};
use super::lists::{InMemory, Lists};
use super::material::{DEFAULT_DIFFUSE, Material};
use super::spooled::Announced;
use super::{Image, Mesh, ReadReport};
pub(super) use corners::Corners;
use glam::Vec3;
use library::Library;
use lines::{Lines, split_keyword, words};
use reader::{Reader, UNKNOWN};
use std::path::Path;

/// What an OBJ file holds, as it stands there.
pub(super) struct Raw<L: Lists> {
    pub positions: L::Of<Vec3>,
    pub triangles: L::Of<[u32; 3]>,
    /// Vertices' colours, sRGB-encoded, if they count.
    pub of_vertices: Option<L::Of<[f32; 3]>>,
    /// Materials, if they count, and that of each triangle.
    pub of_materials: Option<(Vec<Material>, L::Of<u32>)>,
    /// Whether some triangles' material is not among these: see [`known`].
    pub any_unknown: bool,
    /// The pictures that materials name.
    pub images: Vec<Image>,
    pub corners: Corners<L>,
}

/// Parses an OBJ file's bytes; MTL files are looked up beside `path`.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let mut raw = parse_to(&InMemory, bytes, path, report, progress)?;
    let attributes = raw.corners.attributes(raw.triangles.len());
    let mut mesh =
        Mesh { positions: raw.positions, triangles: raw.triangles, attributes, ..Default::default() };
    if let Some(colors) = raw.of_vertices {
        mesh.colors = Colors::PerVertex(color::quantize(&colors));
    } else if let Some((mut materials, mut of_triangle)) = raw.of_materials.take() {
        if raw.any_unknown {
            let known = known(&mut materials);
            of_triangle.iter_mut().for_each(|material| *material = known(*material));
        }
        mesh.colors = Colors::PerMaterial { materials, of_triangle };
        mesh.images = raw.images;
    }
    Ok(mesh)
}

/// Parses an OBJ file's bytes, to lists of a kind.
pub(super) fn parse_to<L: Lists>(
    lists: &L,
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Raw<L>, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    let mut reader = Reader::new(lists, Library::beside(folder))?;
    reader.read(Lines::new(bytes, progress))?;
    let raw = reader.finish(report);
    raw.corners.count_bad(report);
    Ok(raw)
}

/// Adds a material for triangles that none is known of; what gives them that.
pub(super) fn known(materials: &mut Vec<Material>) -> impl Fn(u32) -> u32 + use<> {
    let none = materials.len() as u32;
    materials.push(Material::matt("(none)", DEFAULT_DIFFUSE));
    move |material| if material == UNKNOWN { none } else { material }
}

/// How much is in an OBJ file, whether or not it can be read.
pub(super) fn count(bytes: &[u8], progress: &dyn Fn(f32)) -> Announced {
    let mut found = Announced { vertices: 0, triangles: 0, attributes: false };
    let mut lines = Lines::new(bytes, progress);
    while let Some(line) = lines.take() {
        let (keyword, rest) = split_keyword(line.trim_ascii());
        match keyword {
            b"v" => found.vertices += 1,
            b"f" => found.triangles += (words(rest).count() as u64).saturating_sub(2),
            b"vt" | b"vn" => found.attributes = true,
            _ => {}
        }
    }
    found
}
