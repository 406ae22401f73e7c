//! Pictures in memory, and the parts of them that tiles write to.

use super::order::Tile;
use super::settings::{Aovs, Size};

/// A finished picture. Pixels are in rows from the top, each from the left.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Its size.
    pub size: Size,
    /// Linear RGB; 1 is the brightest that a display shows.
    pub color: Vec<[f32; 3]>,
    /// Distance from the eye in the scene's units, infinite where nothing was hit.
    pub depth: Option<Vec<f32>>,
    /// Unit geometric normals on the side of the eye; zero where nothing was hit.
    pub normal: Option<Vec<[f32; 3]>>,
}

/// A tile and the memory for its pixels.
pub(super) struct TilePixels<'a> {
    pub tile: Tile,
    pub color: Rows<'a, [f32; 3]>,
    pub depth: Rows<'a, f32>,
    pub normal: Rows<'a, [f32; 3]>,
}

/// A tile's part of a picture, row by row; none if the picture is not wanted.
///
/// Tiles write where their pixels belong, so that nothing has to be put together afterwards. Two of them share a cache
/// line at most where one's row ends and the other's begins.
pub(super) struct Rows<'a, T>(Vec<&'a mut [T]>);

impl<T> Rows<'_, T> {
    /// Whether there is anything to be put.
    #[inline]
    pub fn is_wanted(&self) -> bool {
        !self.0.is_empty()
    }

    /// The pixels of a row from `x` on, if they are wanted. Panics if the tile has no such place.
    #[inline(always)]
    pub fn part(&mut self, x: u32, y: u32) -> Option<&mut [T]> {
        self.0.get_mut(y as usize).map(|row| &mut row[x as usize..])
    }

    /// Puts a pixel to its place in the tile, if it is wanted. Panics if the tile has no such place.
    #[inline(always)]
    pub fn put(&mut self, x: u32, y: u32, value: T) {
        if self.is_wanted() {
            self.0[y as usize][x as usize] = value;
        }
    }
}

impl Frame {
    /// A black picture.
    pub(super) fn black(size: Size, aovs: Aovs) -> Self {
        let pixels = size.pixels() as usize;
        Self {
            size,
            color: vec![[0.0; 3]; pixels],
            depth: aovs.depth.then(|| vec![0.0; pixels]),
            normal: aovs.normal.then(|| vec![[0.0; 3]; pixels]),
        }
    }

    /// Hands out each tile's memory. `tiles` must be those of a picture of this size, cut into squares of `side`.
    pub(super) fn split<'a>(&'a mut self, tiles: &[Tile], side: u32) -> Vec<TilePixels<'a>> {
        let grid = Grid::new(self.size, tiles, side);
        let color = grid.rows(&mut self.color, tiles);
        let depth = grid.rows(self.depth.as_deref_mut().unwrap_or_default(), tiles);
        let normal = grid.rows(self.normal.as_deref_mut().unwrap_or_default(), tiles);
        let channels = color.into_iter().zip(depth).zip(normal);
        let jobs = tiles.iter().zip(channels);
        jobs.map(|(&tile, ((color, depth), normal))| TilePixels { tile, color, depth, normal }).collect()
    }
}

/// Which tile is where.
struct Grid {
    /// Side of a tile, and width of the picture, in pixels.
    side: usize,
    width: usize,
    columns: usize,
    /// The tile's number, by its place, row by row.
    number: Vec<usize>,
}

impl Grid {
    fn new(size: Size, tiles: &[Tile], side: u32) -> Self {
        let columns = size.width.div_ceil(side);
        let mut number = vec![0; tiles.len()];
        for (i, tile) in tiles.iter().enumerate() {
            number[(tile.y / side * columns + tile.x / side) as usize] = i;
        }
        Self { side: side as usize, width: size.width as usize, columns: columns as usize, number }
    }

    /// The rows of each tile.
    fn rows<'a, T>(&self, pixels: &'a mut [T], tiles: &[Tile]) -> Vec<Rows<'a, T>> {
        let height = if pixels.is_empty() { 0 } else { self.side };
        let mut rows: Vec<Rows<'a, T>> = tiles.iter().map(|_| Rows(Vec::with_capacity(height))).collect();
        for (y, line) in pixels.chunks_exact_mut(self.width).enumerate() {
            let first = y / self.side * self.columns;
            for (part, &number) in line.chunks_mut(self.side).zip(&self.number[first..]) {
                rows[number].0.push(part);
            }
        }
        rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::order::tiles;

    #[test]
    fn pixels_come_to_where_their_tiles_are() {
        let size = Size { width: 13, height: 7 };
        let tiles = tiles(size.width, size.height, 4);
        for aovs in [Aovs { depth: true, normal: false }, Aovs { depth: false, normal: true }] {
            let mut frame = Frame::black(size, aovs);
            for mut pixels in frame.split(&tiles, 4) {
                assert_eq!((pixels.depth.is_wanted(), pixels.normal.is_wanted()), (aovs.depth, aovs.normal));
                let tile = pixels.tile;
                for (x, y) in (0..tile.height).flat_map(|y| (0..tile.width).map(move |x| (x, y))) {
                    let [column, row] = [tile.x + x, tile.y + y].map(|place| place as f32);
                    pixels.color.put(x, y, [column, row, 0.0]);
                    pixels.depth.put(x, y, row * 13.0 + column);
                    pixels.normal.put(x, y, [0.0, row, column]);
                }
            }
            for (i, color) in frame.color.iter().enumerate() {
                assert_eq!(*color, [(i % 13) as f32, (i / 13) as f32, 0.0]);
            }
            assert_eq!(frame.depth, aovs.depth.then(|| (0..13 * 7).map(|i| i as f32).collect()));
            let normal = |i: usize| [0.0, (i / 13) as f32, (i % 13) as f32];
            assert_eq!(frame.normal, aovs.normal.then(|| (0..13 * 7).map(normal).collect()));
        }
    }
}
