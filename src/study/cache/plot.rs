//! Rays a second by frame, a panel for each budget and pass, a line for each cache.

use super::report::{Report, Row};
use crate::cache::Loading;
use crate::cache::policy::Replacement;
use crate::error::Result;
use crate::study::plot::{self, Drawing, Drawn};
use crate::study::text::grouped;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// Width and height of a panel, and of the lines above all.
const PANEL: (u32, u32) = (560, 340);
const HEADER: u32 = 60;
/// How much wider than its lines a panel is, for the legend to stand beside them.
const LEGEND: f64 = 1.36;

/// Draws a report and writes the plot: .svg or .png.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
pub fn write(path: &Path, report: &Report) -> Result<()> {
    plot::write(path, &Plot { report, panels: panels(report) })
}

/// The caches of one budget and pass.
struct Panel<'a> {
    title: String,
    rows: Vec<&'a Row>,
}

fn panels(report: &Report) -> Vec<Panel<'_>> {
    let mut panels: Vec<Panel<'_>> = Vec::new();
    for row in report.rows.iter().filter(|row| row.policy.is_some()) {
        let pass = if row.warm { "warm" } else { "cold" };
        let title = format!("{:.0} % in memory, {pass}", row.budget * 100.0);
        match panels.iter_mut().find(|panel| panel.title == title) {
            Some(panel) => panel.rows.push(row),
            None => panels.push(Panel { title, rows: vec![row] }),
        }
    }
    panels
}

struct Plot<'a> {
    report: &'a Report,
    panels: Vec<Panel<'a>>,
}

impl Plot<'_> {
    fn rows(&self) -> u32 {
        (self.panels.len() as u32).div_ceil(2).max(1)
    }
}

impl Drawing for Plot<'_> {
    fn size(&self) -> (u32, u32) {
        (2 * PANEL.0, HEADER + self.rows() * PANEL.1)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        area.fill(&WHITE)?;
        let (header, panels) = area.split_vertically(HEADER);
        let Report { scene, triangles, size, threads, isa, processor, raypack, build, date, direct, .. } =
            self.report;
        let name = Path::new(scene).file_name().map_or(scene.as_str().into(), |name| name.to_string_lossy());
        let reads = if *direct { "reads from the disk" } else { "reads through the system's memory" };
        let lines = [
            format!("A camera path through caches: {name}, {} triangles, {size}", grouped(*triangles)),
            format!(
                "{threads} threads, {isa}, {processor}, {reads}, raypack {raypack} ({build} build), {date}; dashed: resident; thin: synchronous"
            ),
        ];
        for (i, (line, size)) in lines.into_iter().zip([18, 12]).enumerate() {
            header.draw(&Text::new(line, (14, 8 + 24 * i as i32), ("sans-serif", size)))?;
        }
        let cells = panels.split_evenly((self.rows() as usize, 2));
        let resident = self.report.rows.first();
        self.panels.iter().zip(&cells).try_for_each(|(panel, cell)| draw_panel(cell, panel, resident))
    }
}

/// A policy's colour.
fn color(policy: Replacement) -> RGBColor {
    match policy {
        Replacement::Fifo => RGBColor(120, 120, 120),
        Replacement::Lru => RGBColor(30, 90, 180),
        Replacement::Frequency => RGBColor(200, 60, 50),
        Replacement::Decaying => RGBColor(230, 150, 40),
        Replacement::Clock => RGBColor(60, 160, 160),
        Replacement::Sieve => RGBColor(40, 140, 60),
        Replacement::S3Fifo => RGBColor(140, 70, 170),
    }
}

fn rates(row: &Row) -> impl Iterator<Item = (f64, f64)> + Clone {
    (1..).zip(&row.frames).map(|(i, frame)| (f64::from(i), frame.rays as f64 / frame.seconds * 1e-6))
}

fn draw_panel<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    panel: &Panel<'_>,
    resident: Option<&Row>,
) -> Drawn {
    let frames = panel.rows.iter().map(|row| row.frames.len()).max().unwrap_or(1) as f64;
    let all = panel.rows.iter().copied().chain(resident);
    let top = all.flat_map(rates).fold(0.0, |top: f64, (_, rate)| top.max(rate)) * 1.08;
    let mut chart = ChartBuilder::on(area)
        .caption(&panel.title, ("sans-serif", 15))
        .margin(8)
        .x_label_area_size(32)
        .y_label_area_size(48)
        .build_cartesian_2d(1.0..1.0 + (frames.max(2.0) - 1.0) * LEGEND, 0.0..top.max(1e-3))?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("frame")
        .y_desc("Mrays/s")
        .x_label_formatter(&|x| if *x <= frames { format!("{x:.0}") } else { String::new() })
        .label_style(("sans-serif", 11))
        .draw()?;
    if let Some(row) = resident {
        chart.draw_series(DashedLineSeries::new(rates(row), 6, 4, BLACK.mix(0.6).into()))?;
    }
    for row in &panel.rows {
        let Some(policy) = row.policy else { continue };
        let line = color(policy);
        let width = match row.loading {
            Some(Loading::Asynchronous { .. }) => 3 + 2 * row.prefetch() as u32,
            _ => 1,
        };
        let name = row.loading.map_or("", |loading| loading.name(row.prefetch()));
        let name = format!("{} {name}", policy.name());
        chart
            .draw_series(LineSeries::new(rates(row), line.stroke_width(width)))?
            .label(name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], line.stroke_width(width)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::LowerRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK.mix(0.3))
        .label_font(("sans-serif", 10))
        .draw()?;
    Ok(())
}
