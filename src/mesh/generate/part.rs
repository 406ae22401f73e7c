//! Models in parts: what a generator hands over as soon as it is done, so that memory need not hold the whole.

use crate::mesh::{Colors, Material, Mesh};
use glam::Vec3;

/// A piece of a model, whose triangles use its own vertices alone.
#[derive(Clone, Copy, Debug)]
pub struct Part<'a> {
    /// Vertex positions, all finite; a plant's are in metres.
    pub positions: &'a [Vec3],
    /// Three indices into `positions` for each triangle, counter-clockwise seen from its front.
    pub triangles: &'a [[u32; 3]],
    /// The material of each triangle: an index into the model's materials.
    pub of_triangle: &'a [u32],
}

/// How large a model or a part of one is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Size {
    /// How many triangles it has.
    pub triangles: u64,
    /// How many vertices.
    pub vertices: u64,
}

impl Part<'_> {
    /// How large it is.
    pub fn size(&self) -> Size {
        Size { triangles: self.triangles.len() as u64, vertices: self.positions.len() as u64 }
    }
}

impl std::ops::AddAssign for Size {
    fn add_assign(&mut self, other: Self) {
        self.triangles += other.triangles;
        self.vertices += other.vertices;
    }
}

/// Parts put together in memory, in the order in which they come.
#[derive(Debug, Default)]
pub(super) struct Whole {
    positions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
    of_triangle: Vec<u32>,
}

impl Whole {
    /// Nothing yet, with room for so many triangles.
    pub fn with_capacity(triangles: usize) -> Self {
        Self {
            // Boxes have two vertices for three triangles, tubes one for two.
            positions: Vec::with_capacity(triangles * 2 / 3),
            triangles: Vec::with_capacity(triangles),
            of_triangle: Vec::with_capacity(triangles),
        }
    }

    /// Adds a part.
    pub fn push(&mut self, part: Part<'_>) {
        let base = self.positions.len() as u32;
        self.positions.extend_from_slice(part.positions);
        self.triangles.extend(part.triangles.iter().map(|t| t.map(|i| base + i)));
        self.of_triangle.extend_from_slice(part.of_triangle);
    }

    /// The mesh of all parts.
    pub fn finish(mut self, materials: Vec<Material>) -> Mesh {
        self.positions.shrink_to_fit();
        Mesh {
            positions: self.positions,
            triangles: self.triangles,
            colors: Colors::PerMaterial { materials, of_triangle: self.of_triangle },
            ..Mesh::default()
        }
    }
}
