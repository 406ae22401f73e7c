//! Rendering one tile: its pixels in small blocks, a packet to each.

use super::bounded::StandIn;
use super::frame::TilePixels;
use super::matt::{AddKey, Found, Shades};
use super::order::Tile;
use super::sampling::subpixel;
use super::shade::Shader;
use super::stats::Tally;
use crate::geometry::{Hit, Ray};
use crate::morton;
use crate::scene::{Look, Surface, View};
use crate::simd::{Simd, Task};
use crate::traverse::{Accel, Dispatch, HitPacket, Kernel, PacketWidth, Place, Places, RayPacket, Stopwatch};
use std::time::Instant;

/// Side of the square of pixels that go through the stages together: what the tile kernel takes; enough
/// that reading the clock between stages costs nothing, few enough that their rays and hits stay in the
/// nearest caches.
pub(super) const SQUARE: u32 = 16;

/// Side of a lot of such squares, which wide beams take at once.
const LOT: u32 = 2 * SQUARE;

/// Squares in a lot.
const SQUARES: usize = ((LOT / SQUARE) * (LOT / SQUARE)) as usize;

/// So many squares lie beside one another over so many pixels.
pub(super) const fn squares(pixels: u32) -> usize {
    pixels.div_ceil(SQUARE) as usize
}

/// Pixels in a square.
const BATCH: usize = (SQUARE * SQUARE) as usize;

/// Answers, packet by packet, what was asked of their lanes at the places of their squares.
type Call<const W: usize, A> = fn(&mut Dispatch, &Accel, &[Place<'_>], &[RayPacket<W>], &[u32], &mut [A]);

/// How a square's packets are traced. What was learnt from the squares before is there for those who can
/// use it.
pub(super) struct Calls<const W: usize> {
    /// Side of the square of pixels whose packets come at once: [`SQUARE`] or [`LOT`].
    side: u32,
    /// The closest hits of the lanes given with each packet.
    intersect: Call<W, HitPacket<W>>,
    /// Which of those lanes hit anything.
    occluded: Call<W, u32>,
}

impl<const W: usize> Calls<W>
where
    RayPacket<W>: PacketWidth<W>,
{
    /// Packet by packet.
    pub const PACKETS: Self = Self {
        side: SQUARE,
        intersect: |_, accel, _, rays, active, hits| accel.intersect_packets(rays, active, hits),
        occluded: |_, accel, _, rays, active, occluded| accel.occluded_packets(rays, active, occluded),
    };
}

impl Calls<1> {
    /// All rays of a square in one stream.
    pub const STREAM: Self = Self {
        side: SQUARE,
        intersect: |_, accel, _, rays, active, hits| {
            intersect_each(accel, Kernel::Stream, rays, active, hits)
        },
        occluded: |_, accel, _, rays, active, found| {
            occluded_each(accel, Kernel::Stream, rays, active, found)
        },
    };

    /// All rays of a lot in lists.
    pub const LISTS: Self = Self {
        side: LOT,
        intersect: |_, accel, _, rays, active, hits| {
            intersect_each(accel, Kernel::Filter, rays, active, hits)
        },
        occluded: |_, accel, _, rays, active, found| {
            occluded_each(accel, Kernel::Filter, rays, active, found)
        },
    };
}

/// Traces rays one by one, as the kernel sees it.
fn intersect_each(
    accel: &Accel,
    kernel: Kernel,
    rays: &[RayPacket<1>],
    active: &[u32],
    hits: &mut [HitPacket<1>],
) {
    let mut found = [Hit::MISS; SQUARES * BATCH];
    let found = &mut found[..rays.len()];
    accel.intersect_many(kernel, &unpacked(rays, active)[..rays.len()], found);
    for (packet, hit) in hits.iter_mut().zip(found) {
        *packet = HitPacket::of_hit(hit);
    }
}

/// The same for any hit.
fn occluded_each(accel: &Accel, kernel: Kernel, rays: &[RayPacket<1>], active: &[u32], occluded: &mut [u32]) {
    let mut found = [false; SQUARES * BATCH];
    let found = &mut found[..rays.len()];
    accel.occluded_many(kernel, &unpacked(rays, active)[..rays.len()], found);
    for (lanes, &found) in occluded.iter_mut().zip(&*found) {
        *lanes = u32::from(found);
    }
}

/// Rays one by one; those that do not count look for nothing.
fn unpacked(rays: &[RayPacket<1>], active: &[u32]) -> [Ray; SQUARES * BATCH] {
    let mut all = [RayPacket::<1>::empty().get(0); SQUARES * BATCH];
    for ((ray, packet), &active) in all.iter_mut().zip(rays).zip(active) {
        if active != 0 {
            *ray = packet.get(0);
        }
    }
    all
}

impl Calls<16> {
    /// All rays of a square together where that is quicker.
    pub const TILES: Self =
        Self { side: SQUARE, intersect: Dispatch::intersect, occluded: Dispatch::occluded };

    /// All rays of a lot, likewise.
    pub const LOTS: Self = Self { side: LOT, ..Self::TILES };
}

/// All that a tile's rendering reads.
pub(super) struct TileTask<'a, S, const W: usize> {
    pub accel: &'a Accel,
    pub calls: Calls<W>,
    pub shader: Shader<'a, S>,
    pub view: View,
    pub samples: u32,
    /// What squares have cost before, by their numbers.
    pub places: &'a Places,
    /// Squares beside one another in the picture.
    pub columns: usize,
    /// What is drawn where blocks do not come in time, if time is limited.
    pub stand_in: Option<StandIn<'a>>,
}

/// One packet's pixels.
#[derive(Clone, Copy)]
struct Block {
    /// The upper left pixel in the tile.
    x: u32,
    y: u32,
}

/// What a worker keeps from tile to tile: room for a square, packet by packet, and its counts.
pub(super) struct Scratch<const W: usize> {
    blocks: Vec<Block>,
    /// A bit for each lane whose pixel is in the tile.
    active: Vec<u32>,
    rays: Vec<RayPacket<W>>,
    hits: Vec<HitPacket<W>>,
    /// What one packet after the other hit.
    found: Found<W>,
    shades: Vec<Shades<W>>,
    /// A bit for each lane whose shadow ray matters.
    lit: Vec<u32>,
    shadows: Vec<RayPacket<W>>,
    occluded: Vec<u32>,
    /// What has been learnt about kernels.
    pub dispatch: Dispatch,
    pub camera: Tally,
    pub shadow: Tally,
    /// Seconds that each tile took, waiting included.
    pub tiles: Vec<f32>,
    /// Tiles that are not complete: the places of their upper left pixels.
    pub late: Vec<(u32, u32)>,
    /// Pixels in them that something else stands for.
    pub stand_ins: u64,
}

impl<const W: usize> Scratch<W> {
    /// Empty, with what has been learnt before about kernels.
    pub fn new(dispatch: Dispatch) -> Self {
        let count = SQUARES * BATCH / W;
        Self {
            blocks: vec![Block { x: 0, y: 0 }; count],
            active: vec![0; count],
            rays: vec![RayPacket::empty(); count],
            hits: vec![HitPacket::miss(); count],
            found: Found::nothing(),
            shades: vec![Shades::black(); count],
            lit: vec![0; count],
            shadows: vec![RayPacket::empty(); count],
            occluded: vec![0; count],
            dispatch,
            camera: Tally::default(),
            shadow: Tally::default(),
            tiles: Vec::new(),
            late: Vec::new(),
            stand_ins: 0,
        }
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
#[inline(always)]
pub(super) fn lanes(mut bits: u32) -> impl Iterator<Item = usize> {
    std::iter::from_fn(move || {
        let lane = (bits != 0).then(|| bits.trailing_zeros() as usize)?;
        bits &= bits - 1;
        Some(lane)
    })
}

impl<S: Surface, const W: usize> TileTask<'_, S, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    /// Renders a tile into its pixels; whether it is complete.
    pub fn render(&self, scratch: &mut Scratch<W>, pixels: TilePixels<'_>) -> bool {
        let start = Instant::now();
        let mut pixels = pixels;
        let tile = pixels.tile;
        let mut is_complete = true;
        let side = self.calls.side as usize;
        for y in (0..tile.height).step_by(side) {
            for x in (0..tile.width).step_by(side) {
                // A scene that is in memory in part gives its turns by squares.
                let _session = self.accel.cached().map(|cached| cached.session());
                let Some(stand_in) = &self.stand_in else {
                    self.square(scratch, &mut pixels, (x, y));
                    continue;
                };
                if stand_in.cached.in_time(|| self.square(scratch, &mut pixels, (x, y))).is_none() {
                    is_complete = false;
                    stand_in.draw(&self.shader, scratch, &mut pixels, (x, y));
                }
            }
        }
        scratch.tiles.push(start.elapsed().as_secs_f32());
        if !is_complete {
            scratch.late.push((tile.x, tile.y));
        }
        is_complete
    }

    /// Renders the square of a tile at a place in it, or the lot.
    fn square(&self, scratch: &mut Scratch<W>, pixels: &mut TilePixels<'_>, (x, y): (u32, u32)) {
        let used = scratch.cover(&pixels.tile, x, y, self.calls.side);
        // Where squares of tiles do not lie on the grid of the picture, two may have one number.
        let [column, row] = [pixels.tile.x + x, pixels.tile.y + y].map(|place| (place / SQUARE) as usize);
        let places: [Place<'_>; SQUARES] = std::array::from_fn(|square| {
            let (right, down) = (square % 2, square / 2);
            self.places.at((row + down) * self.columns + column + right)
        });
        for sample in 0..self.samples {
            self.sample(scratch, used, sample, &places, pixels);
        }
        self.write(scratch, used, pixels);
    }

    /// Takes one sample of each pixel of a square: camera rays, shading, shadow rays.
    fn sample(
        &self,
        scratch: &mut Scratch<W>,
        used: usize,
        sample: u32,
        places: &[Place<'_>],
        pixels: &mut TilePixels<'_>,
    ) {
        let start = Stopwatch::start(self.accel);
        let active = &scratch.active[..used];
        self.make_rays(&scratch.blocks[..used], &mut scratch.rays, &pixels.tile, subpixel(sample));
        let (rays, hits) = (&scratch.rays[..used], &mut scratch.hits[..used]);
        (self.calls.intersect)(&mut scratch.dispatch, self.accel, places, rays, active, hits);
        scratch.camera.rays += count(active);
        scratch.camera.time += start.elapsed(self.accel);

        let surfaces = self.shader.reader();
        for packet in 0..used {
            self.shade(scratch, &surfaces, packet, sample == 0, pixels);
        }
        drop(surfaces);

        let start = Stopwatch::start(self.accel);
        let lit = &scratch.lit[..used];
        let (rays, occluded) = (&scratch.shadows[..used], &mut scratch.occluded[..used]);
        (self.calls.occluded)(&mut scratch.dispatch, self.accel, places, rays, lit, occluded);
        self.accel.chosen().run(AddKey { shades: &mut scratch.shades[..used], lit, occluded });
        scratch.shadow.rays += count(lit);
        scratch.shadow.time += start.elapsed(self.accel);
    }

    /// Makes the rays through a point of each pixel.
    fn make_rays(&self, blocks: &[Block], rays: &mut [RayPacket<W>], tile: &Tile, offset: [f32; 2]) {
        self.accel.chosen().run(CameraRays { view: &self.view, blocks, rays, tile, offset });
    }

    /// Shades a packet's hits and makes its shadow rays. The first sample also fills the depth and
    /// normal pictures.
    fn shade(
        &self,
        scratch: &mut Scratch<W>,
        surfaces: &impl Look,
        packet: usize,
        first: bool,
        pixels: &mut TilePixels<'_>,
    ) {
        let (block, shades) = (scratch.blocks[packet], &mut scratch.shades[packet]);
        let (rays, hits, active) = (&scratch.rays[packet], &scratch.hits[packet], scratch.active[packet]);
        let out = (&mut scratch.found, &mut *shades, &mut scratch.shadows[packet]);
        self.shader.shade(self.accel.chosen(), surfaces, (rays, hits, active), out);
        scratch.lit[packet] = shades.lit;
        if first && (pixels.depth.is_wanted() || pixels.normal.is_wanted()) {
            for lane in lanes(active) {
                let (x, y) = place_of::<W>(block.x, block.y, lane);
                // Infinite, as `t` is, where nothing was hit.
                pixels.depth.put(x, y, hits.t[lane] * rays.get(lane).direction.length());
                pixels.normal.put(x, y, shades.normal.each_ref().map(|row| row[lane]));
            }
        }
    }

    fn write(&self, scratch: &Scratch<W>, used: usize, pixels: &mut TilePixels<'_>) {
        let weight = 1.0 / self.samples as f32;
        let (width, height) = block_size(W);
        for (Block { x, y }, shades) in scratch.blocks[..used].iter().zip(&scratch.shades) {
            let [red, green, blue] = &shades.sum;
            for row in 0..height.min(pixels.tile.height - y) {
                let first = (row * width) as usize;
                let to = pixels.color.part(*x, y + row).into_iter().flatten();
                for (pixel, lane) in to.zip(first..first + width as usize) {
                    *pixel = [red[lane], green[lane], blue[lane]].map(|light| light * weight);
                }
            }
        }
    }
}

/// Makes camera rays.
struct CameraRays<'a, const W: usize> {
    view: &'a View,
    blocks: &'a [Block],
    rays: &'a mut [RayPacket<W>],
    tile: &'a Tile,
    /// Where in its pixel each ray goes through: see [`View::ray`].
    offset: [f32; 2],
}

impl<const W: usize> Task for CameraRays<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let Self { view, blocks, rays, tile, offset } = self;
        // Lanes beyond the border get rays like the others: they cost nothing and are not traced.
        for (block, rays) in blocks.iter().zip(rays) {
            for lane in 0..W {
                let (x, y) = place_of::<W>(tile.x + block.x, tile.y + block.y, lane);
                rays.set(lane, &view.ray(x, y, offset));
            }
        }
    }
}

impl<const W: usize> Scratch<W> {
    /// Lays blocks over the square of a tile at (`x`, `y`), and says how many it takes. They come in Morton order, four
    /// by four pixels at a time, so that each four such quarters and each sixteen are squares, too.
    fn cover(&mut self, tile: &Tile, x: u32, y: u32, side: u32) -> usize {
        let (width, height) = block_size(W);
        let mut used = 0;
        for cell in 0..(side / CELL) * (side / CELL) {
            let (right, down) = morton::place(cell);
            let (left, top) = (x + CELL * right, y + CELL * down);
            for y in (top..tile.height.min(top + CELL)).step_by(height as usize) {
                for x in (left..tile.width.min(left + CELL)).step_by(width as usize) {
                    self.active[used] = lanes_inside::<W>(tile, x, y);
                    self.blocks[used] = Block { x, y };
                    self.shades[used].sum = [[0.0; W]; 3];
                    used += 1;
                }
            }
        }
        used
    }
}

/// Side of the square of pixels that the largest packet covers.
const CELL: u32 = 4;

/// How many lanes are set.
fn count(lanes: &[u32]) -> u64 {
    lanes.iter().map(|lanes| u64::from(lanes.count_ones())).sum()
}

/// Where the pixel of a lane is, for the block at (`x`, `y`).
#[inline(always)]
fn place_of<const W: usize>(x: u32, y: u32, lane: usize) -> (u32, u32) {
    let width = block_size(W).0;
    (x + lane as u32 % width, y + lane as u32 / width)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn covered<const W: usize>(tile: Tile, side: u32) {
        let mut seen = vec![0; tile.pixels()];
        let (width, height) = block_size(W);
        assert_eq!((width * height) as usize, W);
        let mut scratch = Scratch::<W>::new(Dispatch::default());
        for y in (0..tile.height).step_by(side as usize) {
            for x in (0..tile.width).step_by(side as usize) {
                let used = scratch.cover(&tile, x, y, side);
                for (block, &active) in scratch.blocks[..used].iter().zip(&scratch.active) {
                    for lane in lanes(active) {
                        let (x, y) = place_of::<W>(block.x, block.y, lane);
                        seen[(y * tile.width + x) as usize] += 1;
                    }
                }
            }
        }
        assert!(seen.iter().all(|&n| n == 1), "{W} lanes, {tile:?}");
    }

    #[test]
    fn blocks_cover_tiles_of_any_size() {
        for (width, height) in [(1, 1), (4, 4), (5, 3), (32, 32), (31, 2), (3, 9)] {
            let tile = Tile { x: 7, y: 11, width, height };
            for side in [SQUARE, LOT] {
                covered::<1>(tile, side);
                covered::<4>(tile, side);
                covered::<8>(tile, side);
                covered::<16>(tile, side);
            }
        }
    }
}
