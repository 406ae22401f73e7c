//! The full record of a closest hit.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The primitive id of a miss.
pub const NO_PRIMITIVE: u32 = u32::MAX;

/// Where a ray meets a triangle; [`Hit::MISS`] where it meets none.
///
/// With the triangle's corners `p0 p1 p2`, the point is `(1 - u - v) p0 + u p1 + v p2`.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Hit {
    /// The ray's parameter, in lengths of its direction; infinite for a miss.
    pub t: f32,
    /// Barycentric weight of `p1`.
    pub u: f32,
    /// Barycentric weight of `p2`.
    pub v: f32,
    /// The triangle's index in its mesh, [`NO_PRIMITIVE`] for a miss.
    pub primitive: u32,
    /// `(p1 - p0) x (p2 - p0)`, not normalised, on the side of the corners' counter-clockwise
    /// order whichever side the ray came from; zero for a miss. Where that would overflow or lose
    /// bits near zero, its greatest component is 1 or -1 instead.
    pub normal: Vec3,
}

impl Hit {
    /// No hit.
    pub const MISS: Self =
        Self { t: f32::INFINITY, u: 0.0, v: 0.0, primitive: NO_PRIMITIVE, normal: Vec3::ZERO };

    /// Whether this is a hit at all.
    #[inline]
    pub const fn is_hit(&self) -> bool {
        self.primitive != NO_PRIMITIVE
    }
}
