//! Rendering one tile: its pixels in small blocks, a packet to each.

mod calls;

pub(super) use calls::Calls;

use super::bounded::StandIn;
use super::frame::TilePixels;
use super::matt::{AddKey, Found, Shades};
use super::order::Tile;
use super::sampling::subpixel;
use super::shade::Shader;
use super::stats::Tally;
use crate::morton;
use crate::scene::{Look, Surface, View};
use crate::simd::{Simd, Task};
use crate::traverse::{Accel, Dispatch, HitPacket, PacketWidth, Place, Places, RayPacket, Stopwatch};
use std::ops::Range;
use std::time::Instant;

/// Side of the square of pixels that go through the stages together: what the tile kernel takes; enough
/// that reading the clock between stages costs nothing, few enough that their rays and hits stay in the
/// nearest caches.
pub(super) const SQUARE: u32 = 16;

/// Side of a lot of such squares, which wide beams take at once.
const LOT: u32 = 2 * SQUARE;

/// So many lots beside one another, and as many below, make a field, whose shadow rays go at once, and camera rays where they go as lists.
const LOTS: u32 = 2;

/// Lots in a field.
const FIELD: usize = (LOTS * LOTS) as usize;

/// Squares in a lot.
const SQUARES: usize = ((LOT / SQUARE) * (LOT / SQUARE)) as usize;

/// So many squares lie beside one another over so many pixels.
pub(super) const fn squares(pixels: u32) -> usize {
    pixels.div_ceil(SQUARE) as usize
}

/// Pixels in a square.
const BATCH: usize = (SQUARE * SQUARE) as usize;

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

/// What goes at once.
struct Field<'a> {
    /// The packets of each lot, one lot behind the other.
    parts: &'a [Range<usize>],
    /// The squares of each.
    places: &'a [[Place<'a>; SQUARES]; FIELD],
    /// Packets in all.
    used: usize,
}

/// One packet's pixels.
#[derive(Clone, Copy)]
struct Block {
    /// The upper left pixel in the tile.
    x: u32,
    y: u32,
}

/// What a worker keeps from tile to tile: room for what goes at once, packet by packet, and its counts.
pub(super) struct Scratch<const W: usize> {
    blocks: Vec<Block>,
    /// A bit for each lane whose pixel is in the tile.
    active: Vec<u32>,
    /// Camera rays of what goes at once, a square, a lot or a field, and what they hit.
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
    /// Empty, with what has been learnt before about kernels, and room for so many squares of pixels, to the right and down, of such a
    /// side.
    pub fn new(dispatch: Dispatch, side: u32, lots: u32) -> Self {
        let count = (lots * lots * side * side) as usize / W;
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
        let side = (self.calls.lots * self.calls.side) as usize;
        for y in (0..tile.height).step_by(side) {
            for x in (0..tile.width).step_by(side) {
                // A scene that is in memory in part gives its turns by squares.
                let _session = self.accel.cached().map(|cached| cached.session());
                let Some(stand_in) = &self.stand_in else {
                    self.field(scratch, &mut pixels, (x, y));
                    continue;
                };
                if stand_in.cached.in_time(|| self.field(scratch, &mut pixels, (x, y))).is_none() {
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

    /// Renders what goes at once at a place in a tile: a square, a lot or a field.
    fn field(&self, scratch: &mut Scratch<W>, pixels: &mut TilePixels<'_>, (x, y): (u32, u32)) {
        let Calls { side, lots, .. } = self.calls;
        let mut places = [[Place::NONE; SQUARES]; FIELD];
        let mut parts = [const { 0..0 }; FIELD];
        let (mut used, mut inside) = (0, 0);
        for lot in 0..lots * lots {
            let (right, down) = morton::place(lot);
            let (x, y) = (x + side * right, y + side * down);
            if x >= pixels.tile.width || y >= pixels.tile.height {
                continue;
            }
            let begin = used;
            used = scratch.cover(&pixels.tile, (x, y), side, begin);
            parts[inside] = begin..used;
            // Where squares of tiles do not lie on the grid of the picture, two may have one number.
            let [column, row] = [pixels.tile.x + x, pixels.tile.y + y].map(|place| (place / SQUARE) as usize);
            places[inside] = std::array::from_fn(|square| {
                let (right, down) = (square % 2, square / 2);
                self.places.at((row + down) * self.columns + column + right)
            });
            inside += 1;
        }
        let field = Field { parts: &parts[..inside], places: &places, used };
        for sample in 0..self.samples {
            self.sample(scratch, &field, sample, pixels);
        }
        self.write(scratch, used, pixels);
    }

    /// Takes one sample of each pixel: camera rays and shading, lot by lot or, where they go as lists, all at once; and shadow rays.
    fn sample(&self, scratch: &mut Scratch<W>, field: &Field<'_>, sample: u32, pixels: &mut TilePixels<'_>) {
        // At the edge of a tile lots are smaller, and a field is none.
        let all = 0..field.used;
        let is_whole = all.len() == field.parts.len() * SQUARES * BATCH / W;
        let parts = |at_once| if at_once { std::slice::from_ref(&all) } else { field.parts };

        let mut places = field.places.as_flattened();
        for part in parts(is_whole && scratch.dispatch.looks_in_lists()) {
            let start = Stopwatch::start(self.accel);
            let active = &scratch.active[part.clone()];
            self.make_rays(&scratch.blocks[part.clone()], &mut scratch.rays, &pixels.tile, subpixel(sample));
            let (rays, hits) = (&scratch.rays[..part.len()], &mut scratch.hits[..part.len()]);
            (self.calls.intersect)(&mut scratch.dispatch, self.accel, places, rays, active, hits);
            scratch.camera.rays += count(active);
            scratch.camera.time += start.elapsed(self.accel);
            places = places.get(SQUARES..).unwrap_or_default();

            let surfaces = self.shader.reader();
            for packet in 0..part.len() {
                self.shade(scratch, &surfaces, (packet, part.start + packet), sample == 0, pixels);
            }
        }

        let mut places = field.places.as_flattened();
        let parts = parts(is_whole);
        for part in parts {
            let start = Stopwatch::start(self.accel);
            let lit = &scratch.lit[part.clone()];
            let (rays, occluded) = (&scratch.shadows[part.clone()], &mut scratch.occluded[part.clone()]);
            (self.calls.occluded)(&mut scratch.dispatch, self.accel, places, rays, lit, occluded);
            self.accel.chosen().run(AddKey { shades: &mut scratch.shades[part.clone()], lit, occluded });
            scratch.shadow.rays += count(lit);
            scratch.shadow.time += start.elapsed(self.accel);
            places = places.get(SQUARES..).unwrap_or_default();
        }
    }

    /// Makes the rays through a point of each pixel.
    fn make_rays(&self, blocks: &[Block], rays: &mut [RayPacket<W>], tile: &Tile, offset: [f32; 2]) {
        self.accel.chosen().run(CameraRays { view: &self.view, blocks, rays, tile, offset });
    }

    /// Shades a packet's hits, by its numbers in what went at once and at all, and makes its shadow rays. The first sample also fills the depth and
    /// normal pictures.
    fn shade(
        &self,
        scratch: &mut Scratch<W>,
        surfaces: &impl Look,
        (at_once, packet): (usize, usize),
        first: bool,
        pixels: &mut TilePixels<'_>,
    ) {
        let (block, shades) = (scratch.blocks[packet], &mut scratch.shades[packet]);
        let (rays, hits, active) = (&scratch.rays[at_once], &scratch.hits[at_once], scratch.active[packet]);
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
    /// Lays blocks over the square of a tile at (`x`, `y`), behind so many others, and says how many there are then. They come in Morton
    /// order, four by four pixels at a time, so that each four such quarters and each sixteen are squares, too.
    fn cover(&mut self, tile: &Tile, (x, y): (u32, u32), side: u32, before: usize) -> usize {
        let (width, height) = block_size(W);
        let mut used = before;
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
        let mut scratch = Scratch::<W>::new(Dispatch::default(), side, 1);
        for y in (0..tile.height).step_by(side as usize) {
            for x in (0..tile.width).step_by(side as usize) {
                let used = scratch.cover(&tile, (x, y), side, 0);
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
