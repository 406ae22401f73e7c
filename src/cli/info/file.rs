//! What `info` says about a scene file.

use crate::cli::progress::Bar;
use crate::cli::report::{Lines, bytes, counted, grouped};
use crate::error::{Error, Result};
use crate::kdtree::BuildParams;
use crate::store::{self, Section, is_scene};
use serde::Serialize;
use std::path::Path;

/// What a scene file says about itself.
#[derive(Debug, Serialize)]
pub struct FileReport<'a> {
    version: u32,
    sections: &'a [Section],
    build_params: &'a BuildParams,
    /// `true` if every checksum was checked; it is an error if one is wrong.
    verified: bool,
}

/// Opens a scene file, and checks every checksum if that is wanted; `None` for a model.
pub fn open(path: &Path, verify: bool) -> Result<Option<store::File>> {
    if !is_scene(path) {
        if verify {
            let message = format!("{} has no checksums; scene files (.rpk) do", path.display());
            return Err(Error::option("--verify", message));
        }
        return Ok(None);
    }
    let file = store::File::open(path)?;
    if verify {
        let bar = Bar::new("verifying");
        file.verify(&|part| bar.set(part))?;
    }
    Ok(Some(file))
}

impl<'a> FileReport<'a> {
    /// What there is to say; `verified` if every checksum was right.
    pub fn new(file: &'a store::File, verified: bool) -> Self {
        let (sections, build_params) = (file.sections(), &file.meta().params);
        Self { version: store::VERSION, sections, build_params, verified }
    }

    /// The same in words: the sections, and what the tree was built with.
    pub fn describe(&self, lines: &mut Lines) {
        let sections = counted(self.sections.len() as u64, "section");
        lines.add("file", format!("version {}, {sections}", self.version));
        for Section { kind, offset, bytes: length, count } in self.sections {
            let (length, count) = (bytes(*length), grouped(*count));
            lines.add("", format!("{kind:<20} {length:>9} at byte {offset}, {count} x {}", kind.element()));
        }
        let params = serde_json::to_value(self.build_params).expect("they are plain data");
        let settings = params.as_object().into_iter().flatten().map(|(key, value)| match value.as_f64() {
            // As the shortest number that is the same in single precision.
            Some(number) if value.is_f64() => format!("{key} {}", number as f32),
            _ => format!("{key} {}", value.to_string().trim_matches('"')),
        });
        lines.add("built with", settings.collect::<Vec<_>>().join(", "));
        if self.verified {
            lines.add("verified", "every checksum is right");
        }
    }
}
