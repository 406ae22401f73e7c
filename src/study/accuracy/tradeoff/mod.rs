//! What accuracy costs in time: every accuracy mode's rays per second and frame times beside its errors.
//!
//! Two studies share a model, a camera and a machine:
//!
//! - **Rays.** Each mode traces the rays of [`rays`](crate::study::rays), kind by kind, with the kernel that
//!   is quickest for it; the modes run in turn, round after round (`timing`). Their answers are then held
//!   against the [`Reference`], which is exact, and errors counted ([`Errors`](super::Errors)). Embree's
//!   fast and robust modes run beside, if it is here, on the same rays against the same reference.
//! - **Frames.** Each mode renders the picture with each number of samples per pixel, with shading and
//!   shadows as `raypack render` has them, again in turn (`frames`). Each picture is compared with the
//!   reference picture, rendered in exact mode with many samples (`picture`).
//!
//! `pareto` says which points nobody beats on both counts; `within` picks the most accurate setting that
//! fits a frame time; [`Report`], `table` and [`plot`] say it.

mod frames;
mod pareto;
mod participants;
mod picture;
pub mod plot;
mod report;
mod table;
mod timing;
mod within;

pub use picture::{Judge, PictureError};
pub use report::{Choice, FrameRow, Header, PerMillion, RayRow, ReferencePicture, Report, Within};

use crate::error::{Error, Result};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use crate::render::{Limits, RenderSettings, Size, Staged, Tuning, Wishes};
use crate::scene::effects::{Effect, Request};
use crate::scene::{Camera, Lighting};
use crate::simd::Isa;
use crate::study::accuracy::Judged;
use crate::study::bench::{EngineInfo, EngineName, Pace, Results, machine};
use crate::study::rays::{RayKind, RaySets, Setup};
use crate::study::reference::Reference;
use crate::traverse::{Accel, Kernel};
use participants::Participant;
use std::time::Instant;

/// The most samples per pixel of the reference picture.
const MAX_REFERENCE_SAMPLES: u32 = 65_536;

/// What to measure and how.
#[derive(Clone, Debug)]
pub struct Options {
    /// Kinds of ray, in the order of the report.
    pub kinds: Vec<RayKind>,
    /// Engines: raypack, and Embree or not.
    pub engines: Vec<EngineName>,
    /// The camera; `None` frames the model.
    pub camera: Option<Camera>,
    /// The picture's size. Ray sets come from a square image of about as many pixels.
    pub size: Size,
    /// Samples per pixel of the pictures, in the order of the report.
    pub samples: Vec<u32>,
    /// Samples per pixel of the reference picture.
    pub reference_samples: u32,
    /// What to make of the effects that the scene calls for.
    pub request: Request,
    /// How far light is followed in the pictures, of scenes whose effects ask for it.
    pub limits: Vec<Limits>,
    /// How many rays of each kind are held against the reference at most, evenly chosen.
    pub oracle_rays: usize,
    /// The frame time in seconds to pick a setting for.
    pub within: Option<f64>,
    /// What the random rays hang on.
    pub seed: u64,
    /// How long each race lasts: one for each kind of ray, one for the frames.
    pub pace: Pace,
    /// raypack's instruction set.
    pub isa: Isa,
    /// Whether Embree is held to that instruction set too; else it chooses its best.
    pub hold_peers_to_isa: bool,
    /// How raypack's tree is built.
    pub build: BuildParams,
    /// How frames are made; its number of threads holds for rays too, its kernel for frames alone.
    pub tuning: Tuning,
}

impl Options {
    /// Checks what can be checked without a model.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first that makes no sense.
    pub fn check(&self) -> Result<()> {
        let wrong = |option: &str, message: String| Err(Error::option(option, message));
        if self.kinds.is_empty() {
            return wrong("--rays", "no kind of ray is named".into());
        }
        if !self.engines.contains(&EngineName::Raypack) {
            return wrong("--engines", "raypack's own modes are what is studied; name it too".into());
        }
        if self.engines.contains(&EngineName::Obvhs) {
            return wrong("--engines", "obvhs has no accuracy modes; raypack and embree have".into());
        }
        if self.oracle_rays == 0 {
            return wrong("--oracle-rays", "0 rays show no errors; give at least 1".into());
        }
        let Some(&most) = self.samples.iter().max() else {
            return wrong("--samples", "no number of samples is named".into());
        };
        for &samples in &self.samples {
            RenderSettings { samples, ..self.settings(1) }.check()?;
        }
        if self.limits.is_empty() {
            return wrong("--bounces", "no number of bounces is named".into());
        }
        self.limits.iter().try_for_each(Limits::check)?;
        if !(most..=MAX_REFERENCE_SAMPLES).contains(&self.reference_samples) {
            let message = format!(
                "{} is not from {most}, the most of --samples, to {MAX_REFERENCE_SAMPLES}",
                self.reference_samples
            );
            return wrong("--reference-samples", message);
        }
        Ok(())
    }

    /// The farthest that light is followed.
    fn most(&self) -> Limits {
        let start = Limits { roulette: 1.0, ..Limits::default() };
        self.limits.iter().fold(Limits { bounces: 0, ..start }, |most, limits| Limits {
            bounces: most.bounces.max(limits.bounces),
            shadow_samples: most.shadow_samples.max(limits.shadow_samples),
            roulette: most.roulette.min(limits.roulette),
            error: 0.0,
        })
    }

    fn settings(&self, samples: u32) -> RenderSettings {
        let (size, tuning) = (self.size, self.tuning.clone());
        RenderSettings { samples, tuning, ..RenderSettings::new(size) }
    }

    /// The side of the square image that ray sets come from.
    fn ray_side(&self) -> u32 {
        (self.size.pixels() as f64).sqrt().round() as u32
    }
}

/// Measures. `progress` is told, a line at a time, what is about to happen.
///
/// # Errors
/// The options make no sense, or nothing can be built from the mesh. That Embree is not here is a note in
/// the report, and an error only where `RAYPACK_EMBREE` says where it ought to be.
pub fn run(model: &str, mesh: &Mesh, options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Report> {
    options.check()?;
    progress("building raypack's tree");
    let start = Instant::now();
    let accel = Accel::build(mesh, &options.build)?.with_isa(options.isa);
    let build_seconds = start.elapsed().as_secs_f64();
    // The fast mode's records are made once and shared by all clones.
    let accel = accel.with_accuracy(Accuracy::Fast).with_accuracy(Accuracy::Exact);
    let mut notes = Vec::new();
    let mut participants = participants::ours(&accel, build_seconds);
    if options.engines.contains(&EngineName::Embree) {
        progress("building Embree's trees");
        match participants::embree(mesh, options.hold_peers_to_isa.then_some(options.isa)) {
            Ok(peers) => participants.extend(peers),
            Err(e @ Error::Missing { .. }) => notes.push(format!("{e}; its modes are left out")),
            Err(e) => return Err(e),
        }
    }
    progress("building the reference");
    let reference = Reference::new(mesh);

    let bounds = mesh.bounds();
    let camera = options.camera.unwrap_or_else(|| Camera::framing(&bounds, options.size.aspect()));
    let setup = Setup::new(camera, options.ray_side(), bounds, options.seed);
    let sets = RaySets::new(setup, mesh, |rays| {
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.intersect_many(Kernel::Packet8, rays, &mut hits);
        hits
    });
    let threads = options.tuning.worker_count();
    let mut rays = Vec::new();
    for &kind in &options.kinds {
        let set = sets.rays(kind);
        if set.is_empty() {
            notes.push(format!("no {} rays: the camera sees nothing that could send any", kind.name()));
            continue;
        }
        rays.extend(study_rays(&participants, &reference, kind, &set, options, progress));
    }

    let lighting = Lighting::for_view(&camera, &accel);
    let wishes = Wishes {
        request: options.request,
        lighting,
        environment: None,
        samples: Some(1),
        limits: Limits::default(),
        error: Some(0.0),
    };
    let staged = Staged::new(&accel, mesh, &camera, wishes);
    notes.extend(staged.problems.iter().map(ToString::to_string));
    let appearance = staged.appearance.as_ref();
    if appearance.is_some() {
        let names: Vec<&str> = staged.analysis.set().iter().map(Effect::name).collect();
        notes.push(format!("pictures show {}", names.join(", ")));
    }
    let view = frames::View { accel: &accel, mesh, camera: &camera, lighting: &lighting, appearance };
    let (reference_picture, frames) = frames::race(&view, options, progress)?;
    let within = match options.within {
        Some(budget) => Some(within::pick(budget, &frames, &view, options, progress)?),
        None => None,
    };
    Ok(Report {
        header: Header {
            model: model.into(),
            triangles: mesh.triangles.len(),
            machine: machine::processor(),
            hardware_threads: machine::hardware_threads(),
            threads,
            isa: accel.isa().name().into(),
            raypack: env!("CARGO_PKG_VERSION").into(),
            build: machine::build_profile(),
            build_params: options.build.clone(),
            tuning: options.tuning.clone(),
            engines: engines(&participants),
            default: Accuracy::default(),
            date: machine::date(),
            seed: options.seed,
            camera: camera.to_string(),
            size: options.size,
            ray_side: options.ray_side(),
            oracle_rays: options.oracle_rays,
        },
        rays,
        reference: reference_picture,
        frames,
        within,
        notes,
    })
}

/// Each engine once.
fn engines(participants: &[Participant]) -> Vec<EngineInfo> {
    let mut engines: Vec<EngineInfo> = Vec::new();
    for Participant { engine, .. } in participants {
        if engines.iter().all(|known| known.name != engine.name()) {
            engines.push(EngineInfo { name: engine.name(), version: engine.version(), isa: engine.isa() });
        }
    }
    engines
}

/// Times all modes on one set of rays, and counts their errors on an even choice of it.
fn study_rays(
    participants: &[Participant],
    reference: &Reference<'_>,
    kind: RayKind,
    rays: &[Ray],
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Vec<RayRow> {
    let threads = options.tuning.worker_count();
    let plural = if threads == 1 { "" } else { "s" };
    progress(&format!("timing {} rays, {threads} thread{plural}", kind.name()));
    let timed = timing::race_modes(participants, rays, kind.any_hit(), threads, &options.pace);

    let checked = timing::evenly(rays.len(), options.oracle_rays);
    progress(&format!("checking {} {} rays against the reference", checked.len(), kind.name()));
    let judged = Judged::new(reference, kind, checked.iter().map(|&i| rays[i]).collect());
    let row = |(participant, timed): (&Participant, timing::Timed)| {
        let errors = judged.errors(&match timed.results {
            Results::Closest(hits) => Results::Closest(checked.iter().map(|&i| hits[i]).collect()),
            Results::Any(flags) => Results::Any(checked.iter().map(|&i| flags[i]).collect()),
        });
        RayRow::new(participant, kind, threads, rays.len(), &timed.kernel, timed.speed, errors)
    };
    let mut rows: Vec<RayRow> = participants.iter().zip(timed).map(row).collect();
    let points: Vec<(f64, f64)> = rows.iter().map(|row| (row.ns_per_ray, row.per_million.total)).collect();
    for (row, pareto) in rows.iter_mut().zip(pareto::front(&points)) {
        row.pareto = pareto;
    }
    rows
}
