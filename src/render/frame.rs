//! Pictures in memory: tile by tile while they are made, row by row when done.

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

/// A picture in the making: the tiles' pixels one tile after the other, so that each worker
/// writes to memory of its own, and no two share a cache line but at a tile's ends.
pub(super) struct TiledFrame {
    color: Vec<[f32; 3]>,
    depth: Option<Vec<f32>>,
    normal: Option<Vec<[f32; 3]>>,
}

/// A tile and the memory for its pixels, in rows.
pub(super) struct TilePixels<'a> {
    pub tile: Tile,
    pub color: &'a mut [[f32; 3]],
    /// Empty if not wanted.
    pub depth: &'a mut [f32],
    /// Empty if not wanted.
    pub normal: &'a mut [[f32; 3]],
}

impl TiledFrame {
    /// A black picture.
    pub fn new(size: Size, aovs: Aovs) -> Self {
        let pixels = size.pixels() as usize;
        Self {
            color: vec![[0.0; 3]; pixels],
            depth: aovs.depth.then(|| vec![0.0; pixels]),
            normal: aovs.normal.then(|| vec![[0.0; 3]; pixels]),
        }
    }

    /// Hands out each tile's memory. `tiles` must cover the picture.
    pub fn split<'a>(&'a mut self, tiles: &[Tile]) -> Vec<TilePixels<'a>> {
        let mut color = self.color.as_mut_slice();
        let mut depth = self.depth.as_deref_mut().unwrap_or_default();
        let mut normal = self.normal.as_deref_mut().unwrap_or_default();
        tiles
            .iter()
            .map(|&tile| {
                let pixels = tile.pixels();
                TilePixels {
                    tile,
                    color: take(&mut color, pixels),
                    depth: take(&mut depth, pixels),
                    normal: take(&mut normal, pixels),
                }
            })
            .collect()
    }

    /// The same picture row by row. `tiles` must be those that it was split into.
    pub fn assemble(&self, size: Size, tiles: &[Tile]) -> Frame {
        Frame {
            size,
            color: in_rows(&self.color, size, tiles),
            depth: self.depth.as_ref().map(|depth| in_rows(depth, size, tiles)),
            normal: self.normal.as_ref().map(|normal| in_rows(normal, size, tiles)),
        }
    }
}

/// Cuts `count` items off the front, or nothing if there are none.
fn take<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let all = std::mem::take(rest);
    let (front, back) = all.split_at_mut(count.min(all.len()));
    *rest = back;
    front
}

fn in_rows<T: Copy + Default>(tiled: &[T], size: Size, tiles: &[Tile]) -> Vec<T> {
    let mut rows = vec![T::default(); tiled.len()];
    let mut rest = tiled;
    for tile in tiles {
        let (pixels, others) = rest.split_at(tile.pixels());
        for (y, line) in pixels.chunks_exact(tile.width as usize).enumerate() {
            let start = (tile.y as usize + y) * size.width as usize + tile.x as usize;
            rows[start..start + line.len()].copy_from_slice(line);
        }
        rest = others;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::order::tiles;

    #[test]
    fn pixels_come_to_where_their_tiles_are() {
        let size = Size { width: 13, height: 7 };
        let tiles = tiles(size.width, size.height, 4);
        let mut tiled = TiledFrame::new(size, Aovs { depth: true, normal: false });
        for job in tiled.split(&tiles) {
            assert!(job.normal.is_empty());
            for i in 0..job.tile.pixels() as u32 {
                let (x, y) = (job.tile.x + i % job.tile.width, job.tile.y + i / job.tile.width);
                job.color[i as usize] = [x as f32, y as f32, 0.0];
                job.depth[i as usize] = (y * 13 + x) as f32;
            }
        }
        let frame = tiled.assemble(size, &tiles);
        for (i, color) in frame.color.iter().enumerate() {
            assert_eq!(*color, [(i % 13) as f32, (i / 13) as f32, 0.0]);
        }
        let expected: Vec<f32> = (0..13 * 7).map(|i| i as f32).collect();
        assert_eq!(frame.depth, Some(expected));
        assert_eq!(frame.normal, None);
    }
}
