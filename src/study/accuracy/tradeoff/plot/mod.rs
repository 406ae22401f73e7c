//! The Pareto plot: time to the right, error upward, a point a mode.
//!
//! A panel for each kind of ray (nanoseconds a ray against errors per million rays, raypack's modes and
//! Embree's) and one for frames (milliseconds against the picture's RMSE, a line a mode, a point a number of
//! samples). Errors stand on a logarithmic axis with a place of its own for none at all.
//!
//! An SVG names the generic family "sans-serif" and is laid out without any font; a PNG is drawn with DejaVu
//! Sans, which is compiled in. So both work on a machine without fonts.

mod axis;
mod canvas;
mod labels;
mod panel;

pub use canvas::register_font;

use super::report::{FrameRow, RayRow, Report};
use crate::error::{Error, Result};
use crate::files::{write_text, write_whole};
use crate::geometry::Accuracy;
use crate::study::rays::RayKind;
use crate::study::text::grouped;
use axis::{Axis, ErrorAxis};
use canvas::{Anchor, Area, Canvas, Failure, Ink};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use panel::{Mark, Panel, Point};
use plotters::backend::{BitMapBackend, SVGBackend};
use plotters::drawing::IntoDrawingArea;
use std::io;
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

/// The kinds of plot that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// Scalable, with text as text.
    Svg,
    /// Pixels.
    Png,
}

impl Format {
    /// The format that a path's ending names, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => Err(Error::UnknownFormat { path: path.into(), expected: "a plot is a .svg or .png file" }),
        }
    }
}

/// Draws a report and writes the plot.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
pub fn write(path: &Path, report: &Report) -> Result<()> {
    let panels = panels(report);
    let size = size(panels.len() as u32);
    let failed = |failure: Failure| Error::Write { path: path.into(), source: io::Error::other(failure.0) };
    match Format::of(path)? {
        Format::Svg => {
            let mut text = String::new();
            let area = SVGBackend::with_string(&mut text, size).into_drawing_area();
            draw(&Canvas::new(&area, 1), size, report, &panels).map_err(failed)?;
            drop(area);
            write_text(path, &text)
        }
        Format::Png => {
            register_font();
            let (width, height) = (size.0 * PNG_SCALE, size.1 * PNG_SCALE);
            let mut bytes = vec![0; (width * height * 3) as usize];
            let area = BitMapBackend::with_buffer(&mut bytes, (width, height)).into_drawing_area();
            draw(&Canvas::new(&area, PNG_SCALE), size, report, &panels).map_err(failed)?;
            drop(area);
            write_whole(path, |out| {
                let png = PngEncoder::new(out);
                png.write_image(&bytes, width, height, ExtendedColorType::Rgb8).map_err(io::Error::other)
            })
        }
    }
}

fn size(panels: u32) -> (u32, u32) {
    // The header's lines want the width of two panels.
    let columns = panels.clamp(2, COLUMNS);
    (columns * PANEL.0, HEADER + panels.div_ceil(columns) * PANEL.1 + FOOTER)
}

fn draw(
    canvas: &Canvas<'_, impl plotters::backend::DrawingBackend>,
    size: (u32, u32),
    report: &Report,
    panels: &[Panel],
) -> std::result::Result<(), Failure> {
    canvas.clear()?;
    let h = &report.header;
    let middle = f64::from(size.0) / 2.0;
    let name = Path::new(&h.model).file_name().map_or(h.model.clone(), |n| n.to_string_lossy().into_owned());
    canvas.text(&format!("What accuracy costs: {name}"), (middle, 24.0), 20.0, Ink::Text, Anchor::Middle)?;
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
    let columns = size.0 / PANEL.0;
    for (i, panel) in (0..).zip(panels) {
        let (column, row) = (i % columns, i / columns);
        let area = Area {
            left: f64::from(column * PANEL.0),
            top: f64::from(HEADER + row * PANEL.1),
            width: f64::from(PANEL.0),
            height: f64::from(PANEL.1),
        };
        panel.draw(canvas, area)?;
    }
    let bottom = f64::from(size.1);
    let legend = "Lower left is better. Ring: raypack's default. Dashes: Pareto front. \
                  Bars: quickest to slowest round.";
    canvas.text(legend, (middle, bottom - 28.0), 12.0, Ink::Faint, Anchor::Middle)?;
    let legend = "Errors: missed and false hits and wrong primitives, against exact arithmetic.";
    canvas.text(legend, (middle, bottom - 12.0), 12.0, Ink::Faint, Anchor::Middle)
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
