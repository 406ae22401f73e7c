//! `raypack bench MODEL`: rays per second, beside Embree and obvhs.

use super::model::Model;
use super::options::{AccuracyOption, BuildOptions, PoolsOption};
use super::report::Json;
use crate::error::{Error, Result};
use crate::scene::Camera;
use crate::simd::Isa;
use crate::study::bench::build::run as bench_builds;
use crate::study::bench::{EngineName, Options, Pace, hardware_threads, run as bench};
use crate::study::rays::RayKind;
use std::io::IsTerminal;
use std::path::PathBuf;

/// Measure rays per second by kind of ray, side by side with Embree and obvhs on the same rays.
///
/// Embree is taken from RAYPACK_EMBREE (a file or folder), from .embree (see scripts/get-embree) or from
/// the system, and is compared in its best mode: packet widths 1, 4, 8 and 16, with and without the
/// coherent flag, on medium, high and robust builds. RAYPACK_ISA=portable|avx2|avx512 holds raypack and
/// Embree to an instruction set.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The model: .obj, .ply, .stl, .gltf or .glb, or the one in a .rpk scene file
    model: PathBuf,
    /// Measure builds: time, memory and the quality of the trees, every preset beside Embree low, medium and
    /// high and obvhs, reading the file apart; rays are then traced in each with all threads
    #[arg(long = "build")]
    builds: bool,
    /// How often each tree is built with --build; the middle one is reported
    #[arg(long, value_name = "N", default_value_t = 3)]
    build_rounds: usize,
    /// The camera, as eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG or a TOML file; without it the model is framed
    #[arg(long)]
    camera: Option<String>,
    /// Width and height of the camera's image: one number, or WxH with both alike
    #[arg(long, default_value = "512")]
    size: String,
    /// Kinds of ray
    #[arg(long, value_delimiter = ',', default_value = "camera,shadow,diffuse,ao,random")]
    rays: Vec<String>,
    /// Engines
    #[arg(long, value_delimiter = ',', default_value = "raypack,embree,obvhs")]
    engines: Vec<String>,
    /// raypack's modes: single, packet4, packet8, packet16, stream, filter, tile, tile1024, auto (what render
    /// does), mixed (what cast does); all of them if none is named
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    modes: Vec<String>,
    /// Give all of raypack's kernels rays in a row, as cast has them, and not packets that are made beforehand: making them
    /// counts then (all but auto)
    #[arg(long, conflicts_with = "builds")]
    slices: bool,
    /// Race with one thread, and with this many; 0 for all processors
    #[arg(long, default_value_t = 0)]
    threads: usize,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    accuracy: AccuracyOption,
    #[command(flatten)]
    pools: PoolsOption,
    /// Rounds of each race at most; its middle round is reported
    #[arg(long, default_value_t = 9)]
    rounds: usize,
    /// Seconds after which a race begins no further round (three are always run)
    #[arg(long, default_value_t = 10.0)]
    seconds: f64,
    /// Keep modes that are more than 25 % slower than their engine's best in the qualifying round
    #[arg(long)]
    all_modes: bool,
    /// Pin each worker to a core
    #[arg(long)]
    pin: bool,
    /// What the random rays hang on
    #[arg(long, default_value_t = 1)]
    seed: u64,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
///
/// # Errors
/// An option makes no sense, the model cannot be read, or the report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let mut options = options(args)?;
    args.json.check()?;
    let model = Model::read(&args.model)?;
    args.build.fit(&model.mesh, &mut options.build)?;
    if args.builds {
        let report = bench_builds(&model.name, &model.mesh, &options, args.build_rounds, &mut watch)?;
        return args.json.give(&report.to_string(), &report);
    }
    let report = bench(&model.name, &model.mesh, &options, &mut watch)?;
    args.json.give(&report.to_string(), &report)
}

/// Says what is about to happen to who looks on.
pub fn watch(line: &str) {
    if std::io::stderr().is_terminal() {
        eprintln!("{line} …");
    }
}

/// As many as are asked for; 0 for all processors.
pub fn threads(wanted: usize) -> Result<usize> {
    let threads = if wanted == 0 { hardware_threads() } else { wanted };
    if threads > 4096 {
        return Err(Error::option("--threads", format!("{threads} is more than 4096")));
    }
    Ok(threads)
}

fn options(args: &Args) -> Result<Options> {
    let most = threads(args.threads)?;
    if args.rounds == 0 {
        return Err(Error::option("--rounds", "0 rounds measure nothing"));
    }
    if args.build_rounds == 0 {
        return Err(Error::option("--build-rounds", "0 rounds measure nothing"));
    }
    if !(args.seconds >= 0.0 && args.seconds.is_finite()) {
        return Err(Error::option("--seconds", format!("{} is no time", args.seconds)));
    }
    let accuracy = args.accuracy.mode()?;
    args.pools.check(&args.build, accuracy)?;
    Ok(Options {
        kinds: args.rays.iter().map(|name| name.parse::<RayKind>()).collect::<Result<_>>()?,
        engines: args.engines.iter().map(|name| name.parse::<EngineName>()).collect::<Result<_>>()?,
        modes: args.modes.clone(),
        camera: args.camera.as_deref().map(Camera::parse).transpose()?,
        size: size(&args.size)?,
        threads: if most == 1 { vec![1] } else { vec![1, most] },
        seed: args.seed,
        pace: Pace { rounds: args.rounds, seconds: args.seconds, all_modes: args.all_modes, pin: args.pin },
        isa: Isa::from_env()?,
        hold_peers_to_isa: std::env::var_os("RAYPACK_ISA").is_some(),
        accuracy,
        build: args.build.profile()?.build,
        slices: args.slices,
        pools: args.pools.wanted(),
    })
}

/// `N` or `NxN`.
fn size(text: &str) -> Result<u32> {
    let (width, height) = text.split_once('x').unwrap_or((text, text));
    match (width.parse(), height.parse::<u32>()) {
        (Ok(w), Ok(h)) if w == h => Ok(w),
        (Ok(_), Ok(_)) => Err(Error::option("--size", format!("{text}: bench takes square images only"))),
        _ => Err(Error::option("--size", format!("\"{text}\" is no size; write 512 or 512x512"))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Accuracy;
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
        let options = parse("bench model.obj").unwrap();
        assert_eq!(options.kinds, RayKind::ALL);
        assert_eq!(options.engines, EngineName::ALL);
        assert_eq!((options.size, options.camera, options.threads[0]), (512, None, 1));
        assert_eq!(options.accuracy, Accuracy::Watertight);
    }

    #[test]
    fn options_that_make_no_sense_are_named() {
        for (line, option) in [
            ("bench m.obj --size 512x256", "--size"),
            ("bench m.obj --size big", "--size"),
            ("bench m.obj --threads 5000", "--threads"),
            ("bench m.obj --rounds 0", "--rounds"),
            ("bench m.obj --build --build-rounds 0", "--build-rounds"),
            ("bench m.obj --preset quick", "--preset"),
            ("bench m.obj --memory plenty", "--memory"),
            ("bench m.obj --seconds nan", "--seconds"),
            ("bench m.obj --rays camera,primary", "--rays"),
            ("bench m.obj --engines optix", "--engines"),
            ("bench m.obj --camera eye=1", "--camera"),
            ("bench m.obj --accuracy precise", "--accuracy"),
        ] {
            let message = parse(line).unwrap_err().to_string();
            assert!(message.starts_with(option) && !message.contains('\n'), "{line}: {message}");
        }
    }
}
