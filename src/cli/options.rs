//! Options that several commands have.

use crate::error::{Error, Result};
use crate::geometry::Accuracy;

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
