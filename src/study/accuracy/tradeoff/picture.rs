//! How far a picture is from the reference.
//!
//! Three figures, for three uses:
//!
//! - RMSE over all channels of linear light, cut to 0 to 1 as a display cuts it: what a renderer's
//!   convergence is plotted by. 0 for equal pictures.
//! - PSNR, the same in decibels below full light.
//! - SSIMULACRA2 of the 8-bit sRGB picture, for the eye: structure, edges and ringing on six scales of a
//!   perceptual colour space, fitted to what people said of picture pairs. 100 for equal pictures; 90 is
//!   said to be hard to tell apart from the original, 70 good, 50 middling, 10 bad.
//!
//! Why not FLIP, which was made for renderers: its one crate wraps NVIDIA's C++, and so raypack would need a
//! C++ compiler where now Rust and a linker do. SSIMULACRA2 has a crate in safe Rust, kept well and tested
//! against the authors' program. Plain SSIM sees the luminance of one scale only.

use crate::mesh::linear_to_srgb;
use crate::render::Frame;
use fast_ssim2::{PixelDescriptor, PixelSlice, Ssimulacra2Reference};
use serde::Serialize;

/// How far a picture is from the reference.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct PictureError {
    /// Root of the mean square error of linear light cut to 0 to 1, over all channels.
    pub rmse: f64,
    /// `-20 log10(rmse)` decibels; `None` for equal pictures, for which it is infinite.
    pub psnr: Option<f64>,
    /// SSIMULACRA2: 100 for equal pictures, less for others, without end.
    pub ssimulacra2: f64,
}

impl PictureError {
    /// The RMSE in two significant digits. Pictures of the same samples differ in those beyond by chance:
    /// which side of an edge a last bit puts a ray on.
    pub fn two_digits(&self) -> f64 {
        format!("{:.1e}", self.rmse).parse().expect("what was written can be read")
    }
}

/// A picture to compare others with.
pub struct Judge {
    frame: Frame,
    perceived: Ssimulacra2Reference,
}

impl Judge {
    /// Makes it ready.
    pub fn new(frame: Frame) -> Self {
        let bytes = display(&frame);
        let perceived = Ssimulacra2Reference::new(&slice(&bytes, &frame)).expect(FITS);
        Self { frame, perceived }
    }

    /// How far a picture of the same size is off.
    ///
    /// # Panics
    /// If it is of another size.
    pub fn error(&self, frame: &Frame) -> PictureError {
        let rmse = rmse(&frame.color, &self.frame.color);
        let bytes = display(frame);
        let ssimulacra2 = self.perceived.compare(&slice(&bytes, frame)).expect(FITS);
        PictureError { rmse, psnr: psnr(rmse), ssimulacra2 }
    }
}

/// What `fast_ssim2` could complain about, our sizes rule out.
const FITS: &str = "pictures of one size, with pixels and no more of them than the metric takes";

/// The picture as bytes, as a PNG of it has them.
fn display(frame: &Frame) -> Vec<u8> {
    frame.color.iter().flat_map(|pixel| pixel.map(linear_to_srgb)).collect()
}

fn slice<'a>(bytes: &'a [u8], frame: &Frame) -> PixelSlice<'a> {
    let (width, height) = (frame.size.width, frame.size.height);
    PixelSlice::new(bytes, width, height, width as usize * 3, PixelDescriptor::RGB8_SRGB).expect(FITS)
}

fn rmse(a: &[[f32; 3]], b: &[[f32; 3]]) -> f64 {
    assert_eq!(a.len(), b.len(), "pictures of one size");
    let shown = |channel: f32| f64::from(channel.clamp(0.0, 1.0));
    let channels = a.as_flattened().iter().zip(b.as_flattened());
    let sum: f64 = channels.map(|(&a, &b)| (shown(a) - shown(b)).powi(2)).sum();
    (sum / (3 * a.len()) as f64).sqrt()
}

fn psnr(rmse: f64) -> Option<f64> {
    (rmse > 0.0).then(|| -20.0 * rmse.log10())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::Size;

    fn frame(pixel: impl Fn(u32, u32) -> [f32; 3]) -> Frame {
        let size = Size { width: 48, height: 32 };
        let color = (0..size.pixels() as u32).map(|i| pixel(i % 48, i / 48)).collect();
        Frame { size, color, depth: None, normal: None }
    }

    #[test]
    fn equal_pictures_have_no_error() {
        let picture = frame(|x, y| [x as f32 / 48.0, y as f32 / 32.0, 0.5]);
        let error = Judge::new(picture.clone()).error(&picture);
        assert_eq!(error, PictureError { rmse: 0.0, psnr: None, ssimulacra2: 100.0 });
    }

    #[test]
    fn known_pictures_have_known_errors() {
        let grey = Judge::new(frame(|_, _| [0.5; 3]));
        // Every channel is off by 0.1: RMSE 0.1, which is 20 dB.
        let error = grey.error(&frame(|_, _| [0.6, 0.4, 0.6]));
        assert!((error.rmse - 0.1).abs() < 1e-7 && (error.psnr.unwrap() - 20.0).abs() < 1e-5, "{error:?}");
        // One channel of three is off by 0.3: the mean square is 0.03.
        let error = grey.error(&frame(|_, _| [0.5, 0.8, 0.5]));
        assert!((error.rmse - 0.03f64.sqrt()).abs() < 1e-7, "{error:?}");
        // A quarter of the pixels is off by 0.2: RMSE 0.1.
        let error = grey.error(&frame(|x, y| [if x % 2 + y % 2 == 0 { 0.7 } else { 0.5 }; 3]));
        assert!((error.rmse - 0.1).abs() < 1e-7, "{error:?}");
    }

    #[test]
    fn light_beyond_the_display_is_cut_off() {
        let white = Judge::new(frame(|_, _| [1.0; 3]));
        assert_eq!(white.error(&frame(|_, _| [7.0; 3])).rmse, 0.0);
    }

    #[test]
    fn two_digits_decide() {
        let digits = |rmse| PictureError { rmse, psnr: None, ssimulacra2: 0.0 }.two_digits();
        assert_eq!([0.012_49, 0.099_9, 0.0].map(digits), [0.012, 0.1, 0.0]);
    }

    #[test]
    fn the_eye_minds_more_what_is_worse() {
        let picture = |noise: f32| {
            frame(move |x, y| {
                let stripe = if x / 8 % 2 == 0 { 0.2 } else { 0.7 };
                [stripe + noise * ((x * 7 + y * 13) % 5) as f32; 3]
            })
        };
        let judge = Judge::new(picture(0.0));
        let scores = [0.002, 0.01, 0.05].map(|noise| judge.error(&picture(noise)).ssimulacra2);
        assert!(100.0 > scores[0] && scores[0] > scores[1] && scores[1] > scores[2], "{scores:?}");
    }
}
