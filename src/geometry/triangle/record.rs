//! A triangle as the tree keeps it.

use super::{Corners, normal_in_double};
use bytemuck::{Pod, Zeroable};

/// Corners, and the plane that they lie in: 48 bytes, three quarters of a cache line.
///
/// The normal takes double precision to be any good for slivers. It is needed wherever a ray comes out
/// inside of a triangle's edges, by one packet after the other, so it is worked out once and kept.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Triangle {
    /// `corners[corner][axis]`.
    pub corners: Corners,
    /// A normal whose greatest component is 1 or -1; zero for a triangle without area.
    pub plane: [f32; 3],
}

impl Triangle {
    /// Prepares a triangle. Its corners must be finite.
    pub fn new(corners: Corners) -> Self {
        let normal = normal_in_double(&corners);
        let size = normal.abs().max_element();
        let plane = if size > 0.0 { (normal / size).as_vec3().to_array() } else { [0.0; 3] };
        Self { corners, plane }
    }

    /// Its twelve numbers in fours, as registers fetch them.
    #[inline(always)]
    pub(crate) fn fours(&self) -> &[[f32; 4]; 3] {
        bytemuck::cast_ref(self)
    }
}
