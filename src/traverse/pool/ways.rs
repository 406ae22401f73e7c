//! The way through nodes of boxes and chunks: what is fetched ahead, and what a ray finds in a chunk.

use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::{Pooled, Prospects, Sixteens};
use crate::kdtree::{Boxes, Chunk, Pools, Way};
use crate::simd::{Sixteen, prefetch};
use std::hint::select_unpredictable;

/// Where rays go on.
pub struct Ways<'a> {
    pub nodes: &'a [Boxes],
    pub words: &'a [u32],
}

/// Words in a line of the cache, and lines that a node has, and most chunks lie in.
const LINE: usize = 16;
const FETCHED: usize = 4;

impl<'a> Ways<'a> {
    /// Those of pools.
    #[inline(always)]
    pub fn new(pools: &'a Pools) -> Self {
        Self { nodes: pools.nodes(), words: pools.words() }
    }

    /// Fetches what a ray will need that goes a way, or most of it, and says whether that is a pool, or the end.
    #[inline(always)]
    pub fn fetch(&self, way: i32) -> bool {
        let way = Way(way);
        let node = self.nodes.as_ptr().wrapping_add(way.node()).cast::<u32>();
        let chunk = self.words.as_ptr().wrapping_add(way.word());
        let first = select_unpredictable(way.is_pool(), chunk, node);
        for line in 0..FETCHED {
            prefetch(first.wrapping_add(LINE * line));
        }
        way.is_pool()
    }
}

/// What a ray may find in a chunk between its ends.
#[inline(always)]
pub fn prospects<L: Sixteen, M: Mode>(
    ray: &Pooled,
    chunk: Chunk<'_>,
    tnear: f32,
    tfar: f32,
) -> Prospects<16, L> {
    let triangles = Sixteens {
        rows: ray.renamed().map(|axis| chunk.row(axis)),
        corners: chunk.corners(),
        count: chunk.count(),
    };
    if M::SIGNS {
        ray.prospects::<L, true>(&triangles, tnear, tfar)
    } else {
        ray.prospects::<L, false>(&triangles, tnear, tfar)
    }
}
