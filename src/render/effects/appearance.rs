//! What a renderer needs to know to show effects.

use super::bounce::Bounce;
use super::direct::Direct;
use super::holes::Holes;
use super::point::Resolver;
use super::wave::{LetsPass, World};
use crate::error::{Error, Result};
use crate::scene::effects::{Effect, EffectSet, calls_for, calls_of, used};
use crate::scene::texture::Textures;
use crate::scene::{Lighting, Lights, Surface};
use crate::traverse::{Accel, Kernel};
use glam::Vec3;
use serde::Serialize;
use std::fmt;

/// The effects of a picture, and what they need beside the surfaces.
#[derive(Debug)]
pub struct Appearance {
    /// The effects that run.
    pub set: EffectSet,
    /// Where light comes from.
    pub lights: Lights,
    /// The pictures on surfaces.
    pub textures: Textures,
    /// How far accuracy goes.
    pub limits: Limits,
}

/// How accurate a picture is to be: more takes longer.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Limits {
    /// Surfaces that a ray's light may have met before the one that the eye sees.
    pub bounces: u32,
    /// Points of lights that have an extent, and directions of an environment, that each matt surface asks for their
    /// light, each with a ray.
    pub shadow_samples: u32,
    /// A path that brings less than this part of the light goes on by chance, as often as it brings of it, and counts for
    /// more if it does ("Russian roulette": Arvo & Kirk, "Particle transport and image synthesis", 1990); 0 has all go
    /// on.
    pub roulette: f32,
    /// The standard error of a pixel's brightness, where black is 0 and white 1, at which no more samples are taken
    /// of it; 0 takes as many as there may be.
    pub error: f32,
}

/// The most bounces that make sense.
const MAX_BOUNCES: u32 = 1024;

/// The most rays to lights that make sense.
const MAX_SHADOW_SAMPLES: u32 = 256;

impl Default for Limits {
    fn default() -> Self {
        Self { bounces: 8, shadow_samples: 1, roulette: 1.0 / 64.0, error: 0.0 }
    }
}

impl fmt::Display for Limits {
    /// All but the error.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { bounces, shadow_samples, roulette, .. } = self;
        write!(f, "{bounces} bounces, {shadow_samples} to lights, roulette {roulette}")
    }
}

impl Limits {
    /// Checks that they make sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first that does not.
    pub fn check(&self) -> Result<()> {
        if self.bounces > MAX_BOUNCES {
            let message = format!("{} is not a number from 0 to {MAX_BOUNCES}", self.bounces);
            return Err(Error::option("--bounces", message));
        }
        if !(1..=MAX_SHADOW_SAMPLES).contains(&self.shadow_samples) {
            let message = format!("{} is not a number from 1 to {MAX_SHADOW_SAMPLES}", self.shadow_samples);
            return Err(Error::option("--shadow-samples", message));
        }
        if !(0.0..=1.0).contains(&self.roulette) {
            let message = format!("{} is not a part of the light from 0 to 1, such as 0.02", self.roulette);
            return Err(Error::option("--roulette", message));
        }
        if !(0.0..1.0).contains(&self.error) {
            let message = format!("{} is not a number from 0 to less than 1, such as 0.01", self.error);
            return Err(Error::option("--error", message));
        }
        Ok(())
    }
}

impl Appearance {
    /// What the plain renderer shows.
    pub(crate) fn plain(lighting: &Lighting, shadows: bool) -> Self {
        let Lighting { key, ambient } = *lighting;
        let (key, ambient) = (Some(key), Some(ambient));
        Self {
            set: EffectSet::NONE.with(Effect::Shadows, shadows),
            lights: Lights { key, ambient, emitters: None, environment: None },
            textures: Textures::default(),
            limits: Limits::default(),
        }
    }

    /// All that paths meet in a scene.
    pub(crate) fn world<'a, S: Surface>(
        &'a self,
        accel: &'a Accel,
        surface: &'a S,
        kernel: Kernel,
        limits: Limits,
    ) -> World<'a, S> {
        let Self { set, ref lights, ref textures, .. } = *self;
        let bounds = accel.bounds();
        let diagonal = (bounds.max.as_dvec3() - bounds.min.as_dvec3()).length() as f32;
        let holes = if set.has(Effect::CutOuts) { Holes::new(surface, textures) } else { None };
        World {
            accel,
            kernel,
            surface,
            resolver: Resolver {
                materials: surface.materials(),
                calls: surface.materials().iter().map(calls_of).collect(),
                textures,
                set,
            },
            direct: Direct { lights, set, reach: diagonal * REACH, samples: limits.shadow_samples },
            bounce: Bounce { set, limit: limits.bounces, faint: limits.roulette },
            holes,
            set,
            lets_pass: lets_pass(surface, set),
        }
    }
}

/// What light goes straight through some surface that triangles have.
fn lets_pass(surface: &impl Surface, set: EffectSet) -> LetsPass {
    let uses = surface.uses();
    used(surface.materials(), &uses).fold(LetsPass::default(), |lets_pass, material| {
        let is_thin = set.has(Effect::Transparency) && calls_for(material, Effect::Transparency)
            || set.has(Effect::Refraction) && material.transmission != Vec3::ZERO && material.ior == 1.0;
        let bends = set.has(Effect::Refraction) && material.transmission != Vec3::ZERO;
        LetsPass { points: lets_pass.points || is_thin || bends, wide: lets_pass.wide || is_thin }
    })
}

/// How far surfaces may be that take light from everywhere away, in diagonals of the scene.
const REACH: f32 = 0.1;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn absurd_limits_name_their_option() {
        Limits::default().check().expect("good");
        let wrong = |limits: Limits| limits.check().expect_err("absurd").to_string();
        assert!(wrong(Limits { shadow_samples: 0, ..Limits::default() }).starts_with("--shadow-samples: 0"));
        assert!(wrong(Limits { roulette: 1.5, ..Limits::default() }).starts_with("--roulette: 1.5"));
        assert!(wrong(Limits { bounces: 2000, ..Limits::default() }).starts_with("--bounces: 2000"));
        for error in [-0.1, 1.0, f32::NAN] {
            assert!(wrong(Limits { error, ..Limits::default() }).starts_with("--error: "));
        }
    }
}
