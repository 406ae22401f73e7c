//! What a cache is worth: a camera path under budgets, policies and ways of loading.
//!
//! The seed paper (Portelli, "Out-of-core rendering of massive data sets") flew 15 frames of 2 degrees round a
//! model of which 16 % or 39 % was in memory. [`run`] does that for each [`Trial`], from an empty cache
//! (*cold*) and some more times with what those before have left (*warm*; the last one counts), beside the resident
//! scene; and it tells how many misses the best of all policies would have had on the same uses (`minimum`).
//!
//! The system keeps files in its own memory, where a read costs some microseconds instead of what the disk
//! takes. [`CacheOptions::direct`] goes past that; reports say which it was.

mod beside;
mod by_frame;
pub mod minimum;
#[cfg(feature = "accuracy")]
pub mod plot;
mod report;
mod shape;
mod table;

pub use beside::{Beside, Column, Rates};
pub use by_frame::{FrameTable, PAPER, Paper};
pub use report::{FrameRow, Report, Row};
pub use shape::{Nodes, Shape};

use crate::cache::policy::Replacement;
use crate::cache::{CacheOptions, Cached, Loading, Prefetch};
use crate::error::Result;
use crate::geometry::Accuracy;
use crate::render::{RenderSettings, Renderer, Size, quantile};
use crate::scene::{CachedSurface, Camera, Lighting, Orbit, Surface};
use crate::simd::Isa;
use crate::store;
use crate::study::bench::machine;
use crate::traverse::Accel;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

/// What is flown, and through which caches.
#[derive(Clone, Debug)]
pub struct Options {
    /// The first camera; without it, the whole scene is framed.
    pub camera: Option<Camera>,
    /// The path.
    pub orbit: Orbit,
    /// The size of frames.
    pub size: Size,
    /// Whether the key light casts shadows: then half of the rays do not start at the eye.
    pub shadows: bool,
    /// Shares of the scene's data that are in memory, 0 to 1.
    pub budgets: Vec<f64>,
    /// Which block makes room.
    pub policies: Vec<Replacement>,
    /// Who reads.
    pub loadings: Vec<Loading>,
    /// Which blocks come before they are needed; where there are loaders to see to that.
    pub prefetches: Vec<Prefetch>,
    /// Bytes of a block.
    pub blocks: Vec<usize>,
    /// Blocks that a set holds.
    pub ways: Vec<usize>,
    /// Locks that sets share.
    pub stripes: Vec<usize>,
    /// A cache of its own for nodes; `None` for one cache of all.
    pub nodes: Vec<Option<Nodes>>,
    /// All else about the caches.
    pub cache: CacheOptions,
    /// Warm flights, at least one: the last is reported. In the first some blocks still come that kernels looked at
    /// which were not tried before. Where there is room for all blocks, all are read before.
    pub warm: u32,
    /// Threads at work.
    pub threads: usize,
    /// How hits are decided.
    pub accuracy: Accuracy,
    /// The instruction set.
    pub isa: Isa,
    /// What was measured elsewhere, to stand beside rays a second by frame.
    pub beside: Option<Rates>,
}

/// One cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trial {
    /// The share of the data that is in memory.
    pub budget: f64,
    /// What it is like, as it was asked for.
    pub shape: Shape,
    /// All of it.
    pub options: CacheOptions,
}

impl Options {
    /// Everything that is tried, in the order of the report.
    pub fn trials(&self) -> Vec<Trial> {
        let shapes = self.shapes();
        let mut trials = Vec::new();
        for &budget in &self.budgets {
            for &shape in &shapes {
                for &policy in &self.policies {
                    for &loading in &self.loadings {
                        // Who needs a block reads it: nobody asks for any before.
                        let prefetches =
                            if loading.loaders() > 0 { &self.prefetches[..] } else { &[Prefetch::Off] };
                        for &prefetch in prefetches {
                            let options = CacheOptions { policy, loading, prefetch, ..self.cache };
                            trials.push(Trial { budget, shape, options: shape.options(options) });
                        }
                    }
                }
            }
        }
        trials
    }

    fn shapes(&self) -> Vec<Shape> {
        let mut shapes = Vec::new();
        for &block in &self.blocks {
            for &ways in &self.ways {
                for &stripes in &self.stripes {
                    shapes.extend(self.nodes.iter().map(|&nodes| Shape { block, ways, stripes, nodes }));
                }
            }
        }
        shapes
    }
}

/// Flies the path through every cache. `progress` is told what part (0 to 1) is behind.
///
/// # Errors
/// The file cannot be read, or is damaged; a budget is too small for the scene.
pub fn run(file: &store::File, options: &Options, progress: &dyn Fn(f64)) -> Result<Report> {
    // The resident scene, warm, is what all are compared with.
    let resident = Accel::of_tree(file.tree()?).with_isa(options.isa).with_accuracy(options.accuracy);
    let flight = Flight::new(file, &resident, options);
    let trials = options.trials();
    let warm = options.warm.max(1) as usize;
    let steps = (warm + 1) * (trials.len() + 1);
    let done = AtomicUsize::new(0);
    let step = || progress(done.fetch_add(1, Ordering::Relaxed) as f64 / steps as f64);

    let surface = file.stored()?;
    let renderer = Renderer::new(&resident, &surface, flight.settings.clone())?.keeping_tile_times();
    for _ in 0..warm {
        flight.fly(&renderer, None)?;
        step();
    }
    let (frames, tiles) = flight.fly(&renderer, None)?;
    step();
    let mut rows = vec![Row::resident(frames, tiles)];
    drop(renderer);
    drop((surface, resident));

    for trial in trials {
        let memory = (flight.data as f64 * trial.budget) as usize;
        let cached = Cached::open(file, &trial.options, memory, 0, options.threads)?;
        let cached = Arc::new(cached);
        let accel =
            Accel::of_cached(Arc::clone(&cached)).with_isa(options.isa).with_accuracy(options.accuracy);
        let surface = CachedSurface::new(Arc::clone(&cached), file)?;
        let renderer = Renderer::new(&accel, &surface, flight.settings.clone())?.keeping_tile_times();
        cached.trace_uses(true);
        for pass in 0..=warm {
            if pass == 1 && cached.holds_all() {
                // No policy has anything to decide.
                cached.trace_uses(false);
                cached.fill()?;
            }
            let flown = flight.fly(&renderer, Some(&cached))?;
            let uses = cached.take_uses();
            if pass == 0 || pass == warm {
                let minimum = minimum::misses(&uses, cached.plan().held(), pass > 0);
                rows.push(Row::cached(&trial, pass > 0, memory, &cached, flown, minimum));
            }
            step();
        }
    }
    Ok(flight.report(file, options, rows))
}

/// The path, ready to be flown.
struct Flight {
    cameras: Vec<Camera>,
    lighting: Lighting,
    settings: RenderSettings,
    /// Bytes of what comes in blocks.
    data: usize,
}

impl Flight {
    fn new(file: &store::File, accel: &Accel, options: &Options) -> Self {
        let camera =
            options.camera.unwrap_or_else(|| Camera::framing(&accel.bounds(), options.size.aspect()));
        let lighting = Lighting::for_view(&camera, accel);
        let mut settings = RenderSettings::new(options.size);
        settings.shadows = options.shadows;
        settings.tuning.threads = options.threads;
        let cameras = options.orbit.cameras(camera).collect();
        Self { cameras, lighting, settings, data: Cached::data_bytes_of(file) }
    }

    /// Renders all frames, and says what each took, and below what seconds half and 99 % of all tiles stayed.
    fn fly<S: Surface>(
        &self,
        renderer: &Renderer<'_, S>,
        cached: Option<&Cached>,
    ) -> Result<(Vec<FrameRow>, [f64; 2])> {
        let frame = |(number, camera): (usize, &Camera)| {
            // Each pass is a path of its own: what comes after its last frame is no part of it.
            renderer.announce(self.cameras.get(number + 1).copied());
            let (_, stats) = renderer.frame_with_progress(camera, &self.lighting, &AtomicUsize::new(0))?;
            let cache = cached.map(Cached::take_stats).unwrap_or_default();
            Ok(FrameRow {
                seconds: stats.seconds,
                rays: stats.total.rays,
                tile_p50: stats.tile_p50,
                tile_p99: stats.tile_p99,
                cache,
            })
        };
        let frames = self.cameras.iter().enumerate().map(frame).collect::<Result<_>>()?;
        let mut times = renderer.take_tile_times();
        Ok((frames, [0.5, 0.99].map(|share| quantile(&mut times, share))))
    }

    fn report(&self, file: &store::File, options: &Options, rows: Vec<Row>) -> Report {
        Report {
            scene: file.path().display().to_string(),
            triangles: file.meta().triangles,
            data_bytes: self.data as u64,
            file_bytes: file.bytes(),
            size: options.size.to_string(),
            frames: self.cameras.len(),
            warm_flights: options.warm,
            step_degrees: options.orbit.step,
            shadows: options.shadows,
            direct: options.cache.direct,
            threads: options.threads,
            isa: options.isa.name(),
            accuracy: options.accuracy,
            processor: machine::processor(),
            raypack: env!("CARGO_PKG_VERSION"),
            build: machine::build_profile(),
            date: machine::date(),
            tables: FrameTable::all(&rows, options.beside.as_ref()),
            rows,
            paper: PAPER,
            beside: options.beside.as_ref().map(|rates| rates.path().display().to_string()),
        }
    }
}
