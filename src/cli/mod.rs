//! The command line: one file per command, each with its arguments and a `run`.
//!
//! Reports go to standard output, everything else to standard error. Failures are one line there,
//! `raypack: error: …`, and exit code 1; a command line that makes no sense is 2, as usual.

mod accuracy;
mod bench;
mod build;
mod cache;
mod cache_options;
mod cast;
mod effects;
mod fault;
mod generate;
mod histogram;
mod info;
mod interrupt;
mod looks;
mod memory;
mod model;
mod options;
mod outputs;
mod progress;
mod render;
mod report;
mod scaling;
mod scene;
mod tune;

use crate::stage;
use clap::{ArgAction, Parser, Subcommand};
use std::io::IsTerminal;
use std::process::ExitCode;
use tracing::level_filters::LevelFilter;

/// A packet-traversal ray engine for the CPU.
#[derive(Debug, Parser)]
#[command(version, propagate_version = true)]
struct Cli {
    #[command(subcommand)]
    command: Command,
    /// Say more about what is going on, on standard error; twice for still more
    #[arg(short, long, global = true, action = ArgAction::Count)]
    verbose: u8,
}

#[derive(Debug, Subcommand)]
enum Command {
    Render(render::Args),
    Build(build::Args),
    Effects(effects::Args),
    Info(info::Args),
    Bench(bench::Args),
    Scaling(scaling::Args),
    Accuracy(accuracy::Args),
    Cache(cache::Args),
    Cast(cast::Args),
    Generate(generate::Args),
    Tune(tune::Args),
}

/// Runs the command that the process's arguments name.
pub fn main() -> ExitCode {
    let cli = Cli::parse();
    log(cli.verbose);
    interrupt::handle();
    fault::handle();
    let result = stage::from_env().and_then(|()| match &cli.command {
        Command::Render(args) => render::run(args),
        Command::Build(args) => build::run(args),
        Command::Effects(args) => effects::run(args),
        Command::Info(args) => info::run(args),
        Command::Bench(args) => bench::run(args),
        Command::Scaling(args) => scaling::run(args),
        Command::Accuracy(args) => accuracy::run(args),
        Command::Cache(args) => cache::run(args),
        Command::Cast(args) => cast::run(args),
        Command::Generate(args) => generate::run(args),
        Command::Tune(args) => tune::run(args),
    });
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            // Whatever the system put into the message, it stays one line.
            let message = error.to_string().split_whitespace().collect::<Vec<_>>().join(" ");
            eprintln!("raypack: error: {message}");
            ExitCode::FAILURE
        }
    }
}

fn log(verbose: u8) {
    let level = match verbose {
        0 => LevelFilter::WARN,
        1 => LevelFilter::INFO,
        2 => LevelFilter::DEBUG,
        _ => LevelFilter::TRACE,
    };
    tracing_subscriber::fmt()
        .with_max_level(level)
        .with_writer(std::io::stderr)
        .with_ansi(std::io::stderr().is_terminal())
        .without_time()
        .with_target(false)
        .init();
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory;

    #[test]
    fn the_arguments_are_consistent() {
        Cli::command().debug_assert();
    }
}
