//! Lists that wait in files: what a build of more than memory holds reads once and again.
//!
//! A [`Spool`] grows at its end, a [`Spooled`] is read from any place. Both read and write explicitly: what is in
//! memory is what the caller holds, and a full disk is an error.

use crate::files::read_at;
use bytemuck::{AnyBitPattern, NoUninit, Zeroable};
use std::fs::File;
use std::io::{self, BufWriter, Write};
use std::marker::PhantomData;
use std::path::Path;
use std::sync::Arc;

/// Bytes that are written or read at once.
const AT_ONCE: usize = 1 << 20;

/// A list in a file without a name, which vanishes with its last owner.
#[derive(Debug)]
pub struct Spool<T> {
    file: BufWriter<File>,
    len: usize,
    /// Why it could not be written. What is pushed later is lost.
    failed: Option<io::Error>,
    values: PhantomData<T>,
}

impl<T: NoUninit + AnyBitPattern> Spool<T> {
    /// An empty list in a file in `folder`.
    ///
    /// # Errors
    /// No file can be made there.
    pub fn new(folder: &Path) -> io::Result<Self> {
        let file = BufWriter::with_capacity(AT_ONCE, tempfile::tempfile_in(folder)?);
        Ok(Self { file, len: 0, failed: None, values: PhantomData })
    }

    /// How many values it has.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Adds a value. That it could not be written is told by [`finish`](Self::finish).
    #[inline]
    pub fn push(&mut self, value: T) {
        self.extend_from_slice(&[value]);
    }

    /// Adds values, likewise.
    #[inline]
    pub fn extend_from_slice(&mut self, values: &[T]) {
        self.len += values.len();
        if self.failed.is_none()
            && let Err(error) = self.file.write_all(bytemuck::cast_slice(values))
        {
            self.failed = Some(error);
        }
    }

    /// Whether all has been written so far that was to be.
    ///
    /// # Errors
    /// Something could not be written.
    pub fn check(&mut self) -> io::Result<()> {
        // An error is told once; that there was one is remembered.
        self.failed.take().map_or(Ok(()), |error| {
            self.failed = Some(error.kind().into());
            Err(error)
        })
    }

    /// The whole list.
    ///
    /// # Errors
    /// Something could not be written.
    pub fn finish(self) -> io::Result<Spooled<T>> {
        if let Some(error) = self.failed {
            return Err(error);
        }
        let file = self.file.into_inner()?;
        Ok(Spooled::in_file(Arc::new(file), 0, self.len))
    }
}

/// A list in a file.
#[derive(Clone, Debug)]
pub struct Spooled<T> {
    file: Arc<File>,
    offset: u64,
    len: usize,
    values: PhantomData<T>,
}

impl<T: NoUninit + AnyBitPattern> Spooled<T> {
    /// Values that lie in a file from a byte on.
    pub fn in_file(file: Arc<File>, offset: u64, len: usize) -> Self {
        Self { file, offset, len, values: PhantomData }
    }

    /// How many values it has.
    pub fn len(&self) -> usize {
        self.len
    }

    /// Whether it has none.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// The file that it lies in.
    pub fn file(&self) -> Arc<File> {
        Arc::clone(&self.file)
    }

    /// Reads the values from the `first` on. Panics if there are not as many.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn read(&self, first: usize, into: &mut [T]) -> io::Result<()> {
        assert!(first + into.len() <= self.len, "a list of {}", self.len);
        let offset = self.offset + (first * size_of::<T>()) as u64;
        read_at(&self.file, bytemuck::cast_slice_mut(into), offset)
    }

    /// All values, in memory.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn to_vec(&self) -> io::Result<Vec<T>> {
        let mut values = vec![T::zeroed(); self.len];
        self.read(0, &mut values)?;
        Ok(values)
    }

    /// Shows all values in order, many at a time, with the place of the first of them.
    ///
    /// # Errors
    /// The file cannot be read, or `show` fails.
    pub fn each<E: From<io::Error>>(
        &self,
        mut show: impl FnMut(usize, &[T]) -> Result<(), E>,
    ) -> Result<(), E> {
        let many = (AT_ONCE / size_of::<T>()).min(self.len);
        let mut values = vec![T::zeroed(); many];
        for first in (0..self.len).step_by(many.max(1)) {
            let some = &mut values[..many.min(self.len - first)];
            self.read(first, some)?;
            show(first, some)?;
        }
        Ok(())
    }

    /// The values at some places, which ascend, each once.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn scattered(&self, places: &[u32]) -> io::Result<Vec<T>> {
        scattered(places, |first, into| self.read(first, into))
    }

    /// The values at the places that the corners of some triangles name.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn of_corners(&self, corners: &[[u32; 3]]) -> io::Result<Vec<[T; 3]>> {
        self.of_places(corners)
    }

    /// The values at places in any order, some of which may be the same, so many at a time.
    ///
    /// # Errors
    /// The file cannot be read.
    pub fn of_places<const N: usize>(&self, wanted: &[[u32; N]]) -> io::Result<Vec<[T; N]>> {
        /// So many values are read for each that is wanted, if they lie together.
        const DENSE: usize = 4;
        let all = wanted.as_flattened();
        let (Some(&first), Some(&last)) = (all.iter().min(), all.iter().max()) else {
            return Ok(Vec::new());
        };
        let span = (last - first) as usize + 1;
        if span <= DENSE * all.len() {
            let mut values = vec![T::zeroed(); span];
            self.read(first as usize, &mut values)?;
            let value = |place: u32| values[(place - first) as usize];
            return Ok(wanted.iter().map(|places| places.map(value)).collect());
        }
        let mut places = all.to_vec();
        places.sort_unstable();
        places.dedup();
        let values = self.scattered(&places)?;
        let value = |place: u32| values[places.binary_search(&place).expect("all were read")];
        Ok(wanted.iter().map(|places| places.map(value)).collect())
    }
}

/// Values that lie so close together, in bytes, are read at once, with what is between them.
const GAP: usize = 4096;

/// The most bytes that are read at once.
const RUN: usize = 1 << 20;

/// The values at some places, which ascend; `read` reads those from a place on.
///
/// # Errors
/// What `read` fails with.
pub fn scattered<T: Zeroable + Copy, E>(
    places: &[u32],
    mut read: impl FnMut(usize, &mut [T]) -> Result<(), E>,
) -> Result<Vec<T>, E> {
    let (gap, most) = ((GAP / size_of::<T>()) as u32, (RUN / size_of::<T>()) as u32);
    let mut found = Vec::with_capacity(places.len());
    let mut run = Vec::new();
    let mut rest = places;
    while let Some(&first) = rest.first() {
        let near = |pair: &[u32]| pair[1] - pair[0] <= gap && pair[1] - first < most;
        let length = 1 + rest.windows(2).take_while(|pair| near(pair)).count();
        let (wanted, behind) = rest.split_at(length);
        run.clear();
        run.resize((wanted[length - 1] - first) as usize + 1, T::zeroed());
        read(first as usize, &mut run)?;
        found.extend(wanted.iter().map(|&place| run[(place - first) as usize]));
        rest = behind;
    }
    Ok(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spooled(values: &[u32]) -> Spooled<u32> {
        let mut spool = Spool::new(&std::env::temp_dir()).expect("a file");
        spool.extend_from_slice(&values[..values.len() / 2]);
        values[values.len() / 2..].iter().for_each(|&value| spool.push(value));
        assert_eq!(spool.len(), values.len());
        spool.finish().expect("written")
    }

    #[test]
    fn what_was_pushed_comes_back() {
        for count in [0, 1, 1000, AT_ONCE / 2 + 3] {
            let values: Vec<u32> = (0..count as u32).map(|i| i.wrapping_mul(2_654_435_761)).collect();
            let list = spooled(&values);
            assert_eq!((list.len(), list.is_empty()), (count, count == 0));
            let mut all = Vec::new();
            let show = |first: usize, some: &[u32]| {
                assert_eq!(first, all.len());
                all.extend_from_slice(some);
                Ok::<(), io::Error>(())
            };
            list.each(show).expect("readable");
            assert_eq!((&all, list.to_vec().expect("readable")), (&values, values.clone()));
        }
    }

    #[test]
    fn scattered_values_are_read_in_runs() {
        let list = spooled(&(0..500_000).map(|i| i * 3).collect::<Vec<u32>>());
        let places = [7, 8, 1031, 1032 + 1025, 300_000, 499_999];
        assert_eq!(list.scattered(&places).expect("readable"), places.map(|place| place * 3));
        let mut runs = Vec::new();
        let read = |first: usize, into: &mut [u32]| {
            runs.push((first, into.len()));
            list.read(first, into)
        };
        scattered(&places, read).expect("readable");
        assert_eq!(runs, [(7, 1025), (2057, 1), (300_000, 1), (499_999, 1)]);
        // A run ends where it is long enough.
        let all: Vec<u32> = (0..500_000).collect();
        assert_eq!(list.scattered(&all).expect("readable").len(), 500_000);
        assert!(list.scattered(&[]).expect("readable").is_empty());
    }

    #[test]
    #[should_panic(expected = "a list of 3")]
    fn nothing_is_read_behind_the_end() {
        let _ = spooled(&[1, 2, 3]).read(2, &mut [0; 2]);
    }
}
