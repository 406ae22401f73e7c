//! Triangles out of primitives.

use super::buffers::Buffers;
use super::elements::Elements;
use crate::mesh::bits::{Bits, Numbers};
use crate::mesh::{MAX_TRIANGLES, ReadReport};
use gltf::accessor::DataType::{F32, I8, I16, U8, U16, U32};
use gltf::accessor::{DataType, Dimensions};
use gltf::mesh::Mode;
use gltf::{Document, Semantic};

/// A part of a mesh: triangles of one material.
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
        buffers: &'a Buffers<'a>,
        set: impl Fn(usize) -> u32,
        report: &mut ReadReport,
    ) -> Result<Option<Self>, String> {
        let (mode, corners) = (primitive.mode(), corners(primitive));
        let Some(triangles) = triangles(mode, corners) else {
            let lines = match mode {
                Mode::Lines => corners / 2,
                Mode::LineLoop => corners,
                _ => corners.saturating_sub(1),
            };
            let (counted, count) = match mode {
                Mode::Points => (&mut report.points, corners),
                _ => (&mut report.lines, lines),
            };
            *counted = counted.saturating_add(count as u64);
            return Ok(None);
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

    /// The vertices that triangles use; `None` if there are none.
    ///
    /// # Errors
    /// One is not among the positions.
    pub fn vertices(&self) -> Result<Option<Vertices>, String> {
        let vertex = |corner| self.indices.as_ref().map_or(corner, |indices| indices.index(corner));
        let corners = (0..self.corners()).map(vertex);
        let Some((first, last)) = bounds(corners.clone()) else { return Ok(None) };
        // Before a bit is set: an index out of range may be any number.
        if last as usize >= self.positions.count {
            let vertices = self.positions.count;
            return Err(format!("index {last} is out of range, a primitive has {vertices} vertices"));
        }
        Ok(Some(Vertices::within(first, last, corners)))
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

/// How many corners a primitive has.
pub(super) fn corners(primitive: &gltf::Primitive<'_>) -> usize {
    let corners = primitive.indices().or(primitive.get(&Semantic::Positions));
    corners.map_or(0, |accessor| accessor.count())
}

/// How many triangles so many corners make; `None` of points and lines.
pub(super) fn triangles(mode: Mode, corners: usize) -> Option<usize> {
    match mode {
        Mode::Triangles => Some(corners / 3),
        Mode::TriangleStrip | Mode::TriangleFan => Some(corners.saturating_sub(2)),
        Mode::Points | Mode::Lines | Mode::LineLoop | Mode::LineStrip => None,
    }
}

/// The first and the last of some vertices; `None` if there are none.
fn bounds(mut vertices: impl Iterator<Item = u32>) -> Option<(u32, u32)> {
    let first = vertices.next()?;
    Some(vertices.fold((first, first), |(first, last), vertex| (first.min(vertex), last.max(vertex))))
}

/// The vertices that some corners use: a bit for each from the first to the last. Few of many may be used, as where
/// primitives share their vertices.
pub(super) struct Vertices {
    first: u32,
    used: Bits,
}

impl Vertices {
    /// Those of so many corners; `None` if there are none.
    pub fn of(corners: impl Iterator<Item = u32> + Clone) -> Option<Self> {
        let (first, last) = bounds(corners.clone())?;
        Some(Self::within(first, last, corners))
    }

    /// Those of so many corners, which are all between two.
    fn within(first: u32, last: u32, corners: impl Iterator<Item = u32>) -> Self {
        let mut used = Bits::new((last - first) as usize + 1);
        corners.for_each(|vertex| used.set((vertex - first) as usize));
        Self { first, used }
    }

    /// Those that are used, rising.
    pub fn in_order(&self) -> impl Iterator<Item = u32> {
        self.used.set_places().map(|place| self.first + place as u32)
    }

    /// Numbers for them, from 0.
    pub fn numbers(&self) -> VertexNumbers<'_> {
        VertexNumbers { first: self.first, numbers: self.used.numbers() }
    }
}

/// Numbers of the vertices that are used.
pub(super) struct VertexNumbers<'a> {
    first: u32,
    numbers: Numbers<'a>,
}

impl VertexNumbers<'_> {
    /// How many are used before this one, which is.
    #[inline]
    pub fn of(&self, vertex: u32) -> u32 {
        self.numbers.of((vertex - self.first) as usize)
    }
}
