//! A file's surfaces, for shading.

use super::meta::ColorMeta;
use super::reader::File;
use super::section::Kind;
use crate::column::Column;
use crate::error::Result;
use crate::geometry::triangle::Triangle;
use crate::mesh::{blend, decode};
use glam::Vec3;

/// The surfaces of a stored scene: where a triangle's corners are, and what colour it has. Nothing is copied.
///
/// It says the same as the [`Mesh`](crate::mesh::Mesh) that was written, to the bit.
#[derive(Debug)]
pub struct Stored {
    corners: StoredCorners,
    paint: Paint,
}

/// Where corners are read from.
#[derive(Debug)]
enum StoredCorners {
    /// The tree's records, which tracing has just read.
    Records(Column<Triangle>),
    /// The mesh: what the tree has was scaled, and scaling back may lose bits of tiny coordinates.
    Mesh { positions: Column<Vec3>, indices: Column<[u32; 3]> },
}

/// The colours of a stored scene. Colours in columns are sRGB.
#[derive(Debug)]
pub enum Paint {
    /// One colour for everything, linear RGB.
    Uniform(Vec3),
    /// One a triangle.
    PerTriangle(Column<[u8; 3]>),
    /// One a corner, interpolated in linear light.
    PerCorner(Column<[[u8; 3]; 3]>),
    /// That of a triangle's material.
    PerMaterial {
        /// The materials' linear RGB.
        diffuse: Vec<Vec3>,
        /// One index a triangle, in range.
        of_triangle: Column<u32>,
    },
}

impl File {
    /// The surfaces. Checks the checksums of their sections, unless that was done.
    ///
    /// # Errors
    /// A section is damaged, or a triangle has a material that is not there.
    pub fn stored(&self) -> Result<Stored> {
        let corners = if self.meta().scale().is_none() {
            self.verify_sections(&[Kind::Triangles])?;
            StoredCorners::Records(self.column(Kind::Triangles))
        } else {
            self.verify_sections(&[Kind::Positions, Kind::Indices])?;
            StoredCorners::Mesh {
                positions: self.column(Kind::Positions),
                indices: self.column(Kind::Indices),
            }
        };
        Ok(Stored { corners, paint: self.paint()? })
    }

    /// The colours. Checks the checksums of their sections, unless that was done.
    ///
    /// # Errors
    /// A section is damaged, or a triangle has a material that is not there.
    pub fn paint(&self) -> Result<Paint> {
        self.verify_sections(&[Kind::TriangleColors, Kind::CornerColors, Kind::MaterialOfTriangle])?;
        Ok(match &self.meta().colors {
            ColorMeta::Uniform { color } => Paint::Uniform((*color).into()),
            ColorMeta::PerTriangle => Paint::PerTriangle(self.column(Kind::TriangleColors)),
            ColorMeta::PerVertex => Paint::PerCorner(self.column(Kind::CornerColors)),
            ColorMeta::PerMaterial { materials } => Paint::PerMaterial {
                diffuse: materials.iter().map(|material| material.diffuse).collect(),
                of_triangle: self.material_of_triangle(materials.len())?,
            },
        })
    }
}

impl Stored {
    /// The three corners of a triangle. Panics if `primitive` is out of range.
    #[inline]
    pub fn corners(&self, primitive: u32) -> [Vec3; 3] {
        match &self.corners {
            StoredCorners::Records(triangles) => triangles[primitive as usize].corners.map(Vec3::from_array),
            StoredCorners::Mesh { positions, indices } => {
                indices[primitive as usize].map(|vertex| positions[vertex as usize])
            }
        }
    }

    /// As [`Mesh::color`](crate::mesh::Mesh::color).
    #[inline]
    pub fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.paint.color(primitive, u, v)
    }

    /// The index of a triangle's material, 0 if the scene has none. Panics if `primitive` is out of range.
    #[inline]
    pub fn material(&self, primitive: u32) -> u32 {
        match &self.paint {
            Paint::PerMaterial { of_triangle, .. } => of_triangle[primitive as usize],
            _ => 0,
        }
    }
}

impl Paint {
    /// As [`Mesh::color`](crate::mesh::Mesh::color), to the bit.
    #[inline]
    pub fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        let i = primitive as usize;
        match self {
            Self::Uniform(color) => *color,
            Self::PerTriangle(colors) => decode(colors[i]),
            Self::PerCorner(colors) => blend(colors[i], u, v),
            Self::PerMaterial { diffuse, of_triangle } => diffuse[of_triangle[i] as usize],
        }
    }
}
