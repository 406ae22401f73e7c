//! `raypack generate plant -o plant.ply`: models of any size.

use super::progress::Bar;
use super::report::{Json, Lines, bytes, duration, grouped};
use crate::error::{Error, Result};
use crate::files::check_writable;
use crate::mesh::generate::plant::{self, PlantParams, TRIANGLES};
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
    /// The file: .ply (binary)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    #[command(flatten)]
    json: Json,
}

#[derive(Debug, Serialize)]
struct Report<'a> {
    file: &'a Path,
    triangles: u64,
    vertices: u64,
    seed: u64,
    seconds: f64,
    bytes: u64,
}

/// Runs the command.
pub fn run(args: &Args) -> Result<()> {
    match &args.what {
        What::Plant(args) => plant(args),
    }
}

fn plant(args: &PlantArgs) -> Result<()> {
    let triangles = count(&args.triangles)?;
    let is_ply = args.output.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply"));
    if !is_ply {
        let expected = "a model is written as .ply";
        return Err(Error::UnknownFormat { path: args.output.clone(), expected });
    }
    if args.json.file() == Some(&args.output) {
        return Err(Error::option("--json", "this is the model's file; give another name"));
    }
    check_writable(&args.output)?;
    args.json.check()?;

    let start = Instant::now();
    let bar = Bar::new("generating");
    let params = PlantParams { triangles, seed: args.seed };
    let plant = plant::write(&args.output, params, &|fraction| bar.set(fraction))?;
    drop(bar);
    let seconds = start.elapsed().as_secs_f64();
    let size = std::fs::metadata(&args.output).map_or(0, |file| file.len());

    let report = Report {
        file: &args.output,
        triangles: plant.triangles,
        vertices: plant.vertices,
        seed: args.seed,
        seconds,
        bytes: size,
    };
    let mut lines = Lines::default();
    let [triangles, vertices] = [report.triangles, report.vertices].map(grouped);
    lines.add("triangles", format!("{triangles} with {vertices} vertices"));
    lines.add("generated", format!("{}, writing included", duration(seconds)));
    lines.add("wrote", format!("{}, {}", args.output.display(), bytes(size)));
    args.json.give(lines.text(), &report)
}

/// A number of triangles: digits, a decimal point if wanted, and `k` or `M`.
fn count(text: &str) -> Result<u64> {
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
