//! Rays per second by frame, laid out as the seed paper's tables 1 to 3.

use super::Row;
use crate::cache::policy::Replacement;
use crate::cache::{Loading, Prefetch};
use crate::study::text::{grid, grouped};
use serde::Serialize;
use std::fmt;

/// What one share of the data in memory and one way of loading gave: a row a frame, a column a policy.
#[derive(Clone, Debug, Serialize)]
pub struct FrameTable {
    /// The share of the data that may be in memory.
    pub budget: f64,
    /// Who reads.
    pub loading: Loading,
    /// Which blocks came before they were needed.
    pub prefetch: Prefetch,
    /// Whether caches held what the same flight had left.
    pub warm: bool,
    /// The columns.
    pub policies: Vec<Replacement>,
    /// The rows: rays a second of each policy.
    pub rays_per_s: Vec<Vec<f64>>,
}

impl FrameTable {
    /// The tables of some flights, in their order; those through the resident scene have no place in them.
    pub fn all(rows: &[Row]) -> Vec<Self> {
        let mut tables: Vec<Self> = Vec::new();
        for row in rows {
            let (Some(policy), Some(loading)) = (row.policy, row.loading) else { continue };
            let is_its = |table: &&mut Self| {
                let key = (table.budget, table.loading, table.prefetch, table.warm);
                key == (row.budget, loading, row.prefetch(), row.warm)
            };
            if tables.iter_mut().find(is_its).is_none() {
                let rays_per_s = vec![Vec::new(); row.frames.len()];
                let (budget, prefetch, warm) = (row.budget, row.prefetch(), row.warm);
                tables.push(Self { budget, loading, prefetch, warm, policies: Vec::new(), rays_per_s });
            }
            let table = tables.iter_mut().find(is_its).expect("it is there now");
            table.policies.push(policy);
            for (rates, frame) in table.rays_per_s.iter_mut().zip(&row.frames) {
                rates.push(frame.rays as f64 / frame.seconds);
            }
        }
        // A share's tables together, and of these the ones of a way of loading.
        tables.sort_by(|a, b| {
            let key = |table: &Self| (table.loading != Loading::Synchronous, table.prefetch, table.warm);
            a.budget.total_cmp(&b.budget).then(key(a).cmp(&key(b)))
        });
        tables
    }
}

impl fmt::Display for FrameTable {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let loading = self.loading.name(self.prefetch);
        let pass = if self.warm { "warm" } else { "cold" };
        writeln!(f, "rays/s by frame, {:.0} % in memory, {loading}, {pass}", self.budget * 100.0)?;
        let names = self.policies.iter().map(|policy| policy.name().to_string());
        let mut lines = vec![std::iter::once("frame".to_string()).chain(names).collect::<Vec<_>>()];
        for (frame, rates) in self.rays_per_s.iter().enumerate() {
            let rates = rates.iter().map(|&rate| grouped(rate as u64));
            lines.push(std::iter::once(frame.to_string()).chain(rates).collect());
        }
        f.write_str(&grid(&lines))
    }
}

/// What the seed paper reports, as far as it is known here: its numbers by frame are not.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct Paper {
    /// Its model.
    pub model: &'static str,
    /// The shares of the data that were in memory.
    pub budgets: [f64; 2],
    /// The least and the greatest of its caches.
    pub rays_per_s: [f64; 2],
    /// What a frame of 512 x 512 took.
    pub frame_seconds: f64,
    /// What it found of policies.
    pub policies: &'static str,
    /// And of asynchronous loading.
    pub loading: &'static str,
}

/// What the seed paper reports.
pub const PAPER: Paper = Paper {
    model: "a power plant of 12.7 M triangles, 4.6 GB with its tree",
    budgets: [0.16, 0.39],
    rays_per_s: [3e3, 12e3],
    frame_seconds: 21.0,
    policies: "LRU best, FIFO close, Frequency and Decaying Frequency poor where the cache is small",
    loading: "asynchronous loading gained nothing",
};

impl fmt::Display for Paper {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [[less, more], [least, most]] =
            [self.budgets.map(|share| share * 100.0), self.rays_per_s.map(|rate| rate * 1e-3)];
        writeln!(
            f,
            "paper: {}, frames 0 to 14 of 512 x 512 with {less:.0} % and {more:.0} % in memory: {least:.0} to \
             {most:.0} thousand rays/s, {:.0} s for a frame;\n       {}; {}",
            self.model, self.frame_seconds, self.policies, self.loading
        )
    }
}
