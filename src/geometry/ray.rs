//! A ray: origin, direction and a closed interval of the parameter `t`.

use bytemuck::{Pod, Zeroable};
use glam::Vec3;

/// The points `origin + t * direction` with `tnear <= t <= tfar`.
///
/// The direction need not be normalised; `t` is counted in its length. Both ends belong to
/// the interval. An empty interval (`tnear > tfar`) and a ray with a NaN in it hit nothing.
/// 32 bytes, in the order that `raypack cast` reads.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Ray {
    /// Where `t` is 0.
    pub origin: Vec3,
    /// Least `t` that counts as a hit (inclusive). Not negative.
    pub tnear: f32,
    /// Where the ray goes; any length but zero.
    pub direction: Vec3,
    /// Greatest `t` that counts as a hit (inclusive); may be infinite.
    pub tfar: f32,
}

impl Ray {
    /// The whole half-line from `origin`: `t` from 0 to infinity.
    #[inline]
    pub const fn new(origin: Vec3, direction: Vec3) -> Self {
        Self { origin, tnear: 0.0, direction, tfar: f32::INFINITY }
    }

    /// A ray with both ends of its interval given.
    #[inline]
    pub const fn segment(origin: Vec3, direction: Vec3, tnear: f32, tfar: f32) -> Self {
        Self { origin, tnear, direction, tfar }
    }

    /// The point at parameter `t`.
    #[inline]
    pub fn at(&self, t: f32) -> Vec3 {
        self.origin + self.direction * t
    }
}
