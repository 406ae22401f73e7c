//! Experiments and their reports: what `raypack bench` measures, and the rivals that it measures against.

pub mod accuracy;
pub mod bench;
#[cfg(feature = "peers")]
pub mod peers;
pub mod rays;
pub mod reference;
pub mod views;
