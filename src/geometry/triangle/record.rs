//! A triangle as the tree keeps it.

use super::{Corners, normal_in_double};
use bytemuck::{Pod, Zeroable};

/// Corners, and the plane that they lie in: 48 bytes, three quarters of a cache line.
///
/// The normal takes double precision to be any good for slivers. It is needed wherever a ray comes out
/// inside of a triangle's edges, by one packet after the other, so it is worked out once and kept.
///
/// What belongs to one axis lies together, so that a register takes up one coordinate of all corners at once, and
/// renaming coordinates is to read other rows:
///
/// ```text
///           column 0    1    2    3
/// row x:         p0.x p1.x p2.x n.x
/// row y:         p0.y p1.y p2.y n.y
/// row z:         p0.z p1.z p2.z n.z
/// ```
///
/// The normal's greatest component is 1 or -1; it is zero for a triangle without area.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C, align(16))]
pub struct Triangle {
    rows: [[f32; 4]; 3],
}

/// The column of a triangle's normal.
pub(super) const NORMAL: usize = 3;

impl Triangle {
    /// Prepares a triangle. Its corners must be finite.
    pub fn new([p0, p1, p2]: Corners) -> Self {
        let normal = normal_in_double(&[p0, p1, p2]);
        let size = normal.abs().max_element();
        let plane = if size > 0.0 { (normal / size).as_vec3().to_array() } else { [0.0; 3] };
        Self { rows: [0, 1, 2].map(|axis| [p0[axis], p1[axis], p2[axis], plane[axis]]) }
    }

    /// Its corners.
    #[inline(always)]
    pub fn corners(&self) -> Corners {
        [self.column(0), self.column(1), self.column(2)]
    }

    /// A normal whose greatest component is 1 or -1; zero for a triangle without area.
    #[inline(always)]
    pub fn plane(&self) -> [f32; 3] {
        self.column(NORMAL)
    }

    /// A corner, or the normal.
    #[inline(always)]
    fn column(&self, column: usize) -> [f32; 3] {
        [self.rows[0][column], self.rows[1][column], self.rows[2][column]]
    }

    /// Its numbers axis by axis, as registers fetch them.
    #[inline(always)]
    pub(crate) fn rows(&self) -> &[[f32; 4]; 3] {
        &self.rows
    }
}
