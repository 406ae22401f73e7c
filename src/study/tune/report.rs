//! What a search has found, as a table, as JSON, and as part of a profile.

use super::Goal;
use crate::geometry::Accuracy;
use crate::profile::{Profile, Tuned, TunedStep};
use crate::study::text::grouped;
use serde::Serialize;
use std::fmt;

/// Which part of a search measured something.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Phase {
    /// The way to the best.
    Search,
    /// The look around it.
    Around,
}

/// A candidate beside what was best when it was measured.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Measured {
    /// Which part of the search.
    pub phase: Phase,
    /// The setting that was changed.
    pub setting: &'static str,
    /// Its value in what was best.
    pub from: f64,
    /// The value that was tried.
    pub value: f64,
    /// What it took beside what was best: least, middle and greatest of the pairs. `None` if its memory was
    /// too much.
    pub time: Option<[f64; 3]>,
    /// Pairs that were run.
    pub pairs: usize,
    /// What the SAH says of it beside what was best.
    pub predicted: f64,
    /// The time that the build took.
    pub build_seconds: f64,
    /// Memory of the tree.
    pub bytes_per_triangle: f64,
    /// Whether it became the best.
    pub accepted: bool,
}

/// A setting's value before and after.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Value {
    /// The key.
    pub setting: &'static str,
    /// At the start.
    pub start: f64,
    /// In the end.
    pub best: f64,
}

/// A search's outcome.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// The model.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// Where it was seen from.
    pub cameras: Vec<String>,
    /// The size of frames.
    pub size: String,
    /// What candidates were timed on.
    pub loads: Vec<String>,
    /// What should be least.
    pub goal: Goal,
    /// Bytes that the model with its tree could take.
    pub memory: Option<usize>,
    /// The machine's processor.
    pub processor: String,
    /// How many threads traced.
    pub threads: usize,
    /// The instruction set.
    pub isa: &'static str,
    /// How hits were decided.
    pub accuracy: Accuracy,
    /// The engine's version.
    pub raypack: &'static str,
    /// The engine's build: `release` or `dev`.
    pub build: &'static str,
    /// When it was, in UTC.
    pub date: String,
    /// What random rays hung on.
    pub seed: u64,
    /// How long it took.
    pub seconds: f64,
    /// Whether somebody stopped it.
    pub interrupted: bool,
    /// Whether the best was no slower than the start when they were run against one another in the end;
    /// otherwise what was found was luck, and the start is given out as the best.
    pub kept: bool,
    /// What the best takes beside the start, run against it in the end: least, middle and greatest of the
    /// pairs. `None` if the start is the best, or there was no time.
    pub time: Option<[f64; 3]>,
    /// Every setting.
    pub values: Vec<Value>,
    /// Of the start and of the best.
    pub build_seconds: [f64; 2],
    /// Memory of the tree, of the start and of the best.
    pub bytes_per_triangle: [f64; 2],
    /// What was tried, in order.
    pub measured: Vec<Measured>,
    /// The best.
    #[serde(skip)]
    pub profile: Profile,
}

impl Report {
    /// The best profile with what was measured.
    pub fn profile(&self) -> Profile {
        let steps = self.measured.iter().filter_map(|step| {
            let [low, time, high] = step.time?.map(thousandths);
            let predicted = thousandths(step.predicted);
            let (setting, from, value) = (step.setting.into(), step.from, step.value);
            Some(TunedStep { setting, from, value, time, low, high, predicted, accepted: step.accepted })
        });
        let tuned = Tuned {
            model: self.model.clone(),
            triangles: self.triangles,
            cameras: self.cameras.clone(),
            size: self.size.clone(),
            loads: self.loads.clone(),
            goal: self.goal.to_string(),
            processor: self.processor.clone(),
            threads: self.threads,
            isa: self.isa.into(),
            accuracy: self.accuracy,
            raypack: self.raypack.into(),
            date: self.date.clone(),
            seed: self.seed,
            seconds: self.seconds.round(),
            time: self.time.map(|time| time.map(thousandths)),
            steps: steps.collect(),
        };
        Profile { tuned: Some(tuned), ..self.profile.clone() }
    }
}

fn thousandths(x: f64) -> f64 {
    (x * 1e3).round() / 1e3
}

/// A value as a profile has it.
fn plain(x: f64) -> String {
    format!("{}", thousandths(x))
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let plural = if self.threads == 1 { "" } else { "s" };
        writeln!(f, "{}: {} triangles", self.model, grouped(self.triangles as u64))?;
        writeln!(
            f,
            "{}, {} thread{plural}, {}, raypack {} ({} build, {}), {}",
            self.processor, self.threads, self.isa, self.raypack, self.build, self.accuracy, self.date
        )?;
        writeln!(
            f,
            "goal {}, on {} at {}, seed {}; {:.0} s{}",
            self.goal,
            self.loads.join(", "),
            self.size,
            self.seed,
            self.seconds,
            if self.interrupted { ", interrupted" } else { "" }
        )?;
        for camera in &self.cameras {
            writeln!(f, "camera {camera}")?;
        }
        writeln!(f, "\n{:22} {:>8} {:>8}", "setting", "start", "best")?;
        for Value { setting, start, best } in &self.values {
            let mark = if start == best { "" } else { "  changed" };
            writeln!(f, "{setting:22} {:>8} {:>8}{mark}", plain(*start), plain(*best))?;
        }
        writeln!(f, "{:22} {:>8.2} {:>8.2}", "build, s", self.build_seconds[0], self.build_seconds[1])?;
        let [before, after] = self.bytes_per_triangle;
        writeln!(f, "{:22} {before:>8.1} {after:>8.1}", "tree, B a triangle")?;
        match self.time {
            Some([low, time, high]) if !self.kept => {
                writeln!(
                    f,
                    "\nwhat was found was luck: run against the start once more, it took {time:.3} of its time \
                     ({low:.3} to {high:.3}); the start stays"
                )?;
            }
            Some([low, time, high]) => {
                writeln!(f, "\nthe best takes {time:.3} of the start's time ({low:.3} to {high:.3})")?;
            }
            None if self.values.iter().all(|value| value.start == value.best) => {
                writeln!(f, "\nnothing better than the start was found")?;
            }
            None => writeln!(f, "\nthere was no time to run the best against the start once more")?,
        }
        for (phase, title) in
            [(Phase::Search, "the way there"), (Phase::Around, "around the best, or what was it then")]
        {
            let mut of_phase = self.measured.iter().filter(|m| m.phase == phase).peekable();
            if of_phase.peek().is_none() {
                continue;
            }
            writeln!(
                f,
                "\n{title}\n{:22} {:>7} {:>7} {:>7} {:>15} {:>7} {:>8} {:>7}",
                "setting", "from", "to", "time", "low-high", "SAH", "build s", "B/tri"
            )?;
            for m in of_phase {
                let [time, spread] = m.time.map_or(["-".into(), "too large".into()], |[low, time, high]| {
                    [format!("{time:.3}"), format!("{low:.3}-{high:.3}")]
                });
                writeln!(
                    f,
                    "{:22} {:>7} {:>7} {time:>7} {spread:>15} {:>7.3} {:>8.2} {:>7.1}{}",
                    m.setting,
                    plain(m.from),
                    plain(m.value),
                    m.predicted,
                    m.build_seconds,
                    m.bytes_per_triangle,
                    if m.accepted { "  taken" } else { "" }
                )?;
            }
        }
        Ok(())
    }
}
