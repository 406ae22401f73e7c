//! `raypack accuracy MODEL`: what accuracy costs in time.

use super::bench::watch;
use super::model::Model;
use super::options::{BuildOptions, as_option};
use super::outputs::check_plot;
use super::report::Json;
use crate::error::{Error, Result};
use crate::render::{Limits, Tuning};
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::accuracy::tradeoff::{Options, plot, run as study};
use crate::study::bench::{EngineName, Pace};
use crate::study::rays::RayKind;
use std::path::PathBuf;

/// Samples per pixel unless told otherwise.
const SAMPLES: [u32; 3] = [1, 4, 16];

/// The same where a setting is to be picked: the finer the steps, the better the pick.
const SAMPLES_WITHIN: [u32; 8] = [1, 2, 3, 4, 6, 8, 12, 16];

/// The reference picture has so many times the most of the samples.
const REFERENCE_FACTOR: u32 = 16;

/// Measure what accuracy costs in time: every mode's speed beside its errors.
///
/// Each mode (fast, watertight, exact) traces every kind of ray, beside Embree's fast and robust modes if
/// Embree is here, and errors are counted against exact arithmetic. Each mode also renders the picture with
/// several numbers of samples per pixel, compared with a reference picture.
///
/// With --within, the most accurate setting that fits a frame time is picked. That nothing fits is an answer
/// too, and no failure: the exit code is 0, and the report says so and names the quickest ("fits" in JSON).
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or the one in a .rpk scene file
    model: PathBuf,
    /// The camera, as eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG or a TOML file; without it the model is framed
    #[arg(long, allow_hyphen_values = true)]
    camera: Option<String>,
    /// Width and height of the picture; rays come from a square image of about as many pixels
    #[arg(long, value_name = "WxH", default_value = "512x512", allow_hyphen_values = true)]
    size: String,
    /// Kinds of ray
    #[arg(long, value_delimiter = ',', default_value = "camera,shadow,diffuse,ao,random")]
    rays: Vec<String>,
    /// Engines: raypack alone, or Embree's modes beside
    #[arg(long, value_delimiter = ',', default_value = "raypack,embree")]
    engines: Vec<String>,
    /// Worker threads; 0 for all processors [default: the profile's]
    #[arg(long, value_name = "N")]
    threads: Option<usize>,
    /// Samples per pixel of the pictures [default: 1,4,16, and with --within 1,2,3,4,6,8,12,16]
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    samples: Vec<u32>,
    /// Samples per pixel of the reference picture [default: 16 times the most of --samples]
    #[arg(long, value_name = "N")]
    reference_samples: Option<u32>,
    /// What pictures show: as in render
    #[arg(
        long,
        value_name = "auto|none|LIST|+NAME|-NAME",
        default_value = "auto",
        allow_hyphen_values = true
    )]
    effects: String,
    /// Bounces of the pictures: surfaces that light may have met before the one that is seen, where effects ask for any;
    /// the reference picture has the most of them
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "8")]
    bounces: Vec<u32>,
    /// The same for rays that each matt surface sends to lights that have an extent
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "1")]
    shadow_samples: Vec<u32>,
    /// The same for the part of the light below which paths go on by chance
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "0.015625",
        allow_hyphen_values = true
    )]
    roulette: Vec<f32>,
    /// Rays of each kind whose answers are held against exact arithmetic; the others are timed only
    #[arg(long, value_name = "N", default_value_t = 1 << 16)]
    oracle_rays: usize,
    /// Pick the most accurate setting that renders a frame in this time, such as 33ms or 0.5s
    #[arg(long, value_name = "TIME", allow_hyphen_values = true)]
    within: Option<String>,
    #[command(flatten)]
    build: BuildOptions,
    /// Rounds of each race at most; its middle round is reported
    #[arg(long, default_value_t = 9)]
    rounds: usize,
    /// Seconds after which a race begins no further round (three are always run)
    #[arg(long, default_value_t = 3.0)]
    seconds: f64,
    /// Pin each worker to a core
    #[arg(long)]
    pin: bool,
    /// What the random rays hang on
    #[arg(long, default_value_t = 1)]
    seed: u64,
    /// Draw time against error, with the Pareto front: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
///
/// # Errors
/// An option makes no sense, the model cannot be read, or an output cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let options = options(args)?;
    args.json.check()?;
    if let Some(file) = &args.plot {
        check_plot(file, args.json.file())?;
    }
    let model = Model::read(&args.model)?;
    let report = study(&model.name, &model.mesh, &options, &mut watch)?;
    if let Some(file) = &args.plot {
        plot::write(file, &report)?;
    }
    args.json.give(&report.to_string(), &report)
}

impl Args {
    /// Each with each.
    fn limits(&self) -> Vec<Limits> {
        let mut all = Vec::new();
        for &bounces in &self.bounces {
            for &shadow_samples in &self.shadow_samples {
                let with = |&roulette: &f32| Limits { bounces, shadow_samples, roulette, error: 0.0 };
                all.extend(self.roulette.iter().map(with));
            }
        }
        all
    }
}

fn options(args: &Args) -> Result<Options> {
    if args.rounds == 0 {
        return Err(Error::option("--rounds", "0 rounds measure nothing"));
    }
    if !(args.seconds >= 0.0 && args.seconds.is_finite()) {
        return Err(Error::option("--seconds", format!("{} is no time", args.seconds)));
    }
    let within = args.within.as_deref().map(seconds).transpose()?;
    let samples = match (&args.samples[..], within) {
        ([], None) => SAMPLES.into(),
        ([], Some(_)) => SAMPLES_WITHIN.into(),
        (named, _) => {
            let mut samples = named.to_vec();
            samples.sort_unstable();
            samples.dedup();
            samples
        }
    };
    let most = samples.iter().max().copied().unwrap_or(1);
    let profile = args.build.profile()?;
    let tuning = Tuning {
        threads: args.threads.unwrap_or(profile.render.threads),
        pin: args.pin || profile.render.pin,
        ..profile.render
    };
    let options = Options {
        kinds: args.rays.iter().map(|name| name.parse::<RayKind>()).collect::<Result<_>>()?,
        engines: args.engines.iter().map(|name| name.parse::<EngineName>()).collect::<Result<_>>()?,
        camera: args.camera.as_deref().map(Camera::parse).transpose()?,
        size: args.size.parse()?,
        samples,
        reference_samples: args.reference_samples.unwrap_or(most.saturating_mul(REFERENCE_FACTOR)),
        request: args.effects.parse()?,
        limits: args.limits(),
        oracle_rays: args.oracle_rays,
        within,
        seed: args.seed,
        pace: Pace { rounds: args.rounds, seconds: args.seconds, all_modes: false, pin: tuning.pin },
        isa: Isa::from_env()?,
        hold_peers_to_isa: std::env::var_os("RAYPACK_ISA").is_some(),
        build: profile.build,
        tuning,
    };
    options.check().map_err(as_option)?;
    Ok(options)
}

/// A time with its unit, in seconds.
fn seconds(text: &str) -> Result<f64> {
    let wrong = || {
        let message = format!("\"{text}\" is not a time above 0 with its unit, such as 33ms or 0.5s");
        Error::option("--within", message)
    };
    let text = text.trim();
    let (digits, scale) = [("ms", 1e-3), ("us", 1e-6), ("µs", 1e-6), ("s", 1.0)]
        .into_iter()
        .find_map(|(unit, scale)| Some((text.strip_suffix(unit)?, scale)))
        .ok_or_else(wrong)?;
    let seconds = digits.trim_end().parse::<f64>().map_err(|_| wrong())? * scale;
    if seconds > 0.0 && seconds.is_finite() { Ok(seconds) } else { Err(wrong()) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::Parser;

    #[derive(clap::Parser)]
    struct Command {
        #[command(flatten)]
        args: Args,
    }

    fn parse(line: &str) -> Result<Options> {
        options(&Command::try_parse_from(line.split(' ')).unwrap().args)
    }

    #[test]
    fn defaults_measure_everything() {
        let options = parse("accuracy model.obj").unwrap();
        assert_eq!(options.kinds, RayKind::ALL);
        assert_eq!(options.engines, [EngineName::Raypack, EngineName::Embree]);
        assert_eq!((options.samples, options.reference_samples), (vec![1, 4, 16], 256));
        assert_eq!((options.oracle_rays, options.within), (65_536, None));
        let options = parse("accuracy model.obj --within 33ms --threads 3 --samples 4,1,4").unwrap();
        assert_eq!((options.samples, options.reference_samples), (vec![1, 4], 64));
        assert_eq!((options.within, options.tuning.threads), (Some(0.033), 3));
    }

    #[test]
    fn times_have_units() {
        for (text, expected) in [("33ms", 0.033), ("0.5s", 0.5), ("16.7 ms", 0.0167), ("250us", 250e-6)] {
            assert!((seconds(text).unwrap() - expected).abs() < 1e-12, "{text}");
        }
        for text in ["", "33", "ms", "-5ms", "0s", "nan s", "inf s", "33 m", "1h", "1e999s"] {
            let message = seconds(text).unwrap_err().to_string();
            assert!(message.starts_with("--within: ") && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        for (line, option) in [
            ("accuracy m.obj --size 512", "--size"),
            ("accuracy m.obj --threads 5000", "--threads"),
            ("accuracy m.obj --rounds 0", "--rounds"),
            ("accuracy m.obj --seconds nan", "--seconds"),
            ("accuracy m.obj --rays camera,primary", "--rays"),
            ("accuracy m.obj --engines optix", "--engines"),
            ("accuracy m.obj --engines embree", "--engines"),
            ("accuracy m.obj --engines raypack,obvhs", "--engines"),
            ("accuracy m.obj --samples 0,1", "--samples"),
            ("accuracy m.obj --samples 4 --reference-samples 2", "--reference-samples"),
            ("accuracy m.obj --samples 60000", "--reference-samples"),
            ("accuracy m.obj --oracle-rays 0", "--oracle-rays"),
            ("accuracy m.obj --within 33", "--within"),
            ("accuracy m.obj --camera eye=1", "--camera"),
        ] {
            let message = parse(line).unwrap_err().to_string();
            assert!(message.starts_with(option) && !message.contains('\n'), "{line}: {message}");
        }
    }
}
