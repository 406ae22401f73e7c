//! Where blocks come from.

use crate::error::Result;
use std::fmt;

/// Something that blocks can be read from.
pub trait Source: Send + Sync + fmt::Debug {
    /// Reads bytes of an array, from `byte` on, to fill `into`; what lies beyond the array's end is left as
    /// it is. Called by many threads at once.
    ///
    /// # Errors
    /// They cannot be read, or are not what was written.
    fn read(&self, column: usize, byte: usize, into: &mut [u8]) -> Result<()>;
}
