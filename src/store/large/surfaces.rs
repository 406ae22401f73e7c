//! The sections that a mesh makes: its own arrays, and its triangles' records.

use super::super::out::Out;
use super::super::section::Kind;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::Scale;
use crate::mesh::Material;
use crate::mesh::spooled::{SpooledColors, SpooledMesh};
use crate::spool::Spooled;
use bytemuck::Pod;
use rayon::prelude::*;
use std::io::{self, Seek, Write};

/// What was found out on the way.
pub struct Surfaces {
    /// Where in the file the records begin.
    pub records: u64,
    /// The box around all triangles, in the tree's coordinates.
    pub bounds: Aabb,
    /// Triangles whose corners lie on one line.
    pub zero_area: u64,
    /// How many triangles each of the materials has.
    pub uses: Vec<u64>,
}

/// Triangles that a task looks at.
const TASK: usize = 1 << 14;

/// Writes all sections that are made of the mesh alone.
///
/// # Errors
/// Something cannot be written, or read.
pub fn write<W: Write + Seek>(
    out: &mut Out<'_, W>,
    mesh: &SpooledMesh,
    scale: Scale,
    progress: &dyn Fn(f64),
) -> io::Result<Surfaces> {
    let mut uses = Vec::new();
    copy(out, Kind::Positions, &mesh.positions)?;
    copy(out, Kind::Indices, &mesh.triangles)?;
    progress(0.2);
    match &mesh.colors {
        SpooledColors::Uniform(_) => {}
        SpooledColors::PerTriangle(colors) => copy(out, Kind::TriangleColors, colors)?,
        SpooledColors::PerVertex(colors) => {
            copy(out, Kind::VertexColors, colors)?;
            out.begin(Kind::CornerColors)?;
            by_task(
                &mesh.triangles,
                |corners| of_corners(colors, corners),
                |colors| out.put(colors.as_flattened().as_flattened()),
            )?;
            out.end()?;
        }
        SpooledColors::PerMaterial { materials, of_triangle } => {
            copy(out, Kind::MaterialOfTriangle, of_triangle)?;
            uses = count(of_triangle, materials.len())?;
            write_emitters(out, materials, of_triangle, &uses)?;
        }
    }
    progress(0.4);

    let record = |corners: [glam::Vec3; 3]| {
        let corners = corners.map(|position| position.to_array());
        Triangle::new(if scale.is_none() { corners } else { scale.apply(&corners) })
    };
    let records = |corners: &[[u32; 3]]| {
        Ok(of_corners(&mesh.positions, corners)?.into_iter().map(record).collect::<Vec<_>>())
    };
    let (mut bounds, mut zero_area, mut done) = (Aabb::EMPTY, 0, 0);
    out.begin(Kind::Triangles)?;
    by_task(&mesh.triangles, records, |records| {
        for Triangle { corners, plane } in &records {
            bounds = bounds.union(Aabb::of_points(corners.map(Into::into)));
            zero_area += u64::from(*plane == [0.0; 3]);
        }
        done += records.len();
        progress(0.4 + 0.6 * done as f64 / mesh.triangles.len() as f64);
        out.put(bytemuck::cast_slice(&records))
    })?;
    let section = out.end()?;
    Ok(Surfaces { records: section.offset, bounds, zero_area, uses })
}

/// How many triangles each of so many materials has.
fn count(of_triangle: &Spooled<u32>, materials: usize) -> io::Result<Vec<u64>> {
    let mut uses = vec![0; materials];
    of_triangle.each(|_, some| {
        some.iter().for_each(|&material| uses[material as usize] += 1);
        Ok::<(), io::Error>(())
    })?;
    Ok(uses)
}

/// Writes the section `emitters`, if any triangle gives off light.
fn write_emitters<W: Write + Seek>(
    out: &mut Out<'_, W>,
    materials: &[Material],
    of_triangle: &Spooled<u32>,
    uses: &[u64],
) -> io::Result<()> {
    let emits: Vec<bool> = materials.iter().map(Material::emits).collect();
    if !emits.iter().zip(uses).any(|(&emits, &uses)| emits && uses > 0) {
        return Ok(());
    }
    out.begin(Kind::Emitters)?;
    of_triangle.each(|first, some| {
        let some = (first as u32..).zip(some).filter(|&(_, &material)| emits[material as usize]);
        let some: Vec<u32> = some.map(|(primitive, _)| primitive).collect();
        out.put(bytemuck::cast_slice(&some))
    })?;
    out.end().map(drop)
}

/// Makes a list a section.
fn copy<W: Write + Seek, T: Pod>(out: &mut Out<'_, W>, kind: Kind, list: &Spooled<T>) -> io::Result<()> {
    out.begin(kind)?;
    list.each(|_, values| out.put(bytemuck::cast_slice(values)))?;
    out.end().map(drop)
}

/// Makes something of all triangles, task by task on all threads, and gives it in order.
fn by_task<T: Send>(
    triangles: &Spooled<[u32; 3]>,
    make: impl Fn(&[[u32; 3]]) -> io::Result<Vec<T>> + Sync,
    mut give: impl FnMut(Vec<T>) -> io::Result<()>,
) -> io::Result<()> {
    triangles.each(|_, some| {
        let made: Vec<io::Result<Vec<T>>> = some.par_chunks(TASK).map(&make).collect();
        made.into_iter().try_for_each(|made| give(made?))
    })
}

/// The values that the corners of some triangles have.
fn of_corners<T: Pod>(list: &Spooled<T>, corners: &[[u32; 3]]) -> io::Result<Vec<[T; 3]>> {
    /// So many values are read for each that is wanted, if they lie together.
    const DENSE: usize = 4;
    let vertices = corners.as_flattened();
    let (Some(&first), Some(&last)) = (vertices.iter().min(), vertices.iter().max()) else {
        return Ok(Vec::new());
    };
    let span = (last - first) as usize + 1;
    if span <= DENSE * vertices.len() {
        let mut values = vec![T::zeroed(); span];
        list.read(first as usize, &mut values)?;
        return Ok(corners
            .iter()
            .map(|corners| corners.map(|vertex| values[(vertex - first) as usize]))
            .collect());
    }
    let mut places = vertices.to_vec();
    places.sort_unstable();
    places.dedup();
    let values = list.scattered(&places)?;
    let value = |vertex: u32| values[places.binary_search(&vertex).expect("all were read")];
    Ok(corners.iter().map(|corners| corners.map(value)).collect())
}
