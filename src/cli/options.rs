//! Options that several commands have.

use super::report::bytes;
use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::kdtree::{BuildParams, Preset};
use crate::mesh::Mesh;
use crate::profile::{self, Profile};

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

/// `--profile`, `--preset` and `--memory`: how a tree is built.
#[derive(Clone, Debug, clap::Args)]
pub struct BuildOptions {
    /// Settings for building and rendering: a name in profiles/ or a TOML file
    #[arg(long, value_name = "NAME|FILE", default_value = profile::DEFAULT)]
    profile: String,
    /// How much time the build may take, in place of the profile's settings for it: preview builds in
    /// about two thirds of the time a tree that is up to a third slower, best takes half as long again for
    /// a few per cent
    #[arg(long, value_name = "preview|standard|best")]
    preset: Option<String>,
    /// The memory that model and build may take, as 512MiB or 2GiB; what needs more is refused before the
    /// build starts [default: no limit]
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

    /// Finds out before a build whether there is memory for it.
    ///
    /// # Errors
    /// There is not: how much it takes.
    pub fn check_memory(&self, mesh: &Mesh, params: &BuildParams) -> Result<()> {
        let Some(limit) = self.limit()? else { return Ok(()) };
        let model = mesh.bytes();
        let build = params.peak_bytes(mesh.triangles.len());
        if model + build <= limit {
            return Ok(());
        }
        let mib = |amount: usize| bytes(amount as u64);
        let needed = (model + build).div_ceil(1 << 20);
        Err(Error::option(
            "--memory",
            format!(
                "the model takes {} and its build up to {} more; give {needed}MiB, or lower build.max_duplication in a profile",
                mib(model),
                mib(build)
            ),
        ))
    }

    fn limit(&self) -> Result<Option<usize>> {
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
        let message = options("x --memory 1MiB").check_memory(&mesh, &params).unwrap_err().to_string();
        let enough = message.split("give ").nth(1).and_then(|rest| rest.split(',').next()).unwrap();
        options(&format!("x --memory {enough}")).check_memory(&mesh, &params).unwrap();
        options("x").check_memory(&mesh, &params).unwrap();
    }
}
