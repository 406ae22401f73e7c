//! Plants straight into files, for sizes that memory does not hold.

use super::{PlantParams, palette, parts};
use crate::error::Result;
use crate::files;
use crate::mesh::generate::Size;
use crate::mesh::ply;
use std::convert::Infallible;
use std::io;
use std::path::Path;

/// Makes a plant and writes it as binary PLY, part by part: the same bytes as [`ply::write`] makes of
/// the mesh of [`generate`](super::generate), but memory holds one part at a time.
///
/// The plant is made twice. A PLY file begins with its numbers of vertices and triangles, which say
/// where its faces begin; the first time finds them out, so that the second can put everything where it
/// belongs, in one file. `progress` is told what part of the work (0 to 1) is behind.
///
/// # Errors
///
/// [`Error::Write`](crate::Error::Write). Nothing is left behind then, and what `path` held before stays.
pub fn write(path: impl AsRef<Path>, params: PlantParams, progress: &dyn Fn(f64)) -> Result<Size> {
    let fraction = |triangles: u64| (triangles as f64 / params.triangles.max(1) as f64).min(1.0);
    let mut size = Size::default();
    let Ok(()) = parts::<Infallible>(params, |part| {
        size += part.size();
        progress(COUNTING * fraction(size.triangles));
        Ok(())
    });
    files::write_whole(path.as_ref(), |out| {
        let mut file = ply::PartWriter::begin(out, size, &palette::materials())?;
        parts::<io::Error>(params, |part| {
            file.part(part)?;
            progress(COUNTING + (1.0 - COUNTING) * fraction(file.written().triangles));
            Ok(())
        })?;
        file.finish()
    })?;
    Ok(size)
}

/// The part of the time that counting takes, for the progress bar.
const COUNTING: f64 = 0.3;
