//! Light from infinitely far, as a picture of all directions.

mod table;

use super::texture::{decode, linear, mix, open_file, repair};
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};
use image::DynamicImage;
use std::f32;
use std::f64::consts::TAU;
use std::path::Path;
use table::Table;

/// Light from infinitely far: a latitude-longitude picture, one column a longitude, one row a latitude.
///
/// Its top row is at +Y, its bottom row at -Y; its middle is seen when looking along -Z, what is right of the middle
/// when turning to the right, to +X; its left and right borders meet at +Z.
#[derive(Debug)]
pub struct Environment {
    width: usize,
    height: usize,
    /// Radiance, linear RGB, the top row first.
    texels: Vec<[f32; 3]>,
    table: Table,
    repaired: u64,
}

/// A direction that light comes from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EnvironmentSample {
    /// Unit vector to where the light comes from.
    pub direction: Vec3,
    /// The light from there.
    pub radiance: Vec3,
    /// The density of such samples in solid angle; never 0.
    pub pdf: f32,
}

impl Environment {
    /// Reads a picture: .exr and .hdr hold amounts of light; what other formats hold is sRGB, with at most 1.
    ///
    /// Amounts that are less than nothing or NaN are taken for 0, infinite ones for the largest number that the
    /// halves of an .exr hold; [`repaired`](Self::repaired) counts them.
    ///
    /// # Errors
    /// [`Error::Read`] for a file that cannot be read; [`Error::Malformed`] for one that is not a picture, is
    /// broken or too large (32768 texels a side, 1 GiB), or is not twice as wide as high.
    pub fn open(path: impl AsRef<Path>) -> Result<Self> {
        let path = path.as_ref();
        let file = open_file(path).map_err(|source| Error::Read { path: path.into(), source })?;
        let picture = decode(file, path).map_err(|message| Error::malformed(path, message))?;
        let (width, height) = (picture.width() as usize, picture.height() as usize);
        if width.abs_diff(2 * height) * 50 > width {
            let message = format!(
                "has {width} x {height} texels; light from all directions is a latitude-longitude picture, twice as \
                 wide as high"
            );
            return Err(Error::malformed(path, message));
        }
        Ok(Self::new(width, height, light(picture)))
    }

    /// The same light from all directions.
    pub fn uniform(radiance: Vec3) -> Self {
        Self::new(1, 1, vec![radiance.to_array()])
    }

    fn new(width: usize, height: usize, mut texels: Vec<[f32; 3]>) -> Self {
        let mut repaired = 0;
        for amount in texels.as_flattened_mut() {
            let Some(nearest) = repair(*amount) else { continue };
            (*amount, repaired) = (nearest, repaired + 1);
        }
        let table = Table::new(width, height, &texels);
        Self { width, height, texels, table, repaired }
    }

    /// The light from the unit vector `direction`, bilinear between texels.
    pub fn radiance(&self, direction: Vec3) -> Vec3 {
        let [u, v] = place(direction);
        let (x, y) = (u * self.width as f32 - 0.5, v * self.height as f32 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        // Around the world there is the first column again; past a pole, the last row.
        let column = |x: isize| x.rem_euclid(self.width as isize) as usize;
        let row = |y: isize| y.clamp(0, self.height as isize - 1) as usize;
        let texel = |dx: isize, dy: isize| {
            let (x, y) = (column(left as isize + dx), row(top as isize + dy));
            Vec3::from_array(self.texels[y * self.width + x]).extend(0.0)
        };
        let above = mix(texel(0, 0), texel(1, 0), x - left);
        let below = mix(texel(0, 1), texel(1, 1), x - left);
        mix(above, below, y - top).truncate()
    }

    /// A direction, more likely where more light comes from; `random` is uniform in the unit square.
    ///
    /// Every direction that light comes from can be chosen; in a black environment all are chosen alike.
    pub fn sample(&self, random: [f32; 2]) -> EnvironmentSample {
        let (u, cosine, pdf) = self.table.sample(random);
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (east, north) = libm::sincos((u - 0.5) * TAU);
        let direction = DVec3::new(sine * east, cosine, -sine * north).as_vec3();
        EnvironmentSample { direction, radiance: self.radiance(direction), pdf }
    }

    /// The density, in solid angle, with which [`sample`](Self::sample) chooses the unit vector `direction`.
    pub fn pdf(&self, direction: Vec3) -> f32 {
        let [u, v] = place(direction);
        let cell = |x: f32, size: usize| ((x * size as f32) as usize).min(size - 1);
        self.table.pdf(cell(u, self.width), cell(v, self.height))
    }

    /// How many numbers of the picture were no amounts of light.
    pub fn repaired(&self) -> u64 {
        self.repaired
    }

    /// Bytes of memory that it takes up.
    pub fn bytes(&self) -> usize {
        self.texels.capacity() * size_of::<[f32; 3]>() + self.table.bytes()
    }
}

/// Where in the picture a direction is: 0 to 1 from the left to the right and from the top to the bottom. What has
/// no direction is in the middle of the top row.
fn place(direction: Vec3) -> [f32; 2] {
    let Vec3 { x, y, z } = direction;
    // Better than the arc cosine of y near the poles.
    let from_top = libm::atan2f((x * x + z * z).sqrt(), y);
    let [u, v] = [0.5 + libm::atan2f(x, -z) / f32::consts::TAU, from_top / f32::consts::PI];
    [u, v].map(|place| if place.is_nan() { 0.0 } else { place.clamp(0.0, 1.0) })
}

/// Linear light of a picture.
fn light(picture: DynamicImage) -> Vec<[f32; 3]> {
    let is_linear = matches!(picture, DynamicImage::ImageRgb32F(_) | DynamicImage::ImageRgba32F(_));
    let light = |numbers: Vec<f32>| numbers.as_chunks().0.to_vec();
    if is_linear {
        return light(picture.into_rgb32f().into_raw());
    }
    // Sixteen bits hold what eight do, and more.
    let words = picture.into_rgb16().into_raw();
    light(words.into_iter().map(linear).collect())
}

#[cfg(test)]
mod tests;
