//! `raypack cast SCENE --rays rays.npy -o hits.npz`: a batch of queries from NumPy and back.

use super::cache_options::{BYTES_PER_WORKER, CacheArgs, CacheReport, Within, describe_memory};
use super::memory::{Beside, MemoryReport};
use super::options::{AccuracyOption, BuildOptions, PoolsOption, as_option};
use super::outputs::same_file;
use super::progress::watch;
use super::report::{ENGINE, Engine, Json, Lines, bytes, counted, duration, grouped};
use super::scene::{Looks, Scene, SceneReport};
use crate::batch::numpy::{RayFile, write_hits, write_occluded};
use crate::batch::{Batch, Traced};
use crate::error::{Error, Result};
use crate::files::check_writable;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::profile::Profile;
use crate::render::{RayCount, Tuning};
use crate::simd::Isa;
use crate::store::is_scene;
use crate::traverse::Kernel;
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Trace a batch of rays from a NumPy file and write the hits to another
///
/// Rays are the rows of an N x 8 float32 array saved with np.save: origin x, y, z, tnear, direction x, y,
/// z, tfar. Hits are arrays in a .npz for np.load, one item a ray:
///
///   t          float32: where on the ray, in lengths of its direction
///   u, v       float32: barycentric weights of the triangle's second and third corner
///   primitive  int64: the triangle's index in the model
///   geometry   int64: the index of its material, as `raypack info` lists them; 0 without materials
///   normal     float32, N x 3: (p1 - p0) x (p2 - p0), not normalised, not turned to the ray
///
/// A miss has t = inf, primitive = geometry = -1, and zeros. With --any there is one array:
///
///   occluded   bool: whether anything lies in the ray's interval
///
/// The interval from tnear to tfar is closed: hits at its very ends count; tfar may be inf. Directions
/// need not be normalised: the point of a hit is origin + t * direction. Both sides of a triangle count.
/// Of several hits with the same t, as on an edge or a vertex that triangles share, the one with the
/// lowest primitive is reported. A ray with a NaN in it, with an infinite origin or direction, with a
/// zero direction or an empty interval (tnear > tfar) is a miss. Answers do not depend on --threads,
/// --packet or the instruction set, to the bit; RAYPACK_ISA=portable|avx2|avx512 forces one.
///
/// Any byte order and both array orders (C and Fortran) are read; N may be 0. Beside the model and its
/// tree, a ray takes 60 bytes of memory, 33 with --any. Triangles count as the reader keeps them: `raypack
/// info` says what it dropped or split.
///
/// With --memory, a part of a .rpk scene file is in memory, so much that all, rays and hits included, stays
/// within the budget. Answers are the same.
#[derive(Clone, Debug, clap::Args)]
#[command(verbatim_doc_comment)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or a .rpk scene file
    scene: PathBuf,
    /// The rays: a .npy file of N x 8 float32
    #[arg(long, value_name = "FILE")]
    rays: PathBuf,
    /// Where the hits go: .npz
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Say only whether each ray meets anything
    #[arg(long)]
    any: bool,
    #[command(flatten)]
    accuracy: AccuracyOption,
    #[command(flatten)]
    pools: PoolsOption,
    /// Worker threads; 0 for all processors [default: the profile's]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Rays that are traced together: 1, 4, 8, 16, 64 (a stream), 256 or 1024 (beams) or 4096 (lists) [default: what is quickest, lot by lot]
    #[arg(long, value_name = "N")]
    packet: Option<usize>,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    cache: CacheArgs,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    engine: Engine,
    #[serde(flatten)]
    scene: SceneReport<'a>,
    profile: &'a str,
    isa: &'static str,
    accuracy: Accuracy,
    /// Rays that the kernel traces together which traced most of them.
    packet: usize,
    /// Rays by kernel.
    kernels: BTreeMap<&'static str, u64>,
    threads: usize,
    /// Whether any hit was asked for instead of the closest.
    any: bool,
    /// Rays, seconds of tracing, rays per second.
    #[serde(flatten)]
    count: RayCount,
    /// Rays that met something.
    hits: u64,
    /// Seconds of reading the rays.
    rays_read_seconds: f64,
    /// Seconds of writing the answers.
    write_seconds: f64,
    output: &'a Path,
    /// The memory that was given, and the most that was taken.
    memory: MemoryReport,
    /// What became of it, if the scene is not all in memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    cache: Option<CacheReport>,
}

/// What is in memory of the files of rays and of hits, while they are read and written.
const FILES: usize = 1 << 20;

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let isa = Isa::from_env()?;
    let profile = args.build.profile_for(Some(&args.scene), true)?;
    let accuracy = args.accuracy.mode()?;
    args.pools.check(&args.build, accuracy)?;
    let kernel = args.kernel()?;
    let threads = args.threads(&profile)?;
    args.check_output()?;
    args.json.check()?;

    let start = Instant::now();
    let file = RayFile::open(&args.rays)?;
    // Whether there is memory for the rays is known before they are read.
    let part = match args.build.limit()? {
        Some(memory) if is_scene(&args.scene) => {
            Some(args.open_within(file.count(), Within { memory, accuracy, threads, isa, prefetch: None })?)
        }
        _ => None,
    };
    let opened_seconds = part.as_ref().map_or(0.0, Scene::open_seconds);
    // A fault of the rays is found before a model is read and built.
    let rays = file.read()?;
    let rays_read_seconds = start.elapsed().as_secs_f64() - opened_seconds;
    let mut scene = match part {
        Some(scene) => scene,
        None => {
            // The rays are there.
            let fixed = args.bytes_of(rays.len(), 0) + threads * BYTES_PER_WORKER;
            let beside = Beside { fixed, accuracy, of_mesh: &|_| 0 };
            Scene::prepare_beside(&args.scene, &args.build, &profile.build, isa, &beside)?
        }
    };
    scene.accel.set_accuracy(accuracy);
    args.pools.make(&scene.accel)?;

    let batch = Batch::new(&scene.accel, &rays).with_kernel(kernel).with_threads(threads);
    let (traced, hits, write_seconds) = args.cast(&batch, &rays, &scene)?;
    let (memory, cache) = scene.memory_report(&args.build)?;
    let report = Report {
        engine: ENGINE,
        scene: scene.report(),
        profile: args.build.name(),
        isa: isa.name(),
        accuracy,
        packet: traced.kernel().width(),
        kernels: traced.kernels.iter().map(|&(kernel, rays)| (kernel.name(), rays)).collect(),
        threads: traced.threads,
        any: args.any,
        count: RayCount::of(rays.len() as u64, traced.seconds),
        hits,
        rays_read_seconds,
        write_seconds,
        output: &args.output,
        memory,
        cache,
    };
    args.json.give(&args.text(&scene, &report), &report)
}

impl Args {
    fn kernel(&self) -> Result<Option<Kernel>> {
        let of_width = |width| {
            Kernel::of_width(width).ok_or_else(|| {
                Error::option("--packet", format!("{width} is not one of 1, 4, 8, 16, 64, 256, 1024, 4096"))
            })
        };
        self.packet.map(of_width).transpose()
    }

    fn threads(&self, profile: &Profile) -> Result<usize> {
        let threads = self.threads.unwrap_or(profile.render.threads);
        let tuning = Tuning { threads, ..Tuning::default() };
        tuning.check().map_err(as_option)?;
        Ok(tuning.worker_count())
    }

    /// The scene file, of which a part will be in memory, for so many rays.
    fn open_within(&self, rays: usize, within: Within) -> Result<Scene> {
        let beside = self.bytes_of(rays, size_of::<Ray>());
        self.cache.open(&self.scene, within, |_, _| beside)
    }

    /// Memory of the answers of so many rays, and of these, if each takes `ray` bytes.
    fn bytes_of(&self, rays: usize, ray: usize) -> usize {
        let answer = if self.any { size_of::<bool>() } else { size_of::<Hit>() };
        rays.saturating_mul(ray + answer).saturating_add(Batch::bytes_beside(rays) + FILES)
    }

    /// Finds out before any work whether the output can be written, and is not one of the other files.
    fn check_output(&self) -> Result<()> {
        if self.output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("npz")) {
            let expected = "hits go to a .npz file";
            return Err(Error::UnknownFormat { path: self.output.clone(), expected });
        }
        let others = [Some(&*self.scene), Some(&*self.rays), self.json.file()];
        if others.into_iter().flatten().any(|other| same_file(&self.output, other)) {
            let message =
                format!("{} is named twice; give each file a name of its own", self.output.display());
            return Err(Error::option("--output", message));
        }
        check_writable(&self.output)
    }

    /// Traces the rays and writes the answers; how it was traced, how many rays met something, and the
    /// seconds of writing.
    fn cast(&self, batch: &Batch<'_>, rays: &[Ray], scene: &Scene) -> Result<(Traced, u64, f64)> {
        let tracing = || batch.fraction();
        if self.any {
            let mut occluded = vec![false; rays.len()];
            let traced = scene.reading(|| watch("tracing", tracing, || batch.occluded(&mut occluded)))?;
            let writing = Instant::now();
            write_occluded(&self.output, &occluded)?;
            let hits = occluded.iter().filter(|&&any| any).count() as u64;
            Ok((traced, hits, writing.elapsed().as_secs_f64()))
        } else {
            let mut hits = vec![Hit::MISS; rays.len()];
            let traced = scene.reading(|| watch("tracing", tracing, || batch.intersect(&mut hits)))?;
            let writing = Instant::now();
            match &scene.looks {
                Looks::Mesh(mesh) => write_hits(&self.output, &hits, mesh)?,
                Looks::Stored(stored) => write_hits(&self.output, &hits, stored)?,
                Looks::Cached(cached) => scene.reading(|| write_hits(&self.output, &hits, cached))??,
            }
            let count = hits.iter().filter(|hit| hit.is_hit()).count() as u64;
            Ok((traced, count, writing.elapsed().as_secs_f64()))
        }
    }

    fn text(&self, scene: &Scene, report: &Report<'_>) -> String {
        let mut lines = Lines::default();
        scene.describe(&mut lines);
        let RayCount { rays, seconds, rays_per_s } = report.count;
        let size = bytes(rays * size_of::<Ray>() as u64);
        lines.add(
            "rays",
            format!("{}, {size}, read in {}", grouped(rays), duration(report.rays_read_seconds)),
        );
        let packets = Kernel::of_width(report.packet).map_or("", Kernel::rays);
        let chosen = match report.kernels.values().max() {
            _ if self.packet.is_some() => String::new(),
            Some(&most) if most < rays => {
                format!(" (chosen, for {:.0} % of the rays)", 100.0 * most as f64 / rays as f64)
            }
            _ => " (chosen)".to_owned(),
        };
        let Engine { version, build } = ENGINE;
        lines.add(
            "engine",
            format!(
                "raypack {version} ({build}), {}, {}, {packets}{chosen}, {}",
                report.isa,
                report.accuracy,
                counted(report.threads as u64, "thread")
            ),
        );
        if cfg!(debug_assertions) {
            lines.add("warning", "a debug build traces slowly; use cargo run --release");
        }
        let query = if self.any { "any hit" } else { "closest hit" };
        lines.add(
            "cast",
            format!("{} rays in {}: {:.2} M/s, {query}", grouped(rays), duration(seconds), rays_per_s * 1e-6),
        );
        lines.add("hits", grouped(report.hits));
        lines.add("wrote", format!("{} in {}", self.output.display(), duration(report.write_seconds)));
        describe_memory(&mut lines, &report.memory, report.cache.as_ref());
        lines.text().to_owned()
    }
}
