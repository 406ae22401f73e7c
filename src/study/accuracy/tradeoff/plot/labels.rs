//! Labels beside points: none over another, over what is drawn or over the edge, as long as there is room.

use super::canvas::{Anchor, Area};

/// Width of a letter on average for a font's size; DejaVu Sans, the widest of the usual ones, has less.
const LETTER: f64 = 0.6;

/// Where a label stands.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// The anchor's point.
    pub at: (f64, f64),
    /// Which part of the text is there.
    pub anchor: Anchor,
    /// Where a line from the point ends, if the label stands so far off that it needs one.
    pub leader: Option<(f64, f64)>,
}

/// Places labels of points one after the other.
pub struct Labels {
    within: Area,
    size: f64,
    taken: Vec<Area>,
}

impl Labels {
    /// For labels of a font's size within an area.
    pub fn new(within: Area, size: f64) -> Self {
        Self { within, size, taken: Vec::new() }
    }

    /// Has labels keep clear of a point by `radius`.
    pub fn avoid(&mut self, (x, y): (f64, f64), radius: f64) {
        let side = 2.0 * radius;
        self.taken.push(Area { left: x - radius, top: y - radius, width: side, height: side });
    }

    /// Has labels keep clear of a line.
    pub fn avoid_line(&mut self, from: (f64, f64), to: (f64, f64)) {
        const STEP: f64 = 4.0;
        let steps = ((to.0 - from.0).hypot(to.1 - from.1) / STEP).ceil().max(1.0);
        for i in 0..=steps as u32 {
            let part = f64::from(i) / steps;
            self.avoid((from.0 + (to.0 - from.0) * part, from.1 + (to.1 - from.1) * part), STEP / 2.0);
        }
    }

    /// The place for a point's label that disturbs the least: as near as can be, first to the right.
    pub fn place(&mut self, text: &str, point: (f64, f64)) -> Placed {
        let width = text.chars().count() as f64 * self.size * LETTER;
        let height = self.size * 1.15;
        let mut best: Option<(f64, Placed, Area)> = None;
        for (number, placed) in places(point, height).into_iter().enumerate() {
            let left = match placed.anchor {
                Anchor::Start => placed.at.0,
                Anchor::Middle => placed.at.0 - width / 2.0,
                Anchor::End => placed.at.0 - width,
            };
            let area = Area { left, top: placed.at.1 - height / 2.0, width, height };
            let covered: f64 = self.taken.iter().map(|other| overlap(&area, other)).sum();
            let outside = width * height - overlap(&area, &self.within);
            // What is covered or cut off decides, then how near it is.
            let cost = (covered + 4.0 * outside) * 100.0 + number as f64;
            if best.as_ref().is_none_or(|(least, ..)| cost < *least) {
                best = Some((cost, placed, area));
            }
        }
        let (_, placed, area) = best.expect("there are places to choose from");
        self.taken.push(area);
        placed
    }
}

/// Places round a point, the better ones first.
fn places((x, y): (f64, f64), height: f64) -> Vec<Placed> {
    const GAP: f64 = 11.0;
    let place = |dx: f64, dy: f64, anchor| Placed { at: (x + dx, y + dy), anchor, leader: None };
    let near = GAP + height / 2.0;
    let mut all = vec![
        place(GAP, 0.0, Anchor::Start),
        place(-GAP, 0.0, Anchor::End),
        place(0.0, -near, Anchor::Middle),
        place(0.0, near, Anchor::Middle),
        place(GAP * 0.7, -near * 0.8, Anchor::Start),
        place(GAP * 0.7, near * 0.8, Anchor::Start),
        place(-GAP * 0.7, -near * 0.8, Anchor::End),
        place(-GAP * 0.7, near * 0.8, Anchor::End),
    ];
    // Farther off, above and below, with a line back.
    for level in 1..=4 {
        for side in [-1.0, 1.0] {
            let dy = side * (near + f64::from(level) * height * 0.7);
            let leader = Some((x, y + dy - side * height / 2.0));
            for (dx, anchor) in [(0.0, Anchor::Middle), (-8.0, Anchor::Start), (8.0, Anchor::End)] {
                all.push(Placed { leader, ..place(dx, dy, anchor) });
            }
        }
    }
    all
}

/// The area that two rectangles share.
fn overlap(a: &Area, b: &Area) -> f64 {
    let width = (a.left + a.width).min(b.left + b.width) - a.left.max(b.left);
    let height = (a.top + a.height).min(b.top + b.height) - a.top.max(b.top);
    width.max(0.0) * height.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const WITHIN: Area = Area { left: 0.0, top: 0.0, width: 300.0, height: 200.0 };

    fn labels(points: &[(f64, f64)]) -> Labels {
        let mut labels = Labels::new(WITHIN, 12.0);
        points.iter().for_each(|&point| labels.avoid(point, 5.0));
        labels
    }

    #[test]
    fn a_lonely_label_stands_to_the_right() {
        let placed = labels(&[(50.0, 50.0)]).place("exact", (50.0, 50.0));
        assert_eq!(placed, Placed { at: (61.0, 50.0), anchor: Anchor::Start, leader: None });
    }

    #[test]
    fn at_the_right_edge_it_stands_to_the_left() {
        assert_eq!(labels(&[(290.0, 50.0)]).place("watertight", (290.0, 50.0)).anchor, Anchor::End);
    }

    #[test]
    fn a_line_is_kept_clear_of() {
        let mut labels = labels(&[(50.0, 50.0)]);
        labels.avoid_line((10.0, 50.0), (120.0, 50.0));
        let placed = labels.place("exact", (50.0, 50.0));
        assert_eq!((placed.anchor, placed.leader), (Anchor::Middle, None));
    }

    #[test]
    fn crowded_labels_keep_apart() {
        let points = [(100.0, 100.0), (112.0, 100.0), (124.0, 100.0), (136.0, 101.0), (104.0, 108.0)];
        let mut labels = labels(&points);
        let placed = points.map(|point| labels.place("watertight", point));
        let (marks, texts) = labels.taken.split_at(points.len());
        for (i, text) in texts.iter().enumerate() {
            assert!(marks.iter().chain(&texts[..i]).all(|other| overlap(text, other) == 0.0), "{texts:?}");
        }
        assert!(placed.iter().any(|placed| placed.leader.is_some()));
    }
}
