//! `raypack cache SCENE.rpk`: what caches are worth along a camera path.

use super::cache_options::ReadingArgs;
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
use crate::study::cache::{Nodes, Options, Rates, plot, run as fly};
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
    /// Cast shadows, too; without it there are camera rays alone, as in the seed paper
    #[arg(long)]
    shadows: bool,
    /// As it is by itself.
    #[arg(long, hide = true, conflicts_with = "shadows")]
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
    /// A cache of its own for nodes, as in the seed paper, each as PART or PART:POLICY: the part (0.01 to 0.99) of the
    /// memory that it has, and its policy, if that is another one; or none, for one cache of all
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "none")]
    nodes: Vec<String>,
    /// Bytes of a block: powers of two from 512 to 65536
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [CacheOptions::default().block])]
    block: Vec<usize>,
    /// Blocks that a set holds: more of them keep what is used better and take longer to choose from
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [CacheOptions::default().ways])]
    ways: Vec<usize>,
    /// Locks that sets share
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_values_t = [CacheOptions::default().stripes])]
    stripes: Vec<usize>,
    #[command(flatten)]
    reading: ReadingArgs,
    /// Warm flights, of which the last is reported: in the first, some blocks still come that a kernel looks at which
    /// was not tried there before
    #[arg(long, value_name = "N", default_value_t = 1)]
    warm: u32,
    /// Threads at work; 0 for all processors
    #[arg(long, value_name = "N", default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    accuracy: AccuracyOption,
    /// Rates measured elsewhere, to print beside rays per second by frame: a .toml file or a .json report of this command
    ///
    /// A TOML file has a [[table]] for each: budget (per cent in memory, as --budgets), loading (sync or async), perhaps
    /// prefetch (off, beside or ahead; without it, the table stands beside all of them), pass (cold or warm; cold if it is
    /// left out), and for each policy, by its name, the rays per second of frames 0, 1 and so on: lru = [3000, 3100].
    #[arg(long, value_name = "FILE")]
    beside: Option<PathBuf>,
    /// Draw rays per second by frame, and what was read beside the least that any policy could have read: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    args.check_files()?;
    let options = args.options()?;
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
        if let (Some(beside), Some(json)) = (&self.beside, self.json.file())
            && same_file(beside, json)
        {
            return Err(Error::option("--beside", "the report would be written over it; give another name"));
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
            self.loading.iter().map(|name| self.reading.loading(name)).collect::<Result<Vec<_>>>()?;
        let prefetches = self.prefetch.iter().map(|name| name.parse()).collect::<Result<Vec<_>>>()?;
        let nodes = self.nodes.iter().map(|text| match text.trim() {
            "none" => Ok(None),
            text => text.parse::<Nodes>().map(Some),
        });
        let camera = self.camera.as_deref().map(Camera::parse).transpose()?;
        camera.as_ref().map(Camera::check).transpose()?;
        let options = Options {
            camera,
            orbit: orbit("--frames", self.frames, self.step)?,
            size: self.size.parse()?,
            shadows: self.shadows,
            budgets: self.budgets.iter().map(|percent| percent / 100.0).collect(),
            policies,
            loadings,
            prefetches,
            blocks: self.block.clone(),
            ways: self.ways.clone(),
            stripes: self.stripes.clone(),
            nodes: nodes.collect::<Result<_>>()?,
            cache: CacheOptions { direct: self.reading.direct(), ..CacheOptions::default() },
            warm: self.warm,
            threads: tuning.worker_count(),
            accuracy,
            isa: Isa::from_env()?,
            beside: self.beside.as_deref().map(Rates::read).transpose()?,
        };
        let trials = options.trials();
        trials.iter().try_for_each(|trial| trial.options.check())?;
        if let Some(rates) = &options.beside {
            rates.check(&trials)?;
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
