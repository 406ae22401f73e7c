//! Rays, hits and boxes: the words that every other room speaks.
//!
//! Coordinates are right-handed `f32`; the library attaches no unit to a length.

mod aabb;
pub mod clip;
pub mod cut;
mod hit;
mod ray;
pub mod triangle;

pub use aabb::Aabb;
pub use hit::{Hit, NO_PRIMITIVE};
pub use ray::Ray;
pub use triangle::Accuracy;
