//! `raypack generate plant -o plant.ply`: models of any size, with their trees as `.rpk`.

use super::build::describe_parts;
use super::build::large::build_mesh;
use super::options::BuildOptions;
use super::progress::Bar;
use super::report::{Json, Lines, bytes, duration, grouped};
use super::scene::{BuildMemory, describe_tree};
use crate::error::{Error, Result};
use crate::files::{check_writable, folder_of};
use crate::kdtree::TreeStats;
use crate::mesh::generate::Size;
use crate::mesh::generate::plant::{self, PlantParams, TRIANGLES};
use crate::stage::Stage;
use crate::store::is_scene;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::time::Instant;

/// Make a model by rule, for tests of any size
#[derive(Clone, Debug, clap::Args)]
pub struct Args {
    #[command(subcommand)]
    what: What,
}

#[derive(Clone, Debug, clap::Subcommand)]
enum What {
    Plant(PlantArgs),
}

/// A process plant of pipes, tanks, columns, girders, gratings, stairs and cables
#[derive(Clone, Debug, clap::Args)]
struct PlantArgs {
    /// About how many triangles: a number such as 300000, 300k or 12.7M, up to 200M
    #[arg(long, value_name = "N", default_value = "300k")]
    triangles: String,
    /// Which of the plants of that size
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The file: .ply (binary), or .rpk, a scene file with its tree, built within --memory [default: 1GiB]
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    build: BuildOptions,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    file: &'a Path,
    triangles: u64,
    vertices: u64,
    seed: u64,
    /// Of generating, writing a model included.
    seconds: f64,
    bytes: u64,
    /// What a scene file took, and what is in it.
    #[serde(flatten)]
    scene: Option<Scene>,
}

/// A tree that was built of the model.
#[derive(Debug, Serialize)]
struct Scene {
    build_seconds: f64,
    build_memory: BuildMemory,
    parts: usize,
    tree: TreeStats,
}

/// What a scene file is built in if nobody says how much: the largest plant takes less than half of it.
const MEMORY: usize = 1 << 30;

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    match &args.what {
        What::Plant(args) => plant(args),
    }
}

fn plant(args: &PlantArgs) -> Result<()> {
    let params = PlantParams { triangles: count(&args.triangles)?, seed: args.seed };
    let with_tree = is_scene(&args.output);
    let is_ply = args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"));
    if !is_ply && !with_tree {
        let expected = "a model is written as .ply, and with its tree as .rpk";
        return Err(Error::UnknownFormat { path: args.output.clone(), expected });
    }
    if let Some(option) = args.build.of_trees().filter(|_| is_ply) {
        return Err(Error::option(option, "only a .rpk has a tree; leave it out"));
    }
    if args.json.file() == Some(&args.output) {
        return Err(Error::option("--json", "this is the model's file; give another name"));
    }
    check_writable(&args.output)?;
    args.json.check()?;
    let report = if with_tree { scene(args, params)? } else { model(args, params)? };

    let mut lines = Lines::default();
    let [triangles, vertices] = [report.triangles, report.vertices].map(grouped);
    lines.add("triangles", format!("{triangles} with {vertices} vertices"));
    let what = if with_tree { "to files" } else { "writing included" };
    lines.add("generated", format!("{}, {what}", duration(report.seconds)));
    if let Some(Scene { build_seconds, build_memory, parts, tree }) = &report.scene {
        describe_parts(&mut lines, *build_seconds, *build_memory, *parts);
        describe_tree(&mut lines, tree);
    }
    lines.add("wrote", format!("{}, {}", args.output.display(), bytes(report.bytes)));
    args.json.give(lines.text(), &report)
}

/// Writes the plant as a model.
fn model(args: &PlantArgs, params: PlantParams) -> Result<Report<'_>> {
    let start = Instant::now();
    let bar = Bar::new("generating");
    let Size { triangles, vertices } = plant::write(&args.output, params, &|fraction| bar.set(fraction))?;
    let bytes = std::fs::metadata(&args.output).map_or(0, |file| file.len());
    let seconds = start.elapsed().as_secs_f64();
    Ok(Report { file: &args.output, triangles, vertices, seed: params.seed, seconds, bytes, scene: None })
}

/// Writes the plant with its tree.
fn scene(args: &PlantArgs, params: PlantParams) -> Result<Report<'_>> {
    let build = args.build.profile()?.build;
    let limit = args.build.limit()?.unwrap_or(MEMORY);
    let start = Instant::now();
    Stage::Generating.begin();
    let bar = Bar::new("generating");
    let mesh = plant::spool(folder_of(&args.output), params, &|fraction| bar.set(fraction))?;
    drop(bar);
    let seconds = start.elapsed().as_secs_f64();
    let (triangles, vertices) = (mesh.triangles.len() as u64, mesh.positions.len() as u64);
    let source = format!("a plant of {} triangles, seed {}", params.triangles, params.seed);
    let (built, build_seconds, build_memory) = build_mesh(&args.output, &mesh, &build, limit, &source)?;
    let scene = Scene { build_seconds, build_memory, parts: built.parts, tree: built.stats };
    Ok(Report {
        file: &args.output,
        triangles,
        vertices,
        seed: params.seed,
        seconds,
        bytes: built.written.bytes,
        scene: Some(scene),
    })
}

/// A number of triangles: digits, a decimal point if wanted, and `k` or `M`.
pub fn count(text: &str) -> Result<u64> {
    let wrong = |what: &str| {
        let (low, high) = (grouped(*TRIANGLES.start()), grouped(*TRIANGLES.end()));
        Error::option("--triangles", format!("\"{text}\" {what} from {low} to {high}, such as 300k or 12.7M"))
    };
    let (digits, scale) = match text.trim().char_indices().last() {
        Some((end, 'k' | 'K')) => (&text.trim()[..end], 1e3),
        Some((end, 'm' | 'M')) => (&text.trim()[..end], 1e6),
        _ => (text.trim(), 1.0),
    };
    let number: f64 = digits.parse().map_err(|_| wrong("is not a number"))?;
    let number = number * scale;
    if !(number >= *TRIANGLES.start() as f64 && number <= *TRIANGLES.end() as f64) {
        return Err(wrong("is not a number"));
    }
    Ok(number.round() as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_may_have_suffixes() {
        for (text, expected) in
            [("10000", 10_000), ("300k", 300_000), ("12.7M", 12_700_000), ("200M", 200_000_000)]
        {
            assert_eq!(count(text).expect(text), expected);
        }
        for text in ["", "k", "-5M", "0", "9999", "201M", "nan", "inf", "3G", "12,7M"] {
            let message = count(text).expect_err(text).to_string();
            assert!(message.starts_with("--triangles: ") && !message.contains('\n'), "{message}");
        }
    }
}
