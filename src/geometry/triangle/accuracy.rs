//! Which ray-triangle test decides.

use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// How much a hit may be wrong, and so what it costs. Every kernel knows all three.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
pub enum Accuracy {
    /// A precomputed test: the least work, but a ray may slip between two triangles that share an edge.
    Fast,
    /// Triangles that share an edge leave no gap; positions are right to some ulps of the distance.
    /// The fastest mode in which closed surfaces are closed, and so the default.
    #[default]
    Watertight,
    /// Hit or miss as for real numbers, decided by exact predicates; `t`, `u` and `v` are right to their
    /// last bit or the one before.
    Exact,
}

impl Accuracy {
    /// All of them, fastest first.
    pub const ALL: [Self; 3] = [Self::Fast, Self::Watertight, Self::Exact];

    /// `fast`, `watertight` or `exact`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Fast => "fast",
            Self::Watertight => "watertight",
            Self::Exact => "exact",
        }
    }
}

impl fmt::Display for Accuracy {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Accuracy {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|accuracy| accuracy.name() == name).ok_or_else(|| {
            Error::option("--accuracy", format!("\"{name}\" is not one of fast, watertight, exact"))
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_parse_back() {
        for accuracy in Accuracy::ALL {
            assert_eq!(accuracy.to_string().parse::<Accuracy>().expect("its own name"), accuracy);
        }
        let message = "precise".parse::<Accuracy>().expect_err("no mode").to_string();
        assert!(message.starts_with("--accuracy: \"precise\""), "{message}");
    }
}
