//! The way through nodes of boxes and chunks: what is fetched ahead, and what a ray finds in a chunk.

use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::{
    FromEight, FromSixteen, Picks, Pooled, Prospects, Sixteens, Vertices,
};
use crate::kdtree::{Boxes, Chunk, MOST, Pools, Way};
use crate::simd::{Dense, Sixteen, prefetch};
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

/// Who takes up what a ray may find.
pub trait Finder {
    /// What a hit must not lie beyond.
    fn tfar(&self) -> f32;

    /// Takes up what there may be in as many triangles, whose ids these are.
    fn take<const W: usize, L: Dense<W>>(&mut self, found: Prospects<W, L>, ids: &[i32; W]);
}

/// Has a ray look at a chunk from `tnear` on: at sixteen triangles at once, or at eight, and once more where there are
/// others. `EARLY` as for [`prospects`](Pooled::prospects).
#[inline(always)]
pub fn look<L: Sixteen, M: Mode, const EARLY: bool>(
    ray: &Pooled,
    chunk: Chunk<'_>,
    tnear: f32,
    finder: &mut impl Finder,
) {
    if M::SIGNS {
        look_by::<L, true, EARLY>(ray, chunk, tnear, finder);
    } else {
        look_by::<L, false, EARLY>(ray, chunk, tnear, finder);
    }
}

#[inline(always)]
fn look_by<L: Sixteen, const SIGNS: bool, const EARLY: bool>(
    ray: &Pooled,
    chunk: Chunk<'_>,
    tnear: f32,
    finder: &mut impl Finder,
) {
    let triangles = Sixteens {
        rows: ray.renamed().map(|axis| chunk.row(axis)),
        corners: chunk.corners(),
        count: chunk.count(),
    };
    let ids = chunk.ids();
    if !L::HALVES_PAY {
        let vertices = ray.see::<L>(&triangles);
        let found = ray.prospects::<L, SIGNS, EARLY>(&vertices, &triangles, tnear, finder.tfar());
        return finder.take(found, ids);
    }
    // Mostly there are few vertices: one register has them then.
    if chunk.vertices() <= 8 {
        let vertices = ray.see_eight::<L::Half>(&triangles);
        look_by_halves::<FromEight, _, SIGNS, EARLY>(ray, &vertices, &triangles, ids, tnear, finder);
    } else {
        let vertices = ray.see::<L>(&triangles);
        look_by_halves::<FromSixteen, _, SIGNS, EARLY>(ray, &vertices, &triangles, ids, tnear, finder);
    }
}

#[inline(always)]
fn look_by_halves<P: Picks<V>, V: Copy, const SIGNS: bool, const EARLY: bool>(
    ray: &Pooled,
    vertices: &Vertices<V>,
    triangles: &Sixteens<'_>,
    ids: &[i32; MOST],
    tnear: f32,
    finder: &mut impl Finder,
) {
    for half in 0..triangles.count.div_ceil(8).min(2) {
        let tfar = finder.tfar();
        let found = ray.prospects_of_half::<P, V, SIGNS, EARLY>(vertices, triangles, half, tnear, tfar);
        finder.take(found, ids[8 * half..].first_chunk().expect("there are two halves"));
    }
}
