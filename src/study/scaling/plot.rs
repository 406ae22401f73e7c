//! Nanoseconds a ray by number of triangles: a panel for each kind of ray, a line for each engine.

use super::Report;
use crate::error::Result;
use crate::study::bench::Header;
use crate::study::plot::{self, Drawing, Drawn};
use crate::study::rays::RayKind;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// Width and height of a panel, and of the lines above all.
const PANEL: (u32, u32) = (560, 360);
const HEADER: u32 = 60;

/// Draws a report and writes the plot: .svg or .png.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
pub fn write(path: &Path, report: &Report) -> Result<()> {
    plot::write(path, &Plot { report, kinds: report.kinds() })
}

struct Plot<'a> {
    report: &'a Report,
    kinds: Vec<RayKind>,
}

impl Plot<'_> {
    fn columns(&self) -> u32 {
        (self.kinds.len() as u32).clamp(1, 2)
    }

    fn rows(&self) -> u32 {
        (self.kinds.len() as u32).div_ceil(2).max(1)
    }
}

impl Drawing for Plot<'_> {
    fn size(&self) -> (u32, u32) {
        (self.columns() * PANEL.0, HEADER + self.rows() * PANEL.1)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        area.fill(&WHITE)?;
        let (header, panels) = area.split_vertically(HEADER);
        let Header { machine, isa, raypack, build, date, .. } = &self.report.header;
        let lines = [
            "Nanoseconds that a thread spends on a ray, by the plant's triangles".to_owned(),
            format!("{machine}, {}, {isa}, raypack {raypack} ({build} build), {date}", self.report.workers()),
        ];
        for (i, (line, size)) in lines.into_iter().zip([17, 11]).enumerate() {
            header.draw(&Text::new(line, (14, 8 + 24 * i as i32), (plot::FAMILY, size)))?;
        }
        let cells = panels.split_evenly((self.rows() as usize, self.columns() as usize));
        self.kinds.iter().zip(&cells).try_for_each(|(&kind, cell)| draw_panel(cell, self.report, kind))
    }
}

/// An engine's colour.
fn color(engine: &str) -> RGBColor {
    match engine {
        "raypack" => RGBColor(200, 60, 50),
        "embree" => RGBColor(30, 90, 180),
        _ => RGBColor(120, 120, 120),
    }
}

fn draw_panel<B: DrawingBackend>(area: &DrawingArea<B, Shift>, report: &Report, kind: RayKind) -> Drawn {
    let engines = report.engines();
    let curves: Vec<(&str, Vec<(f64, f64)>)> = engines
        .into_iter()
        .map(|name| (name, report.curve(name, kind).into_iter().map(|(n, ns)| (n as f64, ns)).collect()))
        .collect();
    let all = || curves.iter().flat_map(|(_, curve)| curve);
    let range = |of: fn(&(f64, f64)) -> f64| {
        let (low, high) = all().map(of).fold((f64::INFINITY, 0.0f64), |(a, b), x| (a.min(x), b.max(x)));
        low * 0.8..high * 1.25
    };
    let mut chart = ChartBuilder::on(area)
        .caption(format!("{} rays", kind.name()), (plot::FAMILY, 15))
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(range(|p| p.0).log_scale(), range(|p| p.1).log_scale())?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("triangles")
        .y_desc("ns a ray")
        .x_label_formatter(&|x| thousands(*x))
        .label_style((plot::FAMILY, 11))
        .draw()?;
    for (name, curve) in &curves {
        let color = color(name);
        chart
            .draw_series(LineSeries::new(curve.iter().copied(), color.stroke_width(2)).point_size(3))?
            .label(*name)
            .legend(move |(x, y)| PathElement::new([(x, y), (x + 16, y)], color.stroke_width(2)));
    }
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperLeft)
        .background_style(WHITE.mix(0.8))
        .border_style(TRANSPARENT)
        .label_font((plot::FAMILY, 12))
        .draw()?;
    Ok(())
}

/// `30k`, `1M`.
fn thousands(number: f64) -> String {
    if number >= 1e6 { format!("{}M", number / 1e6) } else { format!("{}k", number / 1e3) }
}
