//! Profiles: every tunable in one TOML file.
//!
//! Nothing in a profile changes a picture; it changes how long the picture takes. A key that is
//! left out has its default, and an unknown one is an error, so that a misspelt key does not pass
//! for a setting without effect.

use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::kdtree::{BuildParams, Preset};
use crate::render::Tuning;
use serde::{Deserialize, Serialize};
use std::fs;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};

/// The name of the profile that is used when none is named.
pub const DEFAULT: &str = "default";

/// The profiles that are compiled in: names and texts.
const BUILT_IN: [(&str, &str); 5] = [
    (DEFAULT, include_str!("../profiles/default.toml")),
    ("interior", include_str!("../profiles/interior.toml")),
    ("scan", include_str!("../profiles/scan.toml")),
    ("cad", include_str!("../profiles/cad.toml")),
    ("low-memory", include_str!("../profiles/low-memory.toml")),
];

/// The folder, below the current one, in which names are looked up.
const FOLDER: &str = "profiles";

/// Every tunable.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Profile {
    /// How trees are built.
    pub build: BuildParams,
    /// How frames are made.
    pub render: Tuning,
    /// How these settings were found, if `raypack tune` did: for people to read, without any effect.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub tuned: Option<Tuned>,
}

/// What a search for settings was about and what it measured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Tuned {
    /// The model.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// Where it was seen from.
    pub cameras: Vec<String>,
    /// The size of frames.
    pub size: String,
    /// What was timed: frames, or kinds of ray.
    pub loads: Vec<String>,
    /// What should be least.
    pub goal: String,
    /// The machine's processor.
    pub processor: String,
    /// How many threads traced.
    pub threads: usize,
    /// The instruction set.
    pub isa: String,
    /// How hits were decided.
    pub accuracy: Accuracy,
    /// The engine's version.
    pub raypack: String,
    /// When it was, in UTC.
    pub date: String,
    /// What random rays hung on.
    pub seed: u64,
    /// How long the search took.
    pub seconds: f64,
    /// What the settings take beside those that the search started from: least, middle and greatest of the
    /// pairs.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub time: Option<[f64; 3]>,
    /// What was tried, in order.
    pub steps: Vec<TunedStep>,
}

/// A candidate beside what was best when it was tried.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TunedStep {
    /// The setting that was changed.
    pub setting: String,
    /// Its value before.
    pub from: f64,
    /// The value that was tried.
    pub value: f64,
    /// What it took beside what was best: the middle of the pairs.
    pub time: f64,
    /// The least of the pairs.
    pub low: f64,
    /// The greatest.
    pub high: f64,
    /// What the SAH says.
    pub predicted: f64,
    /// Whether it became the best.
    pub accepted: bool,
}

impl Profile {
    /// Finds a profile.
    ///
    /// A name is looked up in the folder `profiles` below the current one, then among those that
    /// are compiled in. What ends in `.toml` or has a folder in it is a path.
    ///
    /// # Errors
    /// There is no such profile, it cannot be read, or something in it makes no sense: the
    /// message names the file and the key.
    pub fn find(name: &str) -> Result<Self> {
        if name.ends_with(".toml") || Path::new(name).components().count() != 1 {
            return Self::read(name);
        }
        let path = Path::new(FOLDER).join(format!("{name}.toml"));
        match fs::read_to_string(&path) {
            Ok(text) => Self::parse(&path, &text),
            Err(error) if error.kind() == ErrorKind::NotFound => Self::built_in(name),
            Err(source) => Err(Error::Read { path, source }),
        }
    }

    /// Reads a profile's file.
    ///
    /// # Errors
    /// The file cannot be read, or something in it makes no sense.
    pub fn read(path: impl Into<PathBuf>) -> Result<Self> {
        let path = path.into();
        match fs::read_to_string(&path) {
            Ok(text) => Self::parse(&path, &text),
            Err(source) => Err(Error::Read { path, source }),
        }
    }

    fn built_in(name: &str) -> Result<Self> {
        let Some((name, text)) = BUILT_IN.iter().find(|(known, _)| *known == name) else {
            let known = BUILT_IN.map(|(name, _)| name).join(", ");
            let message = format!(
                "there is no {FOLDER}/{name}.toml here, and built in are {known}; give a name or a path"
            );
            return Err(Error::option("--profile", message));
        };
        Self::parse(&Path::new(FOLDER).join(format!("{name}.toml")), text)
    }

    fn parse(path: &Path, text: &str) -> Result<Self> {
        let mut profile: Self = toml::from_str(text).map_err(|error| Error::toml(path, text, &error))?;
        profile.build = on_preset(text, profile.build);
        profile.check().map_err(|error| Error::malformed(path, error.to_string()))?;
        Ok(profile)
    }

    /// The profile as a file's text.
    pub fn to_toml(&self) -> String {
        toml::to_string(self).expect("numbers, texts and tables")
    }

    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first key whose value does not.
    pub fn check(&self) -> Result<()> {
        self.build.check()?;
        self.render.check()
    }
}

/// The build settings as written, and where nothing is written, as the preset that they name has it.
fn on_preset(text: &str, written: BuildParams) -> BuildParams {
    let merged = || {
        let mut all = toml::Table::try_from(BuildParams::preset(written.preset)).ok()?;
        let sections: toml::Table = toml::from_str(text).ok()?;
        all.extend(sections.get("build")?.as_table()?.clone());
        all.try_into().ok()
    };
    // The text has been read once: all but the standard preset need it once more.
    if written.preset == Preset::Standard { written } else { merged().unwrap_or(written) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_profile_is_the_default() {
        assert_eq!(Profile::built_in(DEFAULT).expect("a profile"), Profile::default());
    }

    #[test]
    fn the_default_profile_names_every_key() {
        let written: toml::Table = toml::from_str(BUILT_IN[0].1).expect("TOML");
        let all = toml::Table::try_from(Profile::default()).expect("TOML");
        for (section, keys) in &all {
            for key in keys.as_table().expect("a section").keys() {
                assert!(written[section].get(key).is_some(), "{section}.{key} is missing");
            }
        }
    }

    #[test]
    fn built_in_profiles_make_sense_and_say_how_they_were_found() {
        for (name, _) in BUILT_IN {
            let profile = Profile::built_in(name).expect(name);
            if name == DEFAULT {
                continue;
            }
            let tuned = profile.tuned.expect(name);
            assert!(!tuned.steps.is_empty() && tuned.triangles > 0, "{name}");
            assert!(!tuned.model.contains('/'), "{name}: {}", tuned.model);
        }
    }

    #[test]
    fn what_is_left_out_has_its_default() {
        let profile = Profile::parse(Path::new("p.toml"), "[render]\npacket = 4\n").expect("a profile");
        assert_eq!(profile.render.packet.width(), 4);
        assert_eq!(profile.build, BuildParams::default());
    }

    #[test]
    fn what_is_left_out_is_as_the_preset_has_it() {
        let text = "[build]\npreset = \"best\"\nmin_leaf = 5\n[render]\npacket = 4\n";
        let profile = Profile::parse(Path::new("p.toml"), text).expect("a profile");
        assert_eq!(profile.build, BuildParams { min_leaf: 5, ..BuildParams::preset(Preset::Best) });
        assert_eq!(profile.render.packet.width(), 4);
    }

    #[test]
    fn faults_name_the_file_and_the_key() {
        for (text, expected) in [
            ("[render]\ntiles = 3", "p.toml: line 2: unknown field `tiles`"),
            ("[rander]\ntile = 3", "p.toml: line 1: unknown field `rander`"),
            ("[build]\nbin = 3", "p.toml: line 2: unknown field `bin`"),
            (
                "[render]\npacket = 5",
                "p.toml: line 2: packet = 5 is not one of 1, 4, 8, 16, 64, 256, 1024, 4096",
            ),
            ("[render]\ntile = 0", "p.toml: render.tile: 0 is not"),
            ("[render]\ntile = -1", "p.toml: line 2: invalid value"),
            ("[render]\nthreads = 99999", "p.toml: render.threads: 99999 are too many"),
            ("[render]\npin = 1", "p.toml: line 2: invalid type"),
            ("[build]\ntraversal_cost = -1.0", "p.toml: build.traversal_cost: must be"),
            ("[build]\nbins = 1", "p.toml: build.bins: must be"),
            ("[build]\npreset = \"good\"", "p.toml: line 2: unknown variant `good`"),
            ("render", "p.toml: line 1: "),
        ] {
            let message = Profile::parse(Path::new("p.toml"), text).expect_err(text).to_string();
            assert!(message.starts_with(expected) && !message.contains('\n'), "{text}: {message}");
        }
    }

    #[test]
    fn unknown_names_say_what_there_is() {
        let message = Profile::find("nonsense").expect_err("no such profile").to_string();
        assert!(message.contains("profiles/nonsense.toml") && message.contains("default"), "{message}");
        let message = Profile::find("no/such.toml").expect_err("no such file").to_string();
        assert!(message.starts_with("cannot read no/such.toml"), "{message}");
    }
}
