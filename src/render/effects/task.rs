//! Tiles of a picture that shows effects: their pixels in small squares, sample by sample.

use super::cost::Usage;
use super::path::{Path, Use, Way};
use super::wave::{Seen, Waves, World};
use crate::render::frame::TilePixels;
use crate::render::sampling::subpixel;
use crate::render::scatter::{Media, Sequence};
use crate::render::tile::SQUARE;
use crate::scene::effects::{Effect, EffectSet};
use crate::scene::texture::Cone;
use crate::scene::{Surface, View};
use crate::traverse::Dispatch;
use glam::Vec3;
use std::time::Instant;

/// All that rendering a tile with effects reads.
pub struct EffectTask<'a, S> {
    pub world: World<'a, S>,
    pub view: View,
    /// Samples per pixel, at most.
    pub samples: u32,
    /// The standard error of a pixel's brightness, as displays show it from 0 to 1, at which it has samples enough;
    /// 0 takes all of them.
    pub error: f32,
    /// Gives the rays or uses of this effect in place of the light.
    pub counted: Option<Effect>,
}

/// Samples that a pixel gets before its error is guessed: fewer would agree by chance too often.
const LEAST: u32 = 16;

/// What a worker keeps from tile to tile.
#[derive(Debug, Default)]
pub struct EffectScratch {
    pub waves: Waves,
    /// Samples taken.
    pub samples: u64,
    /// Seconds that each tile took, waiting included.
    pub tiles: Vec<f32>,
    paths: Vec<Path>,
    /// Light of the sample at hand, and of all so far.
    sample: Vec<Vec3>,
    sums: Vec<Vec3>,
    /// Rays or uses of the effect that is counted.
    counts: Vec<u32>,
    /// Of the brightness so far: its mean, and the sum of squared differences from it.
    spread: Vec<[f32; 2]>,
    /// Pixels that want more samples, in the order in which they are traced.
    wanting: Vec<u16>,
    taken: Vec<u32>,
    seen: Seen,
}

impl EffectScratch {
    /// About what it takes up at most, where each path may become several: some thousands of paths at once.
    const BYTES: usize = 2 << 20;
    /// The same where paths stay one a pixel, as does light that is looked for: hundreds.
    const BYTES_STRAIGHT: usize = 512 << 10;

    /// About what it takes up at most while these effects run.
    pub fn bytes(set: EffectSet) -> usize {
        const STRAIGHT: EffectSet = EffectSet::NONE
            .with(Effect::Textures, true)
            .with(Effect::Bump, true)
            .with(Effect::SmoothNormals, true)
            .with(Effect::CutOuts, true)
            .with(Effect::Highlights, true)
            .with(Effect::Shadows, true)
            .with(Effect::DepthOfField, true)
            .with(Effect::Antialiasing, true);
        if set.or(STRAIGHT) == STRAIGHT { Self::BYTES_STRAIGHT } else { Self::BYTES }
    }

    /// Empty, with what has been learnt before about kernels.
    pub fn new(learnt: Dispatch, counts: bool) -> Self {
        Self { waves: Waves::new(learnt, counts), ..Self::default() }
    }
}

impl<S: Surface> EffectTask<'_, S> {
    /// Renders a tile into its pixels.
    pub fn render(&self, scratch: &mut EffectScratch, mut pixels: TilePixels<'_>) {
        let start = Instant::now();
        let tile = pixels.tile;
        for y in (0..tile.height).step_by(SQUARE as usize) {
            for x in (0..tile.width).step_by(SQUARE as usize) {
                let _session = self.world.accel.cached().map(|cached| cached.session());
                self.square(scratch, &mut pixels, [x, y]);
            }
        }
        scratch.tiles.push(start.elapsed().as_secs_f32());
    }

    /// Renders the square of a tile at a place in it.
    fn square(&self, scratch: &mut EffectScratch, pixels: &mut TilePixels<'_>, [x, y]: [u32; 2]) {
        let tile = pixels.tile;
        let [width, height] = [SQUARE.min(tile.width - x), SQUARE.min(tile.height - y)];
        let count = (width * height) as usize;
        let in_picture = |pixel: u16| {
            let pixel = u32::from(pixel);
            [tile.x + x + pixel % width, tile.y + y + pixel / width]
        };
        scratch.begin(count);
        scratch.wanting.extend(in_blocks(width, height));

        let mut first_done = None;
        for sample in 0..self.samples {
            scratch.waves.counted.clear();
            self.camera_paths(scratch, sample, &in_picture);
            scratch.sample.fill(Vec3::ZERO);
            let EffectScratch { waves, paths, sample: light, seen, .. } = scratch;
            let seen = (sample == 0).then_some(seen);
            self.world.run(waves, paths, |pixel| Sequence::of(in_picture(pixel), sample), light, seen);
            if let Some(counted) = self.counted {
                scratch.count(counted);
            }
            scratch.take(self.error, sample + 1);
            if scratch.wanting.is_empty() {
                break;
            }
            first_done = first_done.or_else(|| Some(Instant::now()));
        }
        if let Some(start) = first_done.filter(|_| self.world.set.has(Effect::Antialiasing)) {
            let more = scratch.taken.iter().map(|&taken| u64::from(taken - 1)).sum();
            scratch.waves.tallies.uses[Effect::Antialiasing] += Usage::timed(more, start.elapsed());
        }

        for pixel in 0..count {
            let (x, y) = (x + pixel as u32 % width, y + pixel as u32 / width);
            pixels.color.put(x, y, self.shown(scratch, pixel));
            let (depth, normal) = scratch.seen[pixel].unwrap_or((f32::INFINITY, Vec3::ZERO));
            pixels.depth.put(x, y, depth);
            pixels.normal.put(x, y, normal.to_array());
        }
    }

    /// What a pixel of the square shows.
    fn shown(&self, scratch: &EffectScratch, pixel: usize) -> [f32; 3] {
        let taken = scratch.taken[pixel];
        match self.counted {
            None => (scratch.sums[pixel] / taken as f32).to_array(),
            // There is no more than one for each sample, whatever a pixel costs.
            Some(Effect::Antialiasing) if self.world.set.has(Effect::Antialiasing) => [(taken - 1) as f32; 3],
            Some(_) => [scratch.counts[pixel] as f32 / taken as f32; 3],
        }
    }

    /// A path from the camera for each pixel that wants one.
    fn camera_paths(&self, scratch: &mut EffectScratch, sample: u32, in_picture: &impl Fn(u16) -> [u32; 2]) {
        let EffectScratch { paths, wanting, waves, samples, .. } = scratch;
        let cone = Cone::new(self.view.pixel_spread());
        let ray = |[x, y]: [u32; 2]| self.view.ray(x, y, subpixel(sample));
        paths.clear();
        paths.extend(wanting.iter().map(|&pixel| Path {
            pixel,
            cone,
            ..Path::of_ray(ray(in_picture(pixel)))
        }));
        *samples += paths.len() as u64;
        if self.world.set.has(Effect::DepthOfField) {
            let start = Instant::now();
            for path in &mut *paths {
                let [x, y] = in_picture(path.pixel);
                let lens = path.random(&Sequence::of([x, y], sample), Use::Lens);
                path.ray = self.view.lens_ray(x, y, subpixel(sample), lens);
            }
            waves.tallies.uses[Effect::DepthOfField] += Usage::timed(paths.len() as u64, start.elapsed());
            if waves.counts {
                waves.counted.extend(paths.iter().map(|path| (path.pixel, Effect::DepthOfField)));
            }
        }
    }
}

impl EffectScratch {
    /// Forgets the square before.
    fn begin(&mut self, count: usize) {
        self.sample.clear();
        self.sample.resize(count, Vec3::ZERO);
        self.sums.clear();
        self.sums.resize(count, Vec3::ZERO);
        self.counts.clear();
        self.counts.resize(count, 0);
        self.spread.clear();
        self.spread.resize(count, [0.0; 2]);
        self.taken.clear();
        self.taken.resize(count, 0);
        self.seen.clear();
        self.seen.resize(count, None);
        self.wanting.clear();
    }

    /// Counts the rays or uses of an effect in the sample at hand.
    fn count(&mut self, counted: Effect) {
        for &(pixel, effect) in &self.waves.counted {
            if effect == counted {
                self.counts[usize::from(pixel)] += 1;
            }
        }
    }

    /// Adds the sample at hand, of so many that there are now, and lets pixels go whose error is small enough.
    fn take(&mut self, error: f32, count: u32) {
        for &pixel in &self.wanting {
            let pixel = usize::from(pixel);
            let light = self.sample[pixel];
            self.sums[pixel] += light;
            self.taken[pixel] = count;
            // Welford's running mean and sum of squares.
            let [mean, squares] = &mut self.spread[pixel];
            let before = brightness(light) - *mean;
            *mean += before / count as f32;
            *squares += before * (brightness(light) - *mean);
        }
        if error > 0.0 && count >= LEAST {
            let spread = &self.spread;
            self.wanting.retain(|&pixel| {
                let [_, squares] = spread[usize::from(pixel)];
                let variance = squares / (count - 1) as f32;
                variance > error * error * count as f32
            });
        }
    }
}

/// How bright light looks on a display, 0 to 1: about its square root. Brighter than white is white.
fn brightness(light: Vec3) -> f32 {
    light.dot(Vec3::new(0.2126, 0.7152, 0.0722)).clamp(0.0, 1.0).sqrt()
}

/// The pixels of a square, numbered in rows, in the order of the blocks of 4 x 4 that packets are made of.
fn in_blocks(width: u32, height: u32) -> impl Iterator<Item = u16> {
    const SIDE: usize = 4;
    (0..height).step_by(SIDE).flat_map(move |top| {
        (0..width).step_by(SIDE).flat_map(move |left| {
            let rows = top..height.min(top + SIDE as u32);
            rows.flat_map(move |y| (left..width.min(left + SIDE as u32)).map(move |x| (y * width + x) as u16))
        })
    })
}

impl Path {
    /// A ray from the camera, of no width.
    pub fn of_ray(ray: crate::geometry::Ray) -> Self {
        Self {
            ray,
            pixel: 0,
            depth: 0,
            way: Way::Camera,
            density: 0.0,
            is_indirect: false,
            from: ray.origin,
            branch: 0,
            weight: Vec3::ONE,
            cone: Cone::new(0.0),
            media: Media::OUTSIDE,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_hold_each_pixel_once() {
        for (width, height) in [(16, 16), (1, 1), (5, 3), (16, 2)] {
            let mut pixels: Vec<u16> = in_blocks(width, height).collect();
            if width == 16 && height == 16 {
                assert_eq!(pixels[..5], [0, 1, 2, 3, 16]);
                assert_eq!(pixels[16], 4);
            }
            pixels.sort_unstable();
            assert!(pixels.iter().copied().eq(0..(width * height) as u16));
        }
    }

    #[test]
    fn pixels_that_agree_with_themselves_want_no_more() {
        let mut scratch = EffectScratch::default();
        scratch.begin(2);
        scratch.wanting.extend([0, 1]);
        for count in 1..=LEAST {
            scratch.sample = vec![Vec3::splat(0.5), Vec3::splat((count % 2) as f32)];
            scratch.take(0.01, count);
        }
        assert_eq!(scratch.wanting, [1]);
        assert_eq!((scratch.taken[0], scratch.sums[0]), (LEAST, Vec3::splat(0.5 * LEAST as f32)));
    }
}
