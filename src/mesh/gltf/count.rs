//! How much a scene shows, before any of its buffers is opened.

use super::primitives::{corners, triangles};
use super::{container, nodes};
use crate::mesh::ReadReport;
use crate::mesh::spooled::Announced;
use gltf::Semantic;

/// How much is in a glTF file by its JSON; `None` of what cannot be read.
pub(in crate::mesh) fn count(bytes: &[u8]) -> Option<Announced> {
    let (document, _) = container::open(bytes, &mut ReadReport::default()).ok()?;
    let of_meshes: Vec<_> = document.meshes().map(|mesh| all(mesh.primitives().map(|p| of(&p)))).collect();
    let instances = nodes::instances(&document).ok()?;
    Some(all(instances.iter().map(|instance| of_meshes[instance.mesh])))
}

/// How much there is together.
fn all(parts: impl Iterator<Item = Announced>) -> Announced {
    parts.fold(Announced::default(), |sum, part| Announced {
        vertices: sum.vertices.saturating_add(part.vertices),
        triangles: sum.triangles.saturating_add(part.triangles),
        attributes: sum.attributes || part.attributes,
    })
}

/// How much a primitive is: its vertices are those that it names, and no more than it has corners.
fn of(primitive: &gltf::Primitive<'_>) -> Announced {
    let corners = corners(primitive);
    let Some(triangles) = triangles(primitive.mode(), corners) else { return Announced::default() };
    let vertices = primitive.get(&Semantic::Positions).map_or(0, |positions| positions.count());
    let attributes = primitive
        .attributes()
        .any(|(semantic, _)| matches!(semantic, Semantic::Normals | Semantic::TexCoords(_)));
    Announced { vertices: vertices.min(corners) as u64, triangles: triangles as u64, attributes }
}
