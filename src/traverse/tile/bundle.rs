//! What the walk of a beam asks of the rays in it.

use super::beam::PACKETS;
use super::outline::Block;
use super::pairs::Pairs;
use crate::simd::Sixteen;

/// The rays of a beam of `K` squares, and what they have found.
pub trait Bundle<L: Sixteen, const K: usize> {
    /// The work after which a tile is given up, in steps of about one upper node: some times what a tile
    /// takes whose rays are worth tracing together. Rays that are not, because each packet's go all over
    /// the place, or because there are many triangles between one ray and the next, would meet every
    /// triangle in a packet's window.
    const PATIENCE: u32;

    /// Whether packets of a tile that is given up go on alone through what is left of the tree, subtree by subtree; or else from
    /// the root, but no farther than what they have found.
    const TAKES_UP_THE_REST: bool;

    /// Packets with a wider window go on alone from the start: a square of a picture may lie across an edge, so that
    /// a light sees it as two places far apart.
    const WIDEST: f32;

    /// The depth beyond which no ray of each packet of a square looks for anything any more.
    fn reach(&self, square: usize) -> L;

    /// The same of each lane.
    fn reach_of_lanes(&self) -> L;

    /// Tests packets of a square against triangles of a block with the ids `primitives`, pair by pair.
    fn test(&mut self, square: usize, pairs: &Pairs, block: &Block, primitives: &[u32]);

    /// A packet of a square walks on by itself, through the full tree below a place of the upper one, from the depth
    /// `tmin` to `tmax`.
    fn go_alone(&mut self, square: usize, packet: usize, place: usize, tmin: f32, tmax: f32);
}

/// The packet `k` of those in a lane of a beam of `K` squares: its square, and its number there.
#[inline(always)]
pub fn packet_of<const K: usize>(lane: usize, k: usize) -> (usize, usize) {
    let packet = lane * K + k;
    (packet / PACKETS % K, packet % PACKETS)
}

/// The packets of a square whose lanes' bits are set.
#[inline(always)]
pub fn packets_of<const K: usize>(lanes: u32, square: usize) -> u32 {
    if K == 1 {
        return lanes;
    }
    let four = lanes >> (4 * square) & 0xf;
    ((four | four << 3 | four << 6 | four << 9) & 0x1111) * 0xf
}

/// The greatest number of each lane's packets.
#[inline(always)]
pub fn greatest_of_lanes<L: Sixteen, const K: usize>(squares: &[L; K]) -> L {
    match squares.as_chunks::<4>().0 {
        [four] => L::greatest_of_fours(four),
        _ => squares[0],
    }
}

/// What depths are widened by where they become parameters of rays, relative to themselves.
pub const ROUNDINGS: f32 = 1.0 / (1 << 20) as f32;
