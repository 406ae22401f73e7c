//! The census of errors: raypack in every mode, and Embree in its two, against the truth.

#[cfg(feature = "peers")]
use super::embree::rivals;
use super::{Errors, Judged};
use crate::error::{Error, Result};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::bench::Results;
use crate::study::rays::{RayKind, RaySets, Setup};
use crate::study::reference::Reference;
use crate::traverse::{Accel, Kernel};
use rayon::prelude::*;
use serde::Serialize;

/// What to count.
#[derive(Clone, Debug)]
pub struct Options {
    /// The camera; `None` frames the model.
    pub camera: Option<Camera>,
    /// Kinds of ray, in the order of the rows.
    pub kinds: Vec<RayKind>,
    /// Rays of each kind, at least; fewer if no picture of up to 4096 x 4096 yields them.
    pub rays: usize,
    /// What the random rays hang on.
    pub seed: u64,
    /// raypack's instruction set.
    pub isa: Isa,
    /// How raypack's tree is built.
    pub build: BuildParams,
}

/// Errors of one engine in one mode on one kind of ray.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// `raypack` or `embree`.
    pub engine: &'static str,
    /// `fast`, `watertight` or `exact`; Embree's are `fast` and `robust`.
    pub mode: &'static str,
    /// The kind of ray.
    pub rays: RayKind,
    /// What was counted.
    pub errors: Errors,
}

/// All rows of a model.
#[derive(Clone, Debug, Serialize)]
pub struct Census {
    /// Kind by kind, and in each engine by engine.
    pub rows: Vec<Row>,
    /// Why an engine is not there, if one is not.
    pub notes: Vec<String>,
}

/// Counts. `progress` is told, a line at a time, what is about to happen.
///
/// All engines are asked the same rays, eight at a time, by all threads. (raypack's kernels all give
/// the same answers; Embree's may differ between widths.)
///
/// # Errors
/// Nothing can be built from the mesh. Embree's absence is a note, not an error.
pub fn census(mesh: &Mesh, options: &Options, progress: &mut dyn FnMut(&str)) -> Result<Census> {
    progress("building raypack's tree");
    let mut accel = Accel::build(mesh, &options.build)?.with_isa(options.isa);
    progress("building the trees of embree");
    let (rivals, notes) = match rivals(mesh) {
        Ok(rivals) => (rivals, Vec::new()),
        Err(absence @ Error::Missing { .. }) => (Vec::new(), vec![absence.to_string()]),
        Err(e) => return Err(e),
    };
    progress("building the reference");
    let reference = Reference::new(mesh);

    let mut rows = Vec::new();
    for &kind in &options.kinds {
        progress(&format!("finding the truth about {} rays", kind.name()));
        accel.set_accuracy(Accuracy::default());
        let judged = Judged::new(&reference, kind, enough_rays(mesh, &accel, kind, options));
        let mut row = |engine, mode, answers| {
            rows.push(Row { engine, mode, rays: kind, errors: judged.errors(&answers) });
        };
        for accuracy in Accuracy::ALL {
            accel.set_accuracy(accuracy);
            row("raypack", accuracy.name(), answers(&accel, Kernel::Packet8, kind, judged.rays()));
        }
        for rival in &rivals {
            row("embree", rival.mode(), rival.answers(kind, judged.rays()));
        }
    }
    Ok(Census { rows, notes })
}

/// An engine's answers to rays of a kind, by all threads.
pub fn answers(accel: &Accel, kernel: Kernel, kind: RayKind, rays: &[Ray]) -> Results {
    if kind.any_hit() {
        let mut occluded = vec![false; rays.len()];
        let parts = rays.par_chunks(CHUNK).zip(occluded.par_chunks_mut(CHUNK));
        parts.for_each(|(rays, occluded)| accel.occluded_many(kernel, rays, occluded));
        Results::Any(occluded)
    } else {
        let mut hits = vec![Hit::MISS; rays.len()];
        let parts = rays.par_chunks(CHUNK).zip(hits.par_chunks_mut(CHUNK));
        parts.for_each(|(rays, hits)| accel.intersect_many(kernel, rays, hits));
        Results::Closest(hits)
    }
}

/// Rays that a thread takes at a time: packets of any width fill it.
pub(super) const CHUNK: usize = 4096;

/// The largest picture that is made so that there are enough secondary rays.
const LARGEST: u32 = 4096;

/// At least the wanted number of rays of a kind, from the smallest picture that yields them.
fn enough_rays(mesh: &Mesh, accel: &Accel, kind: RayKind, options: &Options) -> Vec<Ray> {
    let bounds = mesh.bounds();
    let camera = options.camera.unwrap_or_else(|| Camera::framing(&bounds, 1.0));
    let mut size = (options.rays as f64).sqrt().ceil().max(1.0) as u32;
    loop {
        let setup = Setup::new(camera, size.min(LARGEST), bounds, options.seed);
        let closest = |rays: &[Ray]| match answers(accel, Kernel::Packet8, RayKind::Camera, rays) {
            Results::Closest(hits) => hits,
            Results::Any(_) => unreachable!("camera rays ask for the closest hit"),
        };
        let rays = RaySets::new(setup, mesh, closest).rays(kind);
        if rays.len() >= options.rays || size >= LARGEST {
            return rays;
        }
        // As many more pixels as are wanted, and a few to spare.
        let more = options.rays as f64 / rays.len().max(1) as f64;
        size = (f64::from(size) * more.sqrt() * 1.01).ceil().min(f64::from(LARGEST)) as u32;
    }
}

/// Without the feature there are none.
#[cfg(not(feature = "peers"))]
fn rivals(_mesh: &Mesh) -> Result<Vec<Rival>> {
    Err(Error::Missing { what: "embree".into(), remedy: "build raypack with the feature `peers`".into() })
}

/// What cannot be, without the feature.
#[cfg(not(feature = "peers"))]
enum Rival {}

#[cfg(not(feature = "peers"))]
impl Rival {
    fn mode(&self) -> &'static str {
        match *self {}
    }

    fn answers(&self, _kind: RayKind, _rays: &[Ray]) -> Results {
        match *self {}
    }
}
