//! The order of tiles: along a Hilbert curve, so that tiles that follow one another are
//! neighbours and find the same part of the tree in the cache.

/// A rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// Left column.
    pub x: u32,
    /// Top row.
    pub y: u32,
    /// Columns; fewer than asked for at the right border.
    pub width: u32,
    /// Rows; fewer than asked for at the lower border.
    pub height: u32,
}

impl Tile {
    /// Number of pixels.
    pub const fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }
}

/// Cuts a picture into tiles of `side` pixels and puts them in order along the Hilbert curve of
/// the least power-of-two square around them: places of that square beyond the picture are left
/// out, so in elongated pictures the way makes a jump now and then.
///
/// Panics if `side` is 0.
pub fn tiles(width: u32, height: u32, side: u32) -> Vec<Tile> {
    let (columns, rows) = (width.div_ceil(side), height.div_ceil(side));
    let order = columns.max(rows).next_power_of_two().trailing_zeros();
    let mut places: Vec<(u64, u32, u32)> = (0..rows)
        .flat_map(|row| (0..columns).map(move |column| (hilbert_index(order, column, row), column, row)))
        .collect();
    places.sort_unstable();
    places
        .into_iter()
        .map(|(_, column, row)| {
            let (x, y) = (column * side, row * side);
            Tile { x, y, width: side.min(width - x), height: side.min(height - y) }
        })
        .collect()
}

/// How far along the Hilbert curve of a square of `2^order` places a side a place lies.
///
/// Quadrant by quadrant from the largest: each adds the quadrants before it, and turns what is
/// inside so that the curve goes on where it left off.
fn hilbert_index(order: u32, mut x: u32, mut y: u32) -> u64 {
    let mut index = 0;
    for level in (0..order).rev() {
        let (right, lower) = (x >> level & 1, y >> level & 1);
        index += u64::from((3 * right) ^ lower) << (2 * level);
        if lower == 0 {
            if right == 1 {
                let last = (1 << level) - 1;
                (x, y) = (last - (x & last), last - (y & last));
            }
            (x, y) = (y, x);
        }
    }
    index
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_in_one_tile() {
        for (width, height, side) in
            [(1, 1, 1), (64, 64, 16), (100, 37, 16), (3, 200, 7), (257, 1, 32), (5, 5, 1024)]
        {
            let mut seen = vec![0u8; (width * height) as usize];
            for tile in tiles(width, height, side) {
                assert!(tile.width <= side && tile.height <= side);
                for y in tile.y..tile.y + tile.height {
                    for x in tile.x..tile.x + tile.width {
                        seen[(y * width + x) as usize] += 1;
                    }
                }
            }
            assert!(seen.iter().all(|&n| n == 1), "{width}x{height} by {side}");
        }
    }

    #[test]
    fn in_a_power_of_two_square_each_tile_touches_the_next() {
        for side in [1, 2, 4, 32] {
            let way = tiles(64, 64, 64 / side);
            assert_eq!(way.len() as u32, side * side);
            for pair in way.windows(2) {
                let step = pair[0].x.abs_diff(pair[1].x) + pair[0].y.abs_diff(pair[1].y);
                assert_eq!(step, 64 / side, "{:?} to {:?}", pair[0], pair[1]);
            }
        }
    }
}
