//! Where blocks come from.

use super::layout::Array;
use crate::error::Result;
use std::fmt;

/// Something that blocks can be read from.
pub trait Source: Send + Sync + fmt::Debug {
    /// Reads bytes of an array, from `byte` on, to fill `into`, which may reach beyond the array's end to the
    /// next multiple of 4 KiB: whatever is there. Called by many threads at once.
    ///
    /// # Errors
    /// They cannot be read, or are not what was written.
    fn read(&self, array: Array, byte: usize, into: &mut [u8]) -> Result<()>;

    /// The same if that takes no longer than to copy them, as of a file that the system has in memory: whether
    /// it did. What `into` holds otherwise means nothing.
    ///
    /// # Errors
    /// They are not what was written.
    fn read_at_once(&self, _array: Array, _byte: usize, _into: &mut [u8]) -> Result<bool> {
        Ok(false)
    }
}
