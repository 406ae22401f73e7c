//! The two kinds of panel.

use super::super::report::Row;
use super::{Group, color, rate};
use crate::cache::Loading;
use crate::cache::policy::Replacement;
use crate::study::plot::{Drawn, FAMILY};
use crate::study::text::grouped;
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};

/// Labels of frames at most.
const FRAME_LABELS: usize = 16;
/// Room for the names of caches, in pixels.
const NAMES: u32 = 120;
/// How much wider than the longest bar a panel is, for figures to stand behind it.
const FIGURES: f64 = 1.75;

/// A row's line: thicker where somebody else reads, and more so where blocks come before they are needed.
fn style(row: &Row) -> Option<ShapeStyle> {
    let width = match row.loading {
        Some(Loading::Asynchronous { .. }) => 3 + 2 * row.prefetch() as u32,
        _ => 1,
    };
    Some(color(row.policy?).stroke_width(width))
}

/// Frames, counted from 0 as in the tables, and their rates.
fn points(row: &Row) -> impl Iterator<Item = (i32, f64)> + Clone {
    (0..).zip(row.frames.iter().map(rate))
}

/// Million rays a second by frame.
pub fn rates<B: DrawingBackend>(
    area: &DrawingArea<B, Shift>,
    group: &Group<'_>,
    resident: Option<&Row>,
) -> Drawn {
    let frames = group.rows.iter().map(|row| row.frames.len()).max().unwrap_or(1);
    let all = group.rows.iter().copied().chain(resident);
    let top = all.flat_map(points).fold(0.0, |top: f64, (_, rate)| top.max(rate)) * 1.08;
    // A single frame has a place for a second one beside it: an axis has to have a length.
    let last = (frames as i32 - 1).max(1);
    let mut chart = ChartBuilder::on(area)
        .caption(&group.title, (FAMILY, 15))
        .margin(8)
        .margin_right(20)
        .x_label_area_size(34)
        .y_label_area_size(52)
        .build_cartesian_2d(0..last, 0.0..top.max(1e-3))?;
    chart
        .configure_mesh()
        .light_line_style(TRANSPARENT)
        .x_desc("frame")
        .y_desc("Mrays/s")
        .x_labels(FRAME_LABELS)
        .x_label_formatter(&|frame| if *frame < frames as i32 { frame.to_string() } else { String::new() })
        .label_style((FAMILY, 12))
        .draw()?;
    if let Some(row) = resident {
        chart.draw_series(DashedLineSeries::new(points(row), 6, 4, BLACK.mix(0.6).into()))?;
    }
    for row in &group.rows {
        let Some(style) = style(row) else { continue };
        chart.draw_series(LineSeries::new(points(row), style))?;
        chart.draw_series(points(row).map(|point| Circle::new(point, 2, style.filled())))?;
    }
    Ok(())
}

/// What each cache read, the least that any policy could have read, and the share of uses that hit.
pub fn reads<B: DrawingBackend>(area: &DrawingArea<B, Shift>, group: &Group<'_>) -> Drawn {
    let count = group.rows.len() as f64;
    let most = group.rows.iter().map(|row| row.loads.max(row.minimum)).max().unwrap_or(0).max(1) as f64;
    let mut chart = ChartBuilder::on(area)
        .caption("blocks read", (FAMILY, 15))
        .margin(8)
        .x_label_area_size(34)
        .y_label_area_size(NAMES)
        .build_cartesian_2d(0.0..most * FIGURES, count..0.0)?;
    let label = |x: &f64| if *x <= most * 1.01 { grouped(*x as u64) } else { String::new() };
    chart
        .configure_mesh()
        .disable_y_mesh()
        .light_line_style(TRANSPARENT)
        .y_labels(0)
        .x_labels(8)
        .x_label_formatter(&label)
        .label_style((FAMILY, 12))
        .draw()?;
    let text = |hpos| (FAMILY, 12).into_text_style(area).pos(Pos::new(hpos, VPos::Center));
    for (at, row) in group.rows.iter().enumerate() {
        let Some(style) = style(row) else { continue };
        let (top, middle, bottom) = (at as f64 + 0.18, at as f64 + 0.5, at as f64 + 0.82);
        let (loads, least) = (row.loads as f64, row.minimum as f64);
        let bar = Rectangle::new([(0.0, top), (loads, bottom)], style.color.mix(0.55).filled());
        chart.draw_series([bar])?;
        let mark = PathElement::new([(least, top - 0.1), (least, bottom + 0.1)], BLACK.stroke_width(2));
        chart.draw_series([mark])?;
        // The name, with its line, stands left of the axis.
        let name = EmptyElement::at((0.0, middle))
            + Text::new(name(row), (-30, 0), text(HPos::Right))
            + PathElement::new([(-26, 0), (-6, 0)], style);
        chart.draw_series([name])?;
        let figures = format!(
            "{}, least {}, {:.1} % hits",
            grouped(row.loads),
            grouped(row.minimum),
            row.hit_ratio * 100.0
        );
        let behind =
            EmptyElement::at((loads.max(least), middle)) + Text::new(figures, (7, 0), text(HPos::Left));
        chart.draw_series([behind])?;
    }
    Ok(())
}

/// `sieve async`.
fn name(row: &Row) -> String {
    let loading = row.loading.map_or("", |loading| loading.name(row.prefetch()));
    format!("{} {loading}", row.policy.map_or("", Replacement::name))
}
