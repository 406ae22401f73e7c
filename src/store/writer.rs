//! A scene to a file.

use super::meta::{ImageMeta, Meta};
use super::out::{Out, length};
use super::pictures;
use super::record::{SurfaceRecord, is_finite};
use super::section::{Kind, Section};
use crate::error::{Error, Result};
use crate::files::write_whole;
use crate::geometry::triangle::Triangle;
use crate::kdtree::{KdTree, Tree};
use crate::mesh::{Colors, Image, ImageSource, Mesh};
use crate::stage::Stage;
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
    /// What is wrong with pictures that could not be read, and are missing in the file: lines that begin with
    /// their names. Those that were missing before are not among them.
    pub missing_images: Vec<String>,
}

/// Writes a scene file: a mesh and the tree that was built of it, its pools if they have been made, with the pictures that its
/// materials name.
/// `source` says in words what it was made of.
/// The file takes its name when it is complete and on the disk; what `path` held before stays until then, and on
/// failure nothing is left behind. `progress` is told now and then what part (0 to 1) is written.
///
/// # Errors
/// [`Error::Write`], or [`Error::Mesh`] if mesh and tree do not belong together, or a colour or a texture coordinate
/// is not finite. A picture that cannot be read is no error: see [`Written::missing_images`].
pub fn write(
    path: &Path,
    mesh: &Mesh,
    tree: &KdTree,
    source: &str,
    progress: &dyn Fn(f64),
) -> Result<Written> {
    check(mesh, tree)?;
    let corner_colors = corner_colors(mesh);
    let emitters = mesh.colors.emitters();
    let arrays = tree.arrays();
    let mut sections: Vec<(Kind, &[u8])> = vec![
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
    if let Some(pools) = arrays.pools {
        sections.push((Kind::PoolNodes, bytemuck::cast_slice(pools.nodes())));
        sections.push((Kind::PoolWords, bytemuck::cast_slice(pools.words())));
    }
    match &mesh.colors {
        Colors::Uniform(_) => {}
        Colors::PerTriangle(colors) => sections.push((Kind::TriangleColors, colors.as_flattened())),
        Colors::PerVertex(colors) => {
            sections.push((Kind::VertexColors, colors.as_flattened()));
            sections.push((Kind::CornerColors, corner_colors.as_flattened().as_flattened()));
        }
        Colors::PerMaterial { of_triangle, .. } if mesh.attributes.is_empty() => {
            sections.push((Kind::MaterialOfTriangle, bytemuck::cast_slice(of_triangle)));
        }
        // The records have them.
        Colors::PerMaterial { .. } => {}
    }
    if !emitters.is_empty() {
        sections.push((Kind::Emitters, bytemuck::cast_slice(&emitters)));
    }
    let rest = [mesh.attributes.len() * size_of::<SurfaceRecord>(), pictures::about(&mesh.images)];
    let total = length(sections.iter().map(|(_, bytes)| bytes.len()).chain(rest)) as f64;
    // What is told last is told once all is on the disk: what pictures take is known no earlier.
    let part = |written: u64| progress((written as f64 / total).min(0.999));
    let mut meta = Meta::new(mesh, tree, source);
    let mut written = None;
    write_whole(path, |file| {
        Stage::Writing.begin();
        let mut out = Out::new(file, &part)?;
        for (kind, bytes) in &sections {
            out.section(*kind, bytes)?;
        }
        write_records(&mut out, mesh)?;
        meta.images = pictures::write(&mut out, &mesh.images)?;
        out.section(Kind::Meta, &serde_json::to_vec_pretty(&meta).expect("it is plain data"))?;
        written = Some(out.finish()?);
        Ok(())
    })?;
    progress(1.0);
    let missing_images = missing(&mesh.images, &meta.images);
    Ok(Written { missing_images, ..written.expect("it was written") })
}

/// Writes the section `surface-records`, if the mesh has attributes.
fn write_records(out: &mut Out<'_, impl Write + Seek>, mesh: &Mesh) -> io::Result<()> {
    /// Records that are made at once.
    const AT_ONCE: usize = 1 << 14;
    if mesh.attributes.is_empty() {
        return Ok(());
    }
    out.begin(Kind::SurfaceRecords)?;
    let count = mesh.attributes.len() as u32;
    for first in (0..count).step_by(AT_ONCE) {
        let some = first..count.min(first + AT_ONCE as u32);
        let records: Vec<_> = some.map(|primitive| SurfaceRecord::of(mesh, primitive)).collect();
        out.put(bytemuck::cast_slice(&records))?;
    }
    out.end().map(drop)
}

/// What is wrong with pictures that went missing on the way to the file.
pub(super) fn missing(images: &[Image], written: &[ImageMeta]) -> Vec<String> {
    let was_there = |image: &Image| !matches!(image.source, ImageSource::Missing(_));
    let lost = images.iter().zip(written).filter(|(image, _)| was_there(image));
    lost.filter_map(|(_, written)| match written {
        ImageMeta::Missing { name, reason } => Some(format!("{name} {reason}")),
        ImageMeta::Stored { .. } => None,
    })
    .collect()
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
    let attributes = &mesh.attributes;
    if !(attributes.is_empty() || attributes.len() == triangles && attributes.iter().all(is_finite)) {
        return Err(Error::Mesh(
            "its texture coordinates are not those of its triangles, or not finite".into(),
        ));
    }
    let mut maps = mesh.colors.materials().iter().flat_map(|material| material.maps.all());
    if !maps.all(|map| (map.image as usize) < mesh.images.len()) {
        return Err(Error::Mesh("a material names a picture that is not there".into()));
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
