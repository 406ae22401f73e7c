//! Rays a second by frame that were measured elsewhere, beside ours: tables that somebody has typed, such as
//! those of the seed paper, or an earlier report.
//!
//! ```toml
//! [[table]]
//! budget = 16            # per cent in memory
//! loading = "sync"       # or "async", perhaps with prefetch = "off", "beside" or "ahead"
//! pass = "cold"          # or "warm"; cold if it is left out
//! lru = [3000, 3100]     # rays a second of frames 0, 1 and so on; a list for each policy
//! ```

use super::{FrameTable, Shape, Trial};
use crate::cache::policy::Replacement;
use crate::cache::{Loading, Prefetch};
use crate::error::{Error, Result};
use crate::study::text::{figure, grid, grouped};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::fs;
use std::path::{Path, PathBuf};

/// What a file says.
#[derive(Clone, Debug)]
pub struct Rates {
    path: PathBuf,
    tables: Vec<Table>,
}

/// A table of it.
#[derive(Clone, Debug)]
struct Table {
    /// Per cent of the data in memory.
    budget: f64,
    is_async: bool,
    /// Which blocks came before they were needed, where that is known and somebody is there to see to it.
    prefetch: Option<Prefetch>,
    warm: bool,
    /// What the caches were like, where that is known.
    shape: Option<Shape>,
    /// Rays a second by frame.
    rates: Vec<(Replacement, Vec<f64>)>,
}

/// A file as people write it.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Written {
    #[serde(default)]
    table: Vec<WrittenTable>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields, rename_all = "kebab-case")]
struct WrittenTable {
    budget: f64,
    loading: Who,
    prefetch: Option<Prefetch>,
    #[serde(default)]
    pass: Pass,
    fifo: Option<Vec<f64>>,
    lru: Option<Vec<f64>>,
    frequency: Option<Vec<f64>>,
    decaying: Option<Vec<f64>>,
    clock: Option<Vec<f64>>,
    sieve: Option<Vec<f64>>,
    #[serde(rename = "s3-fifo")]
    s3_fifo: Option<Vec<f64>>,
}

#[derive(Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Who {
    Sync,
    Async,
}

#[derive(Default, Deserialize, PartialEq)]
#[serde(rename_all = "kebab-case")]
enum Pass {
    #[default]
    Cold,
    Warm,
}

impl From<WrittenTable> for Table {
    fn from(written: WrittenTable) -> Self {
        let WrittenTable { fifo, lru, frequency, decaying, clock, sieve, s3_fifo, .. } = written;
        let rates = [fifo, lru, frequency, decaying, clock, sieve, s3_fifo];
        let rates = Replacement::ALL.into_iter().zip(rates);
        Self {
            budget: written.budget,
            is_async: written.loading == Who::Async,
            prefetch: written.prefetch,
            warm: written.pass == Pass::Warm,
            shape: None,
            rates: rates.filter_map(|(policy, rates)| Some((policy, rates?))).collect(),
        }
    }
}

/// What is needed of an earlier report.
#[derive(Deserialize)]
struct Earlier {
    tables: Vec<EarlierTable>,
}

#[derive(Deserialize)]
struct EarlierTable {
    budget: f64,
    loading: Loading,
    prefetch: Option<Prefetch>,
    warm: bool,
    shape: Option<Shape>,
    policies: Vec<Replacement>,
    rays_per_s: Vec<Vec<f64>>,
}

impl EarlierTable {
    /// `None` if some frame lacks a policy's rate.
    fn table(self) -> Option<Table> {
        let column = |i: usize| -> Option<Vec<f64>> {
            self.rays_per_s.iter().map(|row| row.get(i).copied()).collect()
        };
        let rates = self.policies.iter().enumerate();
        let rates = rates.map(|(i, &policy)| Some((policy, column(i)?))).collect::<Option<_>>()?;
        let Self { budget, loading, prefetch, warm, shape, .. } = self;
        let (budget, is_async) = (budget * 100.0, loading.loaders() > 0);
        Some(Table { budget, is_async, prefetch, warm, shape, rates })
    }
}

impl Table {
    /// What is wrong with it, if anything is.
    fn fault(&self) -> Option<String> {
        if !(0.01..=1000.0).contains(&self.budget) {
            return Some(format!("budget: {} is not a share from 0.01 to 1000 per cent", self.budget));
        }
        if self.rates.is_empty() {
            return Some("no policy has rates; write such as lru = [3000, 3100]".into());
        }
        self.rates.iter().find_map(|(policy, rates)| match rates.iter().position(|rate| !is_rate(*rate)) {
            Some(at) => {
                Some(format!("{policy}, frame {at}: {} is not a number of rays a second above 0", rates[at]))
            }
            None => rates.is_empty().then(|| format!("{policy}: it has no frames")),
        })
    }

    /// Whether it is of this share and way of loading.
    fn is_of(&self, budget: f64, loading: Loading, prefetch: Prefetch) -> bool {
        let is_async = loading.loaders() > 0;
        (self.budget - budget * 100.0).abs() < 1e-6
            && self.is_async == is_async
            && (!is_async || self.prefetch.is_none_or(|known| known == prefetch))
    }

    fn of(&self, policy: Replacement) -> Option<&[f64]> {
        let own = self.rates.iter().find(|(known, _)| *known == policy);
        own.map(|(_, rates)| &rates[..])
    }

    /// Whether nothing tells it from another one.
    fn is_like(&self, other: &Self) -> bool {
        let key = |table: &Self| (table.is_async, table.prefetch.filter(|_| table.is_async), table.warm);
        (self.budget - other.budget).abs() < 1e-6 && key(self) == key(other) && self.shape == other.shape
    }
}

impl fmt::Display for Table {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let loading = match (self.is_async, self.prefetch) {
            (false, _) => "sync",
            (true, None | Some(Prefetch::Off)) => "async",
            (true, Some(prefetch)) => prefetch.name(),
        };
        // A share may be 16.000000000000004 % by its digits.
        let budget = (self.budget * 1e6).round() * 1e-6;
        write!(f, "{budget} % {loading} {}", if self.warm { "warm" } else { "cold" })
    }
}

fn is_rate(rate: f64) -> bool {
    rate.is_finite() && rate > 0.0
}

impl Rates {
    /// Reads a .toml file, or a .json report of `raypack cache`.
    ///
    /// # Errors
    /// It is neither, cannot be read, or a table of it makes no sense.
    pub fn read(path: &Path) -> Result<Self> {
        let wrong = |message: String| Error::malformed(path, message);
        let read = || fs::read_to_string(path).map_err(|source| Error::Read { path: path.into(), source });
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        let tables: Vec<Table> = match ending.as_deref() {
            Some("toml") => {
                let text = read()?;
                let written: Written =
                    toml::from_str(&text).map_err(|error| Error::toml(path, &text, &error))?;
                written.table.into_iter().map(Table::from).collect()
            }
            Some("json") => {
                let earlier: Earlier = serde_json::from_str(&read()?)
                    .map_err(|error| wrong(format!("this is no report of raypack cache: {error}")))?;
                let table = |(i, table): (usize, EarlierTable)| {
                    table.table().ok_or_else(|| {
                        wrong(format!("table {}: a frame has not as many rates as there are policies", i + 1))
                    })
                };
                earlier.tables.into_iter().enumerate().map(table).collect::<Result<_>>()?
            }
            _ => {
                let expected = "rates come from a .toml file or a .json report of raypack cache";
                return Err(Error::UnknownFormat { path: path.into(), expected });
            }
        };
        if tables.is_empty() {
            return Err(wrong("it has no tables; begin each with a line [[table]]".into()));
        }
        for (i, table) in tables.iter().enumerate() {
            if let Some(fault) = table.fault() {
                return Err(wrong(format!("table {}: {fault}", i + 1)));
            }
            if let Some(twin) = tables[..i].iter().position(|other| other.is_like(table)) {
                return Err(wrong(format!(
                    "tables {} and {} are both of {table}; leave one out",
                    twin + 1,
                    i + 1
                )));
            }
        }
        Ok(Self { path: path.into(), tables })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Checks that some table has something to stand beside.
    ///
    /// # Errors
    /// None has, of all that is tried.
    pub fn check(&self, trials: &[Trial]) -> Result<()> {
        let flown = |table: &&Table| {
            trials.iter().any(|trial| {
                let options = &trial.options;
                table.is_of(trial.budget, options.loading, options.prefetch)
                    && table.of(options.policy).is_some()
            })
        };
        if self.tables.iter().any(|table| flown(&table)) {
            return Ok(());
        }
        let known = self.tables.iter().map(Table::to_string).collect::<Vec<_>>().join(", ");
        Err(Error::malformed(
            &self.path,
            format!(
                "it has nothing of what is flown, but {known}; see --budgets, --loading, --prefetch, --policies"
            ),
        ))
    }

    /// What there is beside a table of ours: of caches that were like its, if there were such ones.
    pub fn beside(&self, ours: &FrameTable) -> Option<Beside> {
        let fits = |(_, table): &(usize, &Table)| {
            table.is_of(ours.budget, ours.loading, ours.prefetch)
                && table.warm == ours.warm
                && ours.policies.iter().any(|&policy| table.of(policy).is_some())
        };
        let fitting = || (1..).zip(&self.tables).filter(fits);
        let alike = fitting().find(|(_, table)| table.shape == Some(ours.shape));
        let (number, table) = alike.or_else(|| fitting().next())?;
        let column = |(i, &policy): (usize, &Replacement)| {
            let theirs = table.of(policy)?;
            let ours: Vec<f64> = ours.rays_per_s.iter().map(|row| row[i]).collect();
            let beside: Vec<Option<f64>> = (0..ours.len()).map(|frame| theirs.get(frame).copied()).collect();
            let ratio = ours.iter().zip(&beside).map(|(ours, theirs)| Some(ours / (*theirs)?)).collect();
            Some(Column { policy, ours, beside, ratio })
        };
        let policies = ours.policies.iter().enumerate().filter_map(column).collect();
        Some(Beside { file: self.path.display().to_string(), table: number, policies })
    }
}

/// Rates measured elsewhere, beside ours.
#[derive(Clone, Debug, Serialize)]
pub struct Beside {
    /// Where they come from.
    pub file: String,
    /// Which of its tables, counted from 1.
    pub table: usize,
    /// The policies that both have.
    pub policies: Vec<Column>,
}

/// A policy's rays a second by frame.
#[derive(Clone, Debug, Serialize)]
pub struct Column {
    /// The policy.
    pub policy: Replacement,
    /// Ours.
    pub ours: Vec<f64>,
    /// Those of the file, where it has the frame.
    pub beside: Vec<Option<f64>>,
    /// Ours by these.
    pub ratio: Vec<Option<f64>>,
}

impl fmt::Display for Beside {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "beside {}, table {}: rays/s, ours and its, and ours by its", self.file, self.table)?;
        let head = |column: &Column| [format!("{} ours", column.policy), "beside".into(), "ratio".into()];
        let head = std::iter::once("frame".to_string()).chain(self.policies.iter().flat_map(head));
        let mut lines: Vec<Vec<String>> = vec![head.collect()];
        let frames = self.policies.first().map_or(0, |column| column.ours.len());
        for frame in 0..frames {
            let cells = |column: &Column| {
                let or_none = |cell: Option<String>| cell.unwrap_or_else(|| "-".into());
                [
                    grouped(column.ours[frame] as u64),
                    or_none(column.beside[frame].map(|rate| grouped(rate as u64))),
                    or_none(column.ratio[frame].map(figure)),
                ]
            };
            lines.push(
                std::iter::once(frame.to_string()).chain(self.policies.iter().flat_map(cells)).collect(),
            );
        }
        f.write_str(&grid(&lines))
    }
}

#[cfg(test)]
mod tests;
