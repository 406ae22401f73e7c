//! What a picture is to be, and how the machine is to make it.

use crate::error::{Error, Result};
use crate::traverse::Kernel;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// The longest side of a picture in pixels.
const MAX_SIDE: u32 = 32768;

/// The most pixels of a picture: 3 GiB of colour.
const MAX_PIXELS: u64 = 1 << 28;

/// The longest side of a tile in pixels.
const MAX_TILE: u32 = 1024;

/// The most tiles of a picture. Each costs some 100 bytes, so tiles of a few pixels only make
/// sense for small pictures.
const MAX_TILES: u64 = 1 << 24;

/// The most threads that make sense.
const MAX_THREADS: usize = 1024;

/// The most samples per pixel.
const MAX_SAMPLES: u32 = 65536;

/// A picture's width and height in pixels; written `WxH`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
pub struct Size {
    /// Pixels from left to right.
    pub width: u32,
    /// Pixels from top to bottom.
    pub height: u32,
}

impl Size {
    /// A size, checked.
    ///
    /// # Errors
    /// A side is 0 or longer than 32768, or there are more than 2^28 pixels.
    pub fn new(width: u32, height: u32) -> Result<Self> {
        let size = Self { width, height };
        let wrong = |what: String| Err(Error::option("--size", format!("{size} {what}")));
        if width == 0 || height == 0 {
            wrong("has no pixels; give at least 1x1".into())
        } else if width > MAX_SIDE || height > MAX_SIDE {
            wrong(format!("is too large; a side may have {MAX_SIDE} pixels"))
        } else if size.pixels() > MAX_PIXELS {
            wrong(format!("is too large; a picture may have {MAX_PIXELS} pixels"))
        } else {
            Ok(size)
        }
    }

    /// Width times height.
    pub const fn pixels(self) -> u64 {
        self.width as u64 * self.height as u64
    }

    /// Width divided by height.
    pub fn aspect(self) -> f32 {
        self.width as f32 / self.height as f32
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

impl FromStr for Size {
    type Err = Error;

    fn from_str(size: &str) -> Result<Self> {
        let wrong = || Error::option("--size", format!("\"{size}\" is not WIDTHxHEIGHT, such as 1280x720"));
        let (width, height) = size.split_once(['x', 'X']).ok_or_else(wrong)?;
        let side = |text: &str| {
            let text = text.trim();
            if text.is_empty() || !text.bytes().all(|b| b.is_ascii_digit()) {
                return Err(wrong());
            }
            text.parse().map_err(|_| {
                Error::option("--size", format!("{size} is too large; a side may have {MAX_SIDE} pixels"))
            })
        };
        Self::new(side(width)?, side(height)?)
    }
}

/// How the machine makes a picture: changes how long it takes, never a bit of the picture.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Tuning {
    /// Rays that are traced together: 1, 4, 8, 16, 64, 256, 1024 or 4096. 64 are a stream, each ray alone, 4096 are lists
    /// of rays. With 256, the squares of a picture go together where that is quicker, and by packets of 16 or 8
    /// elsewhere, found out while rendering; with 1024, so do four of them.
    #[serde(with = "packet_width")]
    pub packet: Kernel,
    /// Side of a tile in pixels, 1 to 1024. Smaller tiles share the work more evenly, larger ones
    /// cost less bookkeeping; 16 to 64 are hardly different.
    pub tile: u32,
    /// Worker threads; 0 takes one for each logical processor that the process may use.
    pub threads: usize,
    /// Whether each worker stays on one processor. Steadies timings on an idle machine and slows
    /// down on a busy one.
    pub pin: bool,
}

impl Default for Tuning {
    fn default() -> Self {
        Self { packet: Kernel::WideTile, tile: 32, threads: 0, pin: false }
    }
}

impl Tuning {
    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first key that does not.
    pub fn check(&self) -> Result<()> {
        if !(1..=MAX_TILE).contains(&self.tile) {
            let message = format!("{} is not a number of pixels from 1 to {MAX_TILE}", self.tile);
            return Err(Error::option("render.tile", message));
        }
        if self.threads > MAX_THREADS {
            let message = format!("{} are too many; give at most {MAX_THREADS}, or 0 for all", self.threads);
            return Err(Error::option("render.threads", message));
        }
        Ok(())
    }

    /// The number of workers: `threads`, or what the machine offers for 0.
    pub fn worker_count(&self) -> usize {
        match self.threads {
            0 => std::thread::available_parallelism().map_or(1, |n| n.get().min(MAX_THREADS)),
            threads => threads,
        }
    }
}

/// A kernel as the number of rays that it traces together.
mod packet_width {
    use crate::traverse::Kernel;
    use serde::de::{Deserialize, Deserializer, Error};
    use serde::ser::Serializer;

    pub fn serialize<S: Serializer>(kernel: &Kernel, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u64(kernel.width() as u64)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Kernel, D::Error> {
        let width = i64::deserialize(deserializer)?;
        usize::try_from(width).ok().and_then(Kernel::of_width).ok_or_else(|| {
            D::Error::custom(format!("packet = {width} is not one of 1, 4, 8, 16, 64, 256, 1024, 4096"))
        })
    }
}

/// Pictures wanted beside the colours. They show each pixel's first sample, unfiltered.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Aovs {
    /// Distance from the eye.
    pub depth: bool,
    /// Unit geometric normal, on the side of the eye.
    pub normal: bool,
}

/// All that a [`Renderer`](super::Renderer) needs to know beside the scene.
#[derive(Clone, Debug, PartialEq)]
pub struct RenderSettings {
    /// The picture's size.
    pub size: Size,
    /// Samples per pixel, averaged with equal weights; one goes through the pixel's middle.
    pub samples: u32,
    /// Whether the key light casts shadows.
    pub shadows: bool,
    /// Pictures beside the colours.
    pub aovs: Aovs,
    /// How the machine goes about it.
    pub tuning: Tuning,
}

impl RenderSettings {
    /// One sample per pixel with shadows, default tuning and no pictures beside the colours.
    pub fn new(size: Size) -> Self {
        Self { size, samples: 1, shadows: true, aovs: Aovs::default(), tuning: Tuning::default() }
    }

    /// Bytes of a frame while it is rendered, put together and written.
    pub fn frame_bytes(&self) -> usize {
        let floats = 3 + usize::from(self.aovs.depth) + 3 * usize::from(self.aovs.normal);
        // Tile by tile, and put together; and the bytes of one picture that is written.
        self.size.pixels() as usize * (2 * floats * size_of::<f32>() + 4)
    }

    /// Checks that every value makes sense.
    ///
    /// # Errors
    /// [`Error::Option`] naming the first that does not.
    pub fn check(&self) -> Result<()> {
        let size = Size::new(self.size.width, self.size.height)?;
        if !(1..=MAX_SAMPLES).contains(&self.samples) {
            let message = format!("{} is not a number from 1 to {MAX_SAMPLES}", self.samples);
            return Err(Error::option("--samples", message));
        }
        self.tuning.check()?;
        let tile = self.tuning.tile;
        let tiles = u64::from(size.width.div_ceil(tile)) * u64::from(size.height.div_ceil(tile));
        if tiles > MAX_TILES {
            let message =
                format!("{tile} would make {tiles} tiles of a picture of {size}; give larger tiles");
            return Err(Error::option("render.tile", message));
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sizes_are_read_and_written_alike() {
        let size: Size = "1280x720".parse().expect("a size");
        assert_eq!((size.width, size.height), (1280, 720));
        assert_eq!(size.to_string(), "1280x720");
    }

    #[test]
    fn absurd_sizes_are_refused_in_one_line() {
        for text in
            ["", "x", "0x5", "5x0", "12", "-1x5", "32769x1", "99999999999x9", "32768x32768", "1.5x2", "1x2x3"]
        {
            let message = text.parse::<Size>().expect_err(text).to_string();
            assert!(message.starts_with("--size: ") && !message.contains('\n'), "{message}");
        }
    }

    #[test]
    fn absurd_settings_name_their_key() {
        let good = RenderSettings::new(Size { width: 64, height: 64 });
        good.check().expect("good");
        let tuned = |change: fn(&mut RenderSettings)| {
            let mut settings = good.clone();
            change(&mut settings);
            settings.check().expect_err("absurd").to_string()
        };
        assert!(tuned(|s| s.samples = 0).starts_with("--samples: 0"));
        assert!(tuned(|s| s.tuning.tile = 0).starts_with("render.tile: 0"));
        assert!(tuned(|s| s.tuning.tile = 1025).starts_with("render.tile: 1025"));
        assert!(tuned(|s| s.tuning.threads = 1025).starts_with("render.threads: 1025"));
        let tiny_tiles = tuned(|s| (s.size, s.tuning.tile) = (Size { width: 16384, height: 16384 }, 1));
        assert!(tiny_tiles.starts_with("render.tile: 1 would make"), "{tiny_tiles}");
    }
}
