//! What shading asks of the triangles that rays hit.

use crate::mesh::Mesh;
use crate::store::Stored;
use glam::Vec3;

/// Surfaces by primitive id: a [`Mesh`], or those of a scene file.
///
/// Of one scene they say the same, to the bit, so that pictures are the same. All of them panic if a primitive is
/// out of range.
pub trait Surface: Sync {
    /// The three corners of a triangle, in the scene's coordinates.
    fn corners(&self, primitive: u32) -> [Vec3; 3];
    /// The linear RGB reflectance where a hit's barycentrics are `u` and `v`.
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3;
    /// The index of a triangle's material; 0 in scenes that have none.
    fn material(&self, primitive: u32) -> u32;
}

impl Surface for Mesh {
    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.color(primitive, u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }
}

impl Surface for Stored {
    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.color(primitive, u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }
}
