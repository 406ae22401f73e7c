//! How long trees take to build, what they cost and what they give, beside Embree and obvhs.
//!
//! Every engine builds the same mesh, which is in memory, in each of its qualities, in turn, round after
//! round; then the trees of the last round are raced over the same rays with all threads. raypack's trees are
//! walked besides, to count the steps and tests that rays take in them ([`count`]).

pub mod count;
mod report;
mod subject;

pub use report::{Header, Rate, Report, Row, Seconds};

use super::agreement::Agreement;
use super::engine::chunk_of;
use super::ours::Ours;
use super::race::{Entry, race};
use super::{EngineInfo, EngineName, Options, check, machine};
use crate::error::{Error, Result};
use crate::geometry::{Hit, Ray};
use crate::kdtree::{BuildParams, Preset};
use crate::mesh::Mesh;
use crate::scene::Camera;
use crate::study::rays::{RayKind, RaySets, Setup};
use crate::traverse::Kernel;
use subject::{Built, Subject};

/// Measures. `progress` is told, a line at a time, what is about to happen. Each tree is built `rounds`
/// times, and rays are traced with the greatest number of threads of `options`.
///
/// # Errors
/// As [`super::run`].
pub fn run(
    model: &str,
    mesh: &Mesh,
    options: &Options,
    rounds: usize,
    progress: &mut dyn FnMut(&str),
) -> Result<Report> {
    check(options)?;
    let mut notes = Vec::new();
    let subjects = subjects(options, &mut notes)?;
    let mut built: Vec<Option<Built>> = subjects.iter().map(|_| None).collect();
    for round in 0..rounds.max(1) {
        for (subject, kept) in subjects.iter().zip(&mut built) {
            progress(&format!("building {} {}, round {}", subject.engine(), subject.mode(), round + 1));
            // One tree of each at a time: the one of the round before goes first.
            let before = kept.take();
            let earlier = before.map(Built::into_figures);
            *kept = Some(subject.build(mesh, options, earlier)?);
        }
    }
    let built: Vec<Built> = built.into_iter().flatten().collect();

    let sets = rays(mesh, options, &built)?;
    let mut report = Report {
        header: header(model, mesh, options, &built, sets.setup()),
        rows: built.iter().map(|built| Row::new(built, mesh)).collect(),
        agreements: Vec::new(),
        notes,
    };
    for &kind in &options.kinds {
        let rays = sets.rays(kind);
        if rays.is_empty() {
            let name = kind.name();
            report.notes.push(format!("no {name} rays: the camera sees nothing that could send any"));
            continue;
        }
        progress(&format!("{} rays", kind.name()));
        race_kind(&built, kind, &rays, options, &mut report);
    }
    Ok(report)
}

/// What is built: raypack in every preset, and with other settings if the options have any; the rivals in
/// every quality.
fn subjects(options: &Options, notes: &mut Vec<String>) -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    for &name in &options.engines {
        match Subject::all(name, options) {
            Ok(some) => subjects.extend(some),
            Err(error @ Error::Missing { .. }) if options.engines.len() > 1 => notes.push(error.to_string()),
            Err(error) => return Err(error),
        }
    }
    Ok(subjects)
}

/// The settings that raypack is built with, and their names.
fn settings(options: &Options) -> Vec<(&'static str, BuildParams)> {
    let mut all: Vec<_> =
        Preset::ALL.iter().map(|&preset| (preset.name(), BuildParams::preset(preset))).collect();
    if all.iter().all(|(_, params)| *params != options.build) {
        all.push(("profile", options.build.clone()));
    }
    all
}

/// The rays, made with raypack's first tree, or a preview of one where raypack is not raced.
fn rays(mesh: &Mesh, options: &Options, built: &[Built]) -> Result<RaySets> {
    let bounds = mesh.bounds();
    let camera = options.camera.unwrap_or_else(|| Camera::framing(&bounds, 1.0));
    camera.check()?;
    let own;
    let accel = match built.iter().find_map(|built| built.accel.as_ref()) {
        Some(accel) => accel,
        None => {
            let params = BuildParams::preset(Preset::Preview);
            own = Ours::new(mesh, &params, options.isa, options.accuracy)?;
            own.accel()
        }
    };
    let setup = Setup::new(camera, options.size, bounds, options.seed);
    Ok(RaySets::new(setup, mesh, |rays| {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.intersect_many(Kernel::Packet8, rays, &mut hits);
        hits
    }))
}

fn header(model: &str, mesh: &Mesh, options: &Options, built: &[Built], setup: &Setup) -> Header {
    let mut engines: Vec<EngineInfo> = Vec::new();
    for built in built {
        let engine = &built.engine;
        if engines.iter().all(|info| info.name != engine.name()) {
            engines.push(EngineInfo { name: engine.name(), version: engine.version(), isa: engine.isa() });
        }
    }
    Header {
        model: model.into(),
        triangles: mesh.triangles.len(),
        mesh_bytes: mesh.bytes(),
        machine: machine::processor(),
        hardware_threads: machine::hardware_threads(),
        build_threads: rayon::current_num_threads(),
        ray_threads: options.threads.iter().copied().max().unwrap_or(1),
        raypack: env!("CARGO_PKG_VERSION"),
        accuracy: options.accuracy,
        profile: machine::build_profile(),
        engines,
        date: machine::date(),
        seed: options.seed,
        camera: setup.camera.to_string(),
        size: options.size,
    }
}

/// Races all trees over one set of rays; the best mode of each is its rate.
fn race_kind(built: &[Built], kind: RayKind, rays: &[Ray], options: &Options, report: &mut Report) {
    let (mut contenders, mut entries) = (Vec::new(), Vec::new());
    for (number, built) in built.iter().enumerate() {
        for contender in built.engine.contenders(rays, kind.any_hit()) {
            contenders.push(contender);
            entries.push(Entry { engine: number, qualifies: true });
        }
    }
    let chunks = rays.len().div_ceil(chunk_of(rays.len()));
    let threads = report.header.ray_threads;
    let speeds = race(&contenders, &entries, rays.len(), chunks, threads, &options.pace);
    let mut found = Vec::new();
    for (number, (built, row)) in built.iter().zip(&mut report.rows).enumerate() {
        let of_tree = (0..contenders.len()).filter(|&i| entries[i].engine == number);
        let best = of_tree
            .filter_map(|i| Some((i, speeds[i]?)))
            .max_by(|(_, a), (_, b)| a.median.total_cmp(&b.median));
        let Some((i, speed)) = best else { continue };
        (0..chunks).for_each(|chunk| contenders[i].trace(chunk));
        found.push((format!("{} {}", row.engine, row.mode), contenders[i].results()));
        row.rays.push(Rate {
            rays: kind,
            mode: contenders[i].mode(),
            mrays_per_s: speed.median,
            low: speed.low,
            high: speed.high,
            counts: built.accel.as_ref().map(|accel| count::count(accel, rays)),
        });
    }
    if let Some(((reference, expected), others)) = found.split_first() {
        report.agreements.extend(others.iter().map(|(name, results)| {
            Agreement::new(kind, (reference.clone(), expected), (name.clone(), results))
        }));
    }
}

impl EngineName {
    /// Whether it is raypack.
    fn is_ours(self) -> bool {
        self == Self::Raypack
    }
}
