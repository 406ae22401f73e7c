//! Triangles out of primitives.

use super::buffers::Buffers;
use super::elements::Elements;
use crate::mesh::{MAX_TRIANGLES, ReadReport};
use gltf::accessor::DataType::{F32, I8, I16, U8, U16, U32};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Document, Semantic};

/// A part of a mesh: triangles of one material.
#[derive(Clone, Debug)]
pub(super) struct Part<'a> {
    /// Which corners belong together.
    mode: Mode,
    /// The vertices of the corners; without, they are the vertices in their order.
    indices: Option<Elements<'a>>,
    pub positions: Elements<'a>,
    pub normals: Option<Elements<'a>>,
    /// Texture coordinates, v downward.
    pub uv: Option<Elements<'a>>,
    /// Linear RGB.
    pub colors: Option<Elements<'a>>,
    /// Its number in the document.
    pub material: Option<usize>,
    /// How many triangles it has.
    pub triangles: usize,
}

const SCALAR: &[Dimensions] = &[Dimensions::Scalar];
const VEC2: &[Dimensions] = &[Dimensions::Vec2];
const VEC3: &[Dimensions] = &[Dimensions::Vec3];
const COLORS: &[Dimensions] = &[Dimensions::Vec3, Dimensions::Vec4];
/// `KHR_mesh_quantization` allows small integers.
const NUMBERS: &[DataType] = &[F32, I8, U8, I16, U16];

impl<'a> Part<'a> {
    /// A primitive that consists of triangles; `None` of others, which are counted. `set` gives the set of texture
    /// coordinates that a material goes by.
    ///
    /// # Errors
    /// What it needs is not where it should be, or of another kind.
    pub fn read(
        primitive: &gltf::Primitive<'_>,
        document: &Document,
        buffers: &'a Buffers<'_>,
        set: impl Fn(usize) -> u32,
        report: &mut ReadReport,
    ) -> Result<Option<Self>, String> {
        let corners = primitive.indices().or(primitive.get(&Semantic::Positions));
        let corners = corners.map_or(0, |accessor| accessor.count());
        let mode = primitive.mode();
        let triangles = match mode {
            Mode::Triangles => corners / 3,
            Mode::TriangleStrip | Mode::TriangleFan => corners.saturating_sub(2),
            Mode::Points => {
                report.points = report.points.saturating_add(corners as u64);
                return Ok(None);
            }
            Mode::Lines | Mode::LineLoop | Mode::LineStrip => {
                let lines = match mode {
                    Mode::Lines => corners / 2,
                    Mode::LineLoop => corners,
                    _ => corners.saturating_sub(1),
                };
                report.lines = report.lines.saturating_add(lines as u64);
                return Ok(None);
            }
        };
        if mode == Mode::Triangles {
            if !corners.is_multiple_of(3) {
                report.note("corners after the last whole triangle dropped".into());
            }
        } else {
            report.strips += 1;
        }
        let open = |accessor: Option<gltf::Accessor<'_>>, shape, what| {
            accessor.map(|accessor| Elements::new(&accessor, document, buffers, shape, what)).transpose()
        };
        let material = primitive.material().index();
        let get = |semantic| primitive.get(&semantic);
        let positions = open(get(Semantic::Positions), (VEC3, NUMBERS), "positions")?;
        let positions = positions.ok_or("a primitive has no positions")?;
        let part = Self {
            mode,
            indices: open(primitive.indices(), (SCALAR, &[U8, U16, U32]), "indices")?,
            normals: open(get(Semantic::Normals), (VEC3, NUMBERS), "normals")?,
            uv: open(
                get(Semantic::TexCoords(material.map_or(0, set))),
                (VEC2, NUMBERS),
                "texture coordinates",
            )?,
            colors: open(get(Semantic::Colors(0)), (COLORS, &[F32, U8, U16]), "colours")?,
            positions,
            material,
            triangles,
        };
        let others =
            [(&part.normals, "normals"), (&part.uv, "texture coordinates"), (&part.colors, "colours")];
        for (elements, what) in others {
            if let Some(elements) = elements
                && elements.count < part.positions.count
            {
                let (has, vertices) = (elements.count, part.positions.count);
                return Err(format!(
                    "{has} {what} for {vertices} vertices of one primitive; export it again"
                ));
            }
        }
        Ok(Some(part))
    }

    /// The first and the last vertex that triangles use; `None` if there are none.
    ///
    /// # Errors
    /// One is not among the positions.
    pub fn vertices(&self) -> Result<Option<(u32, u32)>, String> {
        let Some(last_corner) = self.corners().checked_sub(1) else { return Ok(None) };
        let (first, last) = match &self.indices {
            None => (0, last_corner),
            Some(indices) => (0..=last_corner)
                .map(|corner| indices.index(corner))
                .fold((u32::MAX, 0), |(first, last), index| (first.min(index), last.max(index))),
        };
        match last as usize >= self.positions.count {
            true => Err(format!(
                "index {last} is out of range, a primitive has {} vertices",
                self.positions.count
            )),
            false => Ok(Some((first, last))),
        }
    }

    /// How many corners triangles use, at most `3 MAX_TRIANGLES`.
    fn corners(&self) -> u32 {
        debug_assert!(self.triangles <= MAX_TRIANGLES);
        match (self.mode, self.triangles as u32) {
            (_, 0) => 0,
            (Mode::Triangles, triangles) => triangles * 3,
            (_, triangles) => triangles + 2,
        }
    }

    /// A triangle's vertices, counter-clockwise seen from its front.
    #[inline]
    pub fn triangle(&self, number: u32) -> [u32; 3] {
        let corners = match self.mode {
            Mode::TriangleStrip if number % 2 == 1 => [number, number + 2, number + 1],
            Mode::TriangleStrip => [number, number + 1, number + 2],
            Mode::TriangleFan => [0, number + 1, number + 2],
            _ => [3 * number, 3 * number + 1, 3 * number + 2],
        };
        match &self.indices {
            None => corners,
            Some(indices) => corners.map(|corner| indices.index(corner)),
        }
    }
}
