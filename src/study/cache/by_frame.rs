//! Rays per second by frame, laid out as the seed paper's tables 1 to 3.

use super::beside::{Beside, Rates};
use super::{Row, Shape};
use crate::cache::policy::Replacement;
use crate::cache::{Loading, Prefetch};
use crate::study::text::{figure, grid, grouped};
use serde::Serialize;
use std::fmt;

/// What one share of the data in memory, one way of loading and caches of one kind gave: a row a frame, a column a
/// policy.
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
    /// What the caches were like.
    pub shape: Shape,
    /// In words, what of that is otherwise in other tables.
    #[serde(skip)]
    pub differences: String,
    /// The columns.
    pub policies: Vec<Replacement>,
    /// The rows: rays a second of each policy.
    pub rays_per_s: Vec<Vec<f64>>,
    /// The number of the seed paper's table of such a share and way of loading.
    pub paper_table: Option<u8>,
    /// The rows again, as multiples of what the seed paper's fastest cache reached.
    pub times_paper: Vec<Vec<f64>>,
    /// What was measured elsewhere, if there is a file of it.
    pub beside: Option<Beside>,
}

impl FrameTable {
    /// The tables of some flights; those through the resident scene have no place in them. What `elsewhere` has
    /// stands beside them.
    pub fn all(rows: &[Row], elsewhere: Option<&Rates>) -> Vec<Self> {
        let shapes: Vec<Shape> = rows.iter().filter_map(|row| row.shape).collect();
        let differences = Shape::differences(&shapes);
        let mut tables: Vec<Self> = Vec::new();
        for row in rows {
            let (Some(policy), Some(loading), Some(shape)) = (row.policy, row.loading, row.shape) else {
                continue;
            };
            let is_its = |table: &&mut Self| {
                let key = (table.budget, table.loading, table.prefetch, table.warm, table.shape);
                key == (row.budget, loading, row.prefetch(), row.warm, shape)
            };
            if tables.iter_mut().find(is_its).is_none() {
                tables.push(Self {
                    budget: row.budget,
                    loading,
                    prefetch: row.prefetch(),
                    warm: row.warm,
                    shape,
                    differences: shape.words(&differences),
                    policies: Vec::new(),
                    rays_per_s: vec![Vec::new(); row.frames.len()],
                    paper_table: PAPER.table(row.budget, loading),
                    times_paper: vec![Vec::new(); row.frames.len()],
                    beside: None,
                });
            }
            let table = tables.iter_mut().find(is_its).expect("it is there now");
            table.policies.push(policy);
            for (frame, row) in row.frames.iter().enumerate() {
                let rate = row.rays as f64 / row.seconds;
                table.rays_per_s[frame].push(rate);
                table.times_paper[frame].push(rate / PAPER.rays_per_s[1]);
            }
        }
        for table in &mut tables {
            table.beside = elsewhere.and_then(|rates| rates.beside(table));
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
        let (percent, differences) = (self.budget * 100.0, &self.differences);
        write!(f, "rays/s by frame, {percent:.0} % in memory, {loading}, {pass}{differences}")?;
        match self.paper_table {
            Some(number) => writeln!(f, "; in the place of the paper's table {number}")?,
            None => writeln!(f)?,
        }
        let names = self.policies.iter().map(|policy| policy.name().to_string());
        let [least, most] = PAPER.rays_per_s.map(|rate| grouped(rate as u64));
        let known = ["known of the paper".to_string(), format!("x {most}")];
        let mut lines =
            vec![std::iter::once("frame".to_string()).chain(names).chain(known).collect::<Vec<_>>()];
        for (frame, rates) in self.rays_per_s.iter().enumerate() {
            let rates = rates.iter().map(|&rate| grouped(rate as u64));
            let known = [format!("{least}-{most}"), span(&self.times_paper[frame])];
            lines.push(std::iter::once(frame.to_string()).chain(rates).chain(known).collect());
        }
        f.write_str(&grid(&lines))?;
        self.beside.iter().try_for_each(|beside| write!(f, "\n{beside}"))
    }
}

/// The least and the greatest of some numbers.
fn span(numbers: &[f64]) -> String {
    let least = numbers.iter().copied().fold(f64::INFINITY, f64::min);
    let most = numbers.iter().copied().fold(0.0, f64::max);
    let [least, most] = [least, most].map(figure);
    if least == most { least } else { format!("{least}-{most}") }
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

impl Paper {
    /// Which of its tables is of such a share of the data and way of loading: the first two are of its shares, loaded
    /// synchronously, the third of asynchronous loading.
    pub fn table(&self, budget: f64, loading: Loading) -> Option<u8> {
        let share = self.budgets.iter().position(|known| (known - budget).abs() < 1e-9)?;
        Some(if loading == Loading::Synchronous { 1 + share as u8 } else { 3 })
    }
}

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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cache::{CacheOptions, CacheStats};
    use crate::study::cache::FrameRow;

    const SHAPE: Shape = Shape { block: 4096, ways: 32, stripes: 16, nodes: None };

    /// A flight of two frames that takes so many seconds for each, with 1000 rays in it.
    fn row(shape: Shape, policy: Replacement, loading: Loading, seconds: f64) -> Row {
        let cache = CacheStats::default();
        let frame = FrameRow { seconds, rays: 1000, tile_p50: 0.0, tile_p99: 0.0, cache };
        Row {
            budget: 0.16,
            policy: Some(policy),
            loading: Some(loading),
            shape: Some(shape),
            cache: Some(shape.options(CacheOptions { policy, loading, ..CacheOptions::default() })),
            warm: false,
            ..Row::resident(vec![frame, frame], [0.0; 2])
        }
    }

    #[test]
    fn caches_of_different_kinds_have_tables_of_their_own() {
        let (sync, lru) = (Loading::Synchronous, Replacement::Lru);
        let few = Shape { ways: 8, ..SHAPE };
        let nodes = |text: &str| Shape { nodes: text.parse().ok(), ..SHAPE };
        let shapes = [SHAPE, few, nodes("0.3"), nodes("0.3:lru"), Shape { block: 512, ..SHAPE }];
        let mut rows = vec![Row::resident(Vec::new(), [0.0; 2])];
        for shape in shapes {
            rows.extend([Replacement::Fifo, lru].map(|policy| row(shape, policy, sync, 0.1)));
        }
        let tables = FrameTable::all(&rows, None);
        assert_eq!(tables.iter().map(|table| table.shape).collect::<Vec<_>>(), shapes);
        for table in &tables {
            assert_eq!(table.policies, [Replacement::Fifo, lru], "{table}");
            assert_eq!(table.rays_per_s, [[10_000.0; 2]; 2], "{table}");
        }
        assert!(tables[3].to_string().contains("cold, block 4096, ways 32, nodes 0.3:lru;"), "{}", tables[3]);
        let alone = FrameTable::all(&rows[..3], None)[0].to_string();
        assert!(alone.starts_with("rays/s by frame, 16 % in memory, sync, cold; in the place of"), "{alone}");
    }

    #[test]
    fn what_is_known_of_the_paper_stands_beside_ours() {
        let asynchronous = Loading::Asynchronous { loaders: 2 };
        let sync = Loading::Synchronous;
        let rows = [row(SHAPE, Replacement::Fifo, sync, 1e-3), row(SHAPE, Replacement::Lru, sync, 5e-4)];
        let table = &FrameTable::all(&rows, None)[0];
        assert_eq!(table.times_paper[0].iter().map(|x| x.round()).collect::<Vec<_>>(), [83.0, 167.0]);
        let text = table.to_string();
        let lines: Vec<&str> = text.lines().collect();
        assert!(lines[0].ends_with("cold; in the place of the paper's table 1"), "{text}");
        assert!(lines[1].ends_with("  known of the paper  x 12,000"), "{text}");
        let cells: Vec<&str> = lines[3].split_whitespace().collect();
        assert_eq!(cells, ["1", "1,000,000", "2,000,000", "3,000-12,000", "83.3-167"]);
        let places = [(0.16, sync), (0.39, sync), (0.16, asynchronous), (0.39, asynchronous), (0.2, sync)];
        let numbers = places.map(|(budget, loading)| PAPER.table(budget, loading));
        assert_eq!(numbers, [Some(1), Some(2), Some(3), Some(3), None]);
    }
}
