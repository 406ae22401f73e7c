//! A ray on its way from the eye, with what it has met so far.

use crate::geometry::Ray;
use crate::render::scatter::{Media, Sequence};
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

    /// Whether lights that such a ray meets are to be counted: those that a matt surface sees were looked for
    /// already.
    pub const fn sees_lights(self) -> bool {
        !matches!(self, Self::Diffuse)
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
    /// Whether lights that it meets count.
    pub sees_lights: bool,
    /// Which of the many paths of its pixel's sample it is: for random numbers of its own.
    pub branch: u32,
    /// The part of the light that arrives.
    pub weight: Vec3,
    /// How wide it has become.
    pub cone: Cone,
    /// What it is in.
    pub media: Media,
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
    /// Two random numbers, 0 to less than 1.
    #[inline]
    pub fn random(&self, sequence: &Sequence, what: Use) -> [f32; 2] {
        sequence.pair(self.branch.wrapping_mul(USES).wrapping_add(what as u32))
    }

    /// The number of the path that goes on from it in a way.
    #[inline]
    pub fn branch_of(&self, way: Way) -> u32 {
        // One step of a multiplicative hash for each surface: the same branch twice is as unlikely as for numbers
        // drawn at random.
        (self.branch ^ (way as u32 + 1)).wrapping_mul(0x9e37_79b1).rotate_left(11)
    }
}
