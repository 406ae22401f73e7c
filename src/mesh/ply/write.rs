//! Writing binary PLY.

use crate::error::Result;
use crate::files;
use crate::mesh::{Colors, Material, Mesh, color};
use glam::Vec3;
use std::io::{self, Write};
use std::path::Path;

/// Bytes of a vertex without a colour.
pub(super) const VERTEX: u64 = 12;
/// Bytes of a triangle with its colour.
pub(super) const FACE: u64 = 16;

/// Writes `mesh` as little-endian binary PLY, with a colour for each face (for each vertex, if
/// that is what the mesh has).
///
/// The file is written beside its target and renamed when complete: what `path` held before stays
/// until then. Nothing is left behind on failure.
///
/// # Errors
///
/// [`Error::Write`](crate::Error::Write).
pub fn write(path: impl AsRef<Path>, mesh: &Mesh) -> Result<()> {
    files::write_whole(path.as_ref(), |out| {
        let per_vertex = matches!(mesh.colors, Colors::PerVertex(_));
        let header = header(mesh.positions.len() as u64, mesh.triangles.len() as u64, per_vertex);
        out.write_all(header.as_bytes())?;
        match &mesh.colors {
            Colors::PerVertex(colors) => {
                for (p, color) in mesh.positions.iter().zip(colors) {
                    vertex(out, *p)?;
                    out.write_all(color)?;
                }
            }
            _ => mesh.positions.iter().try_for_each(|&p| vertex(out, p))?,
        }
        faces(mesh, out)
    })
}

/// The header, to its last line's end.
pub(super) fn header(vertices: u64, triangles: u64, per_vertex: bool) -> String {
    const COLOR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    format!(
        "ply\nformat binary_little_endian 1.0\ncomment raypack {}\nelement vertex {vertices}\n\
         property float x\nproperty float y\nproperty float z\n{}\
         element face {triangles}\nproperty list uchar int vertex_indices\n{}end_header\n",
        env!("CARGO_PKG_VERSION"),
        if per_vertex { COLOR } else { "" },
        if per_vertex { "" } else { COLOR },
    )
}

/// One vertex: [`VERTEX`] bytes.
#[inline]
pub(super) fn vertex(out: &mut impl Write, position: Vec3) -> io::Result<()> {
    let mut record = [0; VERTEX as usize];
    for (bytes, x) in record.as_chunks_mut::<4>().0.iter_mut().zip(position.to_array()) {
        *bytes = x.to_le_bytes();
    }
    out.write_all(&record)
}

/// One triangle: [`FACE`] bytes, or three fewer if it has no colour.
#[inline]
pub(super) fn face(out: &mut impl Write, triangle: [u32; 3], shade: Option<[u8; 3]>) -> io::Result<()> {
    let mut record = [3; FACE as usize];
    for (bytes, index) in record[1..13].as_chunks_mut::<4>().0.iter_mut().zip(triangle) {
        *bytes = index.to_le_bytes();
    }
    record[13..].copy_from_slice(&shade.unwrap_or_default());
    out.write_all(&record[..if shade.is_some() { 16 } else { 13 }])
}

/// The materials' colours as bytes.
pub(in crate::mesh) fn shades(materials: &[Material]) -> Vec<[u8; 3]> {
    materials.iter().map(|m| color::encode(m.diffuse)).collect()
}

fn faces(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    let palette: Vec<[u8; 3]> = match &mesh.colors {
        Colors::Uniform(linear) => vec![color::encode(*linear)],
        Colors::PerMaterial { materials, .. } => shades(materials),
        Colors::PerTriangle(_) | Colors::PerVertex(_) => Vec::new(),
    };
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let shade = match &mesh.colors {
            Colors::Uniform(_) => Some(palette[0]),
            Colors::PerTriangle(colors) => Some(colors[i]),
            Colors::PerMaterial { of_triangle, .. } => Some(palette[of_triangle[i] as usize]),
            Colors::PerVertex(_) => None,
        };
        face(out, *triangle, shade)?;
    }
    Ok(())
}
