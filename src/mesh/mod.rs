//! Triangle meshes: what readers and generators make and the tree builder takes.
//!
//! [`read()`] turns an OBJ, PLY, STL or glTF file into a checked [`Mesh`] and says what it dropped or
//! repaired; [`generate`] makes models of any size; [`ply::write`] saves one.

mod attributes;
mod bits;
mod check;
mod color;
pub mod generate;
mod gltf;
mod image;
mod join;
mod lists;
mod material;
pub mod obj;
pub mod ply;
mod read;
mod shape;
pub mod spooled;
mod stl;

pub use attributes::{Attributes, Normal};
pub use check::MAX_TRIANGLES;
pub(crate) use color::decode;
pub use color::{Colors, FaceColor, linear_to_srgb, srgb_to_linear};
pub use image::{Image, ImageSource, MAX_IMAGE_BYTES, Packed};
pub use material::{Channel, Map, Maps, Material};
pub use read::{Loaded, ReadReport, parse, read, read_with_progress};
pub use shape::{DECADES, Shapes};

use crate::geometry::Aabb;
use glam::Vec3;

/// Triangles with shared vertices and a colour for each triangle.
///
/// A triangle's place in `triangles` is its primitive id, which a hit names.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// Vertex positions, all finite.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` for each triangle, counter-clockwise seen from its front.
    pub triangles: Vec<[u32; 3]>,
    /// What colour the triangles have.
    pub colors: Colors,
    /// Texture coordinates and normals by triangle; empty if the model has none.
    pub attributes: Vec<Attributes>,
    /// The pictures that materials' maps name.
    pub images: Vec<Image>,
}

impl Mesh {
    /// The three corners of a triangle. Panics if `primitive` or one of its indices is out of range.
    #[inline]
    pub fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.triangles[primitive as usize].map(|i| self.positions[i as usize])
    }

    /// The box around all triangles (vertices that no triangle uses do not count).
    pub fn bounds(&self) -> Aabb {
        Aabb::of_points(self.triangles.iter().flatten().map(|&i| self.positions[i as usize]))
    }

    /// The surface's linear RGB reflectance where a hit's barycentrics are `u` and `v`.
    ///
    /// Vertex colours blend in linear light as `(1 - u - v) c0 + u c1 + v c2`. Panics if
    /// `primitive` is out of range.
    #[inline]
    pub fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.face_color(primitive).at(u, v)
    }

    /// A triangle's colours. Panics if `primitive` is out of range.
    #[inline]
    pub fn face_color(&self, primitive: u32) -> FaceColor {
        let i = primitive as usize;
        match &self.colors {
            Colors::Uniform(color) => FaceColor::One(*color),
            Colors::PerTriangle(colors) => FaceColor::One(color::decode(colors[i])),
            Colors::PerVertex(colors) => FaceColor::of_corners(self.triangles[i].map(|k| colors[k as usize])),
            Colors::PerMaterial { materials, of_triangle } => {
                FaceColor::One(materials[of_triangle[i] as usize].diffuse)
            }
        }
    }

    /// The index of a triangle's material; 0 if the mesh has none. Panics if `primitive` is out of range.
    #[inline]
    pub fn material(&self, primitive: u32) -> u32 {
        match &self.colors {
            Colors::PerMaterial { of_triangle, .. } => of_triangle[primitive as usize],
            _ => 0,
        }
    }

    /// Bytes of memory that the mesh's arrays take up.
    pub fn bytes(&self) -> usize {
        self.positions.capacity() * size_of::<Vec3>()
            + self.triangles.capacity() * size_of::<[u32; 3]>()
            + self.colors.bytes()
            + self.attributes.capacity() * size_of::<Attributes>()
            + self.images.iter().map(Image::bytes).sum::<usize>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn triangle(colors: Colors) -> Mesh {
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        Mesh { positions, triangles: vec![[0, 1, 2]], colors, ..Mesh::default() }
    }

    #[test]
    fn vertex_colors_blend_in_linear_light() {
        let mesh = triangle(Colors::PerVertex(vec![[255, 0, 0], [0, 255, 0], [0, 0, 255]]));
        assert_eq!(mesh.color(0, 0.0, 0.0), Vec3::X);
        assert_eq!(mesh.color(0, 1.0, 0.0), Vec3::Y);
        assert_eq!(mesh.color(0, 0.25, 0.5), Vec3::new(0.25, 0.25, 0.5));
    }

    #[test]
    fn eight_bit_colors_are_srgb() {
        let mesh = triangle(Colors::PerTriangle(vec![[188, 255, 0]]));
        let c = mesh.color(0, 0.3, 0.3);
        assert!((c.x - 0.5).abs() < 0.005, "sRGB 188 is half the light, not {}", c.x);
        assert_eq!((c.y, c.z), (1.0, 0.0));
    }

    #[test]
    fn materials_are_looked_up_by_triangle() {
        let red = Material::matt("red", Vec3::X);
        let blue = Material::matt("blue", Vec3::Z);
        let mesh = triangle(Colors::PerMaterial { materials: vec![red, blue.clone()], of_triangle: vec![1] });
        assert_eq!(mesh.color(0, 0.1, 0.2), blue.diffuse);
    }

    #[test]
    fn bytes_count_every_array() {
        let mesh = triangle(Colors::PerTriangle(vec![[1, 2, 3]]));
        assert_eq!(mesh.bytes(), 3 * 12 + 12 + 3);
    }

    #[test]
    fn bounds_leave_out_unused_vertices() {
        let mut mesh = triangle(Colors::default());
        mesh.positions.push(Vec3::splat(100.0));
        assert_eq!(mesh.bounds().max, Vec3::new(1.0, 1.0, 0.0));
    }
}
