//! What shading asks of the triangles that rays hit.

use crate::cache::Cached;
use crate::kdtree::Tree;
use crate::mesh::{Mesh, decode};
use crate::store::{self, ColorMeta, Stored};
use glam::Vec3;
use std::sync::Arc;

/// Surfaces by primitive id: a [`Mesh`], or those of a scene file.
///
/// Of one scene they say the same, to the bit, so that pictures are the same. All of them panic if a primitive is
/// out of range.
pub trait Surface: Sync {
    /// The three corners of a triangle, in the scene's coordinates.
    fn corners(&self, primitive: u32) -> [Vec3; 3];
    /// The linear RGB reflectance where a hit's barycentrics are `u` and `v`.
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3;
    /// The index of a triangle's material; 0 in scenes that have none.
    fn material(&self, primitive: u32) -> u32;
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
                CachedPaint::PerMaterial(materials.iter().map(|material| material.diffuse.into()).collect())
            }
        };
        Self { cached, paint }
    }
}

impl Surface for CachedSurface {
    #[inline]
    fn corners(&self, primitive: u32) -> [Vec3; 3] {
        let view = self.cached.view();
        view.enter_triangle(primitive);
        let corners = view.corners(primitive);
        let scale = self.cached.scale();
        if scale.is_none() { *corners } else { scale.undo(corners) }.map(Vec3::from_array)
    }

    #[inline]
    fn color(&self, primitive: u32, u: f32, v: f32) -> Vec3 {
        let at = |bytes: usize| primitive as usize * bytes;
        match &self.paint {
            CachedPaint::Uniform(color) => *color,
            CachedPaint::PerTriangle => decode(self.cached.view().color_bytes::<3>(at(3))),
            CachedPaint::PerCorner => {
                let bytes = self.cached.view().color_bytes::<9>(at(9));
                let [a, b, c, d, e, f, g, h, i] = bytes;
                let [c0, c1, c2] = [[a, b, c], [d, e, f], [g, h, i]].map(decode);
                (1.0 - u - v) * c0 + u * c1 + v * c2
            }
            CachedPaint::PerMaterial(diffuse) => diffuse[self.material(primitive) as usize % diffuse.len()],
        }
    }

    #[inline]
    fn material(&self, primitive: u32) -> u32 {
        match &self.paint {
            CachedPaint::PerMaterial(_) => {
                u32::from_le_bytes(self.cached.view().color_bytes(primitive as usize * 4))
            }
            _ => 0,
        }
    }
}

impl Surface for Mesh {
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
}

impl Surface for Stored {
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
}
