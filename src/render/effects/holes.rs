//! Where pictures cut holes into surfaces.

use crate::mesh::Material;
use crate::scene::texture::Textures;
use crate::scene::{Look, Surface};
use crate::traverse::Sieve;

/// Says where surfaces have holes. At its finest: a ray from a light and a ray from the eye must agree.
pub struct Holes<'a, S> {
    surface: &'a S,
    textures: &'a Textures,
    /// By material.
    has_holes: Vec<bool>,
}

impl<'a, S: Surface> Holes<'a, S> {
    /// The holes of a scene, if its materials make any.
    pub fn new(surface: &'a S, textures: &'a Textures) -> Option<Self> {
        let has_holes: Vec<bool> =
            surface.materials().iter().map(|material| has_holes(material, textures)).collect();
        has_holes.contains(&true).then_some(Self { surface, textures, has_holes })
    }

    /// The surfaces.
    pub fn surface(&self) -> &'a S {
        self.surface
    }

    /// Whether there is something of a triangle at a place, told by one who looks at the surfaces already.
    #[inline]
    pub fn is_there_for(&self, surfaces: &impl Look, primitive: u32, u: f32, v: f32) -> bool {
        let detail = surfaces.detail(primitive, u, v);
        if !self.has_holes[detail.material as usize] {
            return true;
        }
        let material = &self.surface.materials()[detail.material as usize];
        let uv = detail.attributes.uv_at(u, v);
        opacity(material, self.textures, uv, 0.0) >= material.cutoff.unwrap_or(0.0)
    }
}

impl<S: Surface> Sieve for Holes<'_, S> {
    #[inline]
    fn has_holes(&self, primitive: u32) -> bool {
        self.has_holes[self.surface.material(primitive) as usize]
    }

    #[inline]
    fn is_there(&self, primitive: u32, u: f32, v: f32) -> bool {
        self.is_there_for(&self.surface.reader(), primitive, u, v)
    }
}

/// Whether a material leaves holes: it is cut out, and not everything of it is there.
pub fn has_holes(material: &Material, textures: &Textures) -> bool {
    let Some(cutoff) = material.cutoff else { return false };
    match &material.maps.opacity {
        Some(map) => !textures.is_opaque(map) || material.opacity < cutoff,
        None => material.opacity < cutoff,
    }
}

/// The share of a surface that is there.
#[inline]
pub fn opacity(material: &Material, textures: &Textures, uv: glam::Vec2, footprint: f32) -> f32 {
    match &material.maps.opacity {
        Some(map) => material.opacity * textures.value(map, uv, footprint),
        None => material.opacity,
    }
}
