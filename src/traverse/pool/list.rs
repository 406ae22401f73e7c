//! The triangles that a ray may hit.
//!
//! Which triangles a ray hits, and where to the bit, is asked of the mode's own test, which takes its time; a pool says what
//! is possible, and within which bounds. So a ray keeps a list of triangles that it *may* hit, and goes on until all that is
//! left of it begins behind one that it hits for certain. Then one or two of those on the list are left, and the test is
//! asked of those.

use super::ways::Finder;
use crate::geometry::Ray;
use crate::geometry::triangle::pooled::Prospects;
use crate::geometry::triangle::{Candidate, Mode, Test, Triangle};
use crate::kdtree::MOST;
use crate::simd::{Dense, Mask, Sixteen, prefetch_both};

/// Triangles, and where each lies at the earliest.
#[derive(Clone, Copy)]
#[repr(C)]
pub struct List {
    /// How many there are, at most [`MOST`] when a chunk is looked at.
    count: u32,
    /// There is room for a chunk's behind a full list.
    ids: [i32; 2 * MOST],
    first: [f32; 2 * MOST],
}

/// The nearest triangle that a ray hits, and where.
pub type Nearest = (u32, Candidate<1, f32>);

/// A ray that looks at a chunk, and lists what it may hit there.
///
/// With `EARLY` it stops where there is nothing to be hit, for the price of branches that nobody can foresee. A ray that is
/// alone is 0.96 to 1.08 times as quick with it, streams have 0.92 to 0.99 of their rate.
pub struct Looking<'a, const EARLY: bool> {
    list: &'a mut List,
    /// What a hit must not lie beyond: where the nearest of those that are certain lies at the latest, or the ray's end.
    pub tfar: f32,
    any: bool,
    /// Whether it may hit anything.
    pub possible: bool,
    /// Whether it does for certain.
    pub certain: bool,
}

impl<'a, const EARLY: bool> Looking<'a, EARLY> {
    /// It has seen nothing so far. With `any`, nobody asks where the ray ends, nor what it may hit, once it hits something for certain.
    #[inline(always)]
    pub fn new(list: &'a mut List, tfar: f32, any: bool) -> Self {
        Self { list, tfar, any, possible: false, certain: false }
    }
}

impl<const EARLY: bool> Finder for Looking<'_, EARLY> {
    #[inline(always)]
    fn tfar(&self) -> f32 {
        self.tfar
    }

    #[inline(always)]
    fn take<const W: usize, L: Dense<W>>(&mut self, found: Prospects<W, L>, ids: &[i32; W]) {
        let Prospects { possible, certain, first, last } = found;
        if EARLY && !possible.any() {
            return;
        }
        if EARLY && self.any && certain.any() {
            self.certain = true;
            return;
        }
        if !self.any {
            self.tfar = L::select(certain, last, L::splat(self.tfar)).least();
        }
        let (possible, certain) = (possible.bits(), certain.bits());
        self.list.put(possible, first, ids);
        self.possible |= possible != 0;
        self.certain |= certain != 0;
    }
}

impl List {
    /// Nothing.
    pub const NONE: Self = Self { count: 0, ids: [0; 2 * MOST], first: [0.0; 2 * MOST] };

    /// Forgets what is listed.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Whether no triangle is listed.
    #[inline(always)]
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Whether there is no room for another chunk's triangles.
    #[inline(always)]
    pub fn is_full(&self) -> bool {
        self.count > MOST as u32
    }

    /// Puts the triangles there whose bits are set.
    #[inline(always)]
    fn put<const W: usize, L: Dense<W>>(&mut self, bits: u32, first: L, ids: &[i32; W]) {
        let (at, room) = ((self.count as usize).min(2 * MOST - W), "room for a register behind a full list");
        first.close_up(bits, self.first[at..].first_chunk_mut().expect(room));
        L::close_up_ids(L::ids_of(ids), bits, self.ids[at..].first_chunk_mut().expect(room));
        self.count = at as u32 + bits.count_ones();
    }

    /// Fetches the record of the triangle that was listed last, if any was.
    #[inline(always)]
    pub fn fetch_last(&self, records: &[Triangle]) {
        if let Some(&id) = self.ids.get((self.count as usize).wrapping_sub(1)) {
            prefetch_both(records.as_ptr().wrapping_add(id as usize));
        }
    }

    /// The triangles that do not lie behind a ray's end for certain. One may be there more than once.
    #[inline(always)]
    fn left(&self, tfar: f32) -> impl Iterator<Item = u32> {
        let listed = self.ids.iter().zip(&self.first).take(self.count as usize);
        listed.filter(move |&(_, &first)| first <= tfar).map(|(&id, _)| id as u32)
    }

    /// Writes the triangles that do not lie behind a ray's end for certain, one behind the other; how many they
    /// are. One may be there more than once.
    #[inline(always)]
    pub fn write<L: Sixteen>(&self, tfar: f32, to: &mut [i32; 2 * MOST]) -> usize {
        let tfar = L::splat(tfar);
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

    /// Asks the test of all that a ray that ends at `tfar` may hit, and leaves the nearest alone on the list; where the ray ends then.
    #[cold]
    #[inline(never)]
    pub fn settle<M: Mode>(&mut self, records: &[M::Record], ray: &Ray, tfar: f32) -> f32 {
        let nearest = self.nearest::<M>(&M::alone(ray), records, ray, tfar);
        self.count = 0;
        let Some((id, Candidate { t, .. })) = nearest else { return tfar };
        (self.ids[0], self.first[0], self.count) = (id as i32, t, 1);
        t.min(tfar)
    }

    /// The nearest of what a ray that ends at `tfar` may hit, by the mode's own test, and the lowest id of several as near.
    #[inline(always)]
    pub fn nearest<M: Mode>(
        &self,
        test: &M::Alone,
        records: &[M::Record],
        ray: &Ray,
        tfar: f32,
    ) -> Option<Nearest> {
        let end = f32::MAX.min(ray.tfar);
        let mut best: Option<Nearest> = None;
        for id in self.left(tfar) {
            let candidate = test.test(&records[id as usize], true);
            let t = candidate.t;
            let nearer =
                best.as_ref().map_or(t <= end, |(other, best)| t < best.t || t == best.t && id < *other);
            if candidate.inside && ray.tnear <= t && nearer {
                best = Some((id, candidate));
            }
        }
        best
    }
}
