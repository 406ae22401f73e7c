//! `raypack cache SCENE.rpk`: what caches are worth along a camera path.

use super::cache_options::ShapeArgs;
use super::options::{AccuracyOption, as_option, orbit};
use super::outputs::same_file;
use super::progress::Bar;
use super::report::Json;
use crate::cache::CacheOptions;
use crate::cache::policy::Replacement;
use crate::error::{Error, Result};
use crate::files::check_writable;
use crate::geometry::Accuracy;
use crate::render::Tuning;
use crate::scene::Camera;
use crate::simd::Isa;
use crate::store::{self, is_scene};
use crate::study::cache::{Options, plot, run as fly};
use crate::study::plot::Format;
use std::path::PathBuf;

/// Fly a camera path through caches of a scene file: budgets, policies, ways of loading
///
/// Each cache flies the path twice or more: cold, from nothing, and warm, with what was left before. A table
/// has them all, beside the resident scene and the best that any policy could have done. Then come rays per
/// second as in the tables of the seed paper (Portelli, "Out-of-core rendering of massive data sets"): one for
/// each share in memory and way of loading, a row a frame, a column a policy.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The scene: a .rpk file, as raypack build makes it
    scene: PathBuf,
    /// The first camera, as eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG or a TOML file; without it the scene is framed
    #[arg(long, allow_hyphen_values = true)]
    camera: Option<String>,
    /// Frames of the path, round the point that is looked at
    #[arg(long, value_name = "N", default_value_t = 15)]
    frames: u32,
    /// Degrees from one frame to the next
    #[arg(long, value_name = "DEG", default_value_t = 2.0, allow_negative_numbers = true)]
    step: f64,
    /// Width and height of frames
    #[arg(long, value_name = "WxH", default_value = "512x512", allow_hyphen_values = true)]
    size: String,
    /// Leave out the shadows: camera rays alone, as in the seed paper
    #[arg(long)]
    no_shadows: bool,
    /// Shares of the scene's data that are in memory, in per cent
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "16,39")]
    budgets: Vec<f64>,
    /// Which block makes room: of fifo, lru, frequency, decaying, clock, sieve, s3-fifo
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "fifo,lru,frequency,decaying,clock,sieve,s3-fifo"
    )]
    policies: Vec<String>,
    /// Who reads: sync, async
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "sync,async")]
    loading: Vec<String>,
    /// What comes before it is needed, with loading async: off, beside, ahead
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = CacheOptions::default().prefetch.name()
    )]
    prefetch: Vec<String>,
    /// A cache of its own for nodes, with this part (0.01 to 0.99) of the memory and the same policy, as in the
    /// seed paper
    #[arg(long, value_name = "PART")]
    nodes: Option<f32>,
    #[command(flatten)]
    shape: ShapeArgs,
    /// Warm flights, of which the last is reported: in the first, some blocks still come that a kernel looks at which
    /// was not tried there before
    #[arg(long, value_name = "N", default_value_t = 1)]
    warm: u32,
    /// Threads at work; 0 for all processors
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    accuracy: AccuracyOption,
    /// Draw rays per second by frame: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let options = args.options()?;
    args.check_files()?;
    let file = store::File::open(&args.scene)?;
    let bar = Bar::new("flying");
    let report = fly(&file, &options, &|part| bar.set(part))?;
    drop(bar);
    if let Some(path) = &args.plot {
        plot::write(path, &report)?;
    }
    args.json.give(&report.to_string(), &report)
}

impl Args {
    /// Everything that can be wrong with the files, before any work.
    fn check_files(&self) -> Result<()> {
        if !is_scene(&self.scene) {
            let expected = "a cache needs a .rpk scene file; make one with raypack build";
            return Err(Error::UnknownFormat { path: self.scene.clone(), expected });
        }
        if let Some(plot) = &self.plot {
            Format::of(plot)?;
            let others = self.json.file().into_iter().chain([self.scene.as_path()]);
            if others.into_iter().any(|other| same_file(other, plot)) {
                return Err(Error::option("--plot", "this file is named twice; give another name"));
            }
            check_writable(plot)?;
        }
        self.json.check()
    }

    fn options(&self) -> Result<Options> {
        let wrong = |option: &str, message: String| Err(Error::option(option, message));
        if let Some(budget) = self.budgets.iter().find(|budget| !(0.01..=1000.0).contains(*budget)) {
            return wrong("--budgets", format!("{budget} is not a share from 0.01 to 1000 per cent"));
        }
        if !(1..=1000).contains(&self.warm) {
            return wrong("--warm", format!("{} is not a number of flights from 1 to 1000", self.warm));
        }
        let tuning = Tuning { threads: self.threads, ..Tuning::default() };
        tuning.check().map_err(as_option)?;
        let accuracy = self.accuracy.mode()?;
        if accuracy == Accuracy::Fast {
            return wrong(
                "--accuracy",
                "fast keeps a record of every triangle in memory; choose watertight or exact".into(),
            );
        }
        let policies: Vec<Replacement> = self
            .policies
            .iter()
            .map(|name| name.parse().map_err(|error: Error| renamed(error, "--policies")))
            .collect::<Result<_>>()?;
        let loadings =
            self.loading.iter().map(|name| self.shape.loading(name)).collect::<Result<Vec<_>>>()?;
        let prefetches = self.prefetch.iter().map(|name| name.parse()).collect::<Result<Vec<_>>>()?;
        let camera = self.camera.as_deref().map(Camera::parse).transpose()?;
        camera.as_ref().map(Camera::check).transpose()?;
        let options = Options {
            camera,
            orbit: orbit("--frames", self.frames, self.step)?,
            size: self.size.parse()?,
            shadows: !self.no_shadows,
            budgets: self.budgets.iter().map(|percent| percent / 100.0).collect(),
            policies,
            loadings,
            prefetches,
            cache: self.shape.options(),
            nodes: self.nodes,
            warm: self.warm,
            threads: tuning.worker_count(),
            accuracy,
            isa: Isa::from_env()?,
        };
        for trial in options.trials() {
            trial.options.check()?;
        }
        Ok(options)
    }
}

/// An error about another option.
fn renamed(error: Error, name: &str) -> Error {
    match error {
        Error::Option { message, .. } => Error::option(name, message),
        other => other,
    }
}
