//! The sections that a mesh makes: its own arrays, and its triangles' records.

use super::super::out::Out;
use super::super::record::SurfaceRecord;
use super::super::section::Kind;
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::Scale;
use crate::mesh::spooled::{SpooledColors, SpooledMesh};
use crate::mesh::{Attributes, Material};
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
    /// Whether any triangle has normals.
    pub normals: bool,
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
                |corners| colors.of_corners(corners),
                |colors| out.put(colors.as_flattened().as_flattened()),
            )?;
            out.end()?;
        }
        SpooledColors::PerMaterial { materials, of_triangle } => {
            // The records have them, where there are records.
            if mesh.attributes.is_none() {
                copy(out, Kind::MaterialOfTriangle, of_triangle)?;
            }
            uses = count(of_triangle, materials.len())?;
            write_emitters(out, materials, of_triangle, &uses)?;
        }
    }
    let normals = match &mesh.attributes {
        Some(attributes) => write_records(out, attributes, &mesh.colors)?,
        None => false,
    };
    progress(0.4);

    let record = |corners: [glam::Vec3; 3]| {
        let corners = corners.map(|position| position.to_array());
        Triangle::new(if scale.is_none() { corners } else { scale.apply(&corners) })
    };
    let records = |corners: &[[u32; 3]]| {
        Ok(mesh.positions.of_corners(corners)?.into_iter().map(record).collect::<Vec<_>>())
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
    Ok(Surfaces { records: section.offset, bounds, zero_area, uses, normals })
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

/// Writes the section `surface-records`; whether any of them has normals.
fn write_records<W: Write + Seek>(
    out: &mut Out<'_, W>,
    attributes: &Spooled<Attributes>,
    colors: &SpooledColors,
) -> io::Result<bool> {
    let mut normals = false;
    let mut materials = Vec::new();
    out.begin(Kind::SurfaceRecords)?;
    attributes.each(|first, some| {
        materials.clear();
        materials.resize(some.len(), 0);
        if let SpooledColors::PerMaterial { of_triangle, .. } = colors {
            of_triangle.read(first, &mut materials)?;
        }
        normals |= some.iter().any(Attributes::has_normals);
        let record = |(&material, &attributes): (&u32, &Attributes)| SurfaceRecord { material, attributes };
        let records: Vec<SurfaceRecord> = materials.iter().zip(some).map(record).collect();
        out.put(bytemuck::cast_slice(&records))
    })?;
    out.end()?;
    Ok(normals)
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
