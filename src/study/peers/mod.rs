//! The rivals that raypack is measured against.

pub mod embree;
pub mod obvhs;
