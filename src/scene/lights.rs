//! All that lights a scene.

use super::{Ambient, Emitters, Environment, Light, Lighting};
use glam::Vec3;

/// Where a picture's light comes from.
#[derive(Debug)]
pub struct Lights {
    /// Light from one direction or one point.
    pub key: Option<Light>,
    /// Light from everywhere, where nothing says what it comes from.
    pub ambient: Option<Ambient>,
    /// Surfaces that give off light.
    pub emitters: Option<Emitters>,
    /// Light from infinitely far away.
    pub environment: Option<Environment>,
}

impl Lights {
    /// Light of which no scene says anything.
    pub fn of(lighting: &Lighting) -> Self {
        Self { key: Some(lighting.key), ambient: Some(lighting.ambient), emitters: None, environment: None }
    }

    /// What is seen in a direction in which there is nothing.
    #[inline]
    pub fn background(&self, direction: Vec3) -> Vec3 {
        match (&self.environment, &self.ambient) {
            (Some(environment), _) => environment.radiance(direction),
            (None, Some(ambient)) => ambient.sky(direction),
            (None, None) => Vec3::ZERO,
        }
    }
}
