//! What shading asks of the triangles that rays hit.

use crate::mesh::{Attributes, FaceColor, Image, Material, Mesh};
use crate::store::Stored;
use glam::Vec3;

/// Surfaces by primitive id: a [`Mesh`], or those of a scene file.
///
/// Of one scene they say the same, to the bit, so that pictures are the same. All of them panic if a primitive is
/// out of range.
pub trait Surface: Sync {
    /// What one thread looks at many of them with.
    type Reader<'a>: Look
    where
        Self: 'a;

    /// A reader, for a while in which this thread traces nothing.
    fn reader(&self) -> Self::Reader<'_>;
    /// The three corners of a triangle, in the scene's coordinates.
    fn corners(&self, primitive: u32) -> [Vec3; 3];
    /// The linear RGB reflectance where a hit's barycentrics are `u` and `v`.
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3;
    /// The index of a triangle's material; 0 in scenes that have none.
    fn material(&self, primitive: u32) -> u32;
    /// The materials; empty in scenes that have none, whose surfaces are matt.
    fn materials(&self) -> &[Material];
    /// The pictures that materials' maps name.
    fn images(&self) -> &[Image];
    /// Whether any triangle has texture coordinates or normals.
    fn has_attributes(&self) -> bool;
    /// Whether any triangle has normals.
    fn has_normals(&self) -> bool;
    /// How many triangles each of the materials has.
    fn uses(&self) -> Vec<u64>;
    /// The triangles whose material gives off light, in the order of their numbers.
    fn emitters(&self) -> Vec<u32>;
}

/// What shading looks at.
pub trait Look {
    /// A triangle's corners and colours: all that there is to know of matt ones.
    fn face(&self, primitive: u32) -> Face;
    /// The index of a triangle's material; 0 in scenes that have none.
    fn material(&self, primitive: u32) -> u32;
    /// All that there is to know about a triangle.
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail;
}

/// A triangle, for shading of matt surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Face {
    /// Its corners, in the scene's coordinates.
    pub corners: [Vec3; 3],
    /// Its reflectance.
    pub color: FaceColor,
}

/// A triangle, for shading that does more than matt surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// Its corners, in the scene's coordinates.
    pub corners: [Vec3; 3],
    /// Its linear RGB reflectance where it was hit, maps left out.
    pub color: Vec3,
    /// The index of its material; 0 in scenes that have none.
    pub material: u32,
    /// What its corners have; [`Attributes::NONE`] in scenes that have none.
    pub attributes: Attributes,
}

impl Look for &Mesh {
    #[inline(always)]
    fn face(&self, primitive: u32) -> Face {
        Face { corners: self.corners(primitive), color: self.face_color(primitive) }
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        Mesh::material(self, primitive)
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        Detail {
            corners: self.corners(primitive),
            color: self.color(primitive, u, v),
            material: Mesh::material(self, primitive),
            attributes: self.attributes.get(primitive as usize).copied().unwrap_or(Attributes::NONE),
        }
    }
}

impl Look for &Stored {
    #[inline(always)]
    fn face(&self, primitive: u32) -> Face {
        Face { corners: self.corners(primitive), color: self.face_color(primitive) }
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        Stored::material(self, primitive)
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        Detail {
            corners: self.corners(primitive),
            color: self.face_color(primitive).at(u, v),
            material: Stored::material(self, primitive),
            attributes: self.attributes(primitive),
        }
    }
}

impl Surface for Mesh {
    type Reader<'a> = &'a Self;

    #[inline(always)]
    fn reader(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.face_color(primitive).at(u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }

    fn materials(&self) -> &[Material] {
        self.colors.materials()
    }

    fn images(&self) -> &[Image] {
        &self.images
    }

    fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    fn has_normals(&self) -> bool {
        self.attributes.iter().any(Attributes::has_normals)
    }

    fn uses(&self) -> Vec<u64> {
        self.colors.uses()
    }

    fn emitters(&self) -> Vec<u32> {
        self.colors.emitters()
    }
}

impl Surface for Stored {
    type Reader<'a> = &'a Self;

    #[inline(always)]
    fn reader(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.face_color(primitive).at(u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }

    fn materials(&self) -> &[Material] {
        self.materials()
    }

    fn images(&self) -> &[Image] {
        self.images()
    }

    fn has_attributes(&self) -> bool {
        self.has_attributes()
    }

    fn has_normals(&self) -> bool {
        self.has_normals()
    }

    fn uses(&self) -> Vec<u64> {
        self.uses().to_vec()
    }

    fn emitters(&self) -> Vec<u32> {
        self.emitters().to_vec()
    }
}
