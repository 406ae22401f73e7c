//! What accuracy engines have, measured against exact answers.

mod errors;

pub use errors::{Deviation, Errors};
