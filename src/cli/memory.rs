//! What commands know beforehand of the memory that a model will take, and what reports say at their end about the
//! memory that the process took.

use super::cache_options::taken_so_far;
use super::options::BuildOptions;
use super::report::{Lines, bytes};
use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::kdtree::BuildParams;
use crate::mesh::{Mesh, spooled};
use crate::study::resident;
use serde::Serialize;
use std::path::Path;

/// What a command takes of memory beside a model and the build of its tree, where its budget is for everything.
///
/// All of it is added up: what the build gives back, an allocator may keep, so that what comes later takes more.
pub struct Beside<'a> {
    /// Bytes that are known without the model: pixels, rays, what threads have.
    pub fixed: usize,
    /// How hits will be decided: one of the ways keeps records beside the tree.
    pub accuracy: Accuracy,
    /// Bytes that the model has a part in: its pictures.
    pub of_mesh: &'a dyn Fn(&Mesh) -> usize,
}

impl Beside<'_> {
    /// A record of a triangle beside the tree, at most.
    const RECORD: usize = 48;

    /// Finds out before a model is read whether there is any use in that.
    ///
    /// # Errors
    /// What is known of it without reading it does not fit, with the least tree: what would.
    pub fn check(&self, path: &Path, params: &BuildParams, limit: usize) -> Result<()> {
        // What cannot be told is told after it has been read; what is wrong with the file, too.
        let Some(announced) = spooled::announced(path) else { return Ok(()) };
        let triangles = announced.triangles as usize;
        let model = (announced.mesh_bytes() as usize).saturating_add(self.records(triangles));
        let held = model.saturating_add(taken_so_far()).saturating_add(self.fixed);
        fit(&mut params.clone(), triangles, held, limit).map(drop)
    }

    /// Lowers `max_duplication` to what fits, with everything else; how many bytes all takes at most.
    ///
    /// # Errors
    /// Even the least tree does not fit: what would.
    pub fn fit(&self, mesh: &Mesh, params: &mut BuildParams, limit: usize) -> Result<usize> {
        let triangles = mesh.triangles.len();
        // The mesh is among it.
        let taken = taken_so_far().max(mesh.bytes());
        let held = taken + self.fixed + self.records(triangles) + (self.of_mesh)(mesh);
        fit(params, triangles, held, limit)
    }

    fn records(&self, triangles: usize) -> usize {
        if self.accuracy == Accuracy::Fast { Self::RECORD * triangles } else { 0 }
    }
}

/// Has a tree of so many triangles fit beside what else is held; how many bytes both take at most.
fn fit(params: &mut BuildParams, triangles: usize, held: usize, limit: usize) -> Result<usize> {
    let Err(least) = params.fit(triangles, limit.saturating_sub(held)) else {
        return Ok(held + params.peak_bytes(triangles));
    };
    let message = format!(
        "the process, the model and all but the tree take {}, and the least tree that is worth building {} more: give \
         {}MiB, or make a .rpk of the model with raypack build, of which a part will do",
        bytes(held as u64),
        bytes(least as u64),
        held.saturating_add(least).div_ceil(1 << 20)
    );
    Err(Error::option("--memory", message))
}

/// The memory that was given and taken.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct MemoryReport {
    /// The bytes that the process might take; `None` if `--memory` was not given.
    pub budget: Option<usize>,
    /// The most bytes that it had in memory, where the system says.
    pub peak_resident: Option<u64>,
    /// The most that it could have taken, as was known before a model's tree was built within `--memory`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub announced: Option<usize>,
}

impl MemoryReport {
    /// What there is to say at the end.
    ///
    /// # Errors
    /// The memory given is no size.
    pub fn new(options: &BuildOptions, announced: Option<usize>) -> Result<Self> {
        Ok(Self { budget: options.limit()?, peak_resident: resident::peak(), announced })
    }

    /// The same in words, with something more in the same line.
    pub fn describe(&self, lines: &mut Lines, more: &str) {
        let peak = self.peak_resident.map_or("an unknown part".into(), bytes);
        let text = match self.budget {
            Some(budget) => format!("{peak} of {} at most", bytes(budget as u64)),
            None => format!("{peak} at most; no budget was given"),
        };
        let announced =
            self.announced.map(|n| format!(", {} announced", bytes(n as u64))).unwrap_or_default();
        lines.add("memory", format!("{text}{announced}{more}"));
    }
}
