//! Triangles that rays of a lot may hit, kept until the lot has ended.
//!
//! A pool says of a triangle whether a ray may hit it, between which bounds, and whether it does for certain. As in a
//! [stream](crate::traverse::pool), the mode's own test is asked in the end, of what does not begin behind what its ray hits
//! for certain: of one or two triangles a ray. Until then nobody fetches their records.

use super::lot::Lot;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::Dense;
use crate::traverse::closest::NONE;
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

    /// The rays and triangles of all of them that do not lie behind what their rays hit for certain. None is left.
    #[inline(always)]
    pub fn take<'a>(&'a mut self, lot: &'a Lot) -> impl Iterator<Item = (i32, i32)> + 'a {
        let count = std::mem::take(&mut self.count);
        let pairs = self.rays[..count].iter().zip(&self.primitives).zip(&self.first);
        pairs
            .filter(|((ray, _), first)| **first <= lot.found_by(**ray).0)
            .map(|((&ray, &primitive), _)| (ray, primitive))
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
            if self.first[i] > closest {
                continue;
            }
            let ray = rays.ray(place + Lot::place(id));
            let test = M::Alone::new(&ray.origin.to_array(), &ray.direction.to_array(), 1);
            let candidate = test.test(&resident.records[primitive as usize], true);
            let t = candidate.t;
            let nearer = t < closest || t == closest && (other == NONE || primitive < other);
            if candidate.inside && ray.tnear <= t && nearer {
                lot.keep_one(id, if ANY { f32::NEG_INFINITY } else { t }, primitive);
            }
        }
    }
}
