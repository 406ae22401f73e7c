//! Plots as files: SVG or PNG, as the file's ending says.
//!
//! An SVG names the generic family "sans-serif"; a PNG is drawn with DejaVu Sans, which is compiled in, and by
//! which labels are measured too. So both work on a machine without fonts.

use crate::error::{Error, Result};
use crate::files::{write_text, write_whole};
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use plotters::backend::{BitMapBackend, DrawingBackend, SVGBackend};
use plotters::coord::Shift;
use plotters::drawing::{DrawingArea, DrawingAreaErrorKind, IntoDrawingArea};
use plotters::style::{FontStyle, register_font as register};
use std::io;
use std::path::Path;
use std::sync::Once;

/// The family of all text.
pub const FAMILY: &str = "sans-serif";

/// Gives plotters DejaVu Sans for [`FAMILY`]: without a font it draws no text into bitmaps, and measures none.
/// [`write`](write()) does so by itself; other users of plotters in a process have need of it too.
pub fn register_font() {
    static ONCE: Once = Once::new();
    ONCE.call_once(|| {
        let known = register(FAMILY, FontStyle::Normal, dejavu::sans::regular());
        assert!(known.is_ok(), "DejaVu Sans is a font");
    });
}

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

/// Why something could not be drawn.
#[derive(Debug)]
pub struct Failure(String);

impl<E: std::error::Error + Send + Sync> From<DrawingAreaErrorKind<E>> for Failure {
    fn from(error: DrawingAreaErrorKind<E>) -> Self {
        Self(error.to_string())
    }
}

/// What drawing gives.
pub type Drawn = std::result::Result<(), Failure>;

/// Something that can be drawn on any of plotters' backends.
pub trait Drawing {
    /// Width and height in pixels.
    fn size(&self) -> (u32, u32);

    /// Draws all of it on an area of that size.
    ///
    /// # Errors
    /// The backend's.
    fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn;
}

/// Draws and writes a plot: .svg or .png.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
pub fn write(path: &Path, drawing: &impl Drawing) -> Result<()> {
    let failed = |failure: Failure| Error::Write { path: path.into(), source: io::Error::other(failure.0) };
    let format = Format::of(path)?;
    register_font();
    let (width, height) = drawing.size();
    match format {
        Format::Svg => {
            let mut text = String::new();
            let area = SVGBackend::with_string(&mut text, (width, height)).into_drawing_area();
            drawing.draw(&area).map_err(failed)?;
            // The text is whole once the backend is gone.
            drop(area);
            write_text(path, &text)
        }
        Format::Png => {
            let mut bytes = vec![0; width as usize * height as usize * 3];
            let area = BitMapBackend::with_buffer(&mut bytes, (width, height)).into_drawing_area();
            drawing.draw(&area).map_err(failed)?;
            drop(area);
            write_whole(path, |out| {
                let png = PngEncoder::new(out);
                png.write_image(&bytes, width, height, ExtendedColorType::Rgb8).map_err(io::Error::other)
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use plotters::element::Text;
    use plotters::style::WHITE;

    /// A word on white.
    struct Word;

    impl Drawing for Word {
        fn size(&self) -> (u32, u32) {
            (80, 40)
        }

        fn draw<B: DrawingBackend>(&self, area: &DrawingArea<B, Shift>) -> Drawn {
            area.fill(&WHITE)?;
            Ok(area.draw(&Text::new("word", (10, 10), (FAMILY, 20)))?)
        }
    }

    #[test]
    fn a_drawing_is_the_same_size_in_both_formats_and_has_its_text() {
        let folder = tempfile::tempdir().expect("a folder");
        let [svg, png] = ["a.svg", "a.PNG"].map(|name| folder.path().join(name));
        write(&svg, &Word).expect("written");
        let text = std::fs::read_to_string(svg).expect("text");
        assert!(text.starts_with("<svg width=\"80\" height=\"40\""), "{text}");
        assert!(text.contains("word") && text.trim_end().ends_with("</svg>"), "{text}");

        write(&png, &Word).expect("written");
        let bytes = std::fs::read(png).expect("bytes");
        let picture = image::load_from_memory(&bytes).expect("a picture").to_rgb8();
        assert_eq!(picture.dimensions(), (80, 40));
        assert_eq!(picture.get_pixel(0, 0).0, [255; 3]);
        assert!(picture.pixels().any(|pixel| pixel.0[0] < 100), "the word is drawn");
    }

    #[test]
    fn an_unknown_ending_leaves_nothing() {
        let folder = tempfile::tempdir().expect("a folder");
        let message = write(&folder.path().join("a.pdf"), &Word).expect_err("unknown").to_string();
        assert!(message.contains("a.pdf: unknown kind of file"), "{message}");
        assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
    }
}
