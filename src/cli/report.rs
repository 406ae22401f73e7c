//! Printing: text for people, JSON for programs.

use crate::error::{Error, Result};
use crate::files::{check_writable, write_text};
pub use crate::study::text::grouped;
use serde::Serialize;
use std::io::{self, ErrorKind, Write};
use std::path::{Path, PathBuf};

/// Version and build of the engine, as reports give it.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Engine {
    /// The package's version.
    pub version: &'static str,
    /// `release`, or `debug` with all checks.
    pub build: &'static str,
}

/// This program.
pub const ENGINE: Engine = Engine {
    version: env!("CARGO_PKG_VERSION"),
    build: if cfg!(debug_assertions) { "debug" } else { "release" },
};

/// Where a report goes: as text to standard output, as JSON where `--json` says, or both.
#[derive(Clone, Debug, clap::Args)]
pub struct Json {
    /// Write the report as JSON to this file; `-` for standard output, which then holds nothing else
    #[arg(long, value_name = "FILE")]
    json: Option<PathBuf>,
}

impl Json {
    /// The file, if there is one.
    pub fn file(&self) -> Option<&Path> {
        self.json.as_deref().filter(|path| *path != Path::new("-"))
    }

    /// Whether standard output is for JSON.
    fn is_stdout(&self) -> bool {
        self.json.is_some() && self.file().is_none()
    }

    /// Finds out before the work whether the file can be written.
    pub fn check(&self) -> Result<()> {
        self.file().map_or(Ok(()), check_writable)
    }

    /// Gives a report.
    pub fn give(&self, text: &str, report: &impl Serialize) -> Result<()> {
        if self.json.is_some() {
            let mut json = serde_json::to_string_pretty(report).expect("reports are plain data");
            json.push('\n');
            match self.file() {
                Some(file) => write_text(file, &json)?,
                None => print(&json)?,
            }
        }
        if self.is_stdout() { Ok(()) } else { print(text) }
    }
}

/// Prints to standard output. That nobody reads on (a closed pipe) is no failure.
fn print(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        Err(source) => Err(Error::Write { path: "standard output".into(), source }),
        Ok(()) => Ok(()),
    }
}

/// A report's lines: a word, and what there is to say about it.
#[derive(Debug, Default)]
pub struct Lines(String);

impl Lines {
    /// Adds a line.
    pub fn add(&mut self, word: &str, what: impl AsRef<str>) {
        let line = format!("{word:<10} {}", what.as_ref());
        self.0.push_str(line.trim_end());
        self.0.push('\n');
    }

    /// All of them.
    pub fn text(&self) -> &str {
        &self.0
    }
}

/// `1 thing`, `2 things`.
pub fn counted(number: u64, noun: &str) -> String {
    format!("{} {noun}{}", grouped(number), if number == 1 { "" } else { "s" })
}

/// A time with three digits: `12.3 ms`, `4.56 s`.
pub fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 1e-3 => format!("{:.0} µs", s * 1e6),
        s if s < 1e-2 => format!("{:.2} ms", s * 1e3),
        s if s < 1e-1 => format!("{:.1} ms", s * 1e3),
        s if s < 1.0 => format!("{:.0} ms", s * 1e3),
        s if s < 10.0 => format!("{s:.2} s"),
        s => format!("{s:.1} s"),
    }
}

/// An amount of memory with three digits: `12.3 MiB`.
pub fn bytes(bytes: u64) -> String {
    let mut amount = bytes as f64;
    let mut unit = "B";
    for larger in ["KiB", "MiB", "GiB", "TiB"] {
        if amount < 1000.0 {
            break;
        }
        (amount, unit) = (amount / 1024.0, larger);
    }
    let digits = if unit == "B" || amount >= 100.0 {
        0
    } else if amount >= 10.0 {
        1
    } else {
        2
    };
    format!("{amount:.digits$} {unit}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well() {
        assert_eq!(
            (counted(1, "sample"), counted(1000, "sample")),
            ("1 sample".into(), "1,000 samples".into())
        );
        assert_eq!(
            [0.000_012, 0.001_234, 0.0123, 0.1234, 1.234, 98.76].map(duration),
            ["12 µs", "1.23 ms", "12.3 ms", "123 ms", "1.23 s", "98.8 s"]
        );
        assert_eq!(
            [0, 999, 1536, 1_048_576 * 12, 1 << 40].map(bytes),
            ["0 B", "999 B", "1.50 KiB", "12.0 MiB", "1.00 TiB"]
        );
    }
}
