//! Experiments and their reports: how fast and how right engines are.
//!
//! [`mod@bench`] measures speed, [`accuracy`] errors, and [`tune`] looks for settings; all on the same kinds of [`rays`], from the standard
//! [`views`], and beside the same rivals. What is right, the [`mod@reference`] says.

pub mod accuracy;
pub mod bench;
pub mod cache;
pub mod heat;
#[cfg(feature = "peers")]
pub mod peers;
#[cfg(feature = "accuracy")]
pub mod plot;
pub mod rays;
pub mod reference;
pub mod resident;
pub mod scaling;
pub(crate) mod text;
pub mod tune;
pub mod views;
