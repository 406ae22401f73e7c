//! `raypack render --heatmap`: a picture of what pixels cost.

use crate::cli::memory::MemoryReport;
use crate::cli::options::BuildOptions;
use crate::cli::progress::watch;
use crate::cli::report::{ENGINE, Engine, Json, Lines};
use crate::cli::scene::{Scene, SceneReport};
use crate::error::Result;
use crate::render::Size;
use crate::render::image::write_heat;
use crate::scene::Camera;
use crate::scene::effects::Effect;
use crate::study::heat::{Cost, Spread, map};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

/// What is shown of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(untagged)]
pub enum Shown {
    /// What a ray through the middle costs.
    Cost(Cost),
    /// The rays that a sample casts for an effect, or how often it uses it, on average.
    Effect(Effect),
}

impl Shown {
    /// Reads `--heatmap`.
    ///
    /// # Errors
    /// There is no such thing.
    pub fn parse(name: &str) -> Result<Self> {
        name.parse().map(Self::Effect).or_else(|()| name.parse().map(Self::Cost))
    }

    fn name(self) -> &'static str {
        match self {
            Self::Cost(cost) => cost.name(),
            Self::Effect(effect) => effect.name(),
        }
    }
}

#[derive(Serialize)]
struct Report<'a> {
    engine: Engine,
    #[serde(flatten)]
    scene: SceneReport<'a>,
    file: &'a Path,
    camera: Camera,
    size: Size,
    heatmap: Shown,
    spread: Spread,
    memory: MemoryReport,
}

/// Measures what all pixels cost.
pub fn costs(scene: &Scene, camera: &Camera, size: Size, cost: Cost) -> Vec<f32> {
    let rows = AtomicU32::new(0);
    watch(
        "measuring",
        || f64::from(rows.load(Ordering::Relaxed)) / f64::from(size.height),
        || {
            map(&scene.accel, camera, size, cost, || {
                rows.fetch_add(1, Ordering::Relaxed);
            })
        },
    )
}

/// Writes the picture and reports.
pub fn give(
    scene: &Scene,
    camera: Camera,
    size: Size,
    heatmap: Shown,
    costs: &[f32],
    file: &Path,
    (build, json): (&BuildOptions, &Json),
) -> Result<()> {
    let spread = Spread::of(costs);
    let brightest = spread.percentile_99.max(f32::MIN_POSITIVE);
    write_heat(file, size, costs, |cost| {
        let color = ViridisRGB.get_color((cost / brightest).min(1.0));
        [color.0, color.1, color.2]
    })?;

    let (memory, _) = scene.memory_report(build)?;
    let report =
        Report { engine: ENGINE, scene: scene.report(), file, camera, size, heatmap, spread, memory };
    let mut lines = Lines::default();
    scene.describe(&mut lines);
    lines.add("camera", camera.to_string());
    let unit = if heatmap == Shown::Cost(Cost::Time) { " ns" } else { "" };
    let of = match heatmap {
        Shown::Cost(_) => "of a pixel's ray, traced alone".to_owned(),
        Shown::Effect(Effect::Antialiasing) => "samples of a pixel beyond its first".to_owned(),
        Shown::Effect(effect) => format!("{} for each sample of a pixel", effect.unit()),
    };
    let Spread { mean, median, percentile_99, greatest } = spread;
    lines.add(
        heatmap.name(),
        format!(
            "{of}: {mean:.1}{unit} on average, {median:.0} in the middle, 99 % at most \
             {percentile_99:.0}, {greatest:.0} at most"
        ),
    );
    lines.add(
        "picture",
        format!("{}: from 0, dark, to {percentile_99:.0}{unit} and more, bright", file.display()),
    );
    memory.describe(&mut lines, "");
    json.give(lines.text(), &report)
}
