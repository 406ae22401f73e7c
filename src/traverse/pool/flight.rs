//! Rays in flight.

use super::list::{List, Looking};
use super::step::Slabs;
use super::ways::look;
use crate::geometry::Ray;
use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::Pooled;
use crate::kdtree::Chunk;
use crate::simd::Sixteen;

/// What is known of a ray on its way, its stack left aside.
#[derive(Clone, Copy)]
#[repr(C, align(64))]
pub struct Flight {
    pub slabs: Slabs,
    pooled: Pooled,
    /// The top of its stack.
    pub top: u32,
    /// Which ray it is.
    pub ray: u32,
    pub tnear: f32,
    /// What a hit must not lie beyond: where the nearest of those that are certain lies at the latest, or the ray's end.
    pub tfar: f32,
    /// What it may hit.
    pub list: List,
}

/// What a ray finds in a chunk.
pub struct Finds {
    /// Whether it may hit anything there.
    pub possible: bool,
    /// Whether it does for certain.
    pub certain: bool,
    /// How many words behind the chunk's first its pool's next one begins, or 0.
    pub next: usize,
}

impl Flight {
    /// None.
    pub const NONE: Self = Self {
        slabs: Slabs::NONE,
        pooled: Pooled::NONE,
        top: 0,
        ray: 0,
        tnear: 0.0,
        tfar: 0.0,
        list: List::NONE,
    };

    /// Becomes a ray that has found nothing.
    #[inline(always)]
    pub fn begin(&mut self, slabs: Slabs, pooled: Pooled, tfar: f32, ray: &Ray, number: usize) {
        (self.slabs, self.pooled) = (slabs, pooled);
        (self.top, self.ray) = (1, number as u32);
        (self.tnear, self.tfar) = (ray.tnear, tfar);
        self.list.clear();
    }

    /// Looks at the chunk that begins at a word, and lists what the ray may hit. With `any`, nobody asks any more where the
    /// ray ends once it hits something for certain.
    #[inline(always)]
    pub fn look<L: Sixteen, M: Mode>(&mut self, words: &[u32], first: usize, any: bool) -> Finds {
        let chunk = Chunk::at(words, first);
        let (pooled, tnear) = (self.pooled, self.tnear);
        let mut looking = Looking::<false>::new(&mut self.list, self.tfar, any);
        look::<L, M, false>(&pooled, chunk, tnear, &mut looking);
        let Looking { possible, certain, tfar, .. } = looking;
        self.tfar = tfar;
        Finds { possible, certain, next: chunk.next() }
    }

    /// Asks the test of all that is listed, and leaves the nearest alone on the list.
    #[inline(always)]
    pub fn settle<M: Mode>(&mut self, records: &[M::Record], ray: &Ray) {
        self.tfar = self.list.settle::<M>(records, ray, self.tfar);
    }
}
