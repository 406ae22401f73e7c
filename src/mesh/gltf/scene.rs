//! One mesh of all that a scene shows.

use super::primitives::Part;
use crate::mesh::check::MAX_TRIANGLES;
use crate::mesh::color::{self, Colors};
use crate::mesh::material::{DEFAULT_DIFFUSE, Material};
use crate::mesh::{Attributes, Mesh, Normal, ReadReport};
use glam::{DMat3, DMat4, DVec3, Vec3};

/// A mesh that grows, primitive by primitive.
pub(super) struct Builder {
    mesh: Mesh,
    materials: Vec<Material>,
    of_triangle: Vec<u32>,
    vertex_colors: Vec<[u8; 3]>,
    /// What the scene calls for.
    has_attributes: bool,
    by_material: bool,
    by_vertex: bool,
    /// Vertices without a colour, and texture coordinates that are none.
    uncolored: u64,
    bad_uv: u64,
    /// For each vertex of a primitive from the first that it uses, its place in the mesh.
    places: Vec<u32>,
}

/// No place yet.
const NOWHERE: u32 = u32::MAX;

impl Builder {
    /// An empty mesh with room for all triangles of `placed`.
    ///
    /// # Errors
    /// There are too many.
    pub fn new(
        placed: &[(&[Part<'_>], DMat4)],
        materials: Vec<Material>,
        report: &mut ReadReport,
    ) -> Result<Self, String> {
        let parts = || placed.iter().flat_map(|(parts, _)| *parts);
        let triangles = parts().fold(0_usize, |sum, part| sum.saturating_add(part.triangles));
        if triangles > MAX_TRIANGLES {
            return Err(format!(
                "{triangles} triangles, at most {MAX_TRIANGLES} are possible; split the model"
            ));
        }
        let by_material = parts().any(|part| part.material.is_some());
        let colored = parts().any(|part| part.colors.is_some());
        if by_material && colored {
            report.note("vertex colours ignored: materials have theirs".into());
        }
        let mut builder = Self {
            mesh: Mesh::default(),
            materials,
            of_triangle: Vec::new(),
            vertex_colors: Vec::new(),
            has_attributes: parts().any(|part| part.normals.is_some() || part.uv.is_some()),
            by_material,
            by_vertex: colored && !by_material,
            uncolored: 0,
            bad_uv: 0,
            places: Vec::new(),
        };
        let few = |_| format!("not enough memory for its {triangles} triangles");
        builder.mesh.triangles.try_reserve_exact(triangles).map_err(few)?;
        if builder.has_attributes {
            builder.mesh.attributes.try_reserve_exact(triangles).map_err(few)?;
        }
        if by_material {
            builder.of_triangle.try_reserve_exact(triangles).map_err(few)?;
        }
        Ok(builder)
    }

    /// Adds a primitive, which `transform` takes to the scene.
    ///
    /// # Errors
    /// Its indices are out of range, or vertices have become too many.
    pub fn add(&mut self, part: &Part<'_>, transform: &DMat4) -> Result<(), String> {
        let Some((first, last)) = part.vertices()? else { return Ok(()) };
        self.places.clear();
        self.places.resize((last - first) as usize + 1, NOWHERE);
        // Normals go by the inverse transpose. This is the same but for its length, and there is one of any matrix.
        let linear = DMat3::from_mat4(*transform);
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let mirrored = linear.determinant() < 0.0;
        let sign = if mirrored { -1.0 } else { 1.0 };
        let turn = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        for number in 0..part.triangles as u32 {
            let mut corners = part.triangle(number);
            if mirrored {
                corners.swap(1, 2);
            }
            let mut triangle = [0; 3];
            for (place, vertex) in triangle.iter_mut().zip(corners) {
                *place = self.place(part, vertex, first, transform)?;
            }
            self.mesh.triangles.push(triangle);
            if self.has_attributes {
                let attributes = self.attributes(part, corners, &turn);
                self.mesh.attributes.push(attributes);
            }
        }
        if self.by_material {
            let material = part.material.map_or(self.materials.len(), |material| material) as u32;
            self.of_triangle.resize(self.mesh.triangles.len(), material);
        }
        Ok(())
    }

    /// A vertex's place in the mesh, where it is put when it is first met.
    #[inline]
    fn place(&mut self, part: &Part<'_>, vertex: u32, first: u32, transform: &DMat4) -> Result<u32, String> {
        let place = &mut self.places[(vertex - first) as usize];
        if *place != NOWHERE {
            return Ok(*place);
        }
        let positions = &mut self.mesh.positions;
        *place = u32::try_from(positions.len()).ok().filter(|&place| place != NOWHERE).ok_or_else(|| {
            format!("more than {} vertices, the most that are possible; split the model", u32::MAX)
        })?;
        let position = DVec3::from_array(part.positions.numbers(vertex).map(f64::from));
        positions.push(transform.transform_point3(position).as_vec3());
        if self.by_vertex {
            let color = part.colors.as_ref().map(|colors| Vec3::from_array(colors.numbers(vertex)));
            self.uncolored += u64::from(color.is_none());
            self.vertex_colors.push(color::encode(color.unwrap_or(DEFAULT_DIFFUSE)));
        }
        Ok(*place)
    }

    /// What a triangle's corners have.
    #[inline]
    fn attributes(&mut self, part: &Part<'_>, corners: [u32; 3], turn: &DMat3) -> Attributes {
        let mut attributes = Attributes::NONE;
        if let Some(uv) = &part.uv {
            attributes.uv = corners.map(|vertex| {
                let [u, v] = uv.numbers(vertex);
                // Ours runs upward.
                let uv = [u, 1.0 - v];
                let finite = u.is_finite() && v.is_finite();
                self.bad_uv += u64::from(!finite);
                if finite { uv } else { [0.0; 2] }
            });
        }
        if let Some(normals) = &part.normals {
            attributes.normals = corners.map(|vertex| {
                let normal = DVec3::from_array(normals.numbers(vertex).map(f64::from));
                (*turn * normal)
                    .try_normalize()
                    .map_or(Normal::NONE, |normal| Normal::encode(normal.as_vec3()))
            });
        }
        attributes
    }

    /// The mesh, without its pictures.
    pub fn finish(mut self, report: &mut ReadReport) -> Mesh {
        report.uncolored_vertices += self.uncolored;
        if self.bad_uv > 0 {
            report.note(format!("NaN or infinite texture coordinates of {} corners taken as 0", self.bad_uv));
        }
        if self.by_material {
            let none = self.materials.len() as u32;
            if self.of_triangle.contains(&none) {
                self.materials.push(Material::matt("(none)", DEFAULT_DIFFUSE));
            }
            self.mesh.colors =
                Colors::PerMaterial { materials: self.materials, of_triangle: self.of_triangle };
        } else if self.by_vertex {
            self.mesh.colors = Colors::PerVertex(self.vertex_colors);
        }
        self.mesh
    }
}
