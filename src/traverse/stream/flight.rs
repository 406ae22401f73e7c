//! Rays in flight.

use super::leaf::Leaf;
use super::step::Crossing;

/// The id of no triangle yet: greater than any, so that equal `t` lets the first hit in.
pub const NONE: u32 = i32::MAX as u32;

/// What is known of a ray on its way, its stack left aside.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Flight<A> {
    pub crossing: Crossing,
    /// The top of its stack.
    pub top: u32,
    /// Which ray it is.
    pub ray: u32,
    pub tnear: f32,
    /// What a hit must not lie beyond: the closest `t`, or `tfar`.
    pub tfar: f32,
    /// The closest triangle.
    pub primitive: u32,
    /// The leaf that it is in.
    pub leaf: Leaf,
    /// Prepared for triangles.
    pub test: A,
}
