//! Wavefront OBJ with its MTL files, through `tobj`.
//!
//! tobj does the parsing; `feed` stands before it and `mtl` beside it, because tobj alone
//! misreads or panics on files that are common: an error names no line, vertex colours shift where
//! only some vertices have them, a tab after a keyword is fatal, so is one Latin-1 letter in a
//! comment, a MTL line `Kd 0.5` panics, and so can a texture index out of range. Normals and texture
//! coordinates, which nothing here uses, never reach it; what this saves pays for the checks (the
//! 148 MB kitchen: 1.6 s, as with tobj alone on the mapped file; 1.8 s through a `BufReader`).
//!
//! Polygons become fans around their first corner. That is right for convex polygons and for
//! concave ones that the first corner sees whole; others come out with overlapping triangles, as
//! in most readers. A triangle's colour is that of its vertices if the file has vertex colours
//! (`v x y z r g b`), otherwise its material's `Kd`, taken as linear light.

mod feed;
mod mtl;

use super::color::{self, Colors};
use super::material::{self, Material};
use super::{Mesh, ReadReport};
use feed::Feed;
use glam::Vec3;
use mtl::Library;
use std::path::Path;

/// No normals and texture coordinates ever reach tobj, so the position alone is a vertex.
const OPTIONS: tobj::LoadOptions =
    tobj::LoadOptions { single_index: true, triangulate: true, ignore_points: true, ignore_lines: true };

/// Parses an OBJ file's bytes; MTL files are looked up beside `path`.
pub(super) fn parse(
    bytes: &[u8],
    path: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<Mesh, String> {
    let folder = path.parent().unwrap_or(Path::new(""));
    // Colours on some vertices only would shift tobj's list of them: then every vertex gets one.
    let mut all_colored = false;
    loop {
        let library = Library::beside(folder);
        let mut feed = Feed::new(bytes, &library, all_colored, progress);
        let parsed = tobj::load_obj_buf(&mut feed, &OPTIONS, |file| library.load(file));
        if let Some(message) = feed.error.take() {
            return Err(message);
        }
        if !all_colored && feed.colored_vertices > 0 && feed.colored_vertices < feed.vertices() {
            all_colored = true;
            continue;
        }
        let (models, materials) = parsed.map_err(|e| format!("line {}: {e}", feed.line))?;
        if feed.vertices() > u64::from(u32::MAX) {
            return Err(format!(
                "{} vertices, at most {} are possible; split the model",
                feed.vertices(),
                u32::MAX
            ));
        }
        feed.refuse_non_finite()?;
        let colored = feed.colored_vertices > 0;
        feed.report(report);
        library.report(report);
        return Ok(merge(models, materials.unwrap_or_default(), colored));
    }
}

/// All models as one mesh.
fn merge(models: Vec<tobj::Model>, materials: Vec<tobj::Material>, colored: bool) -> Mesh {
    let vertices = models.iter().map(|m| m.mesh.positions.len() / 3).sum();
    let triangles = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices),
        triangles: Vec::with_capacity(triangles),
        ..Default::default()
    };
    let has_material = |m: &tobj::Model| m.mesh.material_id.is_some();
    let by_material = !colored && models.iter().any(has_material);
    let mut of_triangle = Vec::with_capacity(if by_material { triangles } else { 0 });
    let mut vertex_colors = Vec::with_capacity(if colored { vertices } else { 0 });
    let no_material = materials.len() as u32;
    let mut some_without = false;
    for tobj::Model { mesh: model, .. } in models {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(model.positions.as_chunks().0.iter().map(|&p| Vec3::from_array(p)));
        mesh.triangles.extend(model.indices.as_chunks().0.iter().map(|t: &[u32; 3]| t.map(|i| base + i)));
        if colored {
            vertex_colors.extend_from_slice(model.vertex_color.as_chunks::<3>().0);
        } else if by_material {
            let material = model.material_id.map_or(no_material, |m| m as u32);
            some_without |= material == no_material && !model.indices.is_empty();
            of_triangle.resize(mesh.triangles.len(), material);
        }
    }
    if colored {
        mesh.colors = Colors::PerVertex(color::quantize(&vertex_colors));
    } else if by_material {
        let mut materials: Vec<Material> = materials.into_iter().map(mtl::material).collect();
        if some_without {
            materials.push(Material::matt("(none)", material::DEFAULT_DIFFUSE));
        }
        mesh.colors = Colors::PerMaterial { materials, of_triangle };
    }
    mesh
}
