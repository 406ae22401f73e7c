//! Texture coordinates and normals of vertices.

use crate::mesh::{Attributes, Normal, ReadReport};
use glam::{DVec3, Vec3};

/// What vertices have beside their places: each list has one for every vertex, or is empty.
#[derive(Default)]
pub(in crate::mesh) struct Looks {
    coordinates: Vec<[f32; 2]>,
    normals: Vec<Normal>,
    bad_coordinates: u64,
    bad_normals: u64,
}

impl Looks {
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

    /// What triangles' corners have; nothing if the vertices have nothing.
    pub(super) fn of_triangles(&self, triangles: &[[u32; 3]], report: &mut ReadReport) -> Vec<Attributes> {
        report.bad_texture_coordinates += self.bad_coordinates;
        report.bad_normals += self.bad_normals;
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
