//! Rays per second by kind of ray, beside Embree and obvhs, on the same rays in one run.
//!
//! A ray's way through here: [`RaySets`] makes it; an `engine::Engine` prepares it in the layout that it
//! likes best, once for each of its modes; `race` runs all modes in turn, round after round; a worker of
//! `schedule` takes the ray's chunk of 1024 and has the `engine::Contender` trace it and write the full
//! record (t, u, v, primitive, normal) or the any-hit flag; [`agreement`] compares what the engines found;
//! [`Report`] and `table` say it.
//!
//! What each engine is given:
//!
//! - raypack: rays for its single-ray, stream and filter kernels, its own packets for the others; or, if that is asked for,
//!   rays for all ([`Options::slices`]).
//! - Embree: its own packets. Every width, flag and build is a mode of its own; denormals are flushed.
//! - obvhs: its own rays with their inverse directions, its triangles in the tree's order.
//!
//! Each traces a chunk at a time and writes its records in its own form. All trees are built with all
//! threads before any race. Only `trace` is timed. To save time, modes of a rival that are more than 25 %
//! slower than its best in a qualifying run are dropped unless [`Pace::all_modes`] is set.

pub mod agreement;
pub mod build;
#[cfg(feature = "peers")]
pub(super) mod embree;
pub(super) mod engine;
pub(super) mod machine;
#[cfg(feature = "peers")]
mod obvhs;
pub(super) mod ours;
pub(super) mod race;
mod report;
mod schedule;
mod table;

pub use agreement::Agreement;
pub use engine::Results;
pub use machine::hardware_threads;
pub use race::Pace;
pub use report::{Beams, Choices, EngineInfo, Header, Report, Row, Share};

use crate::error::{Error, Result};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use crate::scene::Camera;
use crate::simd::Isa;
#[cfg(feature = "peers")]
use crate::study::peers::embree::Build;
use crate::study::rays::{RayKind, RaySets, Setup};
use crate::traverse::Kernel;
use engine::{Engine, chunk_of};
use ours::Ours;
use race::{Entry, race};

/// An engine that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum EngineName {
    /// This crate.
    Raypack,
    /// Embree 4, if it is here.
    Embree,
    /// obvhs.
    Obvhs,
}

impl EngineName {
    /// All of them.
    pub const ALL: [Self; 3] = [Self::Raypack, Self::Embree, Self::Obvhs];

    /// `raypack`, `embree` or `obvhs`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raypack => "raypack",
            Self::Embree => "embree",
            Self::Obvhs => "obvhs",
        }
    }
}

impl std::str::FromStr for EngineName {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|engine| engine.name() == name).ok_or_else(|| {
            Error::option("--engines", format!("\"{name}\" is unknown; known are raypack, embree, obvhs"))
        })
    }
}

/// What to measure and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Kinds of ray, in the order of the report.
    pub kinds: Vec<RayKind>,
    /// Engines, in the order of the report.
    pub engines: Vec<EngineName>,
    /// raypack's modes, by name: its kernels, `auto` and `mixed`. None named are all. Rivals always race in every mode.
    pub modes: Vec<String>,
    /// The camera; `None` frames the model.
    pub camera: Option<Camera>,
    /// Width and height of the camera's image.
    pub size: u32,
    /// Numbers of threads, each raced for itself.
    pub threads: Vec<usize>,
    /// What the random rays hang on.
    pub seed: u64,
    /// How long each race lasts.
    pub pace: Pace,
    /// raypack's instruction set.
    pub isa: Isa,
    /// Whether Embree is held to that instruction set too; else it chooses its best.
    pub hold_peers_to_isa: bool,
    /// How raypack decides hits.
    pub accuracy: Accuracy,
    /// How raypack's tree is built.
    pub build: BuildParams,
    /// Whether every kernel is given rays in a row, as `raypack cast` has them, and makes packets of them while the clock
    /// runs.
    pub slices: bool,
    /// Whether raypack keeps pools beside its tree.
    pub pools: bool,
}

/// Measures. `progress` is told, a line at a time, what is about to happen.
///
/// # Errors
/// Nothing can be built from the mesh, the options make no sense, or the one engine asked for is not here.
/// An engine that is not here while others are is left out, and a note in the report says why.
pub fn run(model: &str, mesh: &Mesh, options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Report> {
    check(options)?;
    progress("building raypack's tree");
    let mut ours = Ours::new(mesh, &options.build, options.isa, options.accuracy)?;
    ours.give_slices(options.slices);
    if options.pools {
        progress("making raypack's pools");
        ours.make_pools()?;
    }
    let mut notes = Vec::new();
    let mut peers: Vec<(EngineName, Box<dyn Engine>)> = Vec::new();
    for &name in options.engines.iter().filter(|&&name| name != EngineName::Raypack) {
        progress(&format!("building the trees of {}", name.name()));
        match peer(name, mesh, options) {
            Ok(engine) => peers.push((name, engine)),
            Err(e @ Error::Missing { .. }) if options.engines.len() > 1 => notes.push(e.to_string()),
            Err(e) => return Err(e),
        }
    }
    let engine = |&name: &EngineName| match name {
        EngineName::Raypack => Some(&ours as &dyn Engine),
        _ => peers.iter().find(|(of, _)| *of == name).map(|(_, engine)| &**engine),
    };
    let engines: Vec<&dyn Engine> = options.engines.iter().filter_map(engine).collect();

    let bounds = mesh.bounds();
    let camera = options.camera.unwrap_or_else(|| Camera::framing(&bounds, 1.0));
    camera.check()?;
    let setup = Setup::new(camera, options.size, bounds, options.seed);
    let sets = RaySets::new(setup, mesh, |rays| {
        let mut hits = vec![Hit::MISS; rays.len()];
        ours.accel().intersect_many(Kernel::Packet8, rays, &mut hits);
        hits
    });
    let mut report = Report {
        header: Header {
            model: model.into(),
            triangles: mesh.triangles.len(),
            machine: machine::processor(),
            hardware_threads: machine::hardware_threads(),
            isa: ours.isa(),
            raypack: ours.version(),
            accuracy: options.accuracy,
            build: machine::build_profile(),
            engines: engines
                .iter()
                .map(|e| EngineInfo { name: e.name(), version: e.version(), isa: e.isa() })
                .collect(),
            date: machine::date(),
            seed: options.seed,
            camera: setup.camera.to_string(),
            size: options.size,
            slices: options.slices,
            pools: options.pools,
            light: setup.light.to_array(),
        },
        rows: Vec::new(),
        choices: Vec::new(),
        beams: Vec::new(),
        agreements: Vec::new(),
        notes,
    };
    for &kind in &options.kinds {
        let rays = sets.rays(kind);
        if rays.is_empty() {
            report
                .notes
                .push(format!("no {} rays: the camera sees nothing that could send any", kind.name()));
            continue;
        }
        race_kind(&engines, kind, &rays, options, &mut report, progress);
        if options.engines.contains(&EngineName::Raypack) {
            let beams = ours.beams(kind, &rays);
            report.beams.extend((beams.counts.beams > 0).then_some(beams));
        }
    }
    Ok(report)
}

fn check(options: &Options) -> Result<()> {
    if options.engines.is_empty() {
        return Err(Error::option("--engines", "no engine is named; known are raypack, embree, obvhs"));
    }
    let known: Vec<&str> =
        Kernel::ALL.iter().map(|kernel| kernel.name()).chain([ours::AUTO, ours::MIXED]).collect();
    if let Some(mode) = options.modes.iter().find(|mode| !known.contains(&mode.as_str())) {
        return Err(Error::option("--modes", format!("\"{mode}\" is not one of {}", known.join(", "))));
    }
    if options.slices && options.modes.iter().any(|mode| mode == ours::AUTO) {
        return Err(Error::option(
            "--slices",
            "auto takes squares of a picture, not rays in a row; name mixed",
        ));
    }
    if options.kinds.is_empty() {
        return Err(Error::option("--rays", "no kind of ray is named"));
    }
    if options.size == 0 || options.size > 16_384 {
        return Err(Error::option("--size", format!("{} is not between 1 and 16384", options.size)));
    }
    Ok(())
}

/// Builds a rival.
#[cfg(feature = "peers")]
fn peer(name: EngineName, mesh: &Mesh, options: &Options) -> Result<Box<dyn Engine>> {
    Ok(match name {
        EngineName::Embree => Box::new(embree::Embree::new(
            mesh,
            options.hold_peers_to_isa.then_some(options.isa),
            &Build::ALL,
        )?),
        _ => Box::new(obvhs::Obvhs::new(mesh)),
    })
}

/// Without the feature there are no rivals.
#[cfg(not(feature = "peers"))]
fn peer(name: EngineName, _mesh: &Mesh, _options: &Options) -> Result<Box<dyn Engine>> {
    Err(Error::Missing { what: name.name().into(), remedy: "build raypack with the feature `peers`".into() })
}

/// Races all engines over one set of rays with each number of threads, then compares their answers.
fn race_kind(
    engines: &[&dyn Engine],
    kind: RayKind,
    rays: &[Ray],
    options: &Options,
    report: &mut Report,
    progress: &mut dyn FnMut(&str),
) {
    let (mut contenders, mut entries) = (Vec::new(), Vec::new());
    for (number, engine) in engines.iter().enumerate() {
        let named = |mode: &String| options.modes.is_empty() || options.modes.contains(mode);
        for contender in engine.contenders(rays, kind.any_hit()) {
            // Only raypack's modes never have to qualify.
            if !engine.qualifies() && !named(&contender.mode()) {
                continue;
            }
            contenders.push(contender);
            entries.push(Entry { engine: number, qualifies: engine.qualifies() });
        }
    }
    let chunks = rays.len().div_ceil(chunk_of(rays.len()));
    let mut speeds = Vec::new();
    for &threads in &options.threads {
        progress(&format!("{} rays, {threads} thread{}", kind.name(), if threads == 1 { "" } else { "s" }));
        let of_modes = race(&contenders, &entries, rays.len(), chunks, threads, &options.pace);
        speeds.extend(of_modes.into_iter().enumerate().filter_map(|(i, s)| Some((i, threads, s?))));
    }
    // Modes of an engine share their memory for results, so each is traced once more and read at once.
    let mut best: Vec<Option<(f64, String, Results)>> = engines.iter().map(|_| None).collect();
    for (i, contender) in contenders.iter().enumerate() {
        let mut of_mode = speeds.iter().filter(|s| s.0 == i).peekable();
        let Some(&&(_, _, first)) = of_mode.peek() else { continue };
        let share = |(kernel, rays): (Kernel, u64)| Share { kernel: kernel.name(), rays };
        let kernels: Vec<Share> = contender.traced().into_iter().map(share).collect();
        if !kernels.is_empty() {
            report.choices.push(Choices { rays: kind, mode: contender.mode(), kernels });
        }
        (0..chunks).for_each(|chunk| contender.trace(chunk));
        let results = contender.results();
        let engine = entries[i].engine;
        report.rows.extend(of_mode.map(|&(_, threads, speed)| Row {
            engine: engines[engine].name(),
            mode: contender.mode(),
            rays: kind,
            threads,
            isa: engines[engine].isa(),
            accuracy: engines[engine].accuracy(),
            mrays_per_s: speed.median,
            low: speed.low,
            high: speed.high,
            rounds: speed.rounds,
            count: rays.len(),
            hits: results.hits(),
            build_seconds: contender.build_seconds(),
            bytes: contender.bytes(),
        }));
        if best[engine].as_ref().is_none_or(|b| b.0 < first.median) {
            best[engine] =
                Some((first.median, format!("{} {}", engines[engine].name(), contender.mode()), results));
        }
    }
    let mut best = best.iter().flatten();
    if let Some((_, reference, expected)) = best.next() {
        let compare = |(_, name, found): &(f64, String, Results)| {
            Agreement::new(kind, (reference.clone(), expected), (name.clone(), found))
        };
        report.agreements.extend(best.map(compare));
    }
}
