//! A tree's arrays that grow in files.

use crate::error::{Error, Result};
use crate::files::write_at;
use crate::kdtree::outer::{Array, Output};
use crate::spool::{Spool, Spooled};
use std::io;
use std::path::Path;

/// A file for each array, which vanish with it.
pub struct Arrays<'a> {
    lists: [Spool<u8>; Array::ALL.len()],
    /// What is written over what: told last, done last.
    patches: Vec<(Array, usize, Vec<u8>)>,
    /// What errors name.
    path: &'a Path,
}

impl<'a> Arrays<'a> {
    /// Empty arrays in files in `folder`. `path` is what errors name.
    ///
    /// # Errors
    /// No files can be made there.
    pub fn new(folder: &Path, path: &'a Path) -> Result<Self> {
        let mut lists = Vec::new();
        for _ in Array::ALL {
            let list = Spool::new(folder).map_err(|source| Error::Write { path: path.into(), source })?;
            lists.push(list);
        }
        let lists = lists.try_into().expect("one each");
        Ok(Self { lists, patches: Vec::new(), path })
    }

    /// The arrays as they are in the end, in the order of [`Array::ALL`].
    ///
    /// # Errors
    /// Something could not be written.
    pub fn finish(self) -> io::Result<Vec<Spooled<u8>>> {
        let lists = self.lists.into_iter().map(Spool::finish).collect::<io::Result<Vec<_>>>()?;
        for (array, at, bytes) in self.patches {
            write_at(&lists[array as usize].file(), &bytes, at as u64)?;
        }
        Ok(lists)
    }
}

impl Output for Arrays<'_> {
    fn append(&mut self, array: Array, bytes: &[u8]) -> Result<()> {
        let list = &mut self.lists[array as usize];
        list.extend_from_slice(bytes);
        list.check().map_err(|source| Error::Write { path: self.path.into(), source })
    }

    fn patch(&mut self, array: Array, at: usize, bytes: &[u8]) -> Result<()> {
        self.patches.push((array, at, bytes.to_vec()));
        Ok(())
    }
}
