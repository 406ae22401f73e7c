//! Ray against triangle: one file per test.

mod accuracy;
pub mod watertight;

pub use accuracy::Accuracy;

use glam::{DVec3, Vec3};

/// The corners of a triangle, as the kernels fetch them: `[corner][axis]`.
pub type Corners = [[f32; 3]; 3];

/// The geometric normal `(p1 - p0) x (p2 - p0)`, not normalised. Computed in double precision: in
/// single, the normal of a sliver may point anywhere.
#[inline]
pub fn normal(corners: &Corners) -> Vec3 {
    normal_in_double(corners).as_vec3()
}

/// The same before it is rounded.
#[inline(always)]
fn normal_in_double(corners: &Corners) -> DVec3 {
    let [p0, p1, p2] = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
    (p1 - p0).cross(p2 - p0)
}
