//! Tracing rays through a tree.
//!
//! [`Accel`] is what a user holds: a mesh made ready. The kernels beneath it are written once,
//! over [`crate::simd::Lanes`] and [`crate::kdtree::Tree`]; they know no files and no threads.
//!
//! **What a hit is, in every kernel and on every instruction set:** of all triangles that the
//! chosen accuracy's test finds with a `t` in the closed interval `tnear..=tfar`, the one with the
//! least `t`, and of those with equal `t` the one with the lowest primitive id. Answers agree bit
//! for bit. A ray with a NaN in it, an infinite or NaN origin or direction, or a zero direction hits
//! nothing.

mod accel;
mod ahead;
mod closest;
mod coarse;
mod columns;
mod dispatch;
mod filter;
mod kernel;
mod lanes;
mod many;
mod pack;
mod packet;
mod pool;
mod query;
mod range;
mod ready;
mod records;
mod sieve;
mod source;
mod stack;
mod stopwatch;
mod stream;
mod tile;
mod walk;
mod width;

pub use accel::Accel;
pub(crate) use ahead::look_ahead;
pub use coarse::{Entry, first_page};
pub use dispatch::{Dispatch, DispatchPool, Place, Places, ScatteredDispatch, SliceDispatch};
pub use kernel::Kernel;
pub(crate) use kernel::tally;
pub(crate) use lanes::give_lanes;
pub use lanes::{HitPacket, RayPacket};
pub use sieve::Sieve;
pub use stopwatch::Stopwatch;
pub use tile::TileCounts;
pub use width::PacketWidth;

#[cfg(test)]
mod tests;
