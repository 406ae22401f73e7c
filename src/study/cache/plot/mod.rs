//! Flights through caches: two panels for each budget and pass. On the left are rays a second by frame, a line for
//! each cache; on the right is what each read beside the least that any policy could have read, and its hits. The
//! names there say which line is whose.

mod panels;

use super::report::{Report, Row};
use super::{FrameRow, Shape};
use crate::cache::policy::Replacement;
use crate::error::Result;
use crate::study::plot::{self, Drawing, Drawn, FAMILY};
use crate::study::text::grouped;
use plotters::coord::Shift;
use plotters::prelude::*;
use std::path::Path;

/// Width of a panel, and the height of one with few caches.
const PANEL: (u32, u32) = (620, 320);
/// Height of the lines above all.
const HEADER: u32 = 84;
/// Height of a cache on the right, and of what else is there.
const BAR: u32 = 17;
const AROUND_BARS: u32 = 80;

/// Draws a report and writes the plot: .svg or .png.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
pub fn write(path: &Path, report: &Report) -> Result<()> {
    plot::write(path, &Plot { report, groups: groups(report) })
}

/// The caches of one budget, kind and pass.
struct Group<'a> {
    title: String,
    rows: Vec<&'a Row>,
}

fn groups(report: &Report) -> Vec<Group<'_>> {
    let shapes: Vec<Shape> = report.rows.iter().filter_map(|row| row.shape).collect();
    let differences = Shape::differences(&shapes);
    let mut groups: Vec<Group<'_>> = Vec::new();
    for row in report.rows.iter().filter(|row| row.policy.is_some()) {
        let pass = if row.warm { "warm" } else { "cold" };
        let differences = row.shape.map(|shape| shape.words(&differences)).unwrap_or_default();
        let title = format!("{:.0} % in memory, {pass}{differences}", row.budget * 100.0);
        match groups.iter_mut().find(|group| group.title == title) {
            Some(group) => group.rows.push(row),
            None => groups.push(Group { title, rows: vec![row] }),
        }
    }
    groups
}

struct Plot<'a> {
    report: &'a Report,
    groups: Vec<Group<'a>>,
}

impl Plot<'_> {
    /// The height of a group's panels.
    fn height(&self) -> u32 {
        let bars = self.groups.iter().map(|group| group.rows.len()).max().unwrap_or(0) as u32;
        PANEL.1.max(AROUND_BARS + BAR * bars)
    }

    fn lines(&self) -> [String; 3] {
        let Report { scene, triangles, size, threads, isa, processor, raypack, build, date, direct, .. } =
            self.report;
        let name = Path::new(scene).file_name().map_or(scene.as_str().into(), |name| name.to_string_lossy());
        let reads = if *direct { "reads from the disk" } else { "reads through the system's memory" };
        let rays = if self.report.shadows { "camera and shadow rays" } else { "camera rays" };
        [
            format!("A camera path through caches: {name}, {} triangles, {size}", grouped(*triangles)),
            format!(
                "{rays}, {threads} threads, {isa}, {processor}, {reads}, raypack {raypack} ({build} build), {date}"
            ),
            "left: dashed: resident; thin: synchronous; thicker: asynchronous, more so with blocks that come before they \
             are needed; right: blocks read, and | the least that any policy could have read (Belady's MIN)"
                .into(),
        ]
    }
}

impl Drawing for Plot<'_> {
    fn size(&self) -> (u32, u32) {
        (2 * PANEL.0, HEADER + self.height() * self.groups.len().max(1) as u32)
    }

    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
        area.fill(&WHITE)?;
        let (header, panels) = area.split_vertically(HEADER);
        for (i, (line, size)) in self.lines().into_iter().zip([18, 12, 12]).enumerate() {
            header.draw(&Text::new(line, (14, 8 + 24 * i as i32), (FAMILY, size)))?;
        }
        let cells = panels.split_evenly((self.groups.len().max(1), 2));
        let resident = self.report.rows.first();
        for (group, cells) in self.groups.iter().zip(cells.chunks(2)) {
            panels::rates(&cells[0], group, resident)?;
            panels::reads(&cells[1], group)?;
        }
        Ok(())
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

/// A frame's million rays a second.
fn rate(frame: &FrameRow) -> f64 {
    frame.rays as f64 / frame.seconds * 1e-6
}
