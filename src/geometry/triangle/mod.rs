//! Ray against triangle: one file per test.

pub mod watertight;

use glam::Vec3;

/// The corners of a triangle, as the kernels fetch them: `[corner][axis]`.
pub type Corners = [[f32; 3]; 3];

/// The geometric normal `(p1 - p0) x (p2 - p0)`, not normalised.
#[inline]
pub fn normal(corners: &Corners) -> Vec3 {
    let [p0, p1, p2] = corners.map(Vec3::from_array);
    (p1 - p0).cross(p2 - p0)
}
