//! How right engines are, measured against exact answers.
//!
//! [`census()`] makes rays of every kind, finds the truth about them ([`Judged`]), asks every engine in
//! every mode, and counts their [`Errors`]. What counts as one is written down in [`errors`].

mod census;
#[cfg(feature = "peers")]
mod embree;
pub mod errors;
mod judged;

pub use census::{Census, Options, Row, answers, census};
pub use errors::{Deviation, Errors};
pub use judged::Judged;
