//! What reports say at their end about the memory that the process took.

use super::options::BuildOptions;
use super::report::{Lines, bytes};
use crate::error::Result;
use crate::study::resident;
use serde::Serialize;

/// The memory that was given and taken.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MemoryReport {
    /// The bytes that the process might take; `None` if `--memory` was not given.
    pub budget: Option<usize>,
    /// The most bytes that it had in memory, where the system says.
    pub peak_resident: Option<u64>,
}

impl MemoryReport {
    /// What there is to say at the end.
    ///
    /// # Errors
    /// The memory given is no size.
    pub fn new(options: &BuildOptions) -> Result<Self> {
        Ok(Self { budget: options.limit()?, peak_resident: resident::peak() })
    }

    /// The same in words, with something more in the same line.
    pub fn describe(&self, lines: &mut Lines, more: &str) {
        let peak = self.peak_resident.map_or("an unknown part".into(), bytes);
        let text = match self.budget {
            Some(budget) => format!("{peak} of {} at most", bytes(budget as u64)),
            None => format!("{peak} at most; no budget was given"),
        };
        lines.add("memory", format!("{text}{more}"));
    }
}
