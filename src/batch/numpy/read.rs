//! Rays from a `.npy` file.

use super::header::Header;
use crate::error::{Error, Result};
use crate::geometry::Ray;
use glam::Vec3;
use std::fs::File;
use std::io::{self, Read};
use std::path::Path;

/// Floats in a ray.
const COLUMNS: usize = 8;

/// Bytes in a float.
const FLOAT: usize = 4;

/// How the numbers of a file of rays lie.
#[derive(Clone, Copy, Debug)]
struct Layout {
    rays: u64,
    /// Column after column, instead of row after row.
    fortran_order: bool,
    big_endian: bool,
}

impl Layout {
    /// What the header announces, if it is rays.
    fn of(header: &Header) -> Result<Self, String> {
        let big_endian = match header.descr.as_str() {
            "<f4" => false,
            ">f4" => true,
            other => {
                return Err(format!(
                    "its type is '{}', but rays are float32; save rays.astype(np.float32)",
                    other.escape_debug()
                ));
            }
        };
        let [rays, 8] = header.shape[..] else {
            let shape = header.shape.iter().map(u64::to_string).collect::<Vec<_>>().join(" x ");
            let shape = if shape.is_empty() { "a single number".into() } else { format!("of shape {shape}") };
            return Err(format!(
                "the array is {shape}, but rays are N x 8: origin x, y, z, tnear, direction x, y, z, tfar"
            ));
        };
        Ok(Self { rays, fortran_order: header.fortran_order, big_endian })
    }
}

/// Reads rays from a `.npy` file: an array of N x 8 float32, one row a ray, in the order of [`Ray`]'s
/// fields: origin x, y, z, tnear, direction x, y, z, tfar.
///
/// Both byte orders and both of NumPy's array orders (C and Fortran) are understood, and N may be 0. Any
/// numbers make a ray; what is none will hit nothing. The rays take 32 bytes each, and nothing beside
/// them is kept. What follows the array in the file is left unread, as NumPy does.
///
/// # Errors
/// The file cannot be read, is no `.npy` file, is cut short, or holds an array of another shape or type:
/// the message says what to do in NumPy.
pub fn read_rays(path: impl AsRef<Path>) -> Result<Vec<Ray>> {
    RayFile::open(path.as_ref())?.read()
}

/// The same from anything that gives a file's bytes: `length` of them, if that is known, so that an array
/// that cannot be whole is refused at once. If it is not known, the rays' memory grows with what comes,
/// whatever the header announces. `path` is what errors name.
///
/// # Errors
/// As for [`read_rays`].
pub fn read_rays_from(source: impl Read, length: Option<u64>, path: &Path) -> Result<Vec<Ray>> {
    RayFile::new(source, length, path)?.read()
}

/// A `.npy` file of rays whose header has been read: it says how many there are.
#[derive(Debug)]
pub struct RayFile<'a, R> {
    source: R,
    layout: Layout,
    count: usize,
    /// Whether all of them are there, as far as the file's length tells.
    is_whole: bool,
    path: &'a Path,
}

impl<'a> RayFile<'a, File> {
    /// Opens a file.
    ///
    /// # Errors
    /// As for [`read_rays`], as far as the header shows it.
    pub fn open(path: &'a Path) -> Result<Self> {
        let unreadable = |source| Error::Read { path: path.into(), source };
        let file = File::open(path).map_err(unreadable)?;
        let metadata = file.metadata().map_err(unreadable)?;
        if metadata.is_dir() {
            return Err(unreadable(io::ErrorKind::IsADirectory.into()));
        }
        // Of a pipe, the length is not known beforehand.
        Self::new(file, metadata.is_file().then_some(metadata.len()), path)
    }
}

impl<'a, R: Read> RayFile<'a, R> {
    fn new(mut source: R, length: Option<u64>, path: &'a Path) -> Result<Self> {
        let malformed = |message: String| Error::malformed(path, message);
        let (header, header_size) =
            Header::read(&mut source).map_err(|error| failed(path, error))?.map_err(malformed)?;
        let layout = Layout::of(&header).map_err(malformed)?;

        let bytes = layout.rays.checked_mul((COLUMNS * FLOAT) as u64);
        let left = length.map(|length| length.saturating_sub(header_size));
        if left.is_some_and(|left| bytes.is_none_or(|bytes| bytes > left)) {
            let whole = left.unwrap_or_default() / (COLUMNS * FLOAT) as u64;
            return Err(malformed(format!(
                "truncated: the header announces {} rays, but there is room for {whole}; save the array again",
                layout.rays
            )));
        }
        let count = bytes.and_then(|_| usize::try_from(layout.rays).ok());
        let count = count.ok_or_else(|| too_many(path, layout))?;
        Ok(Self { source, layout, count, is_whole: left.is_some(), path })
    }

    /// How many rays there are.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Reads them.
    ///
    /// # Errors
    /// As for [`read_rays`].
    pub fn read(self) -> Result<Vec<Ray>> {
        let Self { mut source, layout, count, is_whole, path } = self;
        let mut rays = Vec::new();
        if is_whole {
            rays.try_reserve_exact(count).map_err(|_| too_many(path, layout))?;
        }
        if layout.fortran_order {
            read_columns(&mut source, count, layout.big_endian, &mut rays)
        } else {
            read_rows(&mut source, count, layout.big_endian, &mut rays)
        }
        .map_err(|error| match error.kind() {
            io::ErrorKind::OutOfMemory => too_many(path, layout),
            _ => failed(path, error),
        })?;
        Ok(rays)
    }
}

/// Why a file cannot be read on.
fn failed(path: &Path, error: io::Error) -> Error {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => {
            Error::malformed(path, "truncated: the file ends before its array does")
        }
        _ => Error::Read { path: path.into(), source: error },
    }
}

fn too_many(path: &Path, layout: Layout) -> Error {
    let message =
        format!("{} rays of 32 bytes are more than the memory holds; cast them in parts", layout.rays);
    Error::malformed(path, message)
}

/// Rows of a C-ordered array.
fn read_rows(source: &mut impl Read, count: usize, big_endian: bool, rays: &mut Vec<Ray>) -> io::Result<()> {
    let floats = count.checked_mul(COLUMNS).ok_or(io::ErrorKind::OutOfMemory)?;
    read_floats(source, floats, big_endian, |_, floats| {
        rays.try_reserve(floats.len() / COLUMNS)?;
        rays.extend(floats.as_chunks::<COLUMNS>().0.iter().map(|&[ox, oy, oz, tnear, dx, dy, dz, tfar]| {
            Ray::segment(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), tnear, tfar)
        }));
        Ok(())
    })
}

/// Columns of a Fortran-ordered array, one after the other.
fn read_columns(
    source: &mut impl Read,
    count: usize,
    big_endian: bool,
    rays: &mut Vec<Ray>,
) -> io::Result<()> {
    for column in 0..COLUMNS {
        read_floats(source, count, big_endian, |first, floats| {
            if column == 0 {
                rays.try_reserve(floats.len())?;
                rays.extend(floats.iter().map(|_| Ray::segment(Vec3::ZERO, Vec3::ZERO, 0.0, 0.0)));
            }
            for (ray, &value) in rays[first..].iter_mut().zip(floats) {
                match column {
                    0..3 => ray.origin[column] = value,
                    3 => ray.tnear = value,
                    4..7 => ray.direction[column - 4] = value,
                    _ => ray.tfar = value,
                }
            }
            Ok(())
        })?;
    }
    Ok(())
}

/// Reads `count` floats, and hands them on in parts of whole rays with the index of the part's first.
fn read_floats(
    source: &mut impl Read,
    count: usize,
    big_endian: bool,
    mut take: impl FnMut(usize, &[f32]) -> io::Result<()>,
) -> io::Result<()> {
    const PART: usize = 1 << 14;
    let mut bytes = vec![0; PART.min(count) * FLOAT];
    let mut floats = Vec::with_capacity(PART.min(count));
    for first in (0..count).step_by(PART) {
        let bytes = &mut bytes[..PART.min(count - first) * FLOAT];
        source.read_exact(bytes)?;
        let words = bytes.as_chunks::<FLOAT>().0.iter();
        floats.clear();
        if big_endian {
            floats.extend(words.map(|&word| f32::from_be_bytes(word)));
        } else {
            floats.extend(words.map(|&word| f32::from_le_bytes(word)));
        }
        take(first, &floats)?;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file as NumPy writes it.
    fn npy(header: &str, floats: impl IntoIterator<Item = f32>) -> Vec<u8> {
        let mut file = b"\x93NUMPY\x01\x00\x76\x00".to_vec();
        file.extend(format!("{header:117}\n").bytes());
        file.extend(floats.into_iter().flat_map(f32::to_le_bytes));
        file
    }

    fn read(file: &[u8]) -> Result<Vec<Ray>> {
        read_rays_from(file, Some(file.len() as u64), Path::new("rays.npy"))
    }

    #[test]
    fn more_rays_than_one_part_come_in_either_order() {
        // Component c of ray i is 8 i + c.
        let count = 20_000u16;
        let ray = |i: u16| std::array::from_fn(|c| f32::from(i) * 8.0 + c as f32);
        let rows = (0..count).flat_map(ray);
        let columns = (0..8).flat_map(|c| (0..count).map(move |i| ray(i)[c]));
        let header =
            |fortran| format!("{{'descr': '<f4', 'fortran_order': {fortran}, 'shape': ({count}, 8), }}");
        let c = read(&npy(&header("False"), rows)).expect("rays");
        let fortran = read(&npy(&header("True"), columns)).expect("rays");
        assert_eq!(c.len(), usize::from(count));
        assert_eq!(c, fortran);
        let [ox, oy, oz, tnear, dx, dy, dz, tfar] = ray(19_999);
        let last = Ray::segment(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), tnear, tfar);
        assert_eq!(c.last(), Some(&last));
    }

    #[test]
    fn absurd_counts_set_no_memory_aside() {
        for count in ["518011763", "1000000000000", "18446744073709551615", "99999999999999999999999"] {
            for fortran in ["False", "True"] {
                let header =
                    format!("{{'descr': '<f4', 'fortran_order': {fortran}, 'shape': ({count}, 8), }}");
                let file = npy(&header, [0.0; 16]);
                for length in [None, Some(file.len() as u64)] {
                    let message = read_rays_from(&file[..], length, Path::new("a.npy"))
                        .expect_err("it cannot be whole")
                        .to_string();
                    assert!(message.starts_with("a.npy: "), "{message}");
                }
            }
        }
    }
}
