//! Corners at the same place made one vertex, within little memory.
//!
//! A table of all vertices may be more than memory holds. So each corner goes, by a hash of its place, to one of many
//! parts, which lie in a file; then the parts are taken one after the other, each with a table of its own, that finds
//! for each of its corners the first one at the same place. The corners that are the first at their places are the
//! vertices, and have a bit. One more walk over all corners in their order takes each one's first from its part's
//! list, and numbers vertices by the bits that are set before: as a table of all would have, in the order in which they
//! are met.
//!
//! What is in memory is one part's table, three bits a triangle and half as much again, and some 16 KiB a part for what
//! waits to be written, or read.

use crate::mesh::bits::Bits;
use crate::mesh::lists::{InFiles, Lists};
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use glam::Vec3;
use std::collections::HashMap;
use std::hash::{BuildHasher, RandomState};
use std::io;
use std::ops::Range;

/// What tells vertices apart: the bits of a corner's place, or anything else of that size.
pub(in crate::mesh) type Key = [u32; 3];

/// A corner: its key, and its number among all.
type Record = [u32; 4];

/// Records that are written and read at once.
const PIECE: usize = 1024;

/// About how many corners a part has: its table then takes 27 MiB if no two are at the same place.
const CORNERS_PER_PART: usize = 1 << 19;

/// The most parts. A byte says which one it is.
const MOST_PARTS: usize = 256;

/// Triangles whose corners are yet to be welded.
pub(in crate::mesh) struct Weld {
    parts: Vec<Part>,
    /// The full pieces of all parts.
    pieces: Spool<Record>,
    /// By triangle, its corners' parts.
    parts_of: Spool<[u8; 3]>,
    /// Keyed anew each time: no file can be made of which all corners go to one part. Nothing that comes out depends
    /// on it.
    hasher: RandomState,
}

/// The corners of a part, in their order.
#[derive(Default)]
struct Part {
    /// Its full pieces' numbers among all.
    pieces: Vec<u32>,
    /// The corners after these.
    waiting: Vec<Record>,
}

impl Weld {
    /// No triangles yet, of which so many may come. More than `MAX_TRIANGLES` never do.
    ///
    /// # Errors
    /// No file can be made.
    pub fn new(lists: &InFiles, triangles: usize) -> io::Result<Self> {
        let parts = triangles.saturating_mul(3).div_ceil(CORNERS_PER_PART);
        Self::in_parts(lists, parts.clamp(1, MOST_PARTS))
    }

    /// The same in so many parts, 1 to [`MOST_PARTS`].
    fn in_parts(lists: &InFiles, parts: usize) -> io::Result<Self> {
        Ok(Self {
            parts: (0..parts).map(|_| Part::default()).collect(),
            pieces: lists.list()?,
            parts_of: lists.list()?,
            hasher: RandomState::new(),
        })
    }

    /// Adds a triangle, whose corners are told apart by their places.
    pub fn add(&mut self, corners: [Vec3; 3]) {
        self.add_keys(corners.map(|corner| corner.to_array().map(f32::to_bits)));
    }

    /// Adds a triangle with corners of these keys.
    pub fn add_keys(&mut self, corners: [Key; 3]) {
        let mut number = 3 * self.parts_of.len() as u32;
        self.parts_of.push(corners.map(|[x, y, z]| {
            let place = (self.hasher.hash_one([x, y, z]) % self.parts.len() as u64) as usize;
            let part = &mut self.parts[place];
            part.waiting.push([x, y, z, number]);
            number += 1;
            if part.waiting.len() == PIECE {
                part.pieces.push((self.pieces.len() / PIECE) as u32);
                self.pieces.extend_from_slice(&part.waiting);
                part.waiting.clear();
            }
            place as u8
        }));
    }

    /// The vertices, in the order in which triangles name them first, and the triangles. `progress` is told now and
    /// then what part (0 to 1) is behind.
    ///
    /// # Errors
    /// Something cannot be written, or read.
    pub fn finish(
        self,
        lists: &InFiles,
        progress: &dyn Fn(f32),
    ) -> io::Result<(Spooled<Vec3>, Spooled<[u32; 3]>)> {
        let (keys, triangles) = self.finish_keys(lists, progress)?;
        // A place is its bits.
        Ok((Spooled::in_file(keys.file(), 0, keys.len()), triangles))
    }

    /// The vertices' keys, likewise, and the triangles.
    ///
    /// # Errors
    /// Something cannot be written, or read.
    pub fn finish_keys(
        self,
        lists: &InFiles,
        progress: &dyn Fn(f32),
    ) -> io::Result<(Spooled<Key>, Spooled<[u32; 3]>)> {
        let (pieces, parts_of) = (self.pieces.finish()?, self.parts_of.finish()?);
        let mut is_first = Bits::new(3 * parts_of.len());
        let mut found = Found { firsts: lists.list()?, keys: lists.list()? };
        let mut ranges = Vec::with_capacity(self.parts.len());
        let mut table = HashMap::new();
        for (done, part) in self.parts.iter().enumerate() {
            progress(0.5 * done as f32 / self.parts.len() as f32);
            let (first, key) = (found.firsts.len(), found.keys.len());
            part.find(&pieces, &mut table, &mut is_first, &mut found)?;
            ranges.push((first..found.firsts.len(), key..found.keys.len()));
        }
        drop((pieces, table, self.parts));

        let (firsts, keys) = (found.firsts.finish()?, found.keys.finish()?);
        let ahead = |(first, key)| (Ahead::new(&firsts, first), Ahead::new(&keys, key));
        let mut of_parts: Vec<_> = ranges.into_iter().map(ahead).collect();
        let numbers = is_first.numbers();
        let (mut vertices, mut triangles) = (lists.list()?, lists.list()?);
        parts_of.each(|done, some| {
            progress(0.5 + 0.5 * done as f32 / parts_of.len() as f32);
            for (triangle, parts) in (done..).zip(some) {
                let mut corners = [0; 3];
                for (i, &part) in parts.iter().enumerate() {
                    let (firsts, keys) = &mut of_parts[usize::from(part)];
                    let first = firsts.next()?;
                    if first as usize == 3 * triangle + i {
                        vertices.push(keys.next()?);
                    }
                    corners[i] = numbers.of(first as usize);
                }
                triangles.push(corners);
            }
            Ok::<(), io::Error>(())
        })?;
        Ok((vertices.finish()?, triangles.finish()?))
    }
}

/// What was found of the parts, one after the other.
struct Found {
    /// For each corner, the first that has the same key.
    firsts: Spool<u32>,
    /// The keys of those that are the first.
    keys: Spool<Key>,
}

impl Part {
    /// Finds the first corner with each one's key. `table` is for that; what is in it does not count.
    fn find(
        &self,
        pieces: &Spooled<Record>,
        table: &mut HashMap<Key, u32>,
        is_first: &mut Bits,
        found: &mut Found,
    ) -> io::Result<()> {
        table.clear();
        let mut find = |records: &[Record]| {
            for &[x, y, z, corner] in records {
                let first = *table.entry([x, y, z]).or_insert_with(|| {
                    is_first.set(corner as usize);
                    found.keys.push([x, y, z]);
                    corner
                });
                found.firsts.push(first);
            }
        };
        let mut piece = [[0; 4]; PIECE];
        for &number in &self.pieces {
            pieces.read(number as usize * PIECE, &mut piece)?;
            find(&piece);
        }
        find(&self.waiting);
        Ok(())
    }
}

/// The values of a piece of a list, one after the other.
struct Ahead<'a, T> {
    list: &'a Spooled<T>,
    /// What is to be read yet.
    rest: Range<usize>,
    read: std::vec::IntoIter<T>,
}

impl<'a, T: Pod> Ahead<'a, T> {
    fn new(list: &'a Spooled<T>, rest: Range<usize>) -> Self {
        Self { list, rest, read: Vec::new().into_iter() }
    }

    /// The next. Panics if there is none.
    fn next(&mut self) -> io::Result<T> {
        loop {
            if let Some(value) = self.read.next() {
                return Ok(value);
            }
            assert!(!self.rest.is_empty(), "as many are taken as were put in");
            let mut some = vec![T::zeroed(); self.rest.len().min(PIECE)];
            self.list.read(self.rest.start, &mut some)?;
            self.rest.start += some.len();
            self.read = some.into_iter();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::Soup;
    use super::*;

    /// Triangles of which corners meet in every way: within one, with the one before, with others far away.
    fn triangles(count: u32) -> impl Iterator<Item = [Vec3; 3]> {
        let place = |i: u32| Vec3::new((i % 61) as f32, (i / 61 % 53) as f32, f32::from_bits(i % 3));
        let scattered = move |i: u32| place(i.wrapping_mul(2_654_435_761) >> 16);
        (0..count).map(move |i| match i % 7 {
            0 => [place(i), place(i), place(i + 1)],
            1 => [Vec3::splat(f32::NAN), place(i - 1), scattered(i)],
            _ => [place(i), scattered(i), scattered(3 * i)],
        })
    }

    #[test]
    fn vertices_are_those_of_one_table_in_their_order() {
        let lists = InFiles::new(std::env::temp_dir());
        for (count, parts) in [(0, 1), (1, 1), (2, 256), (4000, 1), (4000, 3), (20_000, 5)] {
            let mut soup = Soup::default();
            let mut weld = Weld::in_parts(&lists, parts).expect("room");
            triangles(count).for_each(|corners| {
                soup.add(corners);
                weld.add(corners);
            });
            let full = weld.parts.iter().filter(|part| !part.pieces.is_empty()).count();
            assert_eq!(full, if count < 4000 { 0 } else { parts }, "pieces are written");
            let (positions, triangles) = weld.finish(&lists, &|_| ()).expect("room");
            let bits = |places: &[Vec3]| bytemuck::cast_slice::<_, u32>(places).to_vec();
            assert_eq!(triangles.to_vec().expect("readable"), soup.mesh.triangles);
            assert_eq!(bits(&positions.to_vec().expect("readable")), bits(&soup.mesh.positions));
        }
    }

    #[test]
    fn parts_are_as_many_as_their_tables_ask_for() {
        let lists = InFiles::new(std::env::temp_dir());
        let parts = |triangles| Weld::new(&lists, triangles).expect("room").parts.len();
        let part = CORNERS_PER_PART / 3;
        assert_eq!([0, 1, part, part + 1, 100 * part].map(parts), [1, 1, 1, 2, 100]);
        assert_eq!(parts(usize::MAX), MOST_PARTS);
    }
}
