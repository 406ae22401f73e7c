//! All that lights a scene.

use super::light::{ENOUGH, Seen};
use super::{Ambient, Camera, Emitters, Environment, Light, Lighting};
use crate::traverse::Accel;
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
    /// The light of a scene. One that is lit by its own lights, so that enough of what a camera sees of it is seen
    /// by them, or by an environment, gets no other; where a few lamps glow on a dashboard, `lighting` is there
    /// as well. `lets_pass` says of triangles whether they are as clear as glass.
    pub fn for_view(
        camera: &Camera,
        accel: &Accel,
        lets_pass: &impl Fn(u32) -> bool,
        lighting: &Lighting,
        emitters: Option<Emitters>,
        environment: Option<Environment>,
    ) -> Self {
        let is_lit = environment.is_some()
            || emitters.as_ref().is_some_and(|emitters| {
                Seen::new(camera, accel, lets_pass).share_lit_by(emitters, accel, lets_pass) >= ENOUGH
            });
        let (key, ambient) = if is_lit { (None, None) } else { (Some(lighting.key), Some(lighting.ambient)) };
        Self { key, ambient, emitters, environment }
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
