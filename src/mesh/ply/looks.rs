//! Texture coordinates and normals of vertices.

use crate::mesh::lists::{InFiles, InMemory, List, Lists};
use crate::mesh::{Attributes, Normal, ReadReport};
use crate::spool::{Spool, Spooled};
use bytemuck::Pod;
use glam::{DVec3, Vec3};
use std::io;

/// What vertices have beside their places: each list has one for every vertex, or is empty.
pub(in crate::mesh) struct Looks<L: Lists> {
    coordinates: L::Of<[f32; 2]>,
    normals: L::Of<Normal>,
    bad_coordinates: u64,
    bad_normals: u64,
}

impl<L: Lists> Looks<L> {
    /// Of no vertices.
    pub(super) fn new(lists: &L) -> io::Result<Self> {
        let (coordinates, normals) = (lists.list()?, lists.list()?);
        Ok(Self { coordinates, normals, bad_coordinates: 0, bad_normals: 0 })
    }

    /// Gives the next vertex texture coordinates; what is not finite is 0.
    pub(super) fn push_coordinates(&mut self, coordinates: [f64; 2]) {
        let coordinates = coordinates.map(|x| x as f32);
        self.bad_coordinates += u64::from(!coordinates.iter().all(|x| x.is_finite()));
        self.coordinates.push(coordinates.map(|x| if x.is_finite() { x } else { 0.0 }));
    }

    /// Gives the next vertex a normal; what has no direction is none.
    pub(super) fn push_normal(&mut self, normal: [f64; 3]) {
        let normal = DVec3::from_array(normal).try_normalize().map_or(Vec3::ZERO, |normal| normal.as_vec3());
        let normal = Normal::encode(normal);
        self.bad_normals += u64::from(normal == Normal::NONE);
        self.normals.push(normal);
    }

    fn count_bad(&self, report: &mut ReadReport) {
        report.bad_texture_coordinates += self.bad_coordinates;
        report.bad_normals += self.bad_normals;
    }
}

impl Looks<InMemory> {
    /// What triangles' corners have; nothing if the vertices have nothing. Adds to the report what was bad.
    pub(super) fn of_triangles(&self, triangles: &[[u32; 3]], report: &mut ReadReport) -> Vec<Attributes> {
        self.count_bad(report);
        if self.coordinates.is_empty() && self.normals.is_empty() {
            return Vec::new();
        }
        let coordinates = |vertex: u32| self.coordinates.get(vertex as usize).copied().unwrap_or_default();
        let normal = |vertex: u32| self.normals.get(vertex as usize).copied().unwrap_or(Normal::NONE);
        let of =
            |corners: &[u32; 3]| Attributes { uv: corners.map(coordinates), normals: corners.map(normal) };
        triangles.iter().map(of).collect()
    }
}

impl Looks<InFiles> {
    /// The same, in a file.
    ///
    /// # Errors
    /// Something cannot be written, or read.
    pub(in crate::mesh) fn of_spooled(
        self,
        triangles: &Spooled<[u32; 3]>,
        lists: &InFiles,
        report: &mut ReadReport,
    ) -> io::Result<Option<Spooled<Attributes>>> {
        self.count_bad(report);
        if self.coordinates.is_empty() && self.normals.is_empty() {
            return Ok(None);
        }
        let (coordinates, normals) = (self.coordinates.finish()?, self.normals.finish()?);
        let mut attributes: Spool<Attributes> = lists.list()?;
        triangles.each(|_, corners| {
            let uv = of_corners(&coordinates, corners, [0.0; 2])?;
            let normals = of_corners(&normals, corners, Normal::NONE)?;
            for (uv, normals) in uv.into_iter().zip(normals) {
                attributes.push(Attributes { uv, normals });
            }
            Ok::<(), io::Error>(())
        })?;
        attributes.finish().map(Some)
    }
}

/// What triangles' corners have of a list; `nothing` if it is empty.
fn of_corners<T: Pod>(list: &Spooled<T>, corners: &[[u32; 3]], nothing: T) -> io::Result<Vec<[T; 3]>> {
    if list.is_empty() { Ok(vec![[nothing; 3]; corners.len()]) } else { list.of_corners(corners) }
}
