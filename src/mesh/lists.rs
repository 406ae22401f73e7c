//! The lists that a reader fills: in memory, or in files where the model is larger than that.

use super::ImageSource;
use crate::files::write_at;
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use std::cell::{Cell, OnceCell};
use std::collections::TryReserveError;
use std::fs::File;
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where a reader's lists are kept.
pub(super) trait Lists {
    /// A list.
    type Of<T: Pod>: List<T>;

    /// An empty list.
    ///
    /// # Errors
    /// No file can be made.
    fn list<T: Pod>(&self) -> io::Result<Self::Of<T>>;

    /// Keeps a copy of a picture file's bytes.
    ///
    /// # Errors
    /// There is no room.
    fn picture(&self, bytes: &[u8]) -> io::Result<ImageSource>;
}

/// A list that grows at its end.
pub(super) trait List<T: Copy> {
    /// How many values it has.
    fn len(&self) -> usize;

    /// Adds a value.
    fn push(&mut self, value: T);

    /// Says that so many values will come.
    ///
    /// # Errors
    /// There is not enough memory for them.
    fn expect(&mut self, _count: usize) -> Result<(), TryReserveError> {
        Ok(())
    }

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

    fn picture(&self, bytes: &[u8]) -> io::Result<ImageSource> {
        Ok(ImageSource::Bytes(bytes.into()))
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

    fn expect(&mut self, count: usize) -> Result<(), TryReserveError> {
        self.try_reserve_exact(count)
    }
}

/// Lists in files in a folder.
pub(super) struct InFiles {
    folder: PathBuf,
    /// All pictures are in one file, as there may be more of them than files can be open.
    pictures: OnceCell<Arc<File>>,
    /// Where the next picture begins.
    end: Cell<u64>,
}

impl InFiles {
    /// In this folder.
    pub fn new(folder: impl Into<PathBuf>) -> Self {
        Self { folder: folder.into(), pictures: OnceCell::new(), end: Cell::new(0) }
    }

    /// The folder.
    pub fn folder(&self) -> &Path {
        &self.folder
    }
}

impl Lists for InFiles {
    type Of<T: Pod> = Spool<T>;

    fn list<T: Pod>(&self) -> io::Result<Spool<T>> {
        Spool::new(&self.folder)
    }

    fn picture(&self, bytes: &[u8]) -> io::Result<ImageSource> {
        let file = match self.pictures.get() {
            Some(file) => Arc::clone(file),
            None => {
                let file = Arc::new(tempfile::tempfile_in(&self.folder)?);
                Arc::clone(self.pictures.get_or_init(|| file))
            }
        };
        let start = self.end.get();
        write_at(&file, bytes, start)?;
        self.end.set(start + bytes.len() as u64);
        Ok(ImageSource::Packed(Arc::new(Spooled::<u8>::in_file(file, start, bytes.len()))))
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
