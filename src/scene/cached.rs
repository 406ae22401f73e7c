//! Surfaces of a scene of which a part is in memory.

use super::surface::{Detail, Face, Look, Surface};
use crate::cache::{Array, Cached, View};
use crate::error::Result;
use crate::mesh::{Attributes, FaceColor, Image, Material, decode};
use crate::store::{self, ColorMeta, SurfaceRecord};
use glam::Vec3;
use std::sync::Arc;

/// The surfaces of a scene that is not all in memory.
#[derive(Debug)]
pub struct CachedSurface {
    cached: Arc<Cached>,
    paint: CachedPaint,
    /// Whether there is a record for each triangle, which has its material then.
    has_attributes: bool,
    has_normals: bool,
    materials: Vec<Material>,
    images: Vec<Image>,
    uses: Vec<u64>,
    emitters: Vec<u32>,
}

/// Where its colours are.
#[derive(Debug)]
enum CachedPaint {
    /// One for everything.
    Uniform(Vec3),
    /// Three bytes a triangle.
    PerTriangle,
    /// Nine bytes a triangle.
    PerCorner,
    /// These, by material.
    PerMaterial(Vec<Vec3>),
}

impl CachedSurface {
    /// The surfaces of a file of which `cached` has a part in memory. What does not come in blocks is copied; the
    /// memory for it was counted when `cached` was opened.
    ///
    /// # Errors
    /// The list of what gives off light is damaged.
    pub fn new(cached: Arc<Cached>, file: &store::File) -> Result<Self> {
        let paint = match &file.meta().colors {
            ColorMeta::Uniform { color } => CachedPaint::Uniform((*color).into()),
            ColorMeta::PerTriangle => CachedPaint::PerTriangle,
            ColorMeta::PerVertex => CachedPaint::PerCorner,
            ColorMeta::PerMaterial { materials } => {
                CachedPaint::PerMaterial(materials.iter().map(|material| material.diffuse).collect())
            }
        };
        let meta = file.meta();
        Ok(Self {
            cached,
            paint,
            has_attributes: meta.attributes,
            has_normals: meta.normals,
            materials: meta.colors.materials().to_vec(),
            images: file.images(),
            uses: meta.uses.clone(),
            emitters: file.emitters()?.to_vec(),
        })
    }

    #[inline(always)]
    fn corners_in(&self, view: &View<'_>, primitive: u32) -> [Vec3; 3] {
        let corners = view.corners_of(primitive);
        let scale = self.cached.scale();
        if scale.is_none() { *corners } else { scale.undo(corners) }.map(Vec3::from_array)
    }

    #[inline(always)]
    fn color_in(&self, view: &View<'_>, primitive: u32) -> FaceColor {
        match &self.paint {
            CachedPaint::PerMaterial(diffuse) => {
                FaceColor::One(diffuse[self.material_in(view, primitive) as usize])
            }
            _ => self.color_beside(view, primitive),
        }
    }

    /// The colours where they are not the material's.
    #[inline(always)]
    fn color_beside(&self, view: &View<'_>, primitive: u32) -> FaceColor {
        let at = |bytes: usize| primitive as usize * bytes;
        match &self.paint {
            CachedPaint::Uniform(color) => FaceColor::One(*color),
            CachedPaint::PerTriangle => FaceColor::One(decode(view.bytes::<3>(Array::Colors, at(3)))),
            CachedPaint::PerCorner => {
                let [a, b, c, d, e, f, g, h, i] = view.bytes::<9>(Array::Colors, at(9));
                FaceColor::of_corners([[a, b, c], [d, e, f], [g, h, i]])
            }
            CachedPaint::PerMaterial(_) => unreachable!("it is the material's"),
        }
    }

    #[inline(always)]
    fn material_in(&self, view: &View<'_>, primitive: u32) -> u32 {
        if self.materials.is_empty() {
            return 0;
        }
        let (array, bytes) =
            if self.has_attributes { (Array::Surfaces, RECORD_BYTES) } else { (Array::Colors, 4) };
        self.in_range(u32::from_le_bytes(view.bytes(array, primitive as usize * bytes)))
    }

    /// An index of a material as it was read: checksums were right, but nobody has looked at all of them. The first one
    /// stands for those that are out of range.
    #[inline(always)]
    fn in_range(&self, material: u32) -> u32 {
        if (material as usize) < self.materials.len() { material } else { 0 }
    }

    fn detail_in(&self, view: &View<'_>, primitive: u32, u: f32, v: f32) -> Detail {
        let (material, attributes) = if self.has_attributes {
            let bytes: [u8; RECORD_BYTES] = view.bytes(Array::Surfaces, primitive as usize * RECORD_BYTES);
            let record: SurfaceRecord = bytemuck::pod_read_unaligned(&bytes);
            (self.in_range(record.material), record.attributes)
        } else {
            (self.material_in(view, primitive), Attributes::NONE)
        };
        let color = match &self.paint {
            CachedPaint::PerMaterial(diffuse) => diffuse[material as usize],
            _ => self.color_beside(view, primitive).at(u, v),
        };
        Detail { corners: self.corners_in(view, primitive), color, material, attributes }
    }
}

/// Bytes of a triangle's record.
const RECORD_BYTES: usize = size_of::<SurfaceRecord>();

/// Surfaces that are not all in memory, through the eyes of one thread: it has its place among the readers once
/// for all that it looks at.
#[derive(Debug)]
pub struct CachedReader<'a> {
    surface: &'a CachedSurface,
    view: View<'a>,
}

impl Look for CachedReader<'_> {
    #[inline]
    fn face(&self, primitive: u32) -> Face {
        let Self { surface, view } = self;
        Face { corners: surface.corners_in(view, primitive), color: surface.color_in(view, primitive) }
    }

    #[inline]
    fn material(&self, primitive: u32) -> u32 {
        self.surface.material_in(&self.view, primitive)
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        self.surface.detail_in(&self.view, primitive, u, v)
    }
}

impl Surface for CachedSurface {
    type Reader<'a> = CachedReader<'a>;

    #[inline]
    fn reader(&self) -> CachedReader<'_> {
        CachedReader { surface: self, view: self.cached.view() }
    }

    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners_in(&self.cached.view(), primitive)
    }

    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.color_in(&self.cached.view(), primitive).at(u, v)
    }

    fn material(&self, primitive: u32) -> u32 {
        self.material_in(&self.cached.view(), primitive)
    }

    fn materials(&self) -> &[Material] {
        &self.materials
    }

    fn images(&self) -> &[Image] {
        &self.images
    }

    fn has_attributes(&self) -> bool {
        self.has_attributes
    }

    fn has_normals(&self) -> bool {
        self.has_normals
    }

    fn uses(&self) -> Vec<u64> {
        self.uses.clone()
    }

    fn emitters(&self) -> Vec<u32> {
        self.emitters.clone()
    }
}
