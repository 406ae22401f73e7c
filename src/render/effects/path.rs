//! A ray on its way from the eye, with what it has met so far.

use crate::geometry::Ray;
use crate::render::scatter::{Media, Sequence, power_heuristic};
use crate::scene::effects::Effect;
use crate::scene::texture::Cone;
use glam::Vec3;

/// What made a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// The camera.
    Camera,
    /// It goes straight on through what is not quite there.
    Through,
    /// A mirror.
    Reflection,
    /// A mirror that is not quite smooth.
    Glossy,
    /// It goes on inside of, or behind, what is transparent.
    Refraction,
    /// It looks for the light that other surfaces throw on a matt one.
    Diffuse,
}

impl Way {
    /// All of them, in the order in which they are traced.
    pub const ALL: [Self; 6] =
        [Self::Camera, Self::Through, Self::Reflection, Self::Glossy, Self::Refraction, Self::Diffuse];

    /// The effect whose rays they are.
    pub const fn effect(self) -> Option<Effect> {
        match self {
            Self::Camera => None,
            Self::Through => Some(Effect::Transparency),
            Self::Reflection => Some(Effect::Reflection),
            Self::Glossy => Some(Effect::Glossy),
            Self::Refraction => Some(Effect::Refraction),
            Self::Diffuse => Some(Effect::Interreflection),
        }
    }
}

/// A ray, and what becomes of the light that it finds.
#[derive(Clone, Copy, Debug)]
pub struct Path {
    /// The ray.
    pub ray: Ray,
    /// The pixel in its square.
    pub pixel: u16,
    /// How many surfaces came before.
    pub depth: u16,
    /// What made it.
    pub way: Way,
    /// The density by solid angle with which its direction was chosen, if the light from there was looked for in
    /// other ways too; 0 if this was the only way.
    pub density: f32,
    /// Whether what it meets lights a matt surface by way of other surfaces, not straight.
    pub is_indirect: bool,
    /// Where its direction was chosen: before it went through what is not quite there.
    pub from: Vec3,
    /// Which of the many paths of its pixel's sample it is: for random numbers of its own.
    pub branch: u32,
    /// The part of the light that arrives.
    pub weight: Vec3,
    /// How wide it has become.
    pub cone: Cone,
    /// What it is in.
    pub media: Media,
}

/// The most that a path adds to a pixel if a matt surface gets it by way of other surfaces; white is 1.
const BRIGHTEST: f32 = 2.0;

/// Light that comes along few paths, much of it along each: single ones would stay as bright dots in the picture, so
/// that each counts for [`BRIGHTEST`] at most.
#[inline]
fn dimmed(light: Vec3) -> Vec3 {
    let brightest = light.max_element();
    if brightest > BRIGHTEST { light * (BRIGHTEST / brightest) } else { light }
}

/// What random numbers are for. Each path has its own for each use.
#[derive(Clone, Copy, Debug)]
pub enum Use {
    Lens,
    Light,
    LightPlace,
    Environment,
    Occlusion,
    Diffuse,
    Gloss,
    Roulette,
}

/// Uses that a path has.
const USES: u32 = 8;

impl Path {
    /// The light that arrives of what the path has met.
    #[inline]
    pub fn arriving(&self, light: Vec3) -> Vec3 {
        if self.is_indirect { dimmed(light) } else { light }
    }

    /// The light that arrives of what a light throws straight on the surface that the path has met.
    #[inline]
    pub fn arriving_from_there(&self, light: Vec3) -> Vec3 {
        if self.is_indirect || self.way == Way::Diffuse { dimmed(light) } else { light }
    }

    /// How much light counts that this path met by chance, where those who looked for it on purpose chose its
    /// direction with the density `on_purpose`: both together count for one (Veach & Guibas, "Optimally combining
    /// sampling techniques for Monte Carlo rendering", 1995).
    #[inline]
    pub fn share(&self, on_purpose: impl FnOnce() -> f32) -> f32 {
        if self.density > 0.0 { power_heuristic(self.density, on_purpose()) } else { 1.0 }
    }

    /// Two random numbers, 0 to less than 1.
    #[inline]
    pub fn random(&self, sequence: &Sequence, what: Use) -> [f32; 2] {
        sequence.pair(self.branch.wrapping_mul(USES).wrapping_add(what as u32))
    }

    /// Two random numbers for each of several times that the same is done.
    #[inline]
    pub fn random_of(&self, sequence: &Sequence, what: Use, time: u32) -> [f32; 2] {
        // The first time as if there were no other.
        let branch = self.branch ^ time.wrapping_mul(0x85eb_ca6b);
        sequence.pair(branch.wrapping_mul(USES).wrapping_add(what as u32))
    }

    /// The number of the path that goes on from it in a way.
    #[inline]
    pub fn branch_of(&self, way: Way) -> u32 {
        // One step of a multiplicative hash for each surface: the same branch twice is as unlikely as for numbers
        // drawn at random.
        (self.branch ^ (way as u32 + 1)).wrapping_mul(0x9e37_79b1).rotate_left(11)
    }
}
