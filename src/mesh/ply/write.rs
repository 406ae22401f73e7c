//! Writing binary PLY.

use crate::error::Result;
use crate::files;
use crate::mesh::{Colors, Mesh, color};
use std::io::{self, Write};
use std::path::Path;

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
        header(mesh, out)?;
        vertices(mesh, out)?;
        faces(mesh, out)
    })
}

fn header(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    const COLOR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    let per_vertex = matches!(mesh.colors, Colors::PerVertex(_));
    write!(
        out,
        "ply\nformat binary_little_endian 1.0\ncomment raypack {}\nelement vertex {}\n\
         property float x\nproperty float y\nproperty float z\n{}\
         element face {}\nproperty list uchar int vertex_indices\n{}end_header\n",
        env!("CARGO_PKG_VERSION"),
        mesh.positions.len(),
        if per_vertex { COLOR } else { "" },
        mesh.triangles.len(),
        if per_vertex { "" } else { COLOR },
    )
}

fn vertices(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    for (i, p) in mesh.positions.iter().enumerate() {
        for x in p.to_array() {
            out.write_all(&x.to_le_bytes())?;
        }
        if let Colors::PerVertex(colors) = &mesh.colors {
            out.write_all(&colors[i])?;
        }
    }
    Ok(())
}

fn faces(mesh: &Mesh, out: &mut impl Write) -> io::Result<()> {
    let palette: Vec<[u8; 3]> = match &mesh.colors {
        Colors::Uniform(linear) => vec![color::encode(*linear)],
        Colors::PerMaterial { materials, .. } => materials.iter().map(|m| color::encode(m.diffuse)).collect(),
        Colors::PerTriangle(_) | Colors::PerVertex(_) => Vec::new(),
    };
    for (i, triangle) in mesh.triangles.iter().enumerate() {
        let mut record = [3; 16];
        for (bytes, index) in record[1..13].as_chunks_mut::<4>().0.iter_mut().zip(triangle) {
            *bytes = index.to_le_bytes();
        }
        let shade = match &mesh.colors {
            Colors::Uniform(_) => Some(palette[0]),
            Colors::PerTriangle(colors) => Some(colors[i]),
            Colors::PerMaterial { of_triangle, .. } => Some(palette[of_triangle[i] as usize]),
            Colors::PerVertex(_) => None,
        };
        record[13..].copy_from_slice(&shade.unwrap_or_default());
        out.write_all(&record[..if shade.is_some() { 16 } else { 13 }])?;
    }
    Ok(())
}
