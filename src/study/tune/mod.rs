//! The search for the settings that suit a model and a machine.
//!
//! From a profile on, one setting at a time is moved along its ladder of values for as long as that helps
//! (coordinate descent). Each candidate is run against the best so far in turn, A B B A, at least three times, and
//! takes its place only if the middle pair and three quarters of all say that it is quicker: machines are noisy,
//! and a search that believes every measurement ends with what was measured luckily. What time is left shows
//! what each setting is worth around the best: that is the report's plot. At the end the best is run against
//! the start once more, since a chain of small gains adds up its luck as well; if it is no quicker then, the start
//! stays.

mod report;
mod search;
mod space;
mod trial;

#[cfg(feature = "accuracy")]
pub mod plot;

pub use report::{Measured, Phase, Report, Value};

use crate::error::{Error, Result};
use crate::geometry::Accuracy;
use crate::mesh::Mesh;
use crate::profile::Profile;
use crate::render::Size;
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::bench::machine;
use crate::study::rays::RayKind;
use search::{Judge, Verdict, around, descend};
use serde::Serialize;
use space::{SETTINGS, Setting};
use std::fmt;
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;
use trial::{Candidate, Track};

/// The parts of the time after which the search ends, and the look around the best.
const SEARCH_UNTIL: f64 = 0.6;
const AROUND_UNTIL: f64 = 0.93;

/// What candidates are timed on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Load {
    /// Frames with shading and shadows.
    Frame,
    /// Rays of a kind, from memory, by the profile's kernel.
    Rays(RayKind),
}

impl FromStr for Load {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        if name == "frame" { Ok(Self::Frame) } else { Ok(Self::Rays(name.parse()?)) }
    }
}

impl fmt::Display for Load {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Frame => f.write_str("frame"),
            Self::Rays(kind) => f.write_str(kind.name()),
        }
    }
}

/// What shall be least.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Goal {
    /// The time that tracing takes.
    Trace,
    /// The time that building and then so many frames take.
    Frames(u32),
}

impl FromStr for Goal {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self> {
        let frames = text.strip_prefix("frames=").and_then(|n| n.parse().ok()).filter(|&n| n > 0);
        match (text, frames) {
            ("trace", _) => Ok(Self::Trace),
            (_, Some(frames)) => Ok(Self::Frames(frames)),
            _ => Err(Error::option("--goal", format!("\"{text}\" is neither trace nor frames=N"))),
        }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Trace => f.write_str("trace"),
            Self::Frames(frames) => write!(f, "frames={frames}"),
        }
    }
}

impl Serialize for Goal {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> std::result::Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

/// What to tune for.
#[derive(Clone, Debug)]
pub struct Options {
    /// Where the model is seen from: at least one.
    pub cameras: Vec<Camera>,
    /// The size of frames; other rays come from a square image of its width.
    pub size: Size,
    /// What candidates are timed on: at least one thing.
    pub loads: Vec<Load>,
    /// What shall be least.
    pub goal: Goal,
    /// Bytes that the model with its tree may take.
    pub memory: Option<usize>,
    /// How long to search.
    pub seconds: f64,
    /// The instruction set to trace with.
    pub isa: Isa,
    /// How hits are decided.
    pub accuracy: Accuracy,
    /// What random rays hang on.
    pub seed: u64,
}

/// How far a search is.
#[derive(Clone, Copy, Debug)]
pub struct Progress {
    /// The part of the time that has gone, from 0 to 1.
    pub fraction: f64,
    /// What the best so far takes beside the start.
    pub best: f64,
    /// Candidates measured.
    pub tried: usize,
}

/// Searches from `start` on, until the time is over or `stop` becomes true; the best so far is the result in
/// either case. `progress` is told after each candidate.
///
/// # Errors
/// Nothing can be built from the mesh, or the start itself does not fit the memory.
pub fn run(
    model: &str,
    mesh: &Mesh,
    start: &Profile,
    options: &Options,
    stop: &AtomicBool,
    progress: &mut dyn FnMut(Progress),
) -> Result<Report> {
    let began = Instant::now();
    let start = Profile { tuned: None, ..start.clone() };
    let first = Candidate::new(start.clone(), mesh, options, None)?;
    let needed = mesh.bytes() + first.stats.bytes();
    if let Some(limit) = options.memory.filter(|&limit| limit < needed) {
        let mib = |bytes: usize| bytes.div_ceil(1 << 20);
        let message = format!(
            "the model takes {} MiB with the tree that the search starts from, more than {} MiB; start from \
             --preset preview, or give more",
            mib(needed),
            mib(limit)
        );
        return Err(Error::option("--memory", message));
    }
    let track = Track::new(mesh, options, &first)?;
    let mut tuner = Tuner {
        mesh,
        options,
        track,
        start: start.clone(),
        best: first,
        gain: 1.0,
        measured: Vec::new(),
        phase: Phase::Search,
        began,
        until: SEARCH_UNTIL,
        stop,
        progress,
        fault: None,
    };
    let best = descend(&SETTINGS, start.clone(), &mut tuner);
    (tuner.phase, tuner.until) = (Phase::Around, AROUND_UNTIL);
    for (setting, candidate) in around(&SETTINGS, &best) {
        if tuner.judge(setting, &candidate) == Verdict::Over {
            break;
        }
    }
    tuner.until = f64::INFINITY;
    tuner.finish(model, &best)
}

/// A search on its way.
struct Tuner<'a> {
    mesh: &'a Mesh,
    options: &'a Options,
    track: Track<'a>,
    start: Profile,
    best: Candidate,
    /// What the best takes beside the start, as the steps between them had it.
    gain: f64,
    measured: Vec<Measured>,
    phase: Phase,
    began: Instant,
    /// The part of the time after which the phase ends.
    until: f64,
    stop: &'a AtomicBool,
    progress: &'a mut dyn FnMut(Progress),
    /// What went wrong, if anything.
    fault: Option<Error>,
}

impl Tuner<'_> {
    fn fraction(&self) -> f64 {
        self.began.elapsed().as_secs_f64() / self.options.seconds
    }

    fn over(&self) -> bool {
        self.stop.load(Ordering::Relaxed) || self.fraction() >= self.until
    }

    /// Measures a candidate; `None` if it is over.
    fn measure(&mut self, setting: &'static Setting, profile: &Profile) -> Result<Option<Verdict>> {
        if self.over() {
            return Ok(None);
        }
        let candidate = Candidate::new(profile.clone(), self.mesh, self.options, Some(&self.best))?;
        let bytes = self.mesh.bytes() + candidate.stats.bytes();
        let fits = self.options.memory.is_none_or(|limit| bytes <= limit);
        let compared = if fits {
            let Some(compared) = self.track.compare(&self.best, &candidate, &|| self.over())? else {
                return Ok(None);
            };
            Some(compared)
        } else {
            None
        };
        let better = compared.is_some_and(|compared| compared.is_better());
        let accepted = better && self.phase == Phase::Search;
        self.measured.push(Measured {
            phase: self.phase,
            setting: setting.key,
            from: setting.value(&self.best.profile),
            value: setting.value(profile),
            time: compared.map(|compared| [compared.low, compared.ratio, compared.high]),
            pairs: compared.map_or(0, |compared| compared.pairs),
            predicted: candidate.predicted(&self.start) / self.best.predicted(&self.start),
            build_seconds: candidate.build_seconds,
            bytes_per_triangle: candidate.stats.bytes_per_triangle,
            accepted,
        });
        if accepted {
            self.gain *= compared.map_or(1.0, |compared| compared.ratio);
            self.best = candidate;
        }
        let (fraction, best) = (self.fraction(), self.gain);
        (self.progress)(Progress { fraction, best, tried: self.measured.len() });
        Ok(Some(if accepted { Verdict::Better } else { Verdict::NotBetter }))
    }

    /// Runs the best against the start once more, and reports.
    fn finish(self, model: &str, best: &Profile) -> Result<Report> {
        if let Some(fault) = self.fault {
            return Err(fault);
        }
        let interrupted = self.stop.load(Ordering::Relaxed);
        let first = Candidate::new(self.start.clone(), self.mesh, self.options, Some(&self.best))?;
        let compared = if interrupted || *best == self.start {
            None
        } else {
            self.track.compare(&first, &self.best, &|| self.stop.load(Ordering::Relaxed))?
        };
        let kept = compared.is_none_or(|compared| compared.ratio < 1.0);
        let (best, candidate) = if kept { (best, &self.best) } else { (&self.start, &first) };
        Ok(Report {
            kept,
            model: model.into(),
            triangles: self.mesh.triangles.len(),
            cameras: self.options.cameras.iter().map(Camera::to_string).collect(),
            size: self.options.size.to_string(),
            loads: self.options.loads.iter().map(Load::to_string).collect(),
            goal: self.options.goal,
            memory: self.options.memory,
            processor: machine::processor(),
            threads: rayon::current_num_threads(),
            isa: self.options.isa.name(),
            accuracy: self.options.accuracy,
            raypack: env!("CARGO_PKG_VERSION"),
            build: machine::build_profile(),
            date: machine::date(),
            seed: self.options.seed,
            seconds: self.began.elapsed().as_secs_f64(),
            interrupted,
            time: compared.map(|compared| [compared.low, compared.ratio, compared.high]),
            values: SETTINGS
                .iter()
                .map(|setting| Value {
                    setting: setting.key,
                    start: setting.value(&self.start),
                    best: setting.value(best),
                })
                .collect(),
            build_seconds: [first.build_seconds, candidate.build_seconds],
            bytes_per_triangle: [first.stats.bytes_per_triangle, candidate.stats.bytes_per_triangle],
            measured: self.measured,
            profile: best.clone(),
        })
    }
}

impl Judge for Tuner<'_> {
    fn judge(&mut self, setting: &'static Setting, candidate: &Profile) -> Verdict {
        match self.measure(setting, candidate) {
            Ok(verdict) => verdict.unwrap_or(Verdict::Over),
            Err(fault) => {
                self.fault = Some(fault);
                Verdict::Over
            }
        }
    }
}
