//! Tracing rays through a tree.
//!
//! [`Accel`] is what a user holds: a mesh made ready. The kernels beneath it are written once,
//! over [`crate::simd::Lanes`] and [`crate::kdtree::Tree`]; they know no files and no threads.
//!
//! **What a hit is, in every kernel and on every instruction set:** of all triangles that the
//! watertight test finds within the closed interval `tnear..=tfar`, the one with the least `t`,
//! and of those with equal `t` the one with the lowest primitive id. Answers agree bit for bit.

mod accel;
mod kernel;
mod lanes;
mod packet;
mod walk;

pub use accel::Accel;
pub use kernel::Kernel;
pub use lanes::{HitPacket, PacketWidth, RayPacket};

#[cfg(test)]
mod tests;
