//! Experiments and their reports: what `raypack bench` measures, and the rivals that it measures against.

pub mod bench;
#[cfg(feature = "peers")]
pub mod peers;
pub mod rays;
