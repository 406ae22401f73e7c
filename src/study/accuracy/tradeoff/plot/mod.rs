//! The Pareto plot: time to the right, error upward, a point a mode.
//!
//! A panel for each kind of ray (nanoseconds a ray against errors per million rays, raypack's modes and
//! Embree's) and one for frames (milliseconds against the picture's RMSE, a line a mode, a point a number of
//! samples). Errors stand on a logarithmic axis with a place of its own for none at all.

mod axis;
mod canvas;
mod labels;
mod panel;

use super::report::{FrameRow, RayRow, Report};
use crate::error::Result;
use crate::geometry::Accuracy;
use crate::study::plot::{self, Drawing, Drawn, Format};
use crate::study::rays::RayKind;
use crate::study::text::grouped;
use axis::{Axis, ErrorAxis};
use canvas::{Anchor, Area, Canvas, Ink};
use panel::{Mark, Panel, Point};
use plotters::backend::DrawingBackend;
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use std::path::Path;

/// Pixels of a PNG for each unit of the layout.
const PNG_SCALE: u32 = 2;
/// Width and height of a panel with its margins.
const PANEL: (u32, u32) = (440, 360);
/// Panels side by side.
const COLUMNS: u32 = 3;
/// Height of the lines above the panels, and below them.
const HEADER: u32 = 84;
const FOOTER: u32 = 44;

/// Draws a report and writes the plot: .svg or .png.
///
/// # Errors
/// As [`plot::write`].
pub fn write(path: &Path, report: &Report) -> Result<()> {
    let scale = match Format::of(path)? {
        Format::Svg => 1,
        Format::Png => PNG_SCALE,
    };
    plot::write(path, &Plot { report, panels: panels(report), scale })
}

/// A report's panels, and above and below them what they say.
struct Plot<'a> {
    report: &'a Report,
    panels: Vec<Panel>,
    /// Pixels for each unit of the layout.
    scale: u32,
}

impl Plot<'_> {
    fn columns(&self) -> u32 {
        // The header's lines want the width of two panels.
        (self.panels.len() as u32).clamp(2, COLUMNS)
    }

    /// Width and height in units of the layout.
    fn extent(&self) -> (u32, u32) {
        let rows = (self.panels.len() as u32).div_ceil(self.columns());
        (self.columns() * PANEL.0, HEADER + rows * PANEL.1 + FOOTER)
    }

    /// What was measured, on which machine.
    fn header(&self, canvas: &Canvas<'_, impl DrawingBackend>) -> Drawn {
        let h = &self.report.header;
        let middle = f64::from(self.extent().0) / 2.0;
        let name =
            Path::new(&h.model).file_name().map_or(h.model.clone(), |n| n.to_string_lossy().into_owned());
        canvas.text(
            &format!("What accuracy costs: {name}"),
            (middle, 24.0),
            20.0,
            Ink::Text,
            Anchor::Middle,
        )?;
        let plural = if h.threads == 1 { "" } else { "s" };
        let engines: Vec<String> =
            h.engines.iter().map(|e| format!("{} {} ({})", e.name, e.version, e.isa)).collect();
        let lines = [
            format!(
                "{} triangles, {}, {} thread{plural}, {} build",
                grouped(h.triangles as u64),
                engines.join(", "),
                h.threads,
                h.build
            ),
            format!("{}, {}, camera {}, seed {}", h.machine, &h.date[..10], h.camera, h.seed),
        ];
        for (line, y) in lines.iter().zip([48.0, 66.0]) {
            canvas.text(line, (middle, y), 12.0, Ink::Faint, Anchor::Middle)?;
        }
        Ok(())
    }

    /// How to read the panels.
    fn footer(&self, canvas: &Canvas<'_, impl DrawingBackend>) -> Drawn {
        let (width, height) = self.extent();
        let (middle, bottom) = (f64::from(width) / 2.0, f64::from(height));
        let legend = "Lower left is better. Ring: raypack's default. Dashes: Pareto front. \
                      Bars: quickest to slowest round.";
        canvas.text(legend, (middle, bottom - 28.0), 12.0, Ink::Faint, Anchor::Middle)?;
        let legend = "Errors: missed and false hits and wrong primitives, against exact arithmetic.";
        canvas.text(legend, (middle, bottom - 12.0), 12.0, Ink::Faint, Anchor::Middle)
    }
}

impl Drawing for Plot<'_> {
    fn size(&self) -> (u32, u32) {
        let (width, height) = self.extent();
        (width * self.scale, height * self.scale)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        let canvas = &Canvas::new(area, self.scale);
        canvas.clear()?;
        self.header(canvas)?;
        let columns = self.columns();
        for (i, panel) in (0..).zip(&self.panels) {
            let (column, row) = (i % columns, i / columns);
            let area = Area {
                left: f64::from(column * PANEL.0),
                top: f64::from(HEADER + row * PANEL.1),
                width: f64::from(PANEL.0),
                height: f64::from(PANEL.1),
            };
            panel.draw(canvas, area)?;
        }
        self.footer(canvas)
    }
}

fn panels(report: &Report) -> Vec<Panel> {
    let kinds = report.kinds().into_iter().map(|kind| ray_panel(report, kind));
    kinds.chain(std::iter::once(frame_panel(report))).collect()
}

fn ray_panel(report: &Report, kind: RayKind) -> Panel {
    let rows: Vec<&RayRow> = report.rays.iter().filter(|row| row.rays == kind).collect();
    let point = |row: &&RayRow| {
        let ours = row.engine == "raypack";
        Point {
            time: row.ns_per_ray,
            spread: (row.ns_low, row.ns_high),
            error: row.per_million.total,
            label: if ours { row.mode.into() } else { format!("Embree {}", row.mode) },
            ink: if ours { Ink::of_mode(row.mode) } else { Ink::of_rival(row.mode) },
            mark: if ours { Mark::Circle } else { Mark::Square },
            default: row.default,
            front: row.pareto,
        }
    };
    let points: Vec<Point> = rows.iter().map(point).collect();
    let (count, checked) = rows.first().map_or((0, 0), |row| (row.count as u64, row.errors.count));
    Panel {
        title: format!("{} rays", kind.name()),
        subtitle: format!("{} timed, {} checked", grouped(count), grouped(checked)),
        time_label: "ns per ray".into(),
        error_label: "errors per million rays".into(),
        time: Axis::linear(points.iter().map(|p| p.spread.1)),
        // A single error among the rays that were checked is the least that can be seen.
        error: ErrorAxis::new(points.iter().map(|p| p.error), 1e6 / checked.max(1) as f64),
        points,
        lines: Vec::new(),
    }
}

fn frame_panel(report: &Report) -> Panel {
    let point = |row: &FrameRow| Point {
        time: row.ms,
        spread: (row.ms_low, row.ms_high),
        error: row.error.rmse,
        label: format!("{} spp", row.samples),
        ink: Ink::of_mode(row.accuracy.name()),
        mark: Mark::Circle,
        default: row.default,
        front: row.pareto,
    };
    let mut points: Vec<Point> = report.frames.iter().map(point).collect();
    let of_mode = |mode: Accuracy| {
        let rows = report.frames.iter().enumerate().filter(move |(_, row)| row.accuracy == mode);
        let mut line: Vec<usize> = rows.map(|(i, _)| i).collect();
        line.sort_by_key(|&i| report.frames[i].samples);
        line
    };
    let lines: Vec<Vec<usize>> = Accuracy::ALL.into_iter().map(of_mode).collect();
    // Each number of samples is named once, at the default mode; each mode at the end of its line.
    for (point, row) in points.iter_mut().zip(&report.frames) {
        if row.accuracy != Accuracy::default() {
            point.label.clear();
        }
    }
    for (line, mode) in lines.iter().zip(Accuracy::ALL) {
        if let Some(&first) = line.first() {
            let samples = std::mem::take(&mut points[first].label);
            let parts = [mode.name(), &samples].into_iter().filter(|part| !part.is_empty());
            points[first].label = parts.collect::<Vec<_>>().join(", ");
        }
    }
    let h = &report.header;
    let r = &report.reference;
    Panel {
        title: "frames".into(),
        subtitle: format!(
            "{}, shadows, {}; reference: {}, {} spp",
            h.size,
            h.tuning.packet.rays(),
            r.accuracy,
            r.samples
        ),
        time_label: "ms per frame".into(),
        error_label: "RMSE of linear light, 0 to 1".into(),
        time: Axis::logarithmic(points.iter().flat_map(|p| [p.spread.0, p.spread.1])),
        error: ErrorAxis::new(points.iter().map(|p| p.error), f64::INFINITY),
        points,
        lines,
    }
}
