//! Hits to a `.npz` file: a zip archive of `.npy` files, stored, not compressed.

use super::header::Header;
use crate::error::Result;
use crate::files::write_whole;
use crate::geometry::Hit;
use crate::scene::{Look, Surface};
use std::io::{self, BufWriter, Seek, Write};
use std::path::Path;
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, ZipWriter};

/// The id of a miss.
const MISS: i64 = -1;

/// Writes hits as arrays for `numpy.load`, one item (of `normal`, one row) a hit:
///
/// | array | type | of a hit | of a miss |
/// |---|---|---|---|
/// | `t` | float32 | the ray's parameter, in lengths of its direction | inf |
/// | `u`, `v` | float32 | barycentric weights of the second and third corner | 0 |
/// | `primitive` | int64 | the triangle's index in the model | -1 |
/// | `geometry` | int64 | the index of the triangle's material, 0 if the model has none | -1 |
/// | `normal` | float32, N x 3 | the geometric normal as in [`Hit::normal`], not normalised | 0 |
///
/// Ids are int64, the type that NumPy itself indexes with: `3 * primitive` cannot overflow.
/// Readers make one mesh of all objects of a file, and what tells its parts apart are its materials, in
/// the order in which `raypack info` lists them. `surface` is the one that the hits' ids belong to.
///
/// # Errors
/// [`Error::Write`](crate::Error::Write); nothing is left behind then.
pub fn write_hits(path: &Path, hits: &[Hit], surface: &impl Surface) -> Result<()> {
    let id = |hit: &Hit| if hit.is_hit() { i64::from(hit.primitive) } else { MISS };
    let reader = surface.reader();
    let geometry = |hit: &Hit| if hit.is_hit() { reader.material(hit.primitive).into() } else { MISS };
    let all = hits.len() as u64;
    write_whole(path, |file| {
        let mut archive = ZipWriter::new(file);
        add(&mut archive, "t", &[all], hits.iter().map(|hit| hit.t))?;
        add(&mut archive, "primitive", &[all], hits.iter().map(id))?;
        add(&mut archive, "geometry", &[all], hits.iter().map(geometry))?;
        add(&mut archive, "u", &[all], hits.iter().map(|hit| hit.u))?;
        add(&mut archive, "v", &[all], hits.iter().map(|hit| hit.v))?;
        add(&mut archive, "normal", &[all, 3], hits.iter().flat_map(|hit| hit.normal.to_array()))?;
        archive.finish().map(drop).map_err(io::Error::other)
    })
}

/// Writes the array `occluded` for `numpy.load`: one bool a ray.
///
/// # Errors
/// [`Error::Write`](crate::Error::Write); nothing is left behind then.
pub fn write_occluded(path: &Path, occluded: &[bool]) -> Result<()> {
    write_whole(path, |file| {
        let mut archive = ZipWriter::new(file);
        add(&mut archive, "occluded", &[occluded.len() as u64], occluded.iter().copied())?;
        archive.finish().map(drop).map_err(io::Error::other)
    })
}

/// A type of NumPy's.
trait Item: Copy {
    /// NumPy's name for it.
    const DESCR: &str;
    /// An item as it is stored.
    type Bytes: AsRef<[u8]>;
    /// The item's bytes.
    fn bytes(self) -> Self::Bytes;
}

impl Item for f32 {
    const DESCR: &str = "<f4";
    type Bytes = [u8; 4];
    fn bytes(self) -> [u8; 4] {
        self.to_le_bytes()
    }
}

impl Item for i64 {
    const DESCR: &str = "<i8";
    type Bytes = [u8; 8];
    fn bytes(self) -> [u8; 8] {
        self.to_le_bytes()
    }
}

impl Item for bool {
    const DESCR: &str = "|b1";
    type Bytes = [u8; 1];
    fn bytes(self) -> [u8; 1] {
        [self.into()]
    }
}

/// Adds an array, in C order.
fn add<T: Item>(
    archive: &mut ZipWriter<impl Write + Seek>,
    name: &str,
    shape: &[u64],
    items: impl Iterator<Item = T>,
) -> io::Result<()> {
    // What a plain entry cannot hold is marked as large beforehand; 4 KiB are for the header.
    let size = shape.iter().product::<u64>().saturating_mul(size_of::<T>() as u64);
    let options = SimpleFileOptions::default()
        .compression_method(CompressionMethod::Stored)
        .large_file(size > u64::from(u32::MAX) - 4096);
    archive.start_file(format!("{name}.npy"), options).map_err(io::Error::other)?;
    // The archive sums up each write by itself, so that they should be large.
    let mut buffered = BufWriter::with_capacity(1 << 16, archive);
    let header = Header { descr: T::DESCR.into(), fortran_order: false, shape: shape.into() };
    buffered.write_all(&header.bytes())?;
    for item in items {
        buffered.write_all(item.bytes().as_ref())?;
    }
    buffered.flush()
}
