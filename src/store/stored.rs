//! A file's surfaces, for shading.

use super::meta::ColorMeta;
use super::reader::File;
use super::record::SurfaceRecord;
use super::section::Kind;
use super::substance::Substances;
use crate::column::Column;
use crate::error::Result;
use crate::geometry::triangle::Triangle;
use crate::mesh::{Attributes, FaceColor, Image, Material, decode};
use glam::Vec3;

/// The surfaces of a stored scene: where a triangle's corners are, what colour and material it has, and what its
/// corners have beside. No array is copied.
///
/// It says the same as the [`Mesh`](crate::mesh::Mesh) that was written, to the bit.
#[derive(Debug)]
pub struct Stored {
    corners: StoredCorners,
    paint: Paint,
    /// Empty if there are no attributes.
    records: Column<SurfaceRecord>,
    has_normals: bool,
    materials: Vec<Material>,
    images: Vec<Image>,
    uses: Vec<u64>,
    emitters: Column<u32>,
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
        of_triangle: Substances,
    },
}

impl File {
    /// The surfaces. Checks the checksums of their sections, unless that was done; of pictures, who reads them does.
    ///
    /// # Errors
    /// A section is damaged, a triangle has a material that is not there, a texture coordinate is not finite, or the
    /// list of what gives off light is another.
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
        let paint = self.paint()?;
        let emitters = self.emitters()?;
        if let Paint::PerMaterial { of_triangle, .. } = &paint {
            self.check_emitters(&emitters, of_triangle)?;
        }
        Ok(Stored {
            corners,
            paint,
            records: self.records()?,
            has_normals: self.meta().normals,
            materials: self.meta().colors.materials().to_vec(),
            images: self.images(),
            uses: self.meta().uses.clone(),
            emitters,
        })
    }

    /// The colours. Checks the checksums of their sections, unless that was done.
    ///
    /// # Errors
    /// A section is damaged, or a triangle has a material that is not there.
    pub fn paint(&self) -> Result<Paint> {
        self.verify_sections(&[Kind::TriangleColors, Kind::CornerColors])?;
        Ok(match &self.meta().colors {
            ColorMeta::Uniform { color } => Paint::Uniform((*color).into()),
            ColorMeta::PerTriangle => Paint::PerTriangle(self.column(Kind::TriangleColors)),
            ColorMeta::PerVertex => Paint::PerCorner(self.column(Kind::CornerColors)),
            ColorMeta::PerMaterial { materials } => Paint::PerMaterial {
                diffuse: materials.iter().map(|material| material.diffuse).collect(),
                of_triangle: self.substances()?,
            },
        })
    }

    /// Bytes of memory that a scene's materials, its pictures' names and the list of what gives off light take up,
    /// of whose triangles a part is in memory.
    pub fn surface_bytes(&self) -> usize {
        let materials = self.meta().colors.materials();
        let names: usize = materials.iter().map(|material| material.name.len() + material.place.len()).sum();
        // With the list of their colours.
        let each = size_of::<Material>() + size_of::<Vec3>() + size_of::<u64>();
        let emitters = self.section(Kind::Emitters).map_or(0, |section| section.bytes as usize);
        materials.len() * each + names + emitters + self.images_bytes()
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

    /// As [`Mesh::face_color`](crate::mesh::Mesh::face_color).
    #[inline]
    pub fn face_color(&self, primitive: u32) -> FaceColor {
        self.paint.face_color(primitive)
    }

    /// The index of a triangle's material, 0 if the scene has none. Panics if `primitive` is out of range.
    #[inline]
    pub fn material(&self, primitive: u32) -> u32 {
        match &self.paint {
            Paint::PerMaterial { of_triangle, .. } => of_triangle.at(primitive),
            _ => 0,
        }
    }

    /// What a triangle's corners have; [`Attributes::NONE`] if no triangle's have anything. Panics if `primitive` is
    /// out of range and some have.
    #[inline]
    pub fn attributes(&self, primitive: u32) -> Attributes {
        if self.records.is_empty() {
            return Attributes::NONE;
        }
        self.records[primitive as usize].attributes
    }

    /// Whether any triangle has texture coordinates or normals.
    pub fn has_attributes(&self) -> bool {
        !self.records.is_empty()
    }

    /// Whether any triangle has normals.
    pub fn has_normals(&self) -> bool {
        self.has_normals
    }

    /// The materials; none if the colours are of another kind.
    pub fn materials(&self) -> &[Material] {
        &self.materials
    }

    /// The pictures that materials name. They are in the file until they are read.
    pub fn images(&self) -> &[Image] {
        &self.images
    }

    /// How many triangles each of the materials has.
    pub fn uses(&self) -> &[u64] {
        &self.uses
    }

    /// The triangles whose material gives off light, ascending.
    pub fn emitters(&self) -> &[u32] {
        &self.emitters
    }
}

impl Paint {
    /// As [`Mesh::face_color`](crate::mesh::Mesh::face_color), to the bit.
    #[inline]
    pub fn face_color(&self, primitive: u32) -> FaceColor {
        let i = primitive as usize;
        match self {
            Self::Uniform(color) => FaceColor::One(*color),
            Self::PerTriangle(colors) => FaceColor::One(decode(colors[i])),
            Self::PerCorner(colors) => FaceColor::of_corners(colors[i]),
            Self::PerMaterial { diffuse, of_triangle } => {
                FaceColor::One(diffuse[of_triangle.at(primitive) as usize])
            }
        }
    }
}
