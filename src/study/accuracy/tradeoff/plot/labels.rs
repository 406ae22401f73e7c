//! Labels beside points, none over another, over a point or over the edge.

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
}

/// Places labels of points one after the other.
pub struct Labels {
    within: Area,
    size: f64,
    taken: Vec<Area>,
}

impl Labels {
    /// For labels of a font's size within an area, keeping clear of `marks` by `radius`.
    pub fn new(within: Area, size: f64, marks: &[(f64, f64)], radius: f64) -> Self {
        let square = |&(x, y): &(f64, f64)| Area {
            left: x - radius,
            top: y - radius,
            width: 2.0 * radius,
            height: 2.0 * radius,
        };
        Self { within, size, taken: marks.iter().map(square).collect() }
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
    const GAP: f64 = 10.0;
    let place = |dx: f64, dy: f64, anchor| Placed { at: (x + dx, y + dy), anchor };
    let mut all = vec![
        place(GAP, 0.0, Anchor::Start),
        place(-GAP, 0.0, Anchor::End),
        place(0.0, -GAP - height / 2.0, Anchor::Middle),
        place(0.0, GAP + height / 2.0, Anchor::Middle),
    ];
    for step in 1..=4 {
        let dy = f64::from(step) * height * 0.6 + 2.0;
        for dy in [-dy, dy] {
            all.push(place(GAP * 0.7, dy, Anchor::Start));
            all.push(place(-GAP * 0.7, dy, Anchor::End));
            all.push(place(0.0, dy - (GAP * 0.5).copysign(-dy), Anchor::Middle));
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

    #[test]
    fn a_lonely_label_stands_to_the_right() {
        let placed = Labels::new(WITHIN, 12.0, &[(50.0, 50.0)], 5.0).place("exact", (50.0, 50.0));
        assert_eq!(placed, Placed { at: (60.0, 50.0), anchor: Anchor::Start });
    }

    #[test]
    fn at_the_right_edge_it_stands_to_the_left() {
        let placed = Labels::new(WITHIN, 12.0, &[(290.0, 50.0)], 5.0).place("watertight", (290.0, 50.0));
        assert_eq!(placed.anchor, Anchor::End);
    }

    #[test]
    fn crowded_labels_keep_apart() {
        let points = [(100.0, 100.0), (112.0, 100.0), (124.0, 100.0), (136.0, 101.0), (104.0, 108.0)];
        let mut labels = Labels::new(WITHIN, 12.0, &points, 5.0);
        for point in points {
            labels.place("watertight", point);
        }
        let (marks, texts) = labels.taken.split_at(points.len());
        for (i, text) in texts.iter().enumerate() {
            assert!(marks.iter().chain(&texts[..i]).all(|other| overlap(text, other) == 0.0), "{texts:?}");
        }
    }
}
