//! The lists that a reader fills: in memory, or in files where the model is larger than that.

use crate::spool::Spool;
use bytemuck::Pod;
use std::io;
use std::path::PathBuf;

/// Where a reader's lists are kept.
pub(super) trait Lists {
    /// A list.
    type Of<T: Pod>: List<T>;

    /// An empty list.
    ///
    /// # Errors
    /// No file can be made.
    fn list<T: Pod>(&self) -> io::Result<Self::Of<T>>;
}

/// A list that grows at its end.
pub(super) trait List<T: Copy> {
    /// How many values it has.
    fn len(&self) -> usize;

    /// Adds a value.
    fn push(&mut self, value: T);

    /// Says that so many values will come.
    fn expect(&mut self, _count: usize) {}

    /// Adds a value so many times.
    fn push_times(&mut self, value: T, times: usize) {
        (0..times).for_each(|_| self.push(value));
    }

    /// Adds a value until there are so many.
    fn fill(&mut self, value: T, count: usize) {
        self.push_times(value, count.saturating_sub(self.len()));
    }
}

/// What readers say of a list that could not be begun.
pub(super) fn no_room(error: io::Error) -> String {
    format!("there is no room for what it holds: {error}")
}

/// Lists in memory.
pub(super) struct InMemory;

impl Lists for InMemory {
    type Of<T: Pod> = Vec<T>;

    fn list<T: Pod>(&self) -> io::Result<Vec<T>> {
        Ok(Vec::new())
    }
}

impl<T: Copy> List<T> for Vec<T> {
    fn len(&self) -> usize {
        self.len()
    }

    #[inline]
    fn push(&mut self, value: T) {
        self.push(value);
    }

    fn expect(&mut self, count: usize) {
        self.reserve_exact(count);
    }
}

/// Lists in files in this folder.
pub(super) struct InFiles(pub PathBuf);

impl Lists for InFiles {
    type Of<T: Pod> = Spool<T>;

    fn list<T: Pod>(&self) -> io::Result<Spool<T>> {
        Spool::new(&self.0)
    }
}

impl<T: Pod> List<T> for Spool<T> {
    fn len(&self) -> usize {
        self.len()
    }

    #[inline]
    fn push(&mut self, value: T) {
        self.push(value);
    }
}
