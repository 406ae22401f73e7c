//! How right engines are, measured against exact answers.
//!
//! [`census()`] makes rays of every kind, finds the truth about them ([`Judged`]), asks every engine in
//! every mode, and counts their [`Errors`]. What counts as one is written down in [`errors`].
//! `tradeoff` (feature `accuracy`) sets them against the time that each mode takes.

mod census;
#[cfg(feature = "peers")]
mod embree;
pub mod errors;
mod judged;
#[cfg(feature = "accuracy")]
pub mod tradeoff;

pub use census::{Census, Options, Row, answers, census};
pub use errors::{Deviation, Errors};
pub use judged::Judged;
