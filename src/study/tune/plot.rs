//! What each setting is worth around the best: a panel a setting, its values to the right, and upward what
//! they take beside the best, as measured and as the SAH has it.

use super::report::{Measured, Phase, Report};
use crate::error::Result;
use crate::study::plot::{self, Drawing, Drawn, FAMILY};
use crate::study::text::grouped;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// Width and height of a panel, and of the lines above all.
const PANEL: (u32, u32) = (360, 260);
const HEADER: u32 = 76;
/// Panels side by side.
const COLUMNS: u32 = 3;

/// A setting's values, ascending, with what they take beside the best: measured (least, middle, greatest)
/// and predicted. The best itself is among them, with 1.
struct Curve {
    setting: &'static str,
    points: Vec<(f64, [f64; 3], f64)>,
    best: f64,
}

/// Draws a report and writes the plot: .svg or .png.
///
/// # Errors
/// As [`plot::write`].
pub fn write(path: &Path, report: &Report) -> Result<()> {
    plot::write(path, &Plot { report, curves: curves(report) })
}

/// A panel for each curve, and above them what was measured.
struct Plot<'a> {
    report: &'a Report,
    curves: Vec<Curve>,
}

impl Plot<'_> {
    fn rows(&self) -> u32 {
        (self.curves.len() as u32).div_ceil(COLUMNS).max(1)
    }
}

impl Drawing for Plot<'_> {
    fn size(&self) -> (u32, u32) {
        (COLUMNS * PANEL.0, HEADER + self.rows() * PANEL.1)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        area.fill(&WHITE)?;
        let (header, panels) = area.split_vertically(HEADER);
        for (i, (line, size)) in lines(self.report).into_iter().zip([19, 12, 12]).enumerate() {
            header.draw(&Text::new(line, (14, 10 + 24 * i as i32), (FAMILY, size)))?;
        }
        let cells = panels.split_evenly((self.rows() as usize, COLUMNS as usize));
        self.curves.iter().zip(&cells).try_for_each(|(curve, cell)| panel(cell, curve))
    }
}

/// The curves of the settings that were looked at around the best; of the way there, if there was no time
/// to look around.
fn curves(report: &Report) -> Vec<Curve> {
    let looked = report.measured.iter().any(|m| m.phase == Phase::Around);
    let phase = if looked { Phase::Around } else { Phase::Search };
    let of = |setting: &'static str, best: f64| {
        let mine = |m: &&Measured| m.setting == setting && m.phase == phase && m.from == best;
        let mut points: Vec<_> = report
            .measured
            .iter()
            .filter(mine)
            .filter_map(|m| Some((m.value, m.time?, m.predicted)))
            .collect();
        points.push((best, [1.0; 3], 1.0));
        points.sort_by(|a, b| a.0.total_cmp(&b.0));
        Curve { setting, points, best }
    };
    let curves = report.values.iter().map(|value| of(value.setting, value.best));
    curves.filter(|curve| curve.points.len() > 1).collect()
}

/// The lines above the panels.
fn lines(report: &Report) -> [String; 3] {
    let name = Path::new(&report.model).file_name().map(|n| n.to_string_lossy().into_owned());
    [
        format!("What settings are worth: {}", name.as_deref().unwrap_or(&report.model)),
        format!(
            "{} triangles; {} at {}, goal {}; {}, {} threads, {}, raypack {} ({} build), {}",
            grouped(report.triangles as u64),
            report.loads.join(", "),
            report.size,
            report.goal,
            report.processor,
            report.threads,
            report.isa,
            report.raypack,
            report.build,
            report.date
        ),
        "blue: time beside the best, middle and spread of the pairs; orange: what the SAH says".into(),
    ]
}

fn panel<B: DrawingBackend>(area: &DrawingArea<B, Shift>, curve: &Curve) -> Drawn {
    let [low, high] = extent(curve);
    let last = curve.points.len() as f64 - 1.0;
    let mut chart = ChartBuilder::on(area)
        .caption(curve.setting, (FAMILY, 14))
        .margin(8)
        .x_label_area_size(24)
        .y_label_area_size(44)
        .build_cartesian_2d(-0.3..last + 0.3, low..high)?;
    let label = |x: &f64| {
        let point = curve.points.get(x.round() as usize).filter(|_| (x - x.round()).abs() < 0.05);
        point.map_or(String::new(), |(value, ..)| format!("{value}"))
    };
    chart
        .configure_mesh()
        .disable_x_mesh()
        .light_line_style(TRANSPARENT)
        .x_labels(2 * curve.points.len() + 1)
        .x_label_formatter(&label)
        .y_label_formatter(&|y| format!("{y:.2}"))
        .label_style((FAMILY, 11))
        .draw()?;
    let at = |i: usize| i as f64;
    let points = || curve.points.iter().enumerate();
    let orange = RGBColor(214, 120, 20);
    let blue = RGBColor(30, 90, 180);
    chart.draw_series(LineSeries::new([(-0.3, 1.0), (last + 0.3, 1.0)], BLACK.mix(0.4)))?;
    chart.draw_series(LineSeries::new(points().map(|(i, p)| (at(i), p.2)), orange))?;
    chart.draw_series(points().map(|(i, p)| Circle::new((at(i), p.2), 3, orange)))?;
    chart
        .draw_series(points().map(|(i, p)| ErrorBar::new_vertical(at(i), p.1[0], p.1[1], p.1[2], blue, 8)))?;
    chart.draw_series(LineSeries::new(points().map(|(i, p)| (at(i), p.1[1])), blue.stroke_width(2)))?;
    let filled = |p: &(f64, [f64; 3], f64)| ShapeStyle { filled: p.0 == curve.best, ..blue.into() };
    chart.draw_series(points().map(|(i, p)| Circle::new((at(i), p.1[1]), 5, filled(p))))?;
    Ok(())
}

/// The least and the greatest that a panel shows.
fn extent(curve: &Curve) -> [f64; 2] {
    let all = curve.points.iter().flat_map(|(_, time, predicted)| [time[0], time[2], *predicted]);
    let (low, high) = all.fold((0.95f64, 1.05f64), |(low, high), y| (low.min(y), high.max(y)));
    let margin = 0.06 * (high - low);
    [low - margin, high + margin]
}
