//! Pictures on surfaces: where they are, and how they lie.

use super::buffers::Buffers;
use super::uri::{self, Target};
use crate::mesh::{Channel, Image, ImageSource, Map, ReadReport};
use gltf::Document;
use gltf::material::NormalTexture;
use gltf::texture::{Info, Texture, WrappingMode};
use serde::Deserialize;
use std::collections::HashMap;
use std::io;
use std::path::Path;

/// Keeps the bytes of a picture, somewhere.
pub(super) type Keep<'a> = &'a dyn Fn(&[u8]) -> io::Result<ImageSource>;

/// A picture that a material names.
pub(super) struct Picture<'a> {
    texture: Texture<'a>,
    /// The set of texture coordinates that it goes by.
    pub set: u32,
    /// `KHR_texture_transform`: in glTF's coordinates, of which v runs downward.
    offset: [f32; 2],
    scale: [f32; 2],
    rotation: f32,
}

impl<'a> From<Info<'a>> for Picture<'a> {
    fn from(info: Info<'a>) -> Self {
        let (texture, set) = (info.texture(), info.tex_coord());
        let (offset, scale, rotation, other) = info.texture_transform().map_or(NOT_MOVED, |transform| {
            (transform.offset(), transform.scale(), transform.rotation(), transform.tex_coord())
        });
        Self { texture, set: other.unwrap_or(set), offset, scale, rotation }
    }
}

impl<'a> From<NormalTexture<'a>> for Picture<'a> {
    fn from(normal: NormalTexture<'a>) -> Self {
        /// The crate leaves this extension of normal textures to its users.
        #[derive(Deserialize)]
        #[serde(default, rename_all = "camelCase")]
        struct Transform {
            offset: [f32; 2],
            scale: [f32; 2],
            rotation: f32,
            tex_coord: Option<u32>,
        }
        impl Default for Transform {
            fn default() -> Self {
                let (offset, scale, rotation, tex_coord) = NOT_MOVED;
                Self { offset, scale, rotation, tex_coord }
            }
        }
        let found = normal.extension_value("KHR_texture_transform");
        let found = found.and_then(|value| Transform::deserialize(value).ok()).unwrap_or_default();
        let Transform { offset, scale, rotation, tex_coord } = found;
        Self {
            texture: normal.texture(),
            set: tex_coord.unwrap_or(normal.tex_coord()),
            offset,
            scale,
            rotation,
        }
    }
}

/// Offset, scale, rotation, and another set of coordinates.
const NOT_MOVED: ([f32; 2], [f32; 2], f32, Option<u32>) = ([0.0; 2], [1.0; 2], 0.0, None);

/// The pictures that materials turned out to name.
pub(super) struct Textures<'a> {
    document: &'a Document,
    buffers: &'a Buffers<'a>,
    folder: &'a Path,
    keep: Keep<'a>,
    /// Why a picture could not be kept.
    failed: Option<io::Error>,
    /// Each once.
    images: Vec<Image>,
    /// By the image's number in the document, its place in `images`.
    places: HashMap<Option<usize>, u32>,
    /// By the number of a buffer view, the copy of its bytes.
    copies: HashMap<usize, ImageSource>,
    /// Bytes that may still be copied out of buffers.
    left: u64,
}

impl<'a> Textures<'a> {
    /// None yet, of a model in `folder`. `keep` takes the bytes of those that lie in buffers.
    pub fn new(document: &'a Document, buffers: &'a Buffers<'a>, folder: &'a Path, keep: Keep<'a>) -> Self {
        Self {
            document,
            buffers,
            folder,
            keep,
            failed: None,
            images: Vec::new(),
            places: HashMap::new(),
            copies: HashMap::new(),
            left: buffers.size(),
        }
    }

    /// A picture as a map.
    pub fn map(&mut self, picture: &Picture<'_>, channel: Channel, report: &mut ReadReport) -> Map {
        let number = picture.texture.source().map(|image| image.index());
        let image = match self.places.get(&number) {
            Some(&place) => place,
            None => {
                let image = self.image(number);
                if let ImageSource::Missing(why) = &image.source {
                    report.note(format!("picture {} {why}", image.name));
                }
                self.images.push(image);
                let place = self.images.len() as u32 - 1;
                self.places.insert(number, place);
                place
            }
        };
        let sampler = picture.texture.sampler();
        let wraps = [sampler.wrap_s(), sampler.wrap_t()];
        if wraps.contains(&WrappingMode::MirroredRepeat) {
            report.note("mirrored repetition of pictures taken as plain".into());
        }
        if wraps.contains(&WrappingMode::ClampToEdge) && wraps[0] != wraps[1] {
            report.note("pictures that end in one direction alone are repeated in both".into());
        }
        if picture.rotation != 0.0 {
            report.note("rotation of pictures ignored".into());
        }
        let ([x, y], [across, down]) = (picture.offset, picture.scale);
        Map {
            // With V = 1 - v upward, v' = y + down v is V' = (1 - y - down) + down V.
            scale: [across, down],
            offset: [x, 1.0 - y - down],
            clamp: wraps == [WrappingMode::ClampToEdge; 2],
            ..Map::whole(image, channel)
        }
    }

    /// An image of the document; `None` is one that only unknown extensions know of.
    fn image(&mut self, number: Option<usize>) -> Image {
        let Some(number) = number else {
            let why = "in a form that is not read; store them as PNG or JPEG";
            return Image { name: "of textures".into(), source: ImageSource::Missing(why.into()) };
        };
        let image = &self.document.as_json().images[number];
        let named = || image.name.clone().unwrap_or_else(|| number.to_string());
        let missing = |why: String| ImageSource::Missing(why);
        let (name, source) = match (&image.uri, image.buffer_view) {
            (Some(uri), _) => {
                let name = if uri.starts_with("data:") { named() } else { uri::shown(uri) };
                let source = match uri::follow(uri, self.folder) {
                    Ok(Target::Bytes(bytes)) => self.kept(&bytes),
                    Ok(Target::File(path)) => ImageSource::File(path),
                    Err(why) => missing(why.into()),
                };
                (name, source)
            }
            (None, Some(view)) => (named(), self.copy(view.value()).unwrap_or_else(missing)),
            (None, None) => (named(), missing("has no data".into())),
        };
        Image { name, source }
    }

    /// A view's bytes.
    fn copy(&mut self, view: usize) -> Result<ImageSource, String> {
        if let Some(copy) = self.copies.get(&view) {
            return Ok(copy.clone());
        }
        let bytes = self.buffers.view(view)?.all();
        // A short file could name the same long piece of a buffer in views without end.
        let left = self.left.checked_sub(bytes.len() as u64);
        self.left = left.ok_or("overlaps others in its buffer")?;
        let copy = self.kept(bytes);
        self.buffers.let_go();
        self.copies.insert(view, copy.clone());
        Ok(copy)
    }

    /// A picture's bytes, wherever they are kept. That they could not be is told by [`finish`](Self::finish).
    fn kept(&mut self, bytes: &[u8]) -> ImageSource {
        (self.keep)(bytes).unwrap_or_else(|error| {
            let why = error.to_string();
            self.failed = Some(error);
            ImageSource::Missing(why)
        })
    }

    /// All of them.
    ///
    /// # Errors
    /// One could not be kept.
    pub fn finish(self) -> io::Result<Vec<Image>> {
        self.failed.map_or(Ok(self.images), Err)
    }
}
