//! Triangle meshes: what readers and generators make and the tree builder takes.

use crate::geometry::Aabb;
use glam::Vec3;

/// Triangles with shared vertices and a colour for each triangle.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Vertex positions, all finite.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` for each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// What colour the triangles have.
    pub colors: Colors,
}

/// Where a triangle's colour comes from. Colours are linear RGB reflectances, 0 to 1.
#[derive(Clone, Debug)]
pub enum Colors {
    /// One colour for everything.
    Uniform(Vec3),
    /// One sRGB-encoded colour a triangle.
    PerTriangle(Vec<[u8; 3]>),
    /// One sRGB-encoded colour a vertex, interpolated in linear light.
    PerVertex(Vec<[u8; 3]>),
    /// Named materials, and for each triangle an index into them.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
        /// One index a triangle.
        of_triangle: Vec<u32>,
    },
}

impl Default for Colors {
    fn default() -> Self {
        Self::Uniform(Vec3::splat(0.7))
    }
}

/// A surface.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// Its name in the file.
    pub name: String,
    /// Diffuse reflectance, linear RGB.
    pub diffuse: Vec3,
}

impl Mesh {
    /// The three corners of a triangle. Panics if `primitive` or one of its indices is out of range.
    #[inline]
    pub fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.triangles[primitive as usize].map(|i| self.positions[i as usize])
    }

    /// The box around all triangles (vertices that no triangle uses do not count).
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.triangles.iter().flatten().map(|&i| self.positions[i as usize]))
    }
}
