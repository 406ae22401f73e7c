//! References that wait in a file.

use crate::error::{Error, Result};
use crate::files::{read_at, write_at};
use crate::kdtree::outer::{PIECE, Shelf};
use std::fs::File;
use std::io;
use std::path::Path;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// A file of places, each for a piece.
pub struct FileShelf<'a> {
    file: File,
    places: Mutex<Places>,
    /// What errors name.
    path: &'a Path,
}

/// Places that are in use lie below `end`, and are not among those that are free.
#[derive(Default)]
struct Places {
    free: Vec<usize>,
    end: usize,
}

impl<'a> FileShelf<'a> {
    /// An empty shelf in a file in `folder`, which vanishes with it. `path` is what errors name.
    ///
    /// # Errors
    /// No file can be made there.
    pub fn new(folder: &Path, path: &'a Path) -> Result<Self> {
        let file =
            tempfile::tempfile_in(folder).map_err(|source| Error::Write { path: path.into(), source })?;
        Ok(Self { file, places: Mutex::default(), path })
    }

    fn places(&self) -> MutexGuard<'_, Places> {
        // Nothing panics while it is locked.
        self.places.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn offset(place: usize) -> u64 {
        (place * PIECE) as u64
    }

    fn cannot(&self) -> impl Fn(io::Error) -> Error + '_ {
        |source| Error::Write { path: self.path.into(), source }
    }
}

impl Shelf for FileShelf<'_> {
    fn put(&self, piece: &[u8]) -> Result<usize> {
        assert!(piece.len() <= PIECE, "a piece of {} bytes", piece.len());
        let mut places = self.places();
        let place = places.free.pop().unwrap_or_else(|| {
            places.end += 1;
            places.end - 1
        });
        drop(places);
        write_at(&self.file, piece, Self::offset(place)).map_err(self.cannot())?;
        Ok(place)
    }

    fn get(&self, place: usize, into: &mut [u8]) -> Result<()> {
        read_at(&self.file, into, Self::offset(place)).map_err(self.cannot())
    }

    fn clear(&self, place: usize) {
        self.places().free.push(place);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_keep_apart_and_places_are_used_again() {
        let shelf = FileShelf::new(&std::env::temp_dir(), Path::new("a.rpk")).expect("a shelf");
        let piece = |byte: u8| vec![byte; PIECE - usize::from(byte)];
        let places: Vec<usize> = (0..5).map(|byte| shelf.put(&piece(byte)).expect("room")).collect();
        shelf.clear(places[1]);
        assert_eq!(shelf.put(&piece(9)).expect("room"), places[1]);
        let mut read = vec![0; 100];
        for (byte, &place) in [0, 9, 2, 3, 4].iter().zip(&places) {
            shelf.get(place, &mut read).expect("readable");
            assert_eq!(read, [*byte; 100]);
        }
        let beyond = shelf.get(7, &mut read).expect_err("nothing is there").to_string();
        assert!(beyond.starts_with("cannot write a.rpk: "), "{beyond}");
    }
}
