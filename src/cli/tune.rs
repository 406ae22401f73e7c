//! `raypack tune MODEL -o profile.toml`: the settings that suit a model and a machine.

use super::interrupt;
use super::model::Model;
use super::options::{AccuracyOption, BuildOptions};
use super::outputs::same_file;
use super::progress::Bar;
use super::report::Json;
use crate::error::{Error, Result};
use crate::files::{check_writable, write_text};
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::plot::Format;
use crate::study::tune::{Load, Options, plot, run as search};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// The least time for a search, in minutes: less says nothing.
const LEAST_MINUTES: f64 = 0.05;

/// Find the settings that suit a model and this machine, and write them as a profile.
///
/// One setting at a time is moved, from those of --profile on, for as long as that helps; candidates and the
/// best so far run in turn, so that noise is not taken for a gain. The rest of the time shows what each
/// setting is worth around the best. Interrupt it (Ctrl-C) to have the best so far written.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or the one in a .rpk scene file
    model: PathBuf,
    /// The profile to write: a .toml file
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// A camera, as eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG or a TOML file; may be given several times; without
    /// it the model is framed
    #[arg(long, allow_hyphen_values = true)]
    camera: Vec<String>,
    /// Width and height of frames; other rays come from a square image of that width
    #[arg(long, value_name = "WxH", default_value = "512x512", allow_hyphen_values = true)]
    size: String,
    /// What to time: frame (shading and shadows), camera, shadow, diffuse, ao, random
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "frame")]
    rays: Vec<String>,
    /// What shall be least: trace (the time to trace), or frames=N (the time to build and then render N
    /// frames)
    #[arg(long, value_name = "trace|frames=N", default_value = "trace")]
    goal: String,
    /// How long to search
    #[arg(long, value_name = "N", default_value_t = 10.0, allow_negative_numbers = true)]
    minutes: f64,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    accuracy: AccuracyOption,
    /// What random rays hang on
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw what each setting is worth: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    let start = args.build.profile()?;
    args.check_files()?;
    let mut options = args.options()?;
    let model = Model::read(&args.model)?;
    if options.cameras.is_empty() {
        let size = options.size;
        options.cameras.push(Camera::framing(&model.mesh.bounds(), size.aspect()));
    }

    let stop = Arc::new(AtomicBool::new(false));
    // A second interrupt ends the process: the first one waits for runs of the candidate at hand.
    interrupt::sets(&stop);

    let bar = Bar::new("tuning");
    let report = search(&model.name, &model.mesh, &start, &options, &stop, &mut |progress| {
        bar.set(progress.fraction.min(1.0));
        bar.say(&format!("{:.3} of the start's time, {} tried", progress.best, progress.tried));
    })?;
    drop(bar);

    let profile = report.profile();
    write_text(&args.output, &profile.to_toml())?;
    if let Some(path) = &args.plot {
        plot::write(path, &report)?;
    }
    args.json.give(&report.to_string(), &report)
}

impl Args {
    /// Everything that can be wrong with the files to be written, before any work.
    fn check_files(&self) -> Result<()> {
        if self.output.extension().is_none_or(|ending| !ending.eq_ignore_ascii_case("toml")) {
            let expected = "a profile is a .toml file";
            return Err(Error::UnknownFormat { path: self.output.clone(), expected });
        }
        let mut files: Vec<(&str, &Path)> = vec![("--output", &self.output)];
        if let Some(plot) = &self.plot {
            Format::of(plot)?;
            files.push(("--plot", plot));
        }
        files.extend(self.json.file().map(|file| ("--json", file)));
        for (i, (option, file)) in files.iter().enumerate() {
            if files[..i].iter().any(|(_, other)| same_file(other, file)) || same_file(&self.model, file) {
                return Err(Error::option(*option, "this file is named twice; give another name"));
            }
        }
        check_writable(&self.output)?;
        if let Some(plot) = &self.plot {
            check_writable(plot)?;
        }
        self.json.check()
    }

    fn options(&self) -> Result<Options> {
        if !(self.minutes >= LEAST_MINUTES && self.minutes <= 1e5) {
            let message = format!("{} is not a time to search, {LEAST_MINUTES} or more", self.minutes);
            return Err(Error::option("--minutes", message));
        }
        let cameras = self.camera.iter().map(|text| {
            let camera = Camera::parse(text)?;
            camera.check()?;
            Ok(camera)
        });
        let mut loads: Vec<Load> = Vec::new();
        for name in &self.rays {
            let load = name.parse()?;
            if !loads.contains(&load) {
                loads.push(load);
            }
        }
        Ok(Options {
            cameras: cameras.collect::<Result<_>>()?,
            size: self.size.parse()?,
            loads,
            goal: self.goal.parse()?,
            memory: self.build.limit()?,
            seconds: self.minutes * 60.0,
            isa: Isa::from_env()?,
            accuracy: self.accuracy.mode()?,
            seed: self.seed,
        })
    }
}
