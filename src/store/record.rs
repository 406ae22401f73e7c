//! What a triangle is made of, and what its corners have, in one record.

use crate::mesh::{Attributes, Mesh};
use bytemuck::{Pod, Zeroable};

/// An element of the section `surface-records`: 40 bytes, little-endian.
///
/// Shading needs all of it where a ray has hit, and reads it at once.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct SurfaceRecord {
    /// The index of its material; 0 in scenes that have none.
    pub material: u32,
    /// Texture coordinates and normals.
    pub attributes: Attributes,
}

impl SurfaceRecord {
    /// That of a triangle of a mesh with attributes. Panics if `primitive` is out of range.
    pub(super) fn of(mesh: &Mesh, primitive: u32) -> Self {
        Self { material: mesh.material(primitive), attributes: mesh.attributes[primitive as usize] }
    }
}

/// Whether texture coordinates are numbers. Normals are vectors whatever their bits.
pub(super) fn is_finite(attributes: &Attributes) -> bool {
    attributes.uv.as_flattened().iter().all(|coordinate| coordinate.is_finite())
}
