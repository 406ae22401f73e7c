//! `raypack render --heatmap`: a picture of what pixels cost.

use crate::cli::progress::watch;
use crate::cli::report::{ENGINE, Engine, Json, Lines};
use crate::cli::scene::{Scene, SceneReport};
use crate::error::Result;
use crate::render::Size;
use crate::render::image::write_heat;
use crate::scene::Camera;
use crate::study::heat::{Cost, Spread, map};
use plotters::style::colors::colormaps::{ColorMap, ViridisRGB};
use serde::Serialize;
use std::path::Path;
use std::sync::atomic::{AtomicU32, Ordering};

#[derive(Serialize)]
struct Report<'a> {
    engine: Engine,
    #[serde(flatten)]
    scene: SceneReport<'a>,
    file: &'a Path,
    camera: Camera,
    size: Size,
    heatmap: Cost,
    spread: Spread,
}

/// Measures all pixels, writes the picture and reports.
pub fn run(scene: &Scene, camera: Camera, size: Size, heatmap: Cost, file: &Path, json: &Json) -> Result<()> {
    let rows = AtomicU32::new(0);
    let costs = watch(
        "measuring",
        || f64::from(rows.load(Ordering::Relaxed)) / f64::from(size.height),
        || {
            map(&scene.accel, &camera, size, heatmap, || {
                rows.fetch_add(1, Ordering::Relaxed);
            })
        },
    );
    let spread = Spread::of(&costs);
    let brightest = spread.percentile_99.max(f32::MIN_POSITIVE);
    write_heat(file, size, &costs, |cost| {
        let color = ViridisRGB.get_color((cost / brightest).min(1.0));
        [color.0, color.1, color.2]
    })?;

    let report = Report { engine: ENGINE, scene: scene.report(), file, camera, size, heatmap, spread };
    let mut lines = Lines::default();
    scene.describe(&mut lines);
    lines.add("camera", camera.to_string());
    let unit = if heatmap == Cost::Time { " ns" } else { "" };
    let Spread { mean, median, percentile_99, greatest } = spread;
    lines.add(
        heatmap.name(),
        format!(
            "of a pixel's ray, traced alone: {mean:.1}{unit} on average, {median:.0} in the middle, 99 % at most \
             {percentile_99:.0}, {greatest:.0} at most"
        ),
    );
    lines.add(
        "picture",
        format!("{}: from 0, dark, to {percentile_99:.0}{unit} and more, bright", file.display()),
    );
    json.give(lines.text(), &report)
}
