//! How the time of a ray grows with the model: generated plants of growing size, traced by raypack and by Embree.
//!
//! A tree's depth grows with the logarithm of the number of triangles, and beyond the caches each step waits for
//! memory. How much of that an engine hides shows in the growth of the time that a ray takes, not in the rate for
//! one model. Each plant is made in memory, raced by [`mod@bench`] as any model is, and forgotten.

#[cfg(feature = "accuracy")]
pub mod plot;
mod report;

pub use report::{Report, Step, Time};

use crate::error::{Error, Result};
use crate::mesh::generate::plant::{self, PlantParams, TRIANGLES};
use crate::study::bench::{self, EngineName};

/// What to measure and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// The numbers of triangles, ascending.
    pub triangles: Vec<u64>,
    /// Which plants of these sizes.
    pub seed: u64,
    /// The races; their numbers of threads are one only.
    pub bench: bench::Options,
}

/// Measures all sizes. `progress` is told, a line at a time, what is about to happen.
///
/// # Errors
/// There are no sizes or one that no plant has, the options of the races make no sense, or no tree can be built.
pub fn run(options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Report> {
    check(options)?;
    let mut report: Option<Report> = None;
    for &triangles in &options.triangles {
        progress(&format!("making a plant of {triangles} triangles"));
        let mesh = plant::generate(PlantParams { triangles, seed: options.seed });
        let raced = bench::run("plant", &mesh, &options.bench, progress)?;
        let step = Step::new(&raced);
        match &mut report {
            Some(report) => report.steps.push(step),
            None => report = Some(Report::new(raced, step, options)),
        }
    }
    report.ok_or_else(|| Error::option("--triangles", "no number is named"))
}

fn check(options: &Options) -> Result<()> {
    let fail = |message: String| Err(Error::option("--triangles", message));
    if let Some(size) = options.triangles.iter().find(|size| !TRIANGLES.contains(size)) {
        return fail(format!("{size} is not between {} and {}", TRIANGLES.start(), TRIANGLES.end()));
    }
    if let Some(pair) = options.triangles.windows(2).find(|pair| pair[0] >= pair[1]) {
        return fail(format!("{} does not grow to {}", pair[0], pair[1]));
    }
    if options.bench.threads.len() != 1 {
        return Err(Error::option("--threads", "one number of threads is raced"));
    }
    if !options.bench.engines.contains(&EngineName::Raypack) {
        return Err(Error::option("--engines", "raypack must be among them"));
    }
    Ok(())
}
