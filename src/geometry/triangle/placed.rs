//! Sixteen triangles as rays from one point see them: what all of those rays can share of each.

use crate::simd::Lanes;

/// A number of each of sixteen triangles.
pub type Row = [f32; 16];

/// Sixteen triangles prepared for rays that all start at one point, the *apex*, and run fastest along one axis:
/// up, or down.
///
/// Coordinates are relative to the apex, and renamed cyclically so that this axis is z.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Placed {
    /// On which sides of the edges a ray passes: with `x` and `y` the ray's slopes `dx / dz` and `dy / dz`, that
    /// of the sign of `edge[0] x + edge[1] y + edge[2]`. A ray that hits is on the same side of all three.
    pub edges: [[Row; 3]; 3],
    /// What those sums are off by, at most, any mode's own errors included: infinite for a triangle without area.
    pub slack: Row,
    /// The planes' normals, as [`Triangle`](super::Triangle) has them.
    pub normal: [Row; 3],
    /// `normal . corner`, of the first corner.
    pub height: Row,
    /// The least z of the corners, and the greatest, in either order.
    pub depths: [Row; 2],
}

impl Placed {
    /// Sixteen triangles that are points at the apex.
    pub const fn at_apex() -> Self {
        const ROW: Row = [0.0; 16];
        Self { edges: [[ROW; 3]; 3], slack: ROW, normal: [ROW; 3], height: ROW, depths: [ROW; 2] }
    }

    /// What an edge of the triangle `which` is for rays with slopes `x` and `y`.
    #[inline(always)]
    pub fn side<const W: usize, L: Lanes<W>>(&self, which: usize, edge: usize, x: L, y: L) -> L {
        let [by_x, by_y, constant] = &self.edges[edge];
        side([by_x, by_y, constant], which, x, y)
    }
}

/// `by_x x + by_y y + constant` for the triangle `which` of sixteen.
#[inline(always)]
pub fn side<const W: usize, L: Lanes<W>>([by_x, by_y, constant]: [&Row; 3], which: usize, x: L, y: L) -> L {
    let which = which & 15;
    L::splat(by_x[which]).mul_add(x, L::splat(by_y[which]).mul_add(y, L::splat(constant[which])))
}
