//! The pictures that `render` writes: checked before the work, written after it.

use crate::error::{Error, Result};
use crate::files::check_writable;
use crate::render::image::{self, Format};
use crate::render::{Aovs, Frame};
use crate::study::plot;
use std::path::{Path, PathBuf};

/// The greatest change of exposure that makes sense.
const MAX_STOPS: f32 = 40.0;

/// Which pictures go where.
#[derive(Clone, Debug, clap::Args)]
pub struct Outputs {
    /// The picture: .png (8-bit sRGB), .exr or .pfm (32-bit float, linear)
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
    /// Show a .png so many stops brighter: 1 doubles the light, -1 halves it
    #[arg(long, value_name = "STOPS", default_value_t = 0.0, allow_negative_numbers = true)]
    exposure: f32,
    /// Write the distance from the eye: .exr or .pfm for its values, .png to look at
    #[arg(long, value_name = "FILE")]
    depth: Option<PathBuf>,
    /// Write the geometric normals: .exr or .pfm for their values, .png to look at
    #[arg(long, value_name = "FILE")]
    normals: Option<PathBuf>,
}

impl Outputs {
    /// What a frame must hold.
    pub fn aovs(&self) -> Aovs {
        Aovs { depth: self.depth.is_some(), normal: self.normals.is_some() }
    }

    /// The main picture's file.
    pub fn picture(&self) -> &Path {
        &self.output
    }

    /// Finds out before any work whether all can be written: endings are known, folders writable,
    /// and no two of them (nor the scene, nor the report) are the same file.
    pub fn check(&self, frames: Option<u32>, others: &[&Path]) -> Result<()> {
        if self.exposure.is_nan() || self.exposure.abs() > MAX_STOPS {
            let message =
                format!("{} is not a number of stops from -{MAX_STOPS} to {MAX_STOPS}", self.exposure);
            return Err(Error::option("--exposure", message));
        }
        let pictures: Vec<&Path> = [Some(&self.output), self.depth.as_ref(), self.normals.as_ref()]
            .into_iter()
            .flatten()
            .map(PathBuf::as_path)
            .collect();
        for (i, picture) in pictures.iter().enumerate() {
            Format::of(picture)?;
            if pictures[..i].iter().chain(others).any(|other| same_file(picture, other)) {
                let message =
                    format!("{} is named twice; give each file a name of its own", picture.display());
                return Err(Error::option("--output", message));
            }
            check_writable(&frame_path(picture, 0, frames))?;
        }
        Ok(())
    }

    /// Writes the picture that a frame was at first, and returns its path.
    pub fn write_first(&self, frame: &Frame, number: u32, frames: Option<u32>) -> Result<PathBuf> {
        let output = first_path(&frame_path(&self.output, number, frames));
        image::write_exposed(&output, frame.size, &frame.color, self.exposure.exp2())?;
        Ok(output)
    }

    /// Writes a frame's pictures and returns the main one's path.
    pub fn write(&self, frame: &Frame, number: u32, frames: Option<u32>) -> Result<PathBuf> {
        let path = |picture: &Path| frame_path(picture, number, frames);
        let output = path(&self.output);
        image::write_exposed(&output, frame.size, &frame.color, self.exposure.exp2())?;
        if let (Some(file), Some(depth)) = (&self.depth, &frame.depth) {
            image::write_depth(&path(file), frame.size, depth)?;
        }
        if let (Some(file), Some(normal)) = (&self.normals, &frame.normal) {
            image::write_normals(&path(file), frame.size, normal)?;
        }
        Ok(output)
    }
}

/// Where a frame's picture goes: the very path for a still; of an animation of `frames` frames,
/// `out.png` becomes `out_000.png` and so on, with as many digits as the last one needs.
fn frame_path(picture: &Path, number: u32, frames: Option<u32>) -> PathBuf {
    let Some(frames) = frames else { return picture.to_path_buf() };
    let digits = frames.saturating_sub(1).to_string().len().max(3);
    let mut name = picture.file_stem().unwrap_or_default().to_os_string();
    name.push(format!("_{number:0digits$}"));
    if let Some(ending) = picture.extension() {
        name.push(".");
        name.push(ending);
    }
    picture.with_file_name(name)
}

/// Where the picture goes that a frame was at first: `out.png` becomes `out.first.png`.
fn first_path(picture: &Path) -> PathBuf {
    let mut name = picture.file_stem().unwrap_or_default().to_os_string();
    name.push(".first");
    if let Some(ending) = picture.extension() {
        name.push(".");
        name.push(ending);
    }
    picture.with_file_name(name)
}

/// Whether two paths name one file, as far as can be known without creating it.
pub fn same_file(a: &Path, b: &Path) -> bool {
    a == b || matches!((a.canonicalize(), b.canonicalize()), (Ok(a), Ok(b)) if a == b)
}

/// Finds out before any work whether a plot can be written, and is not the report's file.
pub fn check_plot(file: &Path, json: Option<&Path>) -> Result<()> {
    plot::Format::of(file)?;
    if json.is_some_and(|json| same_file(file, json)) {
        return Err(Error::option("--plot", "this is the report's file too; give another name"));
    }
    check_writable(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_numbered() {
        let path = |number, frames| frame_path(Path::new("a/out.b.png"), number, frames);
        assert_eq!(path(0, None), Path::new("a/out.b.png"));
        assert_eq!(path(0, Some(15)), Path::new("a/out.b_000.png"));
        assert_eq!(path(14, Some(15)), Path::new("a/out.b_014.png"));
        assert_eq!(path(7, Some(2000)), Path::new("a/out.b_0007.png"));
        assert_eq!(first_path(&path(7, Some(8))), Path::new("a/out.b_007.first.png"));
    }
}
