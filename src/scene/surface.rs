//! What shading asks of the triangles that rays hit.

use crate::cache::{Cached, View};
use crate::kdtree::Tree;
use crate::mesh::{Attributes, Colors, Image, Material, Mesh, blend, decode};
use crate::store::{self, ColorMeta, Stored};
use glam::Vec3;
use std::sync::Arc;

/// Surfaces by primitive id: a [`Mesh`], or those of a scene file.
///
/// Of one scene they say the same, to the bit, so that pictures are the same. All of them panic if a primitive is
/// out of range.
pub trait Surface: Sync {
    /// What one thread looks at many of them with.
    type Reader<'a>: Look
    where
        Self: 'a;

    /// A reader, for a while in which this thread traces nothing.
    fn reader(&self) -> Self::Reader<'_>;
    /// The three corners of a triangle, in the scene's coordinates.
    fn corners(&self, primitive: u32) -> [Vec3; 3];
    /// The linear RGB reflectance where a hit's barycentrics are `u` and `v`.
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3;
    /// The index of a triangle's material; 0 in scenes that have none.
    fn material(&self, primitive: u32) -> u32;
    /// The materials; empty in scenes that have none, whose surfaces are matt.
    fn materials(&self) -> &[Material];
    /// The pictures that materials' maps name.
    fn images(&self) -> &[Image];
    /// Whether any triangle has texture coordinates or normals.
    fn has_attributes(&self) -> bool;
    /// How many triangles each of the materials has.
    fn uses(&self) -> Vec<u64>;
    /// The triangles whose material gives off light, in the order of their numbers.
    fn emitters(&self) -> Vec<u32>;
}

/// What shading looks at.
pub trait Look {
    /// A triangle's corners, and the reflectance where a hit's barycentrics are `u` and `v`: see [`Surface`].
    fn look(&self, primitive: u32, u: f32, v: f32) -> ([Vec3; 3], Vec3);
    /// All that there is to know about a triangle.
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail;
}

/// A triangle, for shading that does more than matt surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Detail {
    /// Its corners, in the scene's coordinates.
    pub corners: [Vec3; 3],
    /// Its linear RGB reflectance where it was hit, maps left out.
    pub color: Vec3,
    /// The index of its material; 0 in scenes that have none.
    pub material: u32,
    /// What its corners have; [`Attributes::NONE`] in scenes that have none.
    pub attributes: Attributes,
}

impl Look for &Mesh {
    #[inline(always)]
    fn look(&self, primitive: u32, u: f32, v: f32) -> ([Vec3; 3], Vec3) {
        (self.corners(primitive), self.color(primitive, u, v))
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        Detail {
            corners: self.corners(primitive),
            color: self.color(primitive, u, v),
            material: self.material(primitive),
            attributes: self.attributes.get(primitive as usize).copied().unwrap_or(Attributes::NONE),
        }
    }
}

impl Look for &Stored {
    #[inline(always)]
    fn look(&self, primitive: u32, u: f32, v: f32) -> ([Vec3; 3], Vec3) {
        (self.corners(primitive), self.color(primitive, u, v))
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        Detail {
            corners: self.corners(primitive),
            color: self.color(primitive, u, v),
            material: self.material(primitive),
            attributes: self.attributes(primitive),
        }
    }
}

/// The surfaces of a scene that is not all in memory.
#[derive(Debug)]
pub struct CachedSurface {
    cached: Arc<Cached>,
    paint: CachedPaint,
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
    /// The index of a material a triangle, four bytes.
    PerMaterial(Vec<Vec3>),
}

impl CachedSurface {
    /// The surfaces of a file of which `cached` has a part in memory.
    pub fn new(cached: Arc<Cached>, file: &store::File) -> Self {
        let paint = match &file.meta().colors {
            ColorMeta::Uniform { color } => CachedPaint::Uniform((*color).into()),
            ColorMeta::PerTriangle => CachedPaint::PerTriangle,
            ColorMeta::PerVertex => CachedPaint::PerCorner,
            ColorMeta::PerMaterial { materials } => {
                CachedPaint::PerMaterial(materials.iter().map(|material| material.diffuse).collect())
            }
        };
        Self { cached, paint }
    }

    #[inline]
    fn corners_in(&self, view: &View<'_>, primitive: u32) -> [Vec3; 3] {
        view.enter_triangle(primitive);
        let corners = view.corners(primitive);
        let scale = self.cached.scale();
        if scale.is_none() { *corners } else { scale.undo(corners) }.map(Vec3::from_array)
    }

    #[inline]
    fn color_in(&self, view: &View<'_>, primitive: u32, u: f32, v: f32) -> Vec3 {
        let at = |bytes: usize| primitive as usize * bytes;
        match &self.paint {
            CachedPaint::Uniform(color) => *color,
            CachedPaint::PerTriangle => decode(view.color_bytes::<3>(at(3))),
            CachedPaint::PerCorner => {
                let [a, b, c, d, e, f, g, h, i] = view.color_bytes::<9>(at(9));
                blend([[a, b, c], [d, e, f], [g, h, i]], u, v)
            }
            CachedPaint::PerMaterial(diffuse) => {
                diffuse[material_in(view, primitive) as usize % diffuse.len()]
            }
        }
    }
}

fn material_in(view: &View<'_>, primitive: u32) -> u32 {
    u32::from_le_bytes(view.color_bytes(primitive as usize * 4))
}

/// Surfaces that are not all in memory, through the eyes of one thread: it has its place among the readers once
/// for all that it looks at.
#[derive(Debug)]
pub struct CachedReader<'a> {
    surface: &'a CachedSurface,
    view: View<'a>,
}

impl Look for CachedReader<'_> {
    #[inline]
    fn look(&self, primitive: u32, u: f32, v: f32) -> ([Vec3; 3], Vec3) {
        let Self { surface, view } = self;
        (surface.corners_in(view, primitive), surface.color_in(view, primitive, u, v))
    }

    #[inline]
    fn detail(&self, primitive: u32, u: f32, v: f32) -> Detail {
        let (corners, color) = self.look(primitive, u, v);
        let material = match &self.surface.paint {
            CachedPaint::PerMaterial(_) => material_in(&self.view, primitive),
            _ => 0,
        };
        Detail { corners, color, material, attributes: Attributes::NONE }
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
        self.color_in(&self.cached.view(), primitive, u, v)
    }

    fn material(&self, primitive: u32) -> u32 {
        match &self.paint {
            CachedPaint::PerMaterial(_) => material_in(&self.cached.view(), primitive),
            _ => 0,
        }
    }

    fn materials(&self) -> &[Material] {
        &[]
    }

    fn images(&self) -> &[Image] {
        &[]
    }

    fn has_attributes(&self) -> bool {
        false
    }

    fn uses(&self) -> Vec<u64> {
        Vec::new()
    }

    fn emitters(&self) -> Vec<u32> {
        Vec::new()
    }
}

impl Surface for Mesh {
    type Reader<'a> = &'a Self;

    #[inline(always)]
    fn reader(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.color(primitive, u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }

    fn materials(&self) -> &[Material] {
        self.colors.materials()
    }

    fn images(&self) -> &[Image] {
        &self.images
    }

    fn has_attributes(&self) -> bool {
        !self.attributes.is_empty()
    }

    fn uses(&self) -> Vec<u64> {
        self.colors.uses()
    }

    fn emitters(&self) -> Vec<u32> {
        self.colors.emitters()
    }
}

impl Surface for Stored {
    type Reader<'a> = &'a Self;

    #[inline(always)]
    fn reader(&self) -> &Self {
        self
    }

    #[inline(always)]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        self.corners(primitive)
    }

    #[inline(always)]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        self.color(primitive, u, v)
    }

    #[inline(always)]
    fn material(&self, primitive: u32) -> u32 {
        self.material(primitive)
    }

    fn materials(&self) -> &[Material] {
        self.materials()
    }

    fn images(&self) -> &[Image] {
        self.images()
    }

    fn has_attributes(&self) -> bool {
        self.has_attributes()
    }

    fn uses(&self) -> Vec<u64> {
        self.uses().to_vec()
    }

    fn emitters(&self) -> Vec<u32> {
        self.emitters().to_vec()
    }
}
