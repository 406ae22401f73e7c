//! One panel: axes, points, the Pareto front and labels.

use super::axis::{Axis, ErrorAxis, tick};
use super::canvas::{Anchor, Area, Canvas, Ink};
use super::labels::Labels;
use crate::study::plot::Drawn;
use plotters::backend::DrawingBackend;

const TICK_SIZE: f64 = 11.0;
const LABEL_SIZE: f64 = 12.0;
const MARK: f64 = 4.5;
const RING: f64 = 8.0;

/// A point's form.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// raypack.
    Circle,
    /// Its rival.
    Square,
}

/// A mode.
#[derive(Clone, Debug)]
pub struct Point {
    pub time: f64,
    /// The least and the greatest time.
    pub spread: (f64, f64),
    pub error: f64,
    /// Empty for none.
    pub label: String,
    pub ink: Ink,
    pub mark: Mark,
    pub default: bool,
    pub front: bool,
}

/// Points between two axes.
#[derive(Clone, Debug)]
pub struct Panel {
    pub title: String,
    pub subtitle: String,
    pub time_label: String,
    pub error_label: String,
    pub time: Axis,
    pub error: ErrorAxis,
    pub points: Vec<Point>,
    /// Points that belong together, by their numbers; with such lines the front is not drawn.
    pub lines: Vec<Vec<usize>>,
}

impl Panel {
    /// Draws it, with its margins, into an area.
    pub fn draw<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>, area: Area) -> Drawn {
        let inner = Area {
            left: area.left + 74.0,
            top: area.top + 46.0,
            width: area.width - 74.0 - 22.0,
            height: area.height - 46.0 - 54.0,
        };
        let middle = inner.left + inner.width / 2.0;
        canvas.text(&self.title, (middle, area.top + 16.0), 15.0, Ink::Text, Anchor::Middle)?;
        canvas.text(&self.subtitle, (middle, area.top + 34.0), TICK_SIZE, Ink::Faint, Anchor::Middle)?;
        self.axes(canvas, inner)?;
        for [from, to] in self.front(inner) {
            canvas.dashes(from, to, Ink::Faint)?;
        }
        for line in &self.lines {
            let places: Vec<(f64, f64)> = line.iter().map(|&i| self.place(inner, &self.points[i])).collect();
            if let (Some(&first), true) = (line.first(), places.len() > 1) {
                canvas.line(&places, 1.5, self.points[first].ink)?;
            }
        }
        self.marks(canvas, inner)
    }

    fn place(&self, inner: Area, point: &Point) -> (f64, f64) {
        (x(inner, self.time.place(point.time)), y(inner, self.error.place(point.error)))
    }

    fn axes<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>, inner: Area) -> Drawn {
        let (right, bottom) = (inner.left + inner.width, inner.top + inner.height);
        let band = self.error.zero_band() * inner.height;
        if band > 0.0 {
            canvas.fill(Area { top: bottom - band, height: band, ..inner }, Ink::Band)?;
        }
        for value in self.error.minor_ticks() {
            let y = y(inner, self.error.place(value));
            canvas.line(&[(inner.left - 3.0, y), (inner.left, y)], 1.0, Ink::Faint)?;
        }
        for value in self.error.ticks() {
            let y = y(inner, self.error.place(value));
            canvas.line(&[(inner.left, y), (right, y)], 1.0, Ink::Grid)?;
            canvas.line(&[(inner.left - 6.0, y), (inner.left, y)], 1.0, Ink::Faint)?;
            canvas.text(&tick(value), (inner.left - 9.0, y), TICK_SIZE, Ink::Text, Anchor::End)?;
        }
        for value in self.time.ticks() {
            let x = x(inner, self.time.place(value));
            canvas.line(&[(x, inner.top), (x, bottom)], 1.0, Ink::Grid)?;
            canvas.line(&[(x, bottom), (x, bottom + 5.0)], 1.0, Ink::Faint)?;
            canvas.text(&tick(value), (x, bottom + 15.0), TICK_SIZE, Ink::Text, Anchor::Middle)?;
        }
        let frame = [(inner.left, inner.top), (inner.left, bottom), (right, bottom)];
        canvas.line(&frame, 1.0, Ink::Faint)?;
        let middle = inner.left + inner.width / 2.0;
        canvas.text(&self.time_label, (middle, bottom + 34.0), LABEL_SIZE, Ink::Text, Anchor::Middle)?;
        let half = inner.top + inner.height / 2.0;
        canvas.upward(&self.error_label, (inner.left - 60.0, half), LABEL_SIZE, Ink::Text)
    }

    /// The front as steps: what any point on it beats lies above and to the right. None where lines say
    /// enough.
    fn front(&self, inner: Area) -> Vec<[(f64, f64); 2]> {
        let on_front = self.points.iter().filter(|p| p.front && self.lines.is_empty());
        let mut places: Vec<(f64, f64)> = on_front.map(|p| self.place(inner, p)).collect();
        places.sort_by(|a, b| a.0.total_cmp(&b.0));
        let step = |pair: &[(f64, f64)]| {
            let corner = (pair[1].0, pair[0].1);
            [[pair[0], corner], [corner, pair[1]]]
        };
        places.windows(2).flat_map(step).collect()
    }

    fn marks<B: DrawingBackend>(&self, canvas: &Canvas<'_, B>, inner: Area) -> Drawn {
        let places: Vec<(f64, f64)> = self.points.iter().map(|p| self.place(inner, p)).collect();
        for (point, &(px, py)) in self.points.iter().zip(&places) {
            let [low, high] = [point.spread.0, point.spread.1].map(|time| x(inner, self.time.place(time)));
            canvas.line(&[(low, py), (high, py)], 1.5, point.ink)?;
            match point.mark {
                Mark::Circle => canvas.disc((px, py), MARK, point.ink)?,
                Mark::Square => {
                    let side = 2.0 * MARK - 1.0;
                    let (left, top) = (px - side / 2.0, py - side / 2.0);
                    canvas.fill(Area { left, top, width: side, height: side }, point.ink)?;
                }
            }
            if point.default {
                canvas.ring((px, py), RING, point.ink)?;
            }
        }
        let mut labels = self.obstacles(inner, &places);
        for (point, &place) in self.points.iter().zip(&places).filter(|(point, _)| !point.label.is_empty()) {
            let placed = labels.place(&point.label, place);
            if let Some(end) = placed.leader {
                canvas.line(&[place, end], 1.0, point.ink)?;
                labels.avoid_line(place, end);
            }
            canvas.text(&point.label, placed.at, LABEL_SIZE, point.ink, placed.anchor)?;
        }
        Ok(())
    }

    /// What labels must not cover.
    fn obstacles(&self, inner: Area, places: &[(f64, f64)]) -> Labels {
        let mut labels = Labels::new(inner, LABEL_SIZE);
        for (point, &place) in self.points.iter().zip(places) {
            labels.avoid(place, if point.default { RING } else { MARK } + 2.0);
            let [low, high] = [point.spread.0, point.spread.1].map(|time| x(inner, self.time.place(time)));
            labels.avoid_line((low, place.1), (high, place.1));
        }
        for [from, to] in self.front(inner) {
            labels.avoid_line(from, to);
        }
        for line in &self.lines {
            line.windows(2).for_each(|pair| labels.avoid_line(places[pair[0]], places[pair[1]]));
        }
        labels
    }
}

fn x(inner: Area, place: f64) -> f64 {
    inner.left + place * inner.width
}

fn y(inner: Area, place: f64) -> f64 {
    inner.top + (1.0 - place) * inner.height
}
