//! Wavefront OBJ with its MTL files, through `tobj`.
//!
//! tobj does the parsing of vertices and faces; `feed` stands before it, because tobj alone misreads or panics on
//! files that are common: an error names no line, vertex colours shift where only some vertices have them, a tab
//! after a keyword is fatal, so is one Latin-1 letter in a comment, and a texture index out of range can make it
//! panic. Normals and texture coordinates never reach it, they would make several vertices of one; `corners` keeps
//! them by triangle, and what this saves pays for the checks. MTL files do not reach it either: a line `Kd 0.5` makes
//! it panic, and it knows no options before a picture's name. `mtl` reads their lines, and `material` says what they
//! mean.
//!
//! Polygons become fans around their first corner. That is right for convex polygons and for
//! concave ones that the first corner sees whole; others come out with overlapping triangles, as
//! in most readers. A triangle's colour is that of its vertices if the file has vertex colours
//! (`v x y z r g b`), otherwise its material's `Kd`, taken as linear light. Of materials with pictures, or through
//! which light goes, or that mirror or give off light, none is given up for vertex colours: these are left out then,
//! and counted. Smoothing groups say nothing that normals do not; a file without normals is drawn flat.

mod corners;
mod feed;
mod images;
mod library;
mod material;
mod mtl;
mod texture;

use super::color::{self, Colors};
use super::material::{DEFAULT_DIFFUSE, Material};
use super::{Mesh, ReadReport};
use feed::{Extras, Feed};
use glam::Vec3;
use library::Library;
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
        let mut feed = Feed::new(bytes, Library::beside(folder), all_colored, progress);
        // No `mtllib` reaches tobj.
        let parsed = tobj::load_obj_buf(&mut feed, &OPTIONS, |_| Ok(Default::default()));
        if let Some(message) = feed.error.take() {
            return Err(message);
        }
        if !all_colored && feed.colored_vertices > 0 && feed.colored_vertices < feed.vertices() {
            all_colored = true;
            continue;
        }
        let (models, _) = parsed.map_err(|e| format!("line {}: {e}", feed.line))?;
        if feed.vertices() > u64::from(u32::MAX) {
            return Err(format!(
                "{} vertices, at most {} are possible; split the model",
                feed.vertices(),
                u32::MAX
            ));
        }
        feed.refuse_non_finite()?;
        return merge(models, feed.finish(report), report);
    }
}

/// All models as one mesh, with what its triangles have.
fn merge(models: Vec<tobj::Model>, extras: Extras, report: &mut ReadReport) -> Result<Mesh, String> {
    let Extras { colored_vertices, mut materials, images, runs, triangles, attributes } = extras;
    let found: usize = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
    if found != triangles {
        return Err(format!(
            "its faces make {triangles} triangles, but {found} were found; please report this"
        ));
    }
    let vertices = models.iter().map(|m| m.mesh.positions.len() / 3).sum();
    let known = |(_, material): &(usize, Option<u32>)| material.is_some();
    let by_material = runs.iter().any(known)
        && (colored_vertices == 0
            || runs.iter().filter_map(|run| run.1).any(|m| outdoes_colors(&materials[m as usize])));
    let colored = colored_vertices > 0 && !by_material;
    report.unused_vertex_colors += if colored { 0 } else { colored_vertices };
    let mut mesh = Mesh {
        positions: Vec::with_capacity(vertices),
        triangles: Vec::with_capacity(triangles),
        attributes,
        ..Default::default()
    };
    let mut vertex_colors = Vec::with_capacity(if colored { vertices } else { 0 });
    for tobj::Model { mesh: model, .. } in models {
        let base = mesh.positions.len() as u32;
        mesh.positions.extend(model.positions.as_chunks().0.iter().map(|&p| Vec3::from_array(p)));
        mesh.triangles.extend(model.indices.as_chunks().0.iter().map(|t: &[u32; 3]| t.map(|i| base + i)));
        if colored {
            vertex_colors.extend_from_slice(model.vertex_color.as_chunks::<3>().0);
        }
    }
    if colored {
        mesh.colors = Colors::PerVertex(color::quantize(&vertex_colors));
    } else if by_material {
        let of_triangle = of_triangles(&runs, triangles, &mut materials);
        mesh.colors = Colors::PerMaterial { materials, of_triangle };
        mesh.images = images;
    }
    Ok(mesh)
}

/// Whether what a material says beside its colour counts for more than vertices' colours.
fn outdoes_colors(material: &Material) -> bool {
    let Material { unlit, reflects, transmission, opacity, emission, maps, .. } = material;
    *unlit
        || *reflects
        || *opacity < 1.0
        || [transmission, emission].iter().any(|light| **light != Vec3::ZERO)
        || maps.all().next().is_some()
}

/// The material of each triangle. One that is nowhere defined is added if any triangle has none.
fn of_triangles(runs: &[(usize, Option<u32>)], triangles: usize, materials: &mut Vec<Material>) -> Vec<u32> {
    let none = materials.len() as u32;
    let mut of_triangle = Vec::with_capacity(triangles);
    let mut current = none;
    for &(first, material) in runs {
        of_triangle.resize(first, current);
        current = material.unwrap_or(none);
    }
    of_triangle.resize(triangles, current);
    if of_triangle.contains(&none) {
        materials.push(Material::matt("(none)", DEFAULT_DIFFUSE));
    }
    of_triangle
}
