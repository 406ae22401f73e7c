//! `--effects` and what goes with it: what a picture shows, and how accurately.

use super::scene::Scene;
use crate::error::{Error, Result};
use crate::render::{Limits, Staged, Wishes};
use crate::scene::effects::{Call, Effect, Request};
use crate::scene::{Camera, Environment, Lighting, Surface};
use std::path::PathBuf;
use tracing::{info, warn};

/// `--effects`, `--environment`, `--bounces` and `--error`.
#[derive(Clone, Debug, clap::Args)]
pub struct LooksOptions {
    /// What to show: auto (what the scene calls for), none, a list, or changes to auto such as
    /// +ambient-occlusion,-shadows. `raypack effects SCENE` says what there is and what a scene calls for
    #[arg(
        long,
        value_name = "auto|none|LIST|+NAME|-NAME",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    effects: String,
    /// Light from infinitely far away: a picture of all directions, in latitude and longitude (.exr, .hdr or .png)
    #[arg(long, value_name = "FILE")]
    environment: Option<PathBuf>,
    /// Surfaces that a ray's light may have met before the one that is seen
    #[arg(long, value_name = "N", default_value_t = Limits::default().bounces)]
    bounces: u32,
    /// Rays that each matt surface sends to lights that have an extent
    #[arg(long, value_name = "N", default_value_t = Limits::default().shadow_samples)]
    shadow_samples: u32,
    /// Paths that bring less than this part of the light go on by chance; 0 has all go on
    #[arg(long, value_name = "PART", default_value_t = Limits::default().roulette, allow_hyphen_values = true)]
    roulette: f32,
    /// Take no more samples of a pixel when the standard error of its brightness, of 0 for black to 1 for white, is
    /// this; 0 takes all [default: 0.02 if effects of chance run and --samples is not given, else 0]
    #[arg(long, value_name = "ERROR", allow_hyphen_values = true)]
    error: Option<f32>,
}

impl LooksOptions {
    /// The effects asked for, with everything checked that can be checked beforehand.
    ///
    /// # Errors
    /// An option makes no sense, or there is no such environment.
    pub fn check(&self) -> Result<Request> {
        self.limits().check()?;
        let request: Request = self.effects.parse()?;
        match &self.environment {
            Some(path) if !path.is_file() => {
                let message = format!("{} is no file", path.display());
                Err(Error::option("--environment", message))
            }
            _ => Ok(request),
        }
    }

    /// Bytes of memory that the environment takes at most while it is opened and from then on, if there is one. It is
    /// opened to know.
    ///
    /// # Errors
    /// It cannot be read.
    pub fn environment_bytes(&self) -> Result<Option<usize>> {
        let environment = self.environment.as_deref().map(Environment::open).transpose()?;
        // While it is opened, the picture of its file is there as well.
        Ok(environment.map(|environment| 2 * environment.bytes()))
    }

    fn limits(&self) -> Limits {
        let Self { bounces, shadow_samples, roulette, .. } = *self;
        Limits { bounces, shadow_samples, roulette, error: self.error.unwrap_or(0.0) }
    }

    /// Finds out what a scene calls for and opens what is needed for it.
    ///
    /// # Errors
    /// The environment, or a scene that is not all in memory, cannot be read.
    pub fn stage(
        &self,
        scene: &Scene,
        surface: &impl Surface,
        camera: &Camera,
        lighting: Lighting,
        (samples, shadows): (Option<u32>, bool),
    ) -> Result<Staged> {
        let request = self.check()?;
        let request = if shadows { request } else { request.without(Effect::Shadows) };
        let name = self.environment.as_deref().map(|path| path.display().to_string());
        let environment = self.environment.as_deref().map(Environment::open).transpose()?;
        if let Some(repaired) =
            environment.as_ref().map(Environment::repaired).filter(|&repaired| repaired > 0)
        {
            warn!(
                "{}: {repaired} values were no amounts of light and became 0",
                name.as_deref().unwrap_or_default()
            );
        }
        let wishes = Wishes {
            request,
            lighting,
            environment: environment.zip(name.as_deref()),
            samples,
            limits: self.limits(),
            error: self.error,
        };
        let staged = scene.reading(|| Staged::new(&scene.accel, surface, camera, wishes))?;
        for problem in &staged.problems {
            warn!("{problem}");
        }
        if let Some(appearance) = &staged.appearance {
            info!("{} textures, {} bytes", appearance.textures.len(), appearance.textures.bytes());
        }
        Ok(staged)
    }
}

/// What calls for an effect, or who.
pub fn callers(call: &Call) -> String {
    let callers = match call.called_for_by.as_slice() {
        [] => "nothing calls for it".to_owned(),
        callers => callers.join(", "),
    };
    let asked = match call.asked {
        Some(true) => " (asked for)",
        Some(false) => " (turned off)",
        None => "",
    };
    callers + asked
}
