//! What the sizes took, as text and as JSON.

use super::Options;
use crate::study::bench::{self, Header};
use crate::study::rays::RayKind;
use crate::study::text::{figure, grid, grouped};
use serde::Serialize;
use std::fmt;

/// Everything that was found.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was measured, where and when. The model is the first plant.
    pub header: Header,
    /// Worker threads.
    pub threads: usize,
    /// Which plants.
    pub plant_seed: u64,
    /// The sizes, ascending.
    pub steps: Vec<Step>,
    /// What was left out and why, a line each.
    pub notes: Vec<String>,
}

/// One size.
#[derive(Clone, Debug, Serialize)]
pub struct Step {
    /// The plant's triangles.
    pub triangles: usize,
    /// Each engine's best mode for each kind of ray.
    pub times: Vec<Time>,
}

/// What a kind of ray took.
#[derive(Clone, Debug, Serialize)]
pub struct Time {
    /// The engine.
    pub engine: &'static str,
    /// Its best mode.
    pub mode: String,
    /// The kind of ray.
    pub rays: RayKind,
    /// Nanoseconds that a thread spends on a ray, of the middle round.
    pub ns_per_ray: f64,
    /// Million rays a second, all threads together.
    pub mrays_per_s: f64,
    /// Seconds that the build took.
    pub build_seconds: f64,
    /// Bytes that the tree holds.
    pub bytes: u64,
}

impl Step {
    pub(super) fn new(raced: &bench::Report) -> Self {
        let mut times = Vec::new();
        for (rays, threads) in raced.races() {
            for engine in &raced.header.engines {
                times.extend(raced.best(engine.name, rays, threads).map(|row| Time {
                    engine: row.engine,
                    mode: row.mode.clone(),
                    rays,
                    ns_per_ray: 1e3 * threads as f64 / row.mrays_per_s,
                    mrays_per_s: row.mrays_per_s,
                    build_seconds: row.build_seconds,
                    bytes: row.bytes,
                }));
            }
        }
        Self { triangles: raced.header.triangles, times }
    }

    fn time(&self, engine: &str, rays: RayKind) -> Option<&Time> {
        self.times.iter().find(|time| time.engine == engine && time.rays == rays)
    }
}

impl Report {
    pub(super) fn new(first: bench::Report, step: Step, options: &Options) -> Self {
        let threads = options.bench.threads[0];
        Self {
            header: first.header,
            threads,
            plant_seed: options.seed,
            steps: vec![step],
            notes: first.notes,
        }
    }

    /// How many threads there were, in words.
    pub(super) fn workers(&self) -> String {
        format!("{} thread{}", self.threads, if self.threads == 1 { "" } else { "s" })
    }

    /// The engines' names, raypack's first.
    pub fn engines(&self) -> Vec<&'static str> {
        let mut names: Vec<_> = self.header.engines.iter().map(|engine| engine.name).collect();
        names.sort_by_key(|&name| name != "raypack");
        names
    }

    /// The kinds of ray, in their order.
    pub fn kinds(&self) -> Vec<RayKind> {
        let mut kinds: Vec<RayKind> = Vec::new();
        for time in self.steps.iter().flat_map(|step| &step.times) {
            if !kinds.contains(&time.rays) {
                kinds.push(time.rays);
            }
        }
        kinds
    }

    /// An engine's nanoseconds for a kind of ray, by number of triangles.
    pub fn curve(&self, engine: &str, rays: RayKind) -> Vec<(usize, f64)> {
        let point = |step: &Step| Some((step.triangles, step.time(engine, rays)?.ns_per_ray));
        self.steps.iter().filter_map(point).collect()
    }

    /// By how much the time of a ray grew from the smallest size to the greatest; `None` for fewer than two.
    pub fn growth(&self, engine: &str, rays: RayKind) -> Option<f64> {
        let curve = self.curve(engine, rays);
        let [(_, first), .., (_, last)] = curve[..] else { return None };
        Some(last / first)
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Header { machine, isa, raypack, build, accuracy, date, size, seed, .. } = &self.header;
        let engines: Vec<String> =
            self.header.engines.iter().map(|e| format!("{} {} ({})", e.name, e.version, e.isa)).collect();
        writeln!(f, "Plants of growing size (seed {}), {size} x {size} rays (seed {seed})", self.plant_seed)?;
        writeln!(f, "{machine}, {}, {isa}, raypack {raypack} ({build} build), {accuracy}", self.workers())?;
        writeln!(f, "{}, {date}\n", engines.join(", "))?;
        let names = self.engines();
        for rays in self.kinds() {
            let mut lines = vec![vec![format!("{} rays: triangles", rays.name())]];
            for name in &names {
                lines[0].extend([format!("{name}: ns a ray"), "Mrays/s".into(), "mode".into()]);
            }
            if names.len() > 1 {
                lines[0].push(format!("raypack : {}", names[1]));
            }
            for step in &self.steps {
                let mut line = vec![grouped(step.triangles as u64)];
                for name in &names {
                    line.extend(match step.time(name, rays) {
                        Some(time) => [figure(time.ns_per_ray), figure(time.mrays_per_s), time.mode.clone()],
                        None => ["-", "-", "-"].map(String::from),
                    });
                }
                if let [ours, other, ..] = names[..] {
                    let ratio = step.time(ours, rays).zip(step.time(other, rays));
                    line.push(ratio.map_or("-".into(), |(a, b)| figure(a.mrays_per_s / b.mrays_per_s)));
                }
                lines.push(line);
            }
            writeln!(f, "{}", grid(&lines))?;
            let grown: Vec<String> = names
                .iter()
                .filter_map(|name| Some(format!("{name} {:.2}", self.growth(name, rays)?)))
                .collect();
            if !grown.is_empty() {
                writeln!(f, "time of a ray, greatest plant beside smallest: {}\n", grown.join(", "))?;
            }
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "note: {note}"))
    }
}
