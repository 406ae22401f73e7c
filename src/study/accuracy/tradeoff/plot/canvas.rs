//! Lines, marks and text in units of the layout, on any of plotters' backends.

use crate::study::plot::{Drawn, FAMILY};
use plotters::backend::DrawingBackend;
use plotters::coord::Shift;
use plotters::drawing::DrawingArea;
use plotters::element::{Circle, PathElement, Rectangle, Text};
use plotters::style::text_anchor::{HPos, Pos, VPos};
use plotters::style::{Color, FontTransform, IntoFont, IntoTextStyle, RGBColor};

/// A rectangle of the layout.
#[derive(Clone, Copy, Debug)]
pub struct Area {
    pub left: f64,
    pub top: f64,
    pub width: f64,
    pub height: f64,
}

/// Where text stands relative to its point; vertically its middle is there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Anchor {
    Start,
    Middle,
    End,
}

/// Colours: of the modes those of Okabe and Ito that people with any colour vision tell apart on white.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ink {
    Text,
    Faint,
    Grid,
    Band,
    Fast,
    Watertight,
    Exact,
    RivalFast,
    RivalRobust,
}

impl Ink {
    /// The colour of raypack's mode of that name.
    pub fn of_mode(mode: &str) -> Self {
        match mode {
            "fast" => Self::Fast,
            "watertight" => Self::Watertight,
            _ => Self::Exact,
        }
    }

    /// The colour of Embree's mode of that name.
    pub fn of_rival(mode: &str) -> Self {
        if mode == "fast" { Self::RivalFast } else { Self::RivalRobust }
    }

    const fn rgb(self) -> RGBColor {
        match self {
            Self::Text => RGBColor(30, 30, 30),
            Self::Faint => RGBColor(95, 95, 95),
            Self::Grid => RGBColor(222, 222, 222),
            Self::Band => RGBColor(240, 245, 240),
            Self::Fast => RGBColor(213, 94, 0),
            Self::Watertight => RGBColor(0, 114, 178),
            Self::Exact => RGBColor(0, 135, 98),
            Self::RivalFast => RGBColor(160, 95, 165),
            Self::RivalRobust => RGBColor(85, 50, 100),
        }
    }
}

/// What is drawn on. Coordinates are units of the layout, from the top left.
pub struct Canvas<'a, B: DrawingBackend> {
    area: &'a DrawingArea<B, Shift>,
    scale: f64,
}

impl<'a, B: DrawingBackend> Canvas<'a, B> {
    /// A canvas of `scale` pixels a unit.
    pub fn new(area: &'a DrawingArea<B, Shift>, scale: u32) -> Self {
        Self { area, scale: f64::from(scale) }
    }

    /// Makes all of it white.
    pub fn clear(&self) -> Drawn {
        Ok(self.area.fill(&plotters::style::WHITE)?)
    }

    fn pixel(&self, (x, y): (f64, f64)) -> (i32, i32) {
        ((x * self.scale).round() as i32, (y * self.scale).round() as i32)
    }

    fn length(&self, units: f64) -> u32 {
        (units * self.scale).round().max(1.0) as u32
    }

    /// A line through points.
    pub fn line(&self, points: &[(f64, f64)], width: f64, ink: Ink) -> Drawn {
        let pixels: Vec<(i32, i32)> = points.iter().map(|&p| self.pixel(p)).collect();
        let style = ink.rgb().stroke_width(self.length(width));
        Ok(self.area.draw(&PathElement::new(pixels, style))?)
    }

    /// A dashed straight line.
    pub fn dashes(&self, from: (f64, f64), to: (f64, f64), ink: Ink) -> Drawn {
        const DASH: f64 = 5.0;
        let (dx, dy) = (to.0 - from.0, to.1 - from.1);
        let length = dx.hypot(dy);
        let at = |d: f64| (from.0 + dx * d / length, from.1 + dy * d / length);
        let mut start = 0.0;
        while start < length {
            self.line(&[at(start), at((start + DASH).min(length))], 1.0, ink)?;
            start += 2.0 * DASH;
        }
        Ok(())
    }

    /// A filled rectangle.
    pub fn fill(&self, area: Area, ink: Ink) -> Drawn {
        let corners = [(area.left, area.top), (area.left + area.width, area.top + area.height)];
        let rectangle = Rectangle::new(corners.map(|p| self.pixel(p)), ink.rgb().filled());
        Ok(self.area.draw(&rectangle)?)
    }

    /// A filled circle.
    pub fn disc(&self, center: (f64, f64), radius: f64, ink: Ink) -> Drawn {
        let circle = Circle::new(self.pixel(center), self.length(radius), ink.rgb().filled());
        Ok(self.area.draw(&circle)?)
    }

    /// A circle's line.
    pub fn ring(&self, center: (f64, f64), radius: f64, ink: Ink) -> Drawn {
        let style = ink.rgb().stroke_width(self.length(1.5));
        let circle = Circle::new(self.pixel(center), self.length(radius), style);
        Ok(self.area.draw(&circle)?)
    }

    /// A line of text, `size` units high.
    pub fn text(&self, text: &str, at: (f64, f64), size: f64, ink: Ink, anchor: Anchor) -> Drawn {
        self.write(text, at, size, ink, anchor, FontTransform::None)
    }

    /// A line of text that goes up, about its middle.
    pub fn upward(&self, text: &str, at: (f64, f64), size: f64, ink: Ink) -> Drawn {
        self.write(text, at, size, ink, Anchor::Middle, FontTransform::Rotate270)
    }

    fn write(
        &self,
        text: &str,
        at: (f64, f64),
        size: f64,
        ink: Ink,
        anchor: Anchor,
        turned: FontTransform,
    ) -> Drawn {
        let along = match anchor {
            Anchor::Start => HPos::Left,
            Anchor::Middle => HPos::Center,
            Anchor::End => HPos::Right,
        };
        let font = (FAMILY, size * self.scale).into_font().transform(turned).color(&ink.rgb());
        let style = font.into_text_style(self.area).pos(Pos::new(along, VPos::Center));
        let text = Text::new(text.to_owned(), self.pixel(at), style);
        Ok(self.area.draw(&text)?)
    }
}
