//! One mesh of all that a scene shows.

use super::Raw;
use super::corners::{TOGETHER, attributes};
use super::primitives::Part;
use crate::mesh::check::MAX_TRIANGLES;
use crate::mesh::color;
use crate::mesh::lists::{List, Lists, no_room};
use crate::mesh::material::{DEFAULT_DIFFUSE, Material};
use crate::mesh::{Attributes, Image, ReadReport};
use glam::{DMat3, DMat4, DVec3, Vec3};

/// A mesh that grows, primitive by primitive.
pub(super) struct Builder<L: Lists> {
    positions: L::Of<Vec3>,
    triangles: L::Of<[u32; 3]>,
    /// What the scene calls for.
    attributes: Option<L::Of<Attributes>>,
    of_triangle: Option<L::Of<u32>>,
    of_vertices: Option<L::Of<[u8; 3]>>,
    materials: Vec<Material>,
    /// Whether any triangle has no material.
    any_bare: bool,
    /// Vertices without a colour, and texture coordinates that are none.
    uncolored: u64,
    bad_uv: u64,
    /// How many triangles there will be.
    total: usize,
}

impl<L: Lists> Builder<L> {
    /// An empty mesh with room for all triangles of `placed`.
    ///
    /// # Errors
    /// There are too many.
    pub fn new(
        lists: &L,
        placed: &[(&[Part<'_>], DMat4)],
        materials: Vec<Material>,
        report: &mut ReadReport,
    ) -> Result<Self, String> {
        let parts = || placed.iter().flat_map(|(parts, _)| *parts);
        let total = parts().fold(0_usize, |sum, part| sum.saturating_add(part.triangles));
        if total > MAX_TRIANGLES {
            return Err(format!("{total} triangles, at most {MAX_TRIANGLES} are possible; split the model"));
        }
        let by_material = parts().any(|part| part.material.is_some());
        let colored = parts().any(|part| part.colors.is_some());
        if by_material && colored {
            report.note("vertex colours ignored: materials have theirs".into());
        }
        let has_attributes = parts().any(|part| part.normals.is_some() || part.uv.is_some());
        let by_vertex = colored && !by_material;
        let mut builder = Self {
            positions: lists.list().map_err(no_room)?,
            triangles: lists.list().map_err(no_room)?,
            attributes: has_attributes.then(|| lists.list()).transpose().map_err(no_room)?,
            of_triangle: by_material.then(|| lists.list()).transpose().map_err(no_room)?,
            of_vertices: by_vertex.then(|| lists.list()).transpose().map_err(no_room)?,
            materials,
            any_bare: false,
            uncolored: 0,
            bad_uv: 0,
            total,
        };
        let few = |_| format!("not enough memory for its {total} triangles");
        builder.triangles.expect(total).map_err(few)?;
        builder.attributes.as_mut().map_or(Ok(()), |list| list.expect(total)).map_err(few)?;
        builder.of_triangle.as_mut().map_or(Ok(()), |list| list.expect(total)).map_err(few)?;
        Ok(builder)
    }

    /// Adds a primitive, which `transform` takes to the scene: the vertices that its triangles use, in their order,
    /// and the triangles. `progress` is told now and then what part (0 to 1) of all triangles is behind.
    ///
    /// # Errors
    /// Its indices are out of range.
    pub fn add(&mut self, part: &Part<'_>, transform: &DMat4, progress: &dyn Fn(f32)) -> Result<(), String> {
        let Some(vertices) = part.vertices()? else { return Ok(()) };
        // Each vertex is a corner of at most MAX_TRIANGLES triangles: 32 bits count them all.
        let base = self.positions.len() as u32;
        for vertex in vertices.in_order() {
            self.vertex(part, vertex, transform);
        }
        let numbers = vertices.numbers();
        // Normals go by the inverse transpose. This is the same but for its length, and there is one of any matrix.
        let linear = DMat3::from_mat4(*transform);
        let [x, y, z] = [linear.x_axis, linear.y_axis, linear.z_axis];
        let mirrored = linear.determinant() < 0.0;
        let sign = if mirrored { -1.0 } else { 1.0 };
        let turn = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y)) * sign;
        let mut together = Vec::new();
        for number in 0..part.triangles as u32 {
            let mut corners = part.triangle(number);
            if mirrored {
                corners.swap(1, 2);
            }
            self.triangles.push(corners.map(|vertex| base + numbers.of(vertex)));
            together.push(corners);
            if together.len() == TOGETHER || number + 1 == part.triangles as u32 {
                if let Some(list) = &mut self.attributes {
                    self.bad_uv += attributes(part, &together, &turn, |attributes| list.push(attributes));
                }
                together.clear();
                progress(self.triangles.len() as f32 / self.total as f32);
            }
        }
        if let Some(of_triangle) = &mut self.of_triangle {
            self.any_bare |= part.material.is_none();
            let material = part.material.unwrap_or(self.materials.len());
            of_triangle.fill(material as u32, self.triangles.len());
        }
        Ok(())
    }

    /// Adds a vertex.
    #[inline]
    fn vertex(&mut self, part: &Part<'_>, vertex: u32, transform: &DMat4) {
        let position = DVec3::from_array(part.positions.numbers(vertex).map(f64::from));
        self.positions.push(transform.transform_point3(position).as_vec3());
        if let Some(of_vertices) = &mut self.of_vertices {
            let color = part.colors.as_ref().map(|colors| Vec3::from_array(colors.numbers(vertex)));
            self.uncolored += u64::from(color.is_none());
            of_vertices.push(color::encode(color.unwrap_or(DEFAULT_DIFFUSE)));
        }
    }

    /// What the scene holds, with these pictures.
    pub fn finish(mut self, images: Vec<Image>, report: &mut ReadReport) -> Raw<L> {
        report.uncolored_vertices += self.uncolored;
        if self.bad_uv > 0 {
            report.note(format!("NaN or infinite texture coordinates of {} corners taken as 0", self.bad_uv));
        }
        if self.any_bare {
            self.materials.push(Material::matt("(none)", DEFAULT_DIFFUSE));
        }
        let Self { positions, triangles, attributes, of_triangle, of_vertices, materials, .. } = self;
        let of_materials = of_triangle.map(|of_triangle| (materials, of_triangle));
        Raw { positions, triangles, attributes, of_vertices, of_materials, images }
    }
}
