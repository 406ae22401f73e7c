//! Presets: build settings for three purposes.

use super::params::BuildParams;
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How much time a build may take, in three words.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// For a first look: planes between bins, triangles cut by one plane after the other instead of clipped, larger
    /// leaves. Builds in 0.35 to 0.56 of the standard time a tree that is an eighth smaller; camera rays are 5 to
    /// 23 % slower, and rays that have nothing in common a sixth to a quarter.
    Preview,
    /// For most work.
    #[default]
    Standard,
    /// For many frames of one model: more bins, more planes swept exactly, finer leaves. Takes 1.6 times as
    /// long as the standard build and a third more memory, for camera rays that are a few per cent quicker and
    /// diffuse ones that are 10 to 30 % (sponza, conference).
    Best,
}

impl Preset {
    /// All of them, quickest first.
    pub const ALL: [Self; 3] = [Self::Preview, Self::Standard, Self::Best];

    /// `preview`, `standard` or `best`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Preview => "preview",
            Self::Standard => "standard",
            Self::Best => "best",
        }
    }
}

impl fmt::Display for Preset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Preset {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|preset| preset.name() == name).ok_or_else(|| {
            Error::option("--preset", format!("\"{name}\" is not one of preview, standard, best"))
        })
    }
}

impl BuildParams {
    /// The settings of a preset.
    pub fn preset(preset: Preset) -> Self {
        let standard = Self::default();
        match preset {
            Preset::Preview => Self {
                preset,
                traversal_cost: 12.0,
                min_leaf: 8,
                bad_splits: 0,
                bins: 64,
                exact_below: 0,
                max_duplication: 4.0,
                perfect: false,
                ..standard
            },
            Preset::Standard => standard,
            Preset::Best => Self {
                preset,
                traversal_cost: 2.5,
                bad_splits: 2,
                bins: 64,
                exact_below: 64,
                max_duplication: 12.0,
                ..standard
            },
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn presets_make_sense_and_know_their_names() {
        for preset in Preset::ALL {
            let params = BuildParams::preset(preset);
            params.check().expect("good settings");
            assert_eq!((params.preset, preset.name().parse::<Preset>().unwrap()), (preset, preset));
        }
        let message = "fast".parse::<Preset>().unwrap_err().to_string();
        assert!(message.starts_with("--preset: \"fast\" is not one of preview"), "{message}");
    }
}
