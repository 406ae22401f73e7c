//! The stages of a build, by name: what it has come to, for a log, and for tests that interrupt it there.
//!
//! With `RAYPACK_STOP_AT=STAGE` the command says `stopped at STAGE` on standard error when it begins that stage, and
//! then does nothing any more, until a signal ends it. That is how `tests/store/stages.rs` knows where a build is when it
//! interrupts it: no clock tells. A stage is begun a few times in a build, and where nobody asks for a stop it costs a
//! look at a variable.

#[cfg(feature = "cli")]
use crate::error::{Error, Result};
use std::sync::OnceLock;
use std::thread;

/// Where to stop.
static STOP: OnceLock<Stage> = OnceLock::new();

/// What a build that is under way is about to do.
#[cfg_attr(not(feature = "cli"), allow(dead_code, reason = "the command line begins some"))]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stage {
    /// Make a model by rule.
    Generating,
    /// Read a model.
    Reading,
    /// Look whether its triangles are sound, and drop what nobody uses.
    Checking,
    /// Write a mesh's own sections, beside which the tree will be built.
    Surfaces,
    /// Divide what is too large to be built in memory.
    Splitting,
    /// Build a tree, or a part of one, in memory.
    Building,
    /// Put parts together.
    Joining,
    /// Write a tree's sections, and what else is in memory.
    Writing,
    /// Copy pictures.
    Pictures,
    /// Write the tables that make it a scene file.
    Closing,
    /// Have what was written on the disk.
    Syncing,
    /// Give the file its name.
    Renaming,
    /// Have the name on the disk.
    Named,
}

impl Stage {
    #[cfg(feature = "cli")]
    const ALL: [Self; 13] = [
        Self::Generating,
        Self::Reading,
        Self::Checking,
        Self::Surfaces,
        Self::Splitting,
        Self::Building,
        Self::Joining,
        Self::Writing,
        Self::Pictures,
        Self::Closing,
        Self::Syncing,
        Self::Renaming,
        Self::Named,
    ];

    /// In small letters.
    fn name(self) -> String {
        format!("{self:?}").to_lowercase()
    }

    /// Says that it begins now. Does not return if this is where to stop.
    pub fn begin(self) {
        tracing::trace!("{self:?}");
        if STOP.get() == Some(&self) {
            eprintln!("stopped at {}", self.name());
            loop {
                thread::park();
            }
        }
    }
}

/// Takes from the environment where to stop.
///
/// # Errors
/// It names no stage.
#[cfg(feature = "cli")]
pub fn from_env() -> Result<()> {
    const VARIABLE: &str = "RAYPACK_STOP_AT";
    let Some(value) = std::env::var_os(VARIABLE) else { return Ok(()) };
    let Some(stage) = Stage::ALL.into_iter().find(|stage| value.to_str() == Some(&stage.name())) else {
        let all = Stage::ALL.map(Stage::name).join(", ");
        let message = format!("\"{}\" is not one of {all}; unset it", value.to_string_lossy());
        return Err(Error::option(VARIABLE, message));
    };
    // It is asked for once.
    let _ = STOP.set(stage);
    Ok(())
}
