//! Rendering one tile: its pixels in small blocks, a packet to each.

use super::frame::TilePixels;
use super::order::Tile;
use super::sampling::subpixel;
use super::shade::Shader;
use super::stats::Tally;
use crate::scene::View;
use crate::traverse::{Accel, HitPacket, PacketWidth, RayPacket};
use glam::Vec3;
use std::time::Instant;

/// Pixels that go through the stages together: enough that reading the clock between stages
/// costs nothing, few enough that their rays and hits stay in the nearest caches.
const BATCH: usize = 256;

/// All that a tile's rendering reads.
pub(super) struct TileTask<'a> {
    pub accel: &'a Accel,
    pub shader: Shader<'a>,
    pub view: View,
    pub samples: u32,
}

/// One packet's pixels on their way through the stages.
struct Block<const W: usize> {
    /// The upper left pixel in the tile.
    x: u32,
    y: u32,
    /// A bit for each lane whose pixel is in the tile.
    active: u32,
    rays: RayPacket<W>,
    hits: HitPacket<W>,
    shadows: RayPacket<W>,
    /// A bit for each lane whose shadow ray matters.
    lit: u32,
    /// Light that a free shadow ray adds.
    key: [Vec3; W],
    /// Light of all samples so far.
    sum: [Vec3; W],
}

/// What a worker keeps from tile to tile: room for a batch, and its counts.
pub(super) struct Scratch<const W: usize> {
    blocks: Vec<Block<W>>,
    pub camera: Tally,
    pub shadow: Tally,
}

impl<const W: usize> Scratch<W> {
    pub fn new() -> Self {
        let block = || Block {
            x: 0,
            y: 0,
            active: 0,
            rays: RayPacket::empty(),
            hits: HitPacket::miss(),
            shadows: RayPacket::empty(),
            lit: 0,
            key: [Vec3::ZERO; W],
            sum: [Vec3::ZERO; W],
        };
        let blocks = (0..BATCH / W).map(|_| block()).collect();
        Self { blocks, camera: Tally::default(), shadow: Tally::default() }
    }
}

/// Width and height of the block of pixels that a packet covers: 1x1, 2x2, 4x2 or 4x4.
const fn block_size(lanes: usize) -> (u32, u32) {
    match lanes {
        1 => (1, 1),
        4 => (2, 2),
        8 => (4, 2),
        _ => (4, 4),
    }
}

/// The lanes of a block at (`x`, `y`) whose pixels are in the tile.
#[inline]
fn lanes_inside<const W: usize>(tile: &Tile, x: u32, y: u32) -> u32 {
    let (width, height) = block_size(W);
    let columns = (1 << width.min(tile.width - x)) - 1;
    (0..height.min(tile.height - y)).fold(0, |lanes, row| lanes | columns << (row * width))
}

/// The indices of the set bits.
#[inline]
fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}

impl TileTask<'_> {
    /// Renders a tile into its pixels.
    pub fn render<const W: usize>(&self, scratch: &mut Scratch<W>, pixels: TilePixels<'_>)
    where
        RayPacket<W>: PacketWidth<W>,
    {
        let mut pixels = pixels;
        let (width, height) = block_size(W);
        let tile = pixels.tile;
        let columns = tile.width.div_ceil(width);
        let count = columns * tile.height.div_ceil(height);
        let batch = scratch.blocks.len() as u32;
        for start in (0..count).step_by(batch as usize) {
            let used = batch.min(count - start) as usize;
            for (index, block) in (start..).zip(&mut scratch.blocks[..used]) {
                (block.x, block.y) = (index % columns * width, index / columns * height);
                block.active = lanes_inside::<W>(&tile, block.x, block.y);
                block.sum = [Vec3::ZERO; W];
            }
            for sample in 0..self.samples {
                self.sample_batch(scratch, used, sample, &mut pixels);
            }
            self.write(&scratch.blocks[..used], &mut pixels);
        }
    }

    /// Takes one sample of each pixel of a batch: camera rays, shading, shadow rays.
    fn sample_batch<const W: usize>(
        &self,
        scratch: &mut Scratch<W>,
        used: usize,
        sample: u32,
        pixels: &mut TilePixels<'_>,
    ) where
        RayPacket<W>: PacketWidth<W>,
    {
        let blocks = &mut scratch.blocks[..used];
        let offset = subpixel(sample);

        let start = Instant::now();
        for block in &mut *blocks {
            self.trace_camera(block, &pixels.tile, offset);
            scratch.camera.rays += u64::from(block.active.count_ones());
        }
        scratch.camera.time += start.elapsed();

        for block in &mut *blocks {
            self.shade(block, sample == 0, pixels);
        }

        let start = Instant::now();
        for block in blocks {
            let occluded = match block.lit {
                0 => 0,
                lit => self.accel.occluded_packet(&block.shadows, lit),
            };
            for lane in lanes(block.lit & !occluded) {
                block.sum[lane] += block.key[lane];
            }
            scratch.shadow.rays += u64::from(block.lit.count_ones());
        }
        scratch.shadow.time += start.elapsed();
    }

    fn trace_camera<const W: usize>(&self, block: &mut Block<W>, tile: &Tile, offset: [f32; 2])
    where
        RayPacket<W>: PacketWidth<W>,
    {
        // Lanes beyond the border get rays like the others: they cost nothing and are not traced.
        let width = block_size(W).0;
        for lane in 0..W as u32 {
            let (x, y) = (tile.x + block.x + lane % width, tile.y + block.y + lane / width);
            block.rays.set(lane as usize, &self.view.ray(x, y, offset));
        }
        block.hits = self.accel.intersect_packet(&block.rays, block.active);
    }

    /// Shades a block's hits and makes its shadow rays. The first sample also fills the depth and
    /// normal pictures.
    fn shade<const W: usize>(&self, block: &mut Block<W>, first: bool, pixels: &mut TilePixels<'_>) {
        block.lit = 0;
        for lane in lanes(block.active) {
            let shade = self.shader.shade(&block.rays.get(lane), &block.hits.get(lane));
            block.sum[lane] += shade.base;
            if let Some(ray) = &shade.shadow {
                block.shadows.set(lane, ray);
                block.key[lane] = shade.key;
                block.lit |= 1 << lane;
            }
            if first {
                let index = pixel_index::<W>(&pixels.tile, block.x, block.y, lane);
                if let Some(depth) = pixels.depth.get_mut(index) {
                    *depth = shade.depth;
                }
                if let Some(normal) = pixels.normal.get_mut(index) {
                    *normal = shade.normal.to_array();
                }
            }
        }
    }

    fn write<const W: usize>(&self, blocks: &[Block<W>], pixels: &mut TilePixels<'_>) {
        let weight = 1.0 / self.samples as f32;
        for block in blocks {
            for lane in lanes(block.active) {
                let index = pixel_index::<W>(&pixels.tile, block.x, block.y, lane);
                pixels.color[index] = (block.sum[lane] * weight).to_array();
            }
        }
    }
}

/// Where in the tile's pixels a lane of the block at (`x`, `y`) is.
#[inline]
fn pixel_index<const W: usize>(tile: &Tile, x: u32, y: u32, lane: usize) -> usize {
    let width = block_size(W).0;
    let (x, y) = (x + lane as u32 % width, y + lane as u32 / width);
    (y * tile.width + x) as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered<const W: usize>(tile: Tile) {
        let mut seen = vec![0; tile.pixels()];
        let (width, height) = block_size(W);
        assert_eq!((width * height) as usize, W);
        for y in (0..tile.height).step_by(height as usize) {
            for x in (0..tile.width).step_by(width as usize) {
                for lane in lanes(lanes_inside::<W>(&tile, x, y)) {
                    seen[pixel_index::<W>(&tile, x, y, lane)] += 1;
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1), "{W} lanes, {tile:?}");
    }

    #[test]
    fn blocks_cover_tiles_of_any_size() {
        for (width, height) in [(1, 1), (4, 4), (5, 3), (32, 32), (31, 2), (3, 9)] {
            let tile = Tile { x: 7, y: 11, width, height };
            covered::<1>(tile);
            covered::<4>(tile);
            covered::<8>(tile);
            covered::<16>(tile);
        }
    }
}
