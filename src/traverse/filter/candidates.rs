//! Triangles that rays of a lot may hit, kept until the lot has ended.
//!
//! A pool says of a triangle whether a ray may hit it, between which bounds, and whether it does for certain. As in a
//! [stream](crate::traverse::pool), the mode's own test is asked in the end, of what does not begin behind what its ray hits
//! for certain: of one or two triangles a ray. Until then nobody fetches their records.

use super::cut::present;
use super::lot::Lot;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Dense, Mask, Sixteen};
use crate::traverse::kernel::Kernel;
use crate::traverse::records::Resident;
use crate::traverse::source::Source;

/// What is written at once.
const REGISTER: usize = 16;

/// So many may wait from one leaf to the next: several of each ray.
const MOST: usize = 4 * Kernel::Filter.width();

/// Pairs of a ray of a lot and a triangle that it may hit.
#[derive(Default)]
pub struct Candidates {
    rays: Vec<i32>,
    primitives: Vec<i32>,
    /// Where each triangle lies at the earliest.
    first: Vec<f32>,
    count: usize,
}

impl Candidates {
    /// Adds those pairs whose bits are set. Hardly ever that takes more memory than was there.
    #[inline(always)]
    pub fn add<const W: usize, L: Dense<W>>(
        &mut self,
        bits: u32,
        rays: L::Ids,
        primitives: L::Ids,
        first: L,
    ) {
        let at = self.count;
        if at + REGISTER > self.first.len() {
            self.grow();
        }
        let room = "a register behind the last";
        L::close_up_ids(rays, bits, self.rays[at..].first_chunk_mut().expect(room));
        L::close_up_ids(primitives, bits, self.primitives[at..].first_chunk_mut().expect(room));
        first.close_up(bits, self.first[at..].first_chunk_mut().expect(room));
        self.count += bits.count_ones() as usize;
    }

    #[cold]
    #[inline(never)]
    fn grow(&mut self) {
        let room = (2 * self.first.len()).max(MOST + REGISTER * REGISTER);
        self.rays.resize(room, 0);
        self.primitives.resize(room, 0);
        self.first.resize(room, 0.0);
    }

    /// Whether it is time to [`settle`](Self::settle).
    #[inline(always)]
    pub fn are_many(&self) -> bool {
        self.count > MOST
    }

    /// How many rows of sixteen they fill.
    pub const fn rows(&self) -> usize {
        self.count.div_ceil(REGISTER)
    }

    /// One of the rows: the places of the rays, the triangles, and a bit for each that does not lie behind what its ray hits for
    /// certain. The lot's rays are those from `place` on.
    #[inline(always)]
    pub fn row<L: Sixteen>(&self, row: usize, lot: &Lot, place: usize) -> ([i32; 16], &[i32; 16], u32) {
        let (at, room) = (REGISTER * row, "a register behind the last");
        let ids: &[i32; 16] = self.rays[at..].first_chunk().expect(room);
        let (mut places, mut closest) = ([0; 16], [0.0; 16]);
        for lane in 0..16 {
            places[lane] = (place + Lot::place(ids[lane])) as i32;
            (closest[lane], _) = lot.found_by(ids[lane]);
        }
        let first = L::load(self.first[at..].first_chunk().expect(room));
        let bits = first.le(L::load(&closest)).bits() & present((self.count - at).min(16));
        (places, self.primitives[at..].first_chunk().expect(room), bits)
    }

    /// Forgets all of them.
    pub const fn clear(&mut self) {
        self.count = 0;
    }

    /// Asks the mode's own test of all of them. What a ray hits is what it has found; with `ANY`, it is done. The lot's rays are
    /// those from a place on.
    #[cold]
    #[inline(never)]
    pub fn settle<M: Mode, const ANY: bool>(
        &mut self,
        resident: &Resident<'_, M::Record>,
        rays: Source<'_>,
        place: usize,
        lot: &mut Lot,
    ) {
        for i in 0..std::mem::take(&mut self.count) {
            let (id, primitive) = (self.rays[i], self.primitives[i]);
            let (closest, other) = lot.found_by(id);
            if closest < self.first[i] {
                continue;
            }
            let ray = rays.ray(place + Lot::place(id));
            let test = M::alone(&ray);
            let candidate = test.test(&resident.records[primitive as usize], true);
            let t = candidate.t;
            let is_nearer = t < closest || t == closest && (ANY || primitive < other);
            if candidate.inside && ray.tnear <= t && is_nearer {
                if ANY {
                    lot.end(id);
                } else {
                    lot.keep_one(id, t, primitive);
                }
            }
        }
    }
}
