//! Plants into files of lists, for scene files of sizes that memory does not hold.

use super::{PlantParams, palette, parts};
use crate::error::{Error, Result};
use crate::mesh::lists::InFiles;
use crate::mesh::ply;
use crate::mesh::spooled::{SpooledColors, SpooledMesh, Whole};
use crate::spool::Spool;
use std::io;
use std::path::Path;

/// Makes a plant, part by part, to files in `folder`, which vanish with it: the mesh that the reader makes of what
/// [`write`](super::write()) writes. `progress` is told what part of the work (0 to 1) is behind.
///
/// # Errors
/// There is no room in `folder`.
pub fn spool(folder: &Path, params: PlantParams, progress: &dyn Fn(f64)) -> Result<SpooledMesh> {
    let whole = whole(folder, params, &|part| progress(0.8 * part));
    let whole = whole.map_err(|source| Error::Write { path: folder.into(), source })?;
    let told = |part: f32| progress(0.8 + 0.2 * f64::from(part));
    whole.checked(&InFiles::new(folder), folder, &mut Default::default(), &told)
}

fn whole(folder: &Path, params: PlantParams, progress: &dyn Fn(f64)) -> io::Result<Whole> {
    let (mut positions, mut triangles, mut colors) =
        (Spool::new(folder)?, Spool::new(folder)?, Spool::new(folder)?);
    let shades = ply::shades(&palette::materials());
    parts::<io::Error>(params, |part| {
        // Not more than some 200 million triangles have not more vertices than can be numbered.
        let base = positions.len() as u32;
        positions.extend_from_slice(part.positions);
        part.triangles.iter().for_each(|triangle| triangles.push(triangle.map(|vertex| base + vertex)));
        part.of_triangle.iter().for_each(|&material| colors.push(shades[material as usize]));
        positions.check()?;
        triangles.check()?;
        progress((triangles.len() as f64 / params.triangles.max(1) as f64).min(1.0));
        colors.check()
    })?;
    Ok(Whole {
        positions: positions.finish()?,
        triangles: triangles.finish()?,
        colors: SpooledColors::PerTriangle(colors.finish()?),
        attributes: None,
        images: Vec::new(),
    })
}
