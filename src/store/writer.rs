//! A scene to a file.

use super::meta::Meta;
use super::out::{Out, length};
use super::section::{Kind, Section};
use crate::error::{Error, Result};
use crate::files::write_whole;
use crate::geometry::triangle::Triangle;
use crate::kdtree::{KdTree, Tree};
use crate::mesh::{Colors, Mesh};
use glam::Vec3;
use rayon::prelude::*;
use serde::Serialize;
use std::io::{self, Seek, Write};
use std::path::Path;

/// What was written.
#[derive(Clone, Debug, Serialize)]
pub struct Written {
    /// The file's length.
    pub bytes: u64,
    /// Its sections.
    pub sections: Vec<Section>,
}

/// Writes a scene file: a mesh and the tree that was built of it. `source` says in words what it was made of.
/// The file takes its name when it is complete and on the disk; what `path` held before stays until then, and on
/// failure nothing is left behind. `progress` is told now and then what part (0 to 1) is written.
///
/// # Errors
/// [`Error::Write`], or [`Error::Mesh`] if mesh and tree do not belong together or a colour is not finite.
pub fn write(
    path: &Path,
    mesh: &Mesh,
    tree: &KdTree,
    source: &str,
    progress: &dyn Fn(f64),
) -> Result<Written> {
    check(mesh, tree)?;
    let meta = serde_json::to_vec_pretty(&Meta::new(mesh, tree, source)).expect("it is plain data");
    let corner_colors = corner_colors(mesh);
    let arrays = tree.arrays();
    let mut sections: Vec<(Kind, &[u8])> = vec![
        (Kind::Meta, &meta),
        (Kind::Nodes, bytemuck::cast_slice(arrays.nodes)),
        (Kind::References, bytemuck::cast_slice(arrays.references)),
        (Kind::Upper, bytemuck::cast_slice(arrays.upper)),
        (Kind::Beneath, bytemuck::cast_slice(arrays.beneath)),
        (Kind::Pages, bytemuck::cast_slice(arrays.pages)),
        (Kind::Lines, bytemuck::cast_slice(arrays.lines)),
        (Kind::Triangles, bytemuck::cast_slice(arrays.triangles)),
        (Kind::Positions, bytemuck::cast_slice(&mesh.positions)),
        (Kind::Indices, bytemuck::cast_slice(&mesh.triangles)),
    ];
    match &mesh.colors {
        Colors::Uniform(_) => {}
        Colors::PerTriangle(colors) => sections.push((Kind::TriangleColors, colors.as_flattened())),
        Colors::PerVertex(colors) => {
            sections.push((Kind::VertexColors, colors.as_flattened()));
            sections.push((Kind::CornerColors, corner_colors.as_flattened().as_flattened()));
        }
        Colors::PerMaterial { of_triangle, .. } => {
            sections.push((Kind::MaterialOfTriangle, bytemuck::cast_slice(of_triangle)));
        }
    }
    let total = length(sections.iter().map(|(_, bytes)| bytes.len())) as f64;
    let part = |written: u64| progress(written as f64 / total);
    let mut written = None;
    write_whole(path, |out| {
        written = Some(fill(out, &sections, &part)?);
        Ok(())
    })?;
    Ok(written.expect("it was written"))
}

/// Writes a file of these sections; `progress` is told now and then how many bytes are written.
pub(super) fn fill(
    file: impl Write + Seek,
    sections: &[(Kind, &[u8])],
    progress: &dyn Fn(u64),
) -> io::Result<Written> {
    let mut out = Out::new(file, progress)?;
    for (kind, bytes) in sections {
        out.section(*kind, bytes)?;
    }
    out.finish()
}

/// Whether mesh and tree make one scene.
fn check(mesh: &Mesh, tree: &KdTree) -> Result<()> {
    let (triangles, vertices) = (mesh.triangles.len(), mesh.positions.len());
    let belongs = match &mesh.colors {
        Colors::Uniform(color) => color.is_finite(),
        Colors::PerTriangle(colors) => colors.len() == triangles,
        Colors::PerVertex(colors) => colors.len() == vertices,
        Colors::PerMaterial { materials, of_triangle } => {
            of_triangle.len() == triangles
                && of_triangle.iter().all(|&material| (material as usize) < materials.len())
                && materials.iter().all(|material| material.fault().is_none())
        }
    };
    if !belongs {
        return Err(Error::Mesh("its colours are not those of its triangles".into()));
    }
    let same = |(indices, triangle): (&[u32; 3], &Triangle)| {
        let corners = indices.map(|vertex| mesh.positions.get(vertex as usize).map(Vec3::to_array));
        matches!(corners, [Some(a), Some(b), Some(c)] if tree.scale().apply(&[a, b, c]) == triangle.corners)
    };
    let is_its = mesh.triangles.par_iter().zip(tree.triangles()).all(same);
    if tree.triangles().len() != triangles || !is_its {
        return Err(Error::Mesh("the tree is another mesh's".into()));
    }
    Ok(())
}

/// The colours of each triangle's corners, if vertices have them.
fn corner_colors(mesh: &Mesh) -> Vec<[[u8; 3]; 3]> {
    let Colors::PerVertex(colors) = &mesh.colors else { return Vec::new() };
    mesh.triangles.par_iter().map(|corners| corners.map(|vertex| colors[vertex as usize])).collect()
}
