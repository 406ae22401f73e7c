//! Picture files, whoever made them, to texels.

use super::pyramid::{Level, Pyramid, Uses};
use super::{Picture, Problem, jpeg, repair};
use crate::mesh::{Image, ImageSource};
use image::{DynamicImage, ImageDecoder as _, ImageError, ImageFormat, ImageReader, Limits};
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Seek};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

/// The longest side of a picture.
const MAX_SIDE: u32 = 32768;
/// The most memory of a decoded picture: 1 GiB.
const MAX_BYTES: u64 = 1 << 30;

const ENDS_EARLY: &str = "is a broken picture: it ends too early";

/// A model's picture, with the levels that its uses call for.
pub(super) fn open(image: &Image, uses: Uses) -> Result<Picture, Problem> {
    // The bytes first: a scene file's are checked as a whole, and a decoder that stops early must not hide damage.
    let decoded = image.source.read().and_then(|bytes| decode(Cursor::new(&bytes[..]), name_of(image)));
    match decoded {
        Ok(picture) => Ok(Picture::new(picture, uses)),
        Err(message) => Err(Problem { image: one_line(&image.name), message: one_line(&message) }),
    }
}

/// What tells of the kind of picture where its bytes do not.
fn name_of(image: &Image) -> &Path {
    match &image.source {
        ImageSource::File(path) => path,
        _ => Path::new(&image.name),
    }
}

/// Opens a file for [`decode`]: no directory, nor a pipe, which would be waited for.
pub(in crate::scene) fn open_file(path: &Path) -> io::Result<BufReader<File>> {
    if std::fs::metadata(path)?.is_file() {
        File::open(path).map(BufReader::new)
    } else {
        Err(io::Error::new(io::ErrorKind::InvalidInput, "it is not a file"))
    }
}

/// The picture that a file holds; of several, the first. Its first bytes say what kind of file it is; where they say
/// nothing, as in a .tga, the name's ending does.
///
/// # Errors
/// What is wrong with it, to be said after the name of the file: it is no picture, a broken one, or larger than
/// 32768 texels a side or 1 GiB.
pub(in crate::scene) fn decode(input: impl BufRead + Seek, name: &Path) -> Result<DynamicImage, String> {
    // Decoders are other people's code at work on anybody's bytes: one that fails its own assertions has met a
    // broken file too.
    catch_unwind(AssertUnwindSafe(|| guarded(input, name)))
        .unwrap_or_else(|_| Err("is a broken picture: its decoder gave up".into()))
}

fn guarded(mut input: impl BufRead + Seek, name: &Path) -> Result<DynamicImage, String> {
    let unread = |error: io::Error| format!("cannot be read: {error}");
    let format = ImageReader::new(&mut input).with_guessed_format().map_err(unread)?.format();
    let Some(format) = format.or_else(|| ImageFormat::from_path(name).ok()) else {
        return Err(
            "is no picture of a known kind; PNG, JPEG, TGA, BMP, GIF, TIFF, WebP, EXR and HDR are read"
                .into(),
        );
    };
    if format == ImageFormat::Jpeg {
        if !jpeg::is_whole(&mut input).map_err(unread)? {
            return Err(ENDS_EARLY.into());
        }
        input.rewind().map_err(unread)?;
    }
    let mut reader = ImageReader::with_format(input, format);
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    limits.max_alloc = Some(MAX_BYTES);
    reader.limits(limits);

    let too_large =
        || format!("is larger than {MAX_SIDE} texels a side or {} MiB; scale it down", MAX_BYTES >> 20);
    let fault = |error: ImageError| match error {
        ImageError::Limits(_) => too_large(),
        ImageError::IoError(error) if error.kind() == io::ErrorKind::UnexpectedEof => ENDS_EARLY.into(),
        error => format!("is a broken picture: {error}"),
    };
    let decoder = reader.into_decoder().map_err(fault)?;
    let (width, height) = decoder.dimensions();
    if width == 0 || height == 0 {
        return Err("is a picture without a texel".into());
    }
    if width.max(height) > MAX_SIDE || decoder.total_bytes() > MAX_BYTES {
        return Err(too_large());
    }
    DynamicImage::from_decoder(decoder).map_err(fault)
}

/// Text from elsewhere, without line ends and other control characters.
fn one_line(text: &str) -> String {
    text.split(char::is_control).map(str::trim).filter(|part| !part.is_empty()).collect::<Vec<_>>().join(" ")
}

impl Picture {
    /// Bytes stay bytes and 16-bit numbers 16 bits. Floats that are no amounts of light are [`repair`]ed.
    fn new(picture: DynamicImage, uses: Uses) -> Self {
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        let bytes =
            |channels, texels| Self::Bytes(Pyramid::new(channels, Level { width, height, texels }, uses));
        let words =
            |channels, texels| Self::Words(Pyramid::new(channels, Level { width, height, texels }, uses));
        let floats = |channels, mut texels: Vec<f32>| {
            texels.iter_mut().for_each(|texel| *texel = repair(*texel).unwrap_or(*texel));
            Self::Floats(Pyramid::new(channels, Level { width, height, texels }, uses))
        };
        match picture {
            DynamicImage::ImageLuma8(picture) => bytes(1, picture.into_raw()),
            DynamicImage::ImageLumaA8(picture) => bytes(2, picture.into_raw()),
            DynamicImage::ImageRgb8(picture) => bytes(3, picture.into_raw()),
            DynamicImage::ImageRgba8(picture) => bytes(4, picture.into_raw()),
            DynamicImage::ImageLuma16(picture) => words(1, picture.into_raw()),
            DynamicImage::ImageLumaA16(picture) => words(2, picture.into_raw()),
            DynamicImage::ImageRgb16(picture) => words(3, picture.into_raw()),
            DynamicImage::ImageRgba16(picture) => words(4, picture.into_raw()),
            DynamicImage::ImageRgb32F(picture) => floats(3, picture.into_raw()),
            picture => floats(4, picture.into_rgba32f().into_raw()),
        }
    }
}
