//! The mesh in a scene file, where it lies.

use super::checksum::{BLOCK, of_block};
use super::meta::ColorMeta;
use super::reader::File;
use super::record::{SurfaceRecord, is_finite};
use super::section::{Kind, Section};
use crate::error::{Error, Result};
use crate::files::read_at;
use crate::mesh::Attributes;
use crate::mesh::spooled::{Announced, SpooledColors, SpooledMesh};
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use glam::Vec3;
use std::io;
use std::path::Path;

/// The sections that it lies in.
const MESH: [Kind; 6] = [
    Kind::Positions,
    Kind::Indices,
    Kind::TriangleColors,
    Kind::VertexColors,
    Kind::MaterialOfTriangle,
    Kind::SurfaceRecords,
];

impl File {
    /// How much there is of the mesh.
    pub fn announced(&self) -> Announced {
        let meta = self.meta();
        Announced { vertices: meta.vertices, triangles: meta.triangles, attributes: meta.attributes }
    }

    /// The mesh that [`mesh`](Self::mesh) copies into memory, in this file. What triangles have beside their corners
    /// goes to files in `folder`, which vanish with it, where records of both have to be taken apart. All is read
    /// explicitly, with its checksums, and looked at: see there.
    ///
    /// # Errors
    /// As for [`mesh`](Self::mesh), or there is no room in `folder`.
    pub fn spooled_mesh(&self, folder: &Path) -> Result<SpooledMesh> {
        let mut sections = MESH.iter().filter_map(|&kind| self.section(kind));
        sections.try_for_each(|section| self.verify_by_reading(section))?;
        let (meta, unreadable) = (self.meta(), self.unreadable());
        let positions: Spooled<Vec3> = self.list(Kind::Positions);
        let triangles: Spooled<[u32; 3]> = self.list(Kind::Indices);
        self.all(&positions, |position| position.is_finite(), "a vertex of its mesh is not finite")?;
        let vertices = positions.len();
        let is_there = |corners: &[u32; 3]| corners.iter().all(|&vertex| (vertex as usize) < vertices);
        self.all(&triangles, is_there, "a triangle of its mesh names a vertex that is not there")?;

        let mut of_triangle: Spooled<u32> = self.list(Kind::MaterialOfTriangle);
        let mut attributes = None;
        if meta.attributes {
            let (materials, list) = self.taken_apart(folder).map_err(|source| match source.kind() {
                io::ErrorKind::InvalidData => Error::malformed(self.path(), source.to_string()),
                _ => unreadable(source),
            })?;
            (of_triangle, attributes) = (materials, Some(list));
        }
        let colors = match &meta.colors {
            ColorMeta::Uniform { color } => SpooledColors::Uniform((*color).into()),
            ColorMeta::PerTriangle => SpooledColors::PerTriangle(self.list(Kind::TriangleColors)),
            ColorMeta::PerVertex => SpooledColors::PerVertex(self.list(Kind::VertexColors)),
            ColorMeta::PerMaterial { materials } => {
                let is_there = |&material: &u32| (material as usize) < materials.len();
                self.all(&of_triangle, is_there, "a triangle has a material that is not there")?;
                SpooledColors::PerMaterial { materials: materials.clone(), of_triangle }
            }
        };
        let bounds = meta.scale().undo_bounds(&meta.tree_bounds());
        Ok(SpooledMesh { positions, triangles, colors, attributes, images: self.images(), bounds })
    }

    fn unreadable(&self) -> impl Fn(io::Error) -> Error + '_ {
        |source| Error::Read { path: self.path().into(), source }
    }

    /// A section's elements, in the file; none if there is no such section.
    fn list<T: Pod>(&self, kind: Kind) -> Spooled<T> {
        let place = self.section(kind).map_or((0, 0), |section| (section.offset, section.count as usize));
        Spooled::in_file(self.handle(), place.0, place.1)
    }

    /// Checks a section's blocks without having them in memory all at once.
    fn verify_by_reading(&self, section: &Section) -> Result<()> {
        const AT_ONCE: usize = 256;
        let blocks = section.blocks();
        let mut bytes = vec![0; AT_ONCE * BLOCK];
        for first in blocks.clone().step_by(AT_ONCE) {
            let some = first..blocks.end.min(first + AT_ONCE);
            let bytes = &mut bytes[..some.len() * BLOCK];
            read_at(&self.handle(), bytes, (first * BLOCK) as u64).map_err(self.unreadable())?;
            let sums = &self.checksums()[some];
            if let Some(block) =
                bytes.chunks(BLOCK).zip(sums).position(|(block, &sum)| of_block(block) != sum)
            {
                return Err(self.damaged(first + block));
            }
        }
        Ok(())
    }

    /// Whether all values are as they should be; `what` says that one is not.
    fn all<T: Pod>(&self, list: &Spooled<T>, is_good: impl Fn(&T) -> bool, what: &str) -> Result<()> {
        let mut all_good = true;
        let show = |_, some: &[T]| {
            all_good &= some.iter().all(&is_good);
            Ok::<(), io::Error>(())
        };
        list.each(show).map_err(self.unreadable())?;
        if all_good { Ok(()) } else { Err(Error::malformed(self.path(), what)) }
    }

    /// Materials and attributes of the records, in files of their own.
    fn taken_apart(&self, folder: &Path) -> io::Result<(Spooled<u32>, Spooled<Attributes>)> {
        let (mut materials, mut attributes) = (Spool::new(folder)?, Spool::new(folder)?);
        let records: Spooled<SurfaceRecord> = self.list(Kind::SurfaceRecords);
        records.each(|_, some| {
            if !some.iter().all(|record| is_finite(&record.attributes)) {
                let message = "a texture coordinate of its mesh is not finite";
                return Err(io::Error::new(io::ErrorKind::InvalidData, message));
            }
            some.iter().for_each(|record| materials.push(record.material));
            some.iter().for_each(|record| attributes.push(record.attributes));
            Ok(())
        })?;
        Ok((materials.finish()?, attributes.finish()?))
    }
}
