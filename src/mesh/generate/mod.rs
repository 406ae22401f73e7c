//! Models made by rule, of any size: a process plant to look at, and shapes to test with.
//!
//! The same parameters give the same mesh to the bit, on every machine: randomness is hashed from
//! the seed, and nothing but operations that IEEE 754 rounds exactly goes into a coordinate.

mod part;
pub mod plant;
mod rng;
pub mod shapes;
mod sketch;

pub use part::{Part, Size};
