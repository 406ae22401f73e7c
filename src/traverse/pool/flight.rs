//! Rays in flight, and the triangles that each may hit.
//!
//! Which triangles a ray hits, and where to the bit, is asked of the mode's own test, which takes its time; a pool says what
//! is possible, and within which bounds. So a ray keeps a list of triangles that it *may* hit, and goes on until all that is
//! left of it begins behind one that it hits for certain. Then one or two of those on the list are left, and the test is
//! asked of those ([`answers`](super::answers)).

use super::step::Slabs;
use super::ways::{Finder, look};
use crate::geometry::Ray;
use crate::geometry::triangle::pooled::{Pooled, Prospects};
use crate::geometry::triangle::{Candidate, Mode, Test, Triangle};
use crate::kdtree::{Chunk, MOST};
use crate::simd::{Dense, Mask, Sixteen, prefetch_both};

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
    /// How many triangles are listed, at most [`MOST`] when a chunk is looked at.
    count: u32,
    /// Those triangles, and where each lies at the earliest. There is room for a chunk's behind a full list.
    ids: [i32; 2 * MOST],
    first: [f32; 2 * MOST],
}

/// The nearest triangle that a ray hits, and where.
pub type Nearest = (u32, Candidate<1, f32>);

/// What a ray finds in a chunk.
pub struct Finds {
    /// Whether it may hit anything there.
    pub possible: bool,
    /// Whether it does for certain.
    pub certain: bool,
    /// How many words behind the chunk's first its pool's next one begins, or 0.
    pub next: usize,
}

/// A ray that looks at a chunk. `EARLY` as for [`Flight::look`].
struct Looking<'a, const EARLY: bool> {
    flight: &'a mut Flight,
    any: bool,
    possible: bool,
    certain: bool,
}

impl<const EARLY: bool> Finder for Looking<'_, EARLY> {
    #[inline(always)]
    fn tfar(&self) -> f32 {
        self.flight.tfar
    }

    #[inline(always)]
    fn take<const W: usize, L: Dense<W>>(&mut self, found: Prospects<W, L>, ids: &[i32; W]) {
        let Prospects { possible, certain, first, last } = found;
        if EARLY && !possible.any() {
            return;
        }
        let Flight { tfar, count, ids: listed, first: firsts, .. } = &mut *self.flight;
        if !self.any {
            *tfar = L::select(certain, last, L::splat(*tfar)).least();
        }
        let (possible, certain) = (possible.bits(), certain.bits());
        let (at, room) = ((*count as usize).min(2 * MOST - W), "room for a register behind a full list");
        first.close_up(possible, firsts[at..].first_chunk_mut().expect(room));
        L::close_up_ids(L::ids_of(ids), possible, listed[at..].first_chunk_mut().expect(room));
        *count = at as u32 + possible.count_ones();
        self.possible |= possible != 0;
        self.certain |= certain != 0;
    }
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
        count: 0,
        ids: [0; 2 * MOST],
        first: [0.0; 2 * MOST],
    };

    /// Becomes a ray that has found nothing.
    #[inline(always)]
    pub fn begin(&mut self, slabs: Slabs, pooled: Pooled, tfar: f32, ray: &Ray, number: usize) {
        (self.slabs, self.pooled) = (slabs, pooled);
        (self.top, self.ray, self.count) = (1, number as u32, 0);
        (self.tnear, self.tfar) = (ray.tnear, tfar);
    }

    /// Whether no triangle is listed.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether the list has no room for another chunk's triangles.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count > MOST as u32
    }

    /// Looks at the chunk that begins at a word, and lists what the ray may hit. With `any`, nobody asks any more where the
    /// ray ends once it hits something for certain.
    ///
    /// With `EARLY` it stops where there is nothing to be hit, for the price of branches that nobody can foresee. A ray that is
    /// alone is 0.96 to 1.08 times as quick with it, streams have 0.92 to 0.99 of their rate.
    #[inline(always)]
    pub fn look<L: Sixteen, M: Mode, const EARLY: bool>(
        &mut self,
        words: &[u32],
        first: usize,
        any: bool,
    ) -> Finds {
        let chunk = Chunk::at(words, first);
        let (pooled, tnear) = (self.pooled, self.tnear);
        let mut looking = Looking::<EARLY> { flight: self, any, possible: false, certain: false };
        look::<L, M, EARLY>(&pooled, chunk, tnear, &mut looking);
        let Looking { possible, certain, .. } = looking;
        Finds { possible, certain, next: chunk.next() }
    }

    /// Fetches the record of the triangle that was listed last, if any was.
    #[inline(always)]
    pub fn fetch_last(&self, records: &[Triangle]) {
        if let Some(&id) = self.ids.get((self.count as usize).wrapping_sub(1)) {
            prefetch_both(records.as_ptr().wrapping_add(id as usize));
        }
    }

    /// The listed triangles that do not lie behind the ray's end for certain. One may be there more than once.
    #[inline(always)]
    pub fn left(&self) -> impl Iterator<Item = u32> {
        let listed = self.ids.iter().zip(&self.first).take(self.count as usize);
        listed.filter(|&(_, &first)| first <= self.tfar).map(|(&id, _)| id as u32)
    }

    /// Writes the listed triangles that do not lie behind the ray's end for certain, one behind the other; how many they
    /// are. One may be there more than once.
    #[inline(always)]
    pub fn listed<L: Sixteen>(&self, to: &mut [i32; 2 * MOST]) -> usize {
        let tfar = L::splat(self.tfar);
        let (ids, _) = self.ids.as_chunks::<MOST>();
        let (first, _) = self.first.as_chunks::<MOST>();
        let present = (1u32 << self.count.min(MOST as u32)) - 1;
        let bits = L::load(&first[0]).le(tfar).bits() & present;
        L::ids_compact(L::ids_load(&ids[0]), bits, to.first_chunk_mut().expect("twice as many"));
        let mut written = bits.count_ones() as usize;
        if self.is_full() {
            let present = (1u32 << (self.count - MOST as u32).min(MOST as u32)) - 1;
            let bits = L::load(&first[1]).le(tfar).bits() & present;
            let behind = to[written.min(MOST)..].first_chunk_mut().expect("twice as many");
            L::ids_compact(L::ids_load(&ids[1]), bits, behind);
            written += bits.count_ones() as usize;
        }
        written
    }

    /// Asks the test of all that is listed, and leaves the nearest alone on the list.
    #[cold]
    #[inline(never)]
    pub fn settle<M: Mode>(&mut self, records: &[M::Record], ray: &Ray) {
        let nearest = self.nearest::<M>(&M::alone(ray), records, ray);
        self.count = 0;
        if let Some((id, Candidate { t, .. })) = nearest {
            (self.ids[0], self.first[0], self.count) = (id as i32, t, 1);
            self.tfar = t.min(self.tfar);
        }
    }

    /// The nearest of what is listed, by the mode's own test, and the lowest id of several as near.
    #[inline(always)]
    pub fn nearest<M: Mode>(&self, test: &M::Alone, records: &[M::Record], ray: &Ray) -> Option<Nearest> {
        let tfar = f32::MAX.min(ray.tfar);
        let mut best: Option<Nearest> = None;
        for id in self.left() {
            let candidate = test.test(&records[id as usize], true);
            let t = candidate.t;
            let nearer =
                best.as_ref().map_or(t <= tfar, |(other, best)| t < best.t || t == best.t && id < *other);
            if candidate.inside && self.tnear <= t && nearer {
                best = Some((id, candidate));
            }
        }
        best
    }
}
