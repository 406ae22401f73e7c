//! The report on builds, as JSON and as text.

use super::count::Counts;
use super::subject::Built;
use crate::geometry::Accuracy;
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use crate::study::bench::{Agreement, EngineInfo};
use crate::study::rays::RayKind;
use crate::study::text::{figure, grid, grouped};
use serde::Serialize;
use std::fmt;

/// Everything that was found about builds.
#[derive(Clone, Debug, Serialize)]
pub struct Report {
    /// What was built, where and when.
    pub header: Header,
    /// A row for each engine and quality.
    pub rows: Vec<Row>,
    /// How the answers of the trees compare.
    pub agreements: Vec<Agreement>,
    /// What was left out and why, a line each.
    pub notes: Vec<String>,
}

/// What was built, where and when.
#[derive(Clone, Debug, Serialize)]
pub struct Header {
    /// The model's file or name.
    pub model: String,
    /// Its triangles.
    pub triangles: usize,
    /// Its memory.
    pub mesh_bytes: usize,
    /// The processor's name.
    pub machine: String,
    /// Its hardware threads.
    pub hardware_threads: usize,
    /// raypack's threads in a build; rivals take all of the machine's.
    pub build_threads: usize,
    /// Threads that traced.
    pub ray_threads: usize,
    /// raypack's version.
    pub raypack: &'static str,
    /// How raypack decided hits.
    pub accuracy: Accuracy,
    /// `release` or `dev`.
    pub profile: &'static str,
    /// The engines.
    pub engines: Vec<EngineInfo>,
    /// When, in UTC.
    pub date: String,
    /// What the random rays hang on.
    pub seed: u64,
    /// The camera, as `--camera` takes it.
    pub camera: String,
    /// Width and height of the camera's image.
    pub size: u32,
}

/// An engine in one quality.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// `raypack`, `embree` or `obvhs`.
    pub engine: &'static str,
    /// The preset or quality.
    pub mode: String,
    /// The time of a build, in seconds.
    #[serde(flatten)]
    pub time: Seconds,
    /// Million triangles a second.
    pub mtriangles_per_s: f64,
    /// By how much the process's memory rose while it was built, the tree included; `None` where the
    /// system does not say.
    pub peak_bytes: Option<u64>,
    /// The same by raypack's own account.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counted_peak_bytes: Option<u64>,
    /// What raypack announced before.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub announced_peak_bytes: Option<u64>,
    /// Bytes of the finished tree with its triangles; Embree's with its copy of the vertices.
    pub bytes: u64,
    /// The same for each triangle.
    pub bytes_per_triangle: f64,
    /// The tree's cost by the SAH, with the costs of the standard preset, whatever it was built with.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sah_cost: Option<f64>,
    /// References for each triangle.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub references_per_triangle: Option<f64>,
    /// What rays make of it.
    pub rays: Vec<Rate>,
}

/// The time of a build.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Seconds {
    /// The middle round.
    pub seconds: f64,
    /// The quickest round.
    pub low: f64,
    /// The slowest round.
    pub high: f64,
    /// How many.
    pub rounds: usize,
}

/// How quick rays of a kind are in a tree, in the mode that suits them best.
#[derive(Clone, Debug, Serialize)]
pub struct Rate {
    /// The kind of ray.
    pub rays: RayKind,
    /// The mode.
    pub mode: String,
    /// Million rays a second, median of the rounds.
    pub mrays_per_s: f64,
    /// The slowest round.
    pub low: f64,
    /// The fastest round.
    pub high: f64,
    /// What the rays did in raypack's tree, counted.
    #[serde(flatten, skip_serializing_if = "Option::is_none")]
    pub counts: Option<Counts>,
}

impl Seconds {
    fn of(mut rounds: Vec<f64>) -> Self {
        rounds.sort_by(f64::total_cmp);
        let n = rounds.len();
        let seconds = 0.5 * (rounds[(n - 1) / 2] + rounds[n / 2]);
        Self { seconds, low: rounds[0], high: rounds[n - 1], rounds: n }
    }
}

impl Row {
    pub(super) fn new(built: &Built, mesh: &Mesh) -> Self {
        let triangles = mesh.triangles.len() as f64;
        let time = Seconds::of(built.figures.seconds.clone());
        let standard = BuildParams::default();
        let [step, test] = [standard.traversal_cost, standard.intersection_cost].map(f64::from);
        Self {
            engine: built.engine.name(),
            mode: built.mode.clone(),
            time,
            mtriangles_per_s: triangles / time.seconds * 1e-6,
            peak_bytes: built.figures.peak,
            counted_peak_bytes: built.counted,
            announced_peak_bytes: built.announced,
            bytes: built.bytes,
            bytes_per_triangle: built.bytes as f64 / triangles,
            sah_cost: built.stats.as_ref().map(|s| step * s.expected_steps + test * s.expected_tests),
            references_per_triangle: built.stats.as_ref().map(|s| s.references_per_triangle),
            rays: Vec::new(),
        }
    }

    fn rate(&self, kind: RayKind) -> Option<&Rate> {
        self.rays.iter().find(|rate| rate.rays == kind)
    }

    /// What rays of all kinds did in the tree, averaged over the kinds.
    fn mean_counts(&self) -> Option<Counts> {
        let counts: Vec<Counts> = self.rays.iter().filter_map(|rate| rate.counts).collect();
        let n = counts.len() as f64;
        let mean = |of: fn(&Counts) -> f64| counts.iter().map(of).sum::<f64>() / n;
        (n > 0.0).then(|| Counts {
            steps: mean(|c| c.steps),
            leaves: mean(|c| c.leaves),
            tests: mean(|c| c.tests),
        })
    }
}

impl fmt::Display for Report {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let h = &self.header;
        let triangles = grouped(h.triangles as u64);
        let mib = h.mesh_bytes as f64 / 1_048_576.0;
        writeln!(f, "{}: {triangles} triangles in {mib:.1} MiB, in memory before the clock starts", h.model)?;
        writeln!(
            f,
            "{}, {} hardware threads, {} build, built with {} threads, traced with {}",
            h.machine, h.hardware_threads, h.profile, h.build_threads, h.ray_threads
        )?;
        let engines: Vec<String> =
            h.engines.iter().map(|e| format!("{} {} ({})", e.name, e.version, e.isa)).collect();
        writeln!(f, "{}, {}", engines.join(", "), h.date)?;
        writeln!(f, "\nBuilds, median of the rounds; peak and tree in MiB\n")?;
        write!(f, "{}", grid(&self.builds()))?;
        writeln!(
            f,
            "\nMillion rays a second, camera {}, {} x {}, in the best mode\n",
            h.camera, h.size, h.size
        )?;
        write!(f, "{}", grid(&self.rates()))?;
        if self.rows.iter().any(|row| row.mean_counts().is_some()) {
            writeln!(f, "\nSteps and triangle tests of a ray in raypack's trees, counted ray by ray\n")?;
            write!(f, "{}", grid(&self.counts()))?;
        }
        let disagreements: u64 = self.agreements.iter().map(|a| a.disagreements as u64).sum();
        let compared: u64 = self.agreements.iter().map(|a| a.count as u64).sum();
        writeln!(
            f,
            "\n{} of {} answers differ from the first tree's",
            grouped(disagreements),
            grouped(compared)
        )?;
        self.notes.iter().try_for_each(|note| writeln!(f, "\nnote: {note}"))
    }
}

impl Report {
    fn builds(&self) -> Vec<Vec<String>> {
        let head = [
            "engine",
            "mode",
            "seconds",
            "low",
            "high",
            "Mtris/s",
            "x Embree high",
            "peak",
            "counted",
            "announced",
            "tree",
            "bytes/tri",
            "refs/tri",
            "SAH",
            "steps",
            "tests",
        ];
        let mut lines = vec![head.map(String::from).to_vec()];
        let high = self.rows.iter().find(|row| row.engine == "embree" && row.mode == "high");
        let none = || "-".to_owned();
        let mib = |bytes: Option<u64>| bytes.map_or_else(none, |b| figure(b as f64 / 1_048_576.0));
        for row in &self.rows {
            let counts = row.mean_counts();
            lines.push(vec![
                row.engine.into(),
                row.mode.clone(),
                format!("{:.3}", row.time.seconds),
                format!("{:.3}", row.time.low),
                format!("{:.3}", row.time.high),
                figure(row.mtriangles_per_s),
                high.map_or_else(none, |high| format!("{:.2}", row.time.seconds / high.time.seconds)),
                mib(row.peak_bytes),
                mib(row.counted_peak_bytes),
                mib(row.announced_peak_bytes),
                mib(Some(row.bytes)),
                format!("{:.1}", row.bytes_per_triangle),
                row.references_per_triangle.map_or_else(none, |r| format!("{r:.2}")),
                row.sah_cost.map_or_else(none, |cost| format!("{cost:.1}")),
                counts.map_or_else(none, |c| format!("{:.1}", c.steps)),
                counts.map_or_else(none, |c| format!("{:.1}", c.tests)),
            ]);
        }
        lines
    }

    fn kinds(&self) -> Vec<RayKind> {
        let raced = |kind: &RayKind| self.rows.iter().any(|row| row.rate(*kind).is_some());
        RayKind::ALL.into_iter().filter(raced).collect()
    }

    fn rates(&self) -> Vec<Vec<String>> {
        let kinds = self.kinds();
        let mut head: Vec<String> = ["engine", "mode"].map(String::from).into();
        head.extend(kinds.iter().flat_map(|kind| [kind.name().to_owned(), String::new()]));
        let mut lines = vec![head];
        for row in &self.rows {
            let mut line = vec![row.engine.to_owned(), row.mode.clone()];
            for &kind in &kinds {
                let rate = row.rate(kind);
                line.push(rate.map_or_else(|| "-".into(), |rate| figure(rate.mrays_per_s)));
                line.push(rate.map_or_else(String::new, |rate| rate.mode.clone()));
            }
            lines.push(line);
        }
        lines
    }

    fn counts(&self) -> Vec<Vec<String>> {
        let kinds = self.kinds();
        let mut head = vec!["mode".to_owned()];
        let names = |kind: &RayKind| [format!("{} steps", kind.name()), format!("{} tests", kind.name())];
        head.extend(kinds.iter().flat_map(names));
        let mut lines = vec![head];
        for row in self.rows.iter().filter(|row| row.mean_counts().is_some()) {
            let mut line = vec![row.mode.clone()];
            for &kind in &kinds {
                let counts = row.rate(kind).and_then(|rate| rate.counts).unwrap_or_default();
                line.extend([counts.steps, counts.tests].map(|number| format!("{number:.1}")));
            }
            lines.push(line);
        }
        lines
    }
}
