//! References to triangles.

use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use glam::Vec3;

/// A triangle, or a part of one, and the box around that.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    pub bounds: Aabb,
    pub id: u32,
}

impl Reference {
    /// All of a triangle.
    pub fn new(id: u32, triangle: &Triangle) -> Self {
        Self { bounds: Aabb::of_points(triangle.corners.map(Vec3::from_array)), id }
    }

    /// Where its box has its middle along an axis, times two.
    #[inline(always)]
    pub fn middle(&self, axis: usize) -> f32 {
        self.bounds.min[axis] + self.bounds.max[axis]
    }
}

/// The box around some of them.
pub fn around(references: &[Reference]) -> Aabb {
    references.iter().fold(Aabb::EMPTY, |all, reference| all.union(reference.bounds))
}
