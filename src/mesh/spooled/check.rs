//! The policy of [`check`](super::super::check), pass by pass over lists in files.

use super::super::bits::Bits;
use super::super::check::{MAX_TRIANGLES, NonFinite, Unusable};
use super::{SpooledColors, SpooledMesh, Whole};
use crate::geometry::Aabb;
use crate::mesh::ReadReport;
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use std::io;
use std::path::Path;

/// Why there is no mesh.
pub(super) enum Fault {
    Io(io::Error),
    Unusable(Unusable),
}

impl From<io::Error> for Fault {
    fn from(error: io::Error) -> Self {
        Self::Io(error)
    }
}

/// The policy of [`check`](super::check), pass by pass.
pub(super) fn check(
    raw: Whole,
    folder: &Path,
    report: &mut ReadReport,
    progress: &dyn Fn(f32),
) -> Result<SpooledMesh, Fault> {
    let Whole { mut positions, mut triangles, mut colors, mut attributes, images } = raw;

    // Which triangles name a vertex twice, and which vertices do the others use?
    let sound = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let mut used = Bits::new(positions.len());
    let mut kept = 0;
    triangles.each(|_, some| {
        for corners in some.iter().filter(|corners| sound(corners)) {
            kept += 1;
            corners.iter().for_each(|&vertex| used.set(vertex as usize));
        }
        Ok::<(), io::Error>(())
    })?;
    progress(0.3);
    report.degenerate_triangles = (triangles.len() - kept) as u64;
    match kept {
        0 => return Err(Fault::Unusable(Unusable::NoTriangles)),
        n if n > MAX_TRIANGLES => return Err(Fault::Unusable(Unusable::TooManyTriangles(n))),
        _ => {}
    }

    // Are all that are used finite, and where are they?
    let (mut bounds, mut bad, mut unused, mut unused_non_finite) = (Aabb::EMPTY, None::<NonFinite>, 0, 0);
    positions.each(|first, some| {
        for (vertex, position) in (first..).zip(some) {
            match (used.get(vertex), position.is_finite()) {
                (true, true) => bounds = bounds.grown(*position),
                (true, false) => {
                    let first = bad.as_ref().map_or(vertex as u32, |bad| bad.first);
                    let count = bad.as_ref().map_or(0, |bad| bad.count) + 1;
                    bad = Some(NonFinite { first, count });
                }
                (false, finite) => {
                    unused += 1;
                    unused_non_finite += u64::from(!finite);
                }
            }
        }
        Ok::<(), io::Error>(())
    })?;
    progress(0.5);
    if let Some(bad) = bad {
        return Err(Fault::Unusable(Unusable::NonFinite(bad)));
    }
    report.unused_vertices += unused;
    report.unused_non_finite += unused_non_finite;

    // Copies without what is dropped.
    if report.degenerate_triangles > 0 {
        colors = match colors {
            SpooledColors::PerTriangle(colors) => {
                SpooledColors::PerTriangle(where_sound(&colors, &triangles, folder, sound)?)
            }
            SpooledColors::PerMaterial { materials, of_triangle } => {
                let of_triangle = where_sound(&of_triangle, &triangles, folder, sound)?;
                SpooledColors::PerMaterial { materials, of_triangle }
            }
            other => other,
        };
        if let Some(list) = &attributes {
            attributes = Some(where_sound(list, &triangles, folder, sound)?);
        }
        triangles = where_sound(&triangles, &triangles, folder, sound)?;
    }
    progress(0.7);
    if unused > 0 {
        let numbers = used.numbers();
        let renamed = |vertex: u32| numbers.of(vertex as usize);
        let mut list = Spool::new(folder)?;
        triangles.each(|_, some| {
            some.iter().for_each(|corners| list.push(corners.map(renamed)));
            Ok::<(), io::Error>(())
        })?;
        triangles = list.finish()?;
        let is_used = |vertex: usize| used.get(vertex);
        positions = where_kept(&positions, folder, is_used)?;
        if let SpooledColors::PerVertex(of_vertices) = &colors {
            colors = SpooledColors::PerVertex(where_kept(of_vertices, folder, is_used)?);
        }
    }
    progress(1.0);
    report.triangles = triangles.len() as u64;
    report.vertices = positions.len() as u64;
    Ok(SpooledMesh { positions, triangles, colors, attributes, images, bounds })
}

/// The values of a list at the places that `keep` accepts.
fn where_kept<T: Pod>(
    list: &Spooled<T>,
    folder: &Path,
    keep: impl Fn(usize) -> bool,
) -> io::Result<Spooled<T>> {
    let mut kept = Spool::new(folder)?;
    list.each(|first, some| {
        for (_, &value) in (first..).zip(some).filter(|(place, _)| keep(*place)) {
            kept.push(value);
        }
        Ok::<(), io::Error>(())
    })?;
    kept.finish()
}

/// The values of a list at the places of the triangles that `sound` accepts.
fn where_sound<T: Pod>(
    list: &Spooled<T>,
    triangles: &Spooled<[u32; 3]>,
    folder: &Path,
    sound: impl Fn(&[u32; 3]) -> bool,
) -> io::Result<Spooled<T>> {
    let mut kept = Spool::new(folder)?;
    let mut values = Vec::new();
    triangles.each(|first, some| {
        values.resize(some.len(), T::zeroed());
        list.read(first, &mut values)?;
        for (_, &value) in some.iter().zip(&values).filter(|(corners, _)| sound(corners)) {
            kept.push(value);
        }
        Ok::<(), io::Error>(())
    })?;
    kept.finish()
}
