//! Writing pictures: PNG for the eye, EXR and PFM for figures.
//!
//! | ending | what it holds |
//! |---|---|
//! | `.png` | 8 bits, sRGB-encoded; light above 1 is cut off there (no exposure, no tone curve) |
//! | `.exr` | OpenEXR, 32-bit float RGB, linear, as computed |
//! | `.pfm` | Portable Float Map, 32-bit float, linear, as computed, little-endian, bottom row first |
//!
//! Depth and normals go into EXR and PFM as they are (depth is infinite where nothing was hit: in
//! EXR in three equal channels, in PFM in one). A PNG of them is for looking at: depth from white
//! (nearest) to dark grey (farthest), black where nothing was hit; normals with -1 to 1 mapped to
//! 0 to 255.

use super::settings::Size;
use crate::error::{Error, Result};
use crate::files::write_whole;
use crate::mesh::linear_to_srgb;
use image::codecs::openexr::OpenExrEncoder;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder};
use std::io::{self, Seek, Write};
use std::path::Path;

/// The kinds of picture that can be written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// 8-bit sRGB.
    Png,
    /// 32-bit float OpenEXR.
    Exr,
    /// 32-bit float Portable Float Map.
    Pfm,
}

impl Format {
    /// The format that a path's ending names, in upper or lower case.
    ///
    /// # Errors
    /// [`Error::UnknownFormat`].
    pub fn of(path: &Path) -> Result<Self> {
        let ending = path.extension().map(|ending| ending.to_string_lossy().to_ascii_lowercase());
        match ending.as_deref() {
            Some("png") => Ok(Self::Png),
            Some("exr") => Ok(Self::Exr),
            Some("pfm") => Ok(Self::Pfm),
            _ => {
                let expected = "a picture is a .png, .exr or .pfm file";
                Err(Error::UnknownFormat { path: path.into(), expected })
            }
        }
    }
}

/// Writes linear RGB.
///
/// # Errors
/// The ending is unknown or the file cannot be written; nothing is left behind then.
///
/// # Panics
/// If the number of pixels is not that of `size`. So do the others.
pub fn write_color(path: &Path, size: Size, pixels: &[[f32; 3]]) -> Result<()> {
    write_exposed(path, size, pixels, 1.0)
}

/// The same; of a .png, `gain` times as bright. The others hold the light as it is.
///
/// # Errors
/// As [`write_color`].
pub fn write_exposed(path: &Path, size: Size, pixels: &[[f32; 3]], gain: f32) -> Result<()> {
    write_rgb(path, size, pixels, |c| c.map(|c| linear_to_srgb(c * gain)))
}

/// Writes unit normals.
///
/// # Errors
/// As [`write_color`].
pub fn write_normals(path: &Path, size: Size, normals: &[[f32; 3]]) -> Result<()> {
    write_rgb(path, size, normals, |n| n.map(|n| ((n * 0.5 + 0.5) * 255.0 + 0.5) as u8))
}

/// Writes distances.
///
/// # Errors
/// As [`write_color`].
pub fn write_depth(path: &Path, size: Size, depths: &[f32]) -> Result<()> {
    assert_eq!(depths.len() as u64, size.pixels());
    let format = Format::of(path)?;
    write_whole(path, |out| match format {
        Format::Png => {
            let finite = depths.iter().copied().filter(|d| d.is_finite());
            let (nearest, farthest) =
                finite.fold((f32::INFINITY, 0.0f32), |(low, high), d| (low.min(d), high.max(d)));
            let range = (farthest - nearest).max(f32::MIN_POSITIVE);
            let grey = |d: f32| if d.is_finite() { 255.0 - 215.0 * ((d - nearest) / range) } else { 0.0 };
            let bytes: Vec<u8> = depths.iter().map(|&d| (grey(d) + 0.5) as u8).collect();
            encode_png(out, size, &bytes, ExtendedColorType::L8)
        }
        Format::Exr => {
            let rgb: Vec<[f32; 3]> = depths.iter().map(|&d| [d; 3]).collect();
            encode_exr(out, size, &rgb)
        }
        Format::Pfm => encode_pfm(out, size, "Pf", depths),
    })
}

/// Writes what pixels cost: as they are into EXR and PFM, as distances are, and in `color`'s colours into PNG.
///
/// # Errors
/// As [`write_color`].
pub fn write_heat(path: &Path, size: Size, costs: &[f32], color: impl Fn(f32) -> [u8; 3]) -> Result<()> {
    assert_eq!(costs.len() as u64, size.pixels());
    if Format::of(path)? != Format::Png {
        return write_depth(path, size, costs);
    }
    let bytes: Vec<u8> = costs.iter().flat_map(|&cost| color(cost)).collect();
    write_whole(path, |out| encode_png(out, size, &bytes, ExtendedColorType::Rgb8))
}

fn write_rgb(
    path: &Path,
    size: Size,
    pixels: &[[f32; 3]],
    to_bytes: impl Fn([f32; 3]) -> [u8; 3],
) -> Result<()> {
    assert_eq!(pixels.len() as u64, size.pixels());
    let format = Format::of(path)?;
    write_whole(path, |out| match format {
        Format::Png => {
            let bytes: Vec<[u8; 3]> = pixels.iter().map(|&p| to_bytes(p)).collect();
            encode_png(out, size, bytes.as_flattened(), ExtendedColorType::Rgb8)
        }
        Format::Exr => encode_exr(out, size, pixels),
        Format::Pfm => encode_pfm(out, size, "PF", pixels),
    })
}

fn encode_png(out: &mut impl Write, size: Size, bytes: &[u8], color: ExtendedColorType) -> io::Result<()> {
    PngEncoder::new(out).write_image(bytes, size.width, size.height, color).map_err(io::Error::other)
}

fn encode_exr(out: &mut (impl Write + Seek), size: Size, pixels: &[[f32; 3]]) -> io::Result<()> {
    OpenExrEncoder::new(out)
        .write_image(bytemuck::cast_slice(pixels), size.width, size.height, ExtendedColorType::Rgb32F)
        .map_err(io::Error::other)
}

/// The header ends with the scale: negative for little-endian.
fn encode_pfm<T: bytemuck::NoUninit>(
    out: &mut impl Write,
    size: Size,
    kind: &str,
    pixels: &[T],
) -> io::Result<()> {
    write!(out, "{kind}\n{} {}\n-1.0\n", size.width, size.height)?;
    for row in pixels.chunks_exact(size.width as usize).rev() {
        if cfg!(target_endian = "little") {
            out.write_all(bytemuck::cast_slice(row))?;
        } else {
            for value in bytemuck::cast_slice::<T, f32>(row) {
                out.write_all(&value.to_le_bytes())?;
            }
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::PathBuf;

    const SIZE: Size = Size { width: 3, height: 2 };
    const PIXELS: [[f32; 3]; 6] = [
        [0.0, 0.25, 1.0],
        [1e-8, 3.5, -0.5],
        [0.5, 0.5, 0.5],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.1, 0.2, 0.3],
    ];

    fn file(name: &str) -> (tempfile::TempDir, PathBuf) {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(name);
        (folder, path)
    }

    #[test]
    fn png_is_srgb_and_clamped() {
        let (_folder, path) = file("a.PNG");
        write_color(&path, SIZE, &PIXELS).expect("written");
        let png =
            image::load_from_memory(&std::fs::read(&path).expect("readable")).expect("a picture").to_rgb8();
        assert_eq!(png.dimensions(), (3, 2));
        assert_eq!(png.get_pixel(0, 0).0, [0, 137, 255]);
        assert_eq!(png.get_pixel(1, 0).0, [0, 255, 0]);
        assert_eq!(png.get_pixel(1, 1).0, [0, 255, 0]);
    }

    #[test]
    fn exr_holds_the_very_floats() {
        let (_folder, path) = file("a.exr");
        write_color(&path, SIZE, &PIXELS).expect("written");
        let exr = image::open(&path).expect("a picture").to_rgb32f();
        assert_eq!(exr.dimensions(), (3, 2));
        assert!(exr.pixels().zip(&PIXELS).all(|(read, written)| read.0 == *written));
    }

    #[test]
    fn exr_depth_keeps_infinity() {
        let (_folder, path) = file("a.exr");
        let depths = [1.0, f32::INFINITY, 2.5, 0.0, 1e30, 7.0];
        write_depth(&path, SIZE, &depths).expect("written");
        let exr = image::open(&path).expect("a picture").to_rgb32f();
        assert!(exr.pixels().zip(&depths).all(|(read, written)| read.0 == [*written; 3]));
    }

    /// Kind, rows from the top, as read by the format's definition.
    fn read_pfm(path: &Path) -> (String, Vec<Vec<f32>>) {
        let bytes = std::fs::read(path).expect("readable");
        let mut lines = bytes.splitn(4, |&b| b == b'\n');
        let mut line = || String::from_utf8(lines.next().expect("a line").to_vec()).expect("text");
        let (kind, size, scale) = (line(), line(), line());
        assert!(scale.parse::<f32>().expect("a number") < 0.0);
        let (width, height) = size.split_once(' ').expect("two numbers");
        let (width, height): (usize, usize) =
            (width.parse().expect("width"), height.parse().expect("height"));
        let data = lines.next().expect("data");
        let channels = if kind == "PF" { 3 } else { 1 };
        assert_eq!(data.len(), 4 * width * height * channels);
        let floats: Vec<f32> =
            data.chunks_exact(4).map(|b| f32::from_le_bytes(b.try_into().expect("four"))).collect();
        (kind, floats.chunks(width * channels).rev().map(<[f32]>::to_vec).collect())
    }

    #[test]
    fn pfm_holds_the_very_floats() {
        let (_folder, path) = file("a.pfm");
        write_color(&path, SIZE, &PIXELS).expect("written");
        let (kind, rows) = read_pfm(&path);
        assert_eq!((kind.as_str(), rows.concat()), ("PF", PIXELS.concat()));

        let depths = [1.0, f32::INFINITY, 2.5, 0.0, 1e30, 7.0];
        write_depth(&path, SIZE, &depths).expect("written");
        let (kind, rows) = read_pfm(&path);
        assert_eq!((kind.as_str(), rows.concat()), ("Pf", depths.to_vec()));
    }

    #[test]
    fn depth_and_normals_can_be_looked_at() {
        let (_folder, path) = file("a.png");
        write_depth(&path, SIZE, &[1.0, f32::INFINITY, 2.0, 3.0, 3.0, 3.0]).expect("written");
        let png = image::open(&path).expect("a picture").to_luma8();
        assert_eq!([0, 1, 2].map(|x| png.get_pixel(x, 0).0[0]), [255, 0, 148]);
        write_depth(&path, SIZE, &[f32::INFINITY; 6]).expect("a picture of nothing");

        write_normals(&path, SIZE, &[[0.0, 1.0, -1.0]; 6]).expect("written");
        let png = image::open(&path).expect("a picture").to_rgb8();
        assert_eq!(png.get_pixel(2, 1).0, [128, 255, 0]);
    }

    #[test]
    fn an_unknown_ending_leaves_nothing() {
        for name in ["a.jpg", "a", "a.png.bak"] {
            let (folder, path) = file(name);
            let message = write_color(&path, SIZE, &PIXELS).expect_err(name).to_string();
            assert!(message.contains("a picture is a .png, .exr or .pfm file"), "{message}");
            assert_eq!(std::fs::read_dir(folder.path()).expect("a folder").count(), 0);
        }
    }
}
