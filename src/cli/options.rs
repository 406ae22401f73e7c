//! Options that several commands have.

use super::report::bytes;
use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::kdtree::{BuildParams, Preset};
use crate::mesh::Mesh;
use crate::profile::{self, Profile};
use crate::scene::Orbit;
use crate::store::is_scene;
use crate::traverse::Accel;
use std::path::Path;
use std::time::Instant;
use tracing::info;

/// `--accuracy`.
#[derive(Clone, Debug, clap::Args)]
pub struct AccuracyOption {
    /// How hits are decided: fast may lose a ray between two triangles, watertight never does, exact
    /// decides as real numbers would
    #[arg(long, value_name = "fast|watertight|exact", default_value = Accuracy::default().name())]
    accuracy: String,
}

impl AccuracyOption {
    /// The mode that is named.
    ///
    /// # Errors
    /// There is no such mode.
    pub fn mode(&self) -> Result<Accuracy> {
        self.accuracy.parse()
    }
}

/// `--pools`.
#[derive(Clone, Debug, clap::Args)]
pub struct PoolsOption {
    /// Keep leaves that hold their triangles' corners beside the tree, and boxes that lead to them: rays that have nothing in common
    /// are 1.0 to 2.6 times as fast, and the tree takes a third to a half as much memory again. Answers are the same
    #[arg(long)]
    pools: bool,
}

impl PoolsOption {
    /// Whether they are asked for.
    pub const fn wanted(&self) -> bool {
        self.pools
    }

    /// Sees to it that they can be made, before any work.
    ///
    /// # Errors
    /// They are of no use for this accuracy, or memory is given, which nothing says that they fit into.
    pub fn check(&self, build: &BuildOptions, accuracy: Accuracy) -> Result<()> {
        let message = match accuracy {
            _ if !self.pools => return Ok(()),
            _ if build.memory.is_some() => "--memory does not count them: leave out one of both",
            Accuracy::Fast => "--accuracy fast has no use for them: leave out one of both",
            Accuracy::Watertight | Accuracy::Exact => return Ok(()),
        };
        Err(Error::option("--pools", message))
    }

    /// Makes them if they are asked for, unless a scene file has brought them along.
    ///
    /// # Errors
    /// As [`Accel::make_pools`].
    pub fn make(&self, accel: &Accel) -> Result<()> {
        if !self.pools || accel.pool_bytes() != 0 {
            return Ok(());
        }
        let start = Instant::now();
        accel.make_pools()?;
        info!("made pools in {:.3} s, {}", start.elapsed().as_secs_f64(), bytes(accel.pool_bytes() as u64));
        Ok(())
    }
}

/// `--profile`, `--preset` and `--memory`: how a tree is built.
#[derive(Clone, Debug, clap::Args)]
pub struct BuildOptions {
    /// Settings for building and rendering: a name in profiles/ or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = profile::DEFAULT)]
    profile: String,
    /// How much time the build may take, in place of the profile's settings for it: preview builds in a
    /// third to a half of the time a tree for a first look, best takes 1.6 times as long for rays that are a little quicker
    #[arg(long, value_name = "preview|standard|best")]
    preset: Option<String>,
    /// The memory that model and build may take, as 512MiB or 2GiB, and with render and cast all that the process
    /// takes: the tree is made coarser to fit, and where that does not do, it is refused before the build starts. Of a scene file, render and cast hold as
    /// much as fits and read the rest when it is needed [default: no limit]
    #[arg(long, value_name = "SIZE")]
    memory: Option<String>,
}

impl BuildOptions {
    /// The name of the profile.
    pub fn name(&self) -> &str {
        &self.profile
    }

    /// The profile, with the preset's settings if one is named.
    ///
    /// # Errors
    /// There is no such profile or preset, something in it makes no sense, or the memory is no size.
    pub fn profile(&self) -> Result<Profile> {
        self.limit()?;
        let mut profile = Profile::find(&self.profile)?;
        if let Some(preset) = &self.preset {
            profile.build = BuildParams::preset(preset.parse::<Preset>()?);
        }
        Ok(profile)
    }

    /// The first option given that says how a tree is built.
    pub fn of_trees(&self) -> Option<&'static str> {
        let given = [("--preset", self.preset.is_some()), ("--memory", self.memory.is_some())];
        given.into_iter().find(|(_, given)| *given).map(|(option, _)| option)
    }

    /// The same for a scene, whose tree may be built already; `--memory` then says how much of it is held, for
    /// a command that can do with a part.
    ///
    /// # Errors
    /// Likewise, or an option would have another tree built of a scene file.
    pub fn profile_for(&self, scene: Option<&Path>, a_part_will_do: bool) -> Result<Profile> {
        let profile = self.profile()?;
        let Some(file) = scene.filter(|scene| is_scene(scene)) else { return Ok(profile) };
        match self.of_trees().filter(|&option| option != "--memory" || !a_part_will_do) {
            Some(option) => {
                let message = format!(
                    "the tree in {} is built already: leave this out, or give it to raypack build",
                    file.display()
                );
                Err(Error::option(option, message))
            }
            None => Ok(profile),
        }
    }

    /// Sees to it that a build stays within the memory given.
    ///
    /// # Errors
    /// It cannot: how much it takes.
    pub fn fit(&self, mesh: &Mesh, params: &mut BuildParams) -> Result<()> {
        let Some(limit) = self.limit()? else { return Ok(()) };
        let (model, before) = (mesh.bytes(), params.max_duplication);
        if let Err(least) = params.fit(mesh.triangles.len(), limit.saturating_sub(model)) {
            let message = format!(
                "the model takes {} and the least tree that is worth building {} more: give {}MiB",
                bytes(model as u64),
                bytes(least as u64),
                (model + least).div_ceil(1 << 20)
            );
            return Err(Error::option("--memory", message));
        }
        if params.max_duplication < before {
            info!("max_duplication is {:.2} instead of {before}, to fit the memory", params.max_duplication);
        }
        Ok(())
    }

    /// The memory that model and build may take, in bytes.
    pub fn limit(&self) -> Result<Option<usize>> {
        self.memory.as_deref().map(parse_size).transpose()
    }
}

/// `4096`, `512MiB`, `1.5 GiB`; MB and GB count by thousands.
fn parse_size(text: &str) -> Result<usize> {
    const UNITS: [(&str, f64); 9] = [
        ("KiB", 1024.0),
        ("MiB", 1_048_576.0),
        ("GiB", 1_073_741_824.0),
        ("TiB", 1_099_511_627_776.0),
        ("KB", 1e3),
        ("MB", 1e6),
        ("GB", 1e9),
        ("TB", 1e12),
        ("B", 1.0),
    ];
    let trimmed = text.trim();
    let with = |&(unit, factor): &(&str, f64)| Some((trimmed.strip_suffix(unit)?, factor));
    let (number, factor) = UNITS.iter().find_map(with).unwrap_or((trimmed, 1.0));
    match number.trim().parse::<f64>() {
        Ok(size) if size >= 0.0 && size * factor < 1e18 => Ok((size * factor) as usize),
        _ => Err(Error::option("--memory", format!("\"{text}\" is no size; write 512MiB or 2GiB"))),
    }
}

/// The longest camera path.
const MAX_FRAMES: u32 = 100_000;

/// A camera path of so many frames, which `option` has given.
///
/// # Errors
/// It has no frames or too many, or the step is no number.
pub fn orbit(option: &str, frames: u32, step: f64) -> Result<Orbit> {
    if !(1..=MAX_FRAMES).contains(&frames) {
        let message = format!("{frames} is not a number of frames from 1 to {MAX_FRAMES}");
        return Err(Error::option(option, message));
    }
    if !step.is_finite() {
        return Err(Error::option("--step", format!("{step} is not a finite number of degrees")));
    }
    Ok(Orbit { frames, step })
}

/// A fault of the settings, named by the option instead of the profile's key.
pub fn as_option(error: Error) -> Error {
    match error {
        Error::Option { option, message } => {
            let option = option.strip_prefix("render.").map_or(option.clone(), |key| format!("--{key}"));
            Error::Option { option, message }
        }
        other => other,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::generate::shapes;
    use clap::Parser;

    #[derive(clap::Parser)]
    struct Command {
        #[command(flatten)]
        build: BuildOptions,
    }

    fn options(line: &str) -> BuildOptions {
        Command::try_parse_from(line.split(' ')).unwrap().build
    }

    #[test]
    fn a_preset_replaces_the_build_settings() {
        let profile = options("x --preset best").profile().unwrap();
        assert_eq!(profile.build, BuildParams::preset(Preset::Best));
        let message = options("x --preset quick").profile().unwrap_err().to_string();
        assert!(message.starts_with("--preset: \"quick\" is not one of"), "{message}");
    }

    #[test]
    fn sizes_have_units() {
        for (text, size) in [
            ("4096", 4096),
            ("12B", 12),
            ("1.5 KiB", 1536),
            ("512MiB", 512 << 20),
            ("2GiB", 2 << 30),
            ("3GB", 3_000_000_000),
        ] {
            assert_eq!(parse_size(text).unwrap(), size, "{text}");
        }
        for text in ["", "MiB", "-1", "1 parsec", "nan", "inf", "1e30"] {
            let message = parse_size(text).unwrap_err().to_string();
            assert!(message.starts_with("--memory: ") && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn what_does_not_fit_says_what_would() {
        let mesh = shapes::soup(5000, 1);
        let params = BuildParams::default();
        let message = options("x --memory 1MiB").fit(&mesh, &mut params.clone()).unwrap_err().to_string();
        let enough = message.split("give ").nth(1).and_then(|rest| rest.split(',').next()).unwrap();
        let mut fitted = params.clone();
        options(&format!("x --memory {enough}")).fit(&mesh, &mut fitted).unwrap();
        assert!(fitted.max_duplication < params.max_duplication);
        let mut untouched = params.clone();
        options("x").fit(&mesh, &mut untouched).unwrap();
        assert_eq!(untouched, params);
    }
}
