//! raypack: a packet-traversal ray engine for the CPU.

#[cfg(feature = "cli")]
pub mod cli;
pub mod error;
pub mod geometry;
pub mod kdtree;
pub mod mesh;
pub mod profile;
pub mod render;
pub mod scene;
pub mod simd;
pub mod study;
pub mod traverse;

pub use error::{Error, Result};
pub use glam::Vec3;
