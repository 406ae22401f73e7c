//! Ray against triangle: one file per test.
//!
//! | file | what decides whether the ray hits | what it costs |
//! |---|---|---|
//! | `fast` | the point where it meets the plane, in single precision | a record of 44 bytes a triangle |
//! | `watertight` | signs of edge functions that neighbours compute alike | |
//! | `exact` | signs of exact determinants | double precision for each likely hit |
//!
//! All three answer for closed triangles, and none ever for one seen exactly edge-on.

mod accuracy;
pub mod exact;
pub mod fast;
mod leaving;
mod placed;
mod record;
mod test;
pub mod watertight;

pub use accuracy::Accuracy;
pub use leaving::leave;
pub use placed::{Placed, Row, side};
pub use record::Triangle;
pub use test::{Alone, Candidate, Exact, Fast, Finds, Lanes3, Mode, Own, Test, Watertight, Weights};
pub use watertight::pooled;

use glam::{DVec3, Vec3};

/// The corners of a triangle, as the kernels fetch them: `[corner][axis]`.
pub type Corners = [[f32; 3]; 3];

/// Which coordinates become x, y and z when an axis becomes z: a cyclic renaming.
const RENAMED: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// The geometric normal `(p1 - p0) x (p2 - p0)`, not normalised. Computed in double precision: in
/// single, the normal of a sliver may point anywhere. Where it would overflow or lose bits near
/// zero, its greatest component is 1 or -1 instead; zero only for a triangle without area.
#[inline]
pub fn normal(corners: &Corners) -> Vec3 {
    let normal = normal_in_double(corners);
    let size = normal.abs().max_element();
    let in_range = size >= f64::from(f32::MIN_POSITIVE) && size <= f64::from(f32::MAX);
    if in_range || size == 0.0 { normal.as_vec3() } else { (normal / size).as_vec3() }
}

/// [`normal`] of `W` triangles, `corners[corner][axis]` of each in a lane, to the bit.
#[inline(always)]
pub fn normals<const W: usize>(corners: &[[[f32; W]; 3]; 3]) -> [[f32; W]; 3] {
    let mut normals = [[0.0; W]; 3];
    let mut in_range = true;
    for lane in 0..W {
        let p = |corner: usize, axis: usize| f64::from(corners[corner][axis][lane]);
        let [ex, ey, ez] = [p(1, 0) - p(0, 0), p(1, 1) - p(0, 1), p(1, 2) - p(0, 2)];
        let [fx, fy, fz] = [p(2, 0) - p(0, 0), p(2, 1) - p(0, 1), p(2, 2) - p(0, 2)];
        let (x, y, z) = (ey * fz - fy * ez, ez * fx - fz * ex, ex * fy - fx * ey);
        let size = x.abs().max(y.abs()).max(z.abs());
        in_range &= size >= f64::from(f32::MIN_POSITIVE) && size <= f64::from(f32::MAX);
        normals[0][lane] = x as f32;
        normals[1][lane] = y as f32;
        normals[2][lane] = z as f32;
    }
    if !in_range {
        for lane in 0..W {
            let one = normal(&corners.map(|corner| corner.map(|row| row[lane])));
            (normals[0][lane], normals[1][lane], normals[2][lane]) = (one.x, one.y, one.z);
        }
    }
    normals
}

/// The same before it is rounded.
#[inline(always)]
fn normal_in_double(corners: &Corners) -> DVec3 {
    let [p0, p1, p2] = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
    (p1 - p0).cross(p2 - p0)
}
