//! `raypack scaling`: how the time of a ray grows with the model.

use super::bench::{threads, watch};
use super::generate::count;
use super::options::{AccuracyOption, BuildOptions, PoolsOption};
use super::outputs::check_plot;
use super::report::Json;
use crate::error::{Error, Result};
use crate::simd::Isa;
use crate::study::bench::{self, EngineName, Pace};
use crate::study::rays::RayKind;
use crate::study::scaling::{Options, plot, run as measure};
use std::path::PathBuf;

/// Measure how the time of a ray grows with the number of triangles, beside Embree.
///
/// Plants of growing size are generated, trees are built of each, and the same rays are traced by both engines, as
/// `raypack bench` does it. A plant of 30 million triangles takes some 12 GB of memory with both engines' trees;
/// leave it out of --triangles if there is less.
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    /// The plants' numbers of triangles, ascending, from 10k to 200M
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "10k,30k,100k,300k,1M,3M,10M,30M"
    )]
    triangles: Vec<String>,
    /// Which plants of these sizes
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Kinds of ray: camera, shadow, diffuse, ao, random
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "camera,diffuse,ao,random")]
    rays: Vec<String>,
    /// Engines: raypack, and embree or obvhs
    #[arg(long, value_name = "LIST", value_delimiter = ',', default_value = "raypack,embree")]
    engines: Vec<String>,
    /// raypack's modes, as `raypack bench` takes them
    #[arg(
        long,
        value_name = "LIST",
        value_delimiter = ',',
        default_value = "tile,tile1024,packet16,packet8,stream,filter,mixed"
    )]
    modes: Vec<String>,
    /// Width and height of the camera's image, and as many rays of each kind at most
    #[arg(long, value_name = "N", default_value_t = 512)]
    size: u32,
    /// Worker threads; 0 for all processors
    #[arg(long, value_name = "N", default_value_t = 1)]
    threads: usize,
    /// Rounds of each race at most; its middle round is reported
    #[arg(long, value_name = "N", default_value_t = 5)]
    rounds: usize,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    accuracy: AccuracyOption,
    #[command(flatten)]
    pools: PoolsOption,
    /// Draw the curves: .svg or .png
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    #[command(flatten)]
    json: Json,
}

/// Runs the command.
///
/// # Errors
/// An option makes no sense, or a report cannot be written.
pub fn run(args: &Args) -> Result<()> {
    let options = options(args)?;
    args.json.check()?;
    if let Some(path) = &args.plot {
        check_plot(path, args.json.file())?;
    }
    let report = measure(&options, &mut watch)?;
    if let Some(path) = &args.plot {
        plot::write(path, &report)?;
    }
    args.json.give(&report.to_string(), &report)
}

fn options(args: &Args) -> Result<Options> {
    let threads = threads(args.threads)?;
    if args.rounds == 0 {
        return Err(Error::option("--rounds", "0 rounds measure nothing"));
    }
    let accuracy = args.accuracy.mode()?;
    args.pools.check(&args.build, accuracy)?;
    Ok(Options {
        triangles: args.triangles.iter().map(|text| count(text)).collect::<Result<_>>()?,
        seed: args.seed,
        bench: bench::Options {
            kinds: args.rays.iter().map(|name| name.parse::<RayKind>()).collect::<Result<_>>()?,
            engines: args.engines.iter().map(|name| name.parse::<EngineName>()).collect::<Result<_>>()?,
            modes: args.modes.clone(),
            camera: None,
            size: args.size,
            threads: vec![threads],
            seed: 1,
            pace: Pace { rounds: args.rounds, seconds: 5.0, all_modes: false, pin: false },
            isa: Isa::from_env()?,
            hold_peers_to_isa: std::env::var_os("RAYPACK_ISA").is_some(),
            accuracy,
            build: args.build.profile()?.build,
            slices: false,
            pools: args.pools.wanted(),
        },
    })
}
