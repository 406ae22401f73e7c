//! Pictures on surfaces: opened when something that is drawn calls for them, filtered where they are looked at.
//!
//! [`Textures`] holds the opened ones; [`Cone`] and [`footprint`] say how much of one a ray sees.

mod cone;
mod jpeg;
mod open;
mod pyramid;
mod sample;
mod texel;

pub use cone::{Cone, footprint};
pub(super) use open::{decode, open_file};

use crate::mesh::{Channel, Image, Map};
use glam::{Vec2, Vec3, Vec4};
use pyramid::{Pyramid, Uses};
use rayon::prelude::*;
use sample::Spot;
use std::fmt;
use texel::Texel;

/// The pictures of a scene.
///
/// What was not called for, and what could not be opened, is white, smooth and flat: it leaves a material's own
/// values as they are.
#[derive(Debug, Default)]
pub struct Textures {
    /// By the index of the image.
    pictures: Vec<Option<Picture>>,
}

/// A picture that cannot be had. `Display` is one line about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Problem {
    /// What the model calls it.
    pub image: String,
    /// What is wrong with it: one line, to be read after the name.
    pub message: String,
}

impl fmt::Display for Problem {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "texture {} {}; a plain colour takes its place", self.image, self.message)
    }
}

/// One picture, in the numbers that its file has.
#[derive(Debug)]
enum Picture {
    Bytes(Pyramid<u8>),
    Words(Pyramid<u16>),
    Floats(Pyramid<f32>),
}

/// Calls for the pyramid of a picture, whatever its numbers are.
macro_rules! with {
    ($picture:expr, $pyramid:ident => $what:expr) => {
        match $picture {
            Picture::Bytes($pyramid) => $what,
            Picture::Words($pyramid) => $what,
            Picture::Floats($pyramid) => $what,
        }
    };
}

impl Textures {
    /// Opens the pictures that `maps` name, in parallel, and no others; `maps` are those that will be sampled (of
    /// others the filtering is coarser, not wrong). The problems are in the order of the images.
    ///
    /// A picture may have 32768 texels a side and take up 1 GiB; one that is larger is a problem, as is one that
    /// is broken or ends too early.
    pub fn open<'a>(images: &[Image], maps: impl IntoIterator<Item = &'a Map>) -> (Self, Vec<Problem>) {
        let mut uses = vec![Uses::default(); images.len()];
        for map in maps {
            let Some(uses) = uses.get_mut(map.image as usize) else { continue };
            match map.channel {
                Channel::Color => uses.color = true,
                Channel::Alpha => uses.alpha = true,
                Channel::Data | Channel::Red | Channel::Green | Channel::Blue | Channel::Grey => {
                    uses.data = true
                }
            }
        }
        let open = |(image, &uses)| (uses != Uses::default()).then(|| open::open(image, uses)).transpose();
        let opened: Vec<Result<_, Problem>> = images.par_iter().zip(&uses).map(open).collect();

        let mut problems = Vec::new();
        let pictures = opened.into_iter().map(|picture| {
            picture.unwrap_or_else(|problem| {
                problems.push(problem);
                None
            })
        });
        (Self { pictures: pictures.collect() }, problems)
    }

    /// Bytes of memory that they take up.
    pub fn bytes(&self) -> usize {
        let opened = self.pictures.iter().flatten();
        opened.map(|picture| with!(picture, pyramid => pyramid.bytes())).sum::<usize>()
            + self.pictures.capacity() * size_of::<Option<Picture>>()
    }

    /// How many were opened.
    pub fn len(&self) -> usize {
        self.pictures.iter().flatten().count()
    }

    /// Whether none was.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Width and height in texels, of an image that was opened.
    pub fn size(&self, image: u32) -> Option<[usize; 2]> {
        self.picture(image)
            .map(|picture| with!(picture, pyramid => [pyramid.base.width, pyramid.base.height]))
    }

    /// Whether some of an image is less than fully there.
    pub fn has_alpha(&self, image: u32) -> bool {
        !self.is_opaque(&Map::whole(image, Channel::Alpha))
    }

    /// Whether what a map of opacity reads is 1 in every texel, so that it cuts nothing out. Looks at all of them:
    /// to be asked once.
    pub fn is_opaque(&self, map: &Map) -> bool {
        self.picture(map.image).is_none_or(|picture| with!(picture, pyramid => is_full(pyramid, map.channel)))
    }

    /// What a map has at the texture coordinates `uv`, the mean over about `footprint` (a width, in units of `uv`;
    /// see [`footprint`]; 0 for the finest there is): RGB as [`Map::channel`] says, the same number thrice for
    /// single channels; and alpha, which is 1 in pictures without.
    ///
    /// Filtered between texels and between two levels of reduction (Williams, "Pyramidal parametrics", 1983). No
    /// coordinate or footprint is out of range: NaN and infinity are taken for 0 and for the whole picture.
    pub fn sample(&self, map: &Map, uv: Vec2, footprint: f32) -> Vec4 {
        let [u, v] = placed(map, uv);
        self.sample_at(map, [u, v], scaled(map, footprint))
    }

    /// The RGB of [`sample`](Self::sample).
    #[inline]
    pub fn color(&self, map: &Map, uv: Vec2, footprint: f32) -> Vec3 {
        self.sample(map, uv, footprint).truncate()
    }

    /// One number: the map's channel, of colours the average of the three.
    #[inline]
    pub fn value(&self, map: &Map, uv: Vec2, footprint: f32) -> f32 {
        mean(self.sample(map, uv, footprint))
    }

    /// How steep a [`bump`](crate::mesh::Maps::bump) is at `uv`: by how much its height grows with u and with v,
    /// all three in units of the texture coordinates, [`Map::scale`] and [`Map::strength`] included.
    ///
    /// By central differences over the footprint, over one texel if that is wider.
    pub fn gradient(&self, map: &Map, uv: Vec2, footprint: f32) -> Vec2 {
        let Some([width, height]) = self.size(map.image) else { return Vec2::ZERO };
        let [u, v] = placed(map, uv);
        let footprint = scaled(map, footprint);
        // Half of the picture at most: over the whole of it, what is repeated would come out level.
        let step =
            |texels: usize| f64::from(footprint).clamp(1.0 / texels as f64, 0.5f64.max(1.0 / texels as f64));
        let slope = |[du, dv]: [f64; 2]| {
            let height = |side: f64| mean(self.sample_at(map, [u + side * du, v + side * dv], footprint));
            (height(0.5) - height(-0.5)) / (du + dv) as f32
        };
        let slopes = Vec2::new(slope([step(width), 0.0]), slope([0.0, step(height)]));
        slopes * Vec2::from_array(map.scale) * map.strength
    }

    /// The unit normal of a [`normal`](crate::mesh::Maps::normal) map at `uv`, in the tangent space of the texture
    /// coordinates: x along u, y along v, z off the surface. Its x and y are multiplied by [`Map::strength`].
    pub fn normal(&self, map: &Map, uv: Vec2, footprint: f32) -> Vec3 {
        if self.picture(map.image).is_none() {
            return Vec3::Z;
        }
        let n = 2.0 * self.color(map, uv, footprint) - 1.0;
        Vec3::new(n.x * map.strength, n.y * map.strength, n.z).normalize_or(Vec3::Z)
    }

    #[inline]
    fn picture(&self, image: u32) -> Option<&Picture> {
        self.pictures.get(image as usize)?.as_ref()
    }

    /// The same with coordinates and footprint in the picture's own units.
    fn sample_at(&self, map: &Map, uv: [f64; 2], footprint: f32) -> Vec4 {
        let Some(picture) = self.picture(map.image) else { return Vec4::ONE };
        let spot = Spot::new(uv, footprint, map.clamp);
        // Alpha is the same in both sets of levels.
        let color = matches!(map.channel, Channel::Color | Channel::Alpha);
        let rgba = with!(picture, pyramid => pyramid.sample(spot, color));
        let single = |x: f32| Vec3::splat(x).extend(rgba.w);
        match map.channel {
            Channel::Color | Channel::Data => rgba,
            Channel::Red => single(rgba.x),
            Channel::Green => single(rgba.y),
            Channel::Blue => single(rgba.z),
            Channel::Alpha => single(rgba.w),
            Channel::Grey => single(mean(rgba)),
        }
    }
}

/// The nearest amount of light, if a picture's number is none: 0 for a NaN and for less than nothing; for infinity,
/// and what sums would make infinite, the largest number that the halves of an .exr hold.
pub(super) fn repair(amount: f32) -> Option<f32> {
    const TOO_LARGE: f32 = 1e30;
    const LARGEST_HALF: f32 = 65504.0;
    match amount {
        x if x.is_nan() || x < 0.0 => Some(0.0),
        x if x > TOO_LARGE => Some(LARGEST_HALF),
        _ => None,
    }
}

/// The light that a 16-bit sRGB-encoded number stands for.
pub(super) fn linear(word: u16) -> f32 {
    word.light()
}

/// Between `a` and `b`: of two that are the same that one, to the bit.
#[inline]
pub(super) fn mix(a: Vec4, b: Vec4, share: f32) -> Vec4 {
    a + (b - a) * share
}

/// Texture coordinates in the picture. In double precision: where a scale makes many tiles of few, the fraction
/// of one counts.
#[inline]
fn placed(map: &Map, uv: Vec2) -> [f64; 2] {
    let place = |x: f32, axis: usize| f64::from(x) * f64::from(map.scale[axis]) + f64::from(map.offset[axis]);
    [place(uv.x, 0), place(uv.y, 1)]
}

/// A footprint in the picture's units: 0 for what is none.
#[inline]
fn scaled(map: &Map, footprint: f32) -> f32 {
    let scaled = footprint * (map.scale[0] * map.scale[1]).abs().sqrt();
    if scaled > 0.0 { scaled } else { 0.0 }
}

#[inline]
fn mean(rgba: Vec4) -> f32 {
    let [r, g, b, _] = rgba.to_array();
    // Of three that are the same it is that one, to the bit, which a sum and a division do not give.
    if r == g && g == b { r } else { (r + g + b) / 3.0 }
}

/// Whether what `channel` reads is full in each texel.
fn is_full<T: Texel>(pyramid: &Pyramid<T>, channel: Channel) -> bool {
    let channels = pyramid.channels;
    let colors = if channels < 3 { 1 } else { 3 };
    let counts = match channel {
        Channel::Alpha => colors..channels,
        Channel::Color | Channel::Data | Channel::Grey => 0..colors,
        Channel::Red => 0..1,
        Channel::Green => (1 % colors)..(1 % colors + 1),
        Channel::Blue => (2 % colors)..(2 % colors + 1),
    };
    pyramid
        .base
        .texels
        .chunks_exact(channels)
        .all(|texel| texel[counts.clone()].iter().all(|&x| x == T::FULL))
}

#[cfg(test)]
mod tests;
