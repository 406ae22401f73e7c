//! One ray against the triangles of a leaf, eight at a time.
//!
//! The mode sifts eight triangles at once; those that may be hit go through its own test. So hits are what
//! packets find, bit for bit.

use super::flight::Flight;
use crate::geometry::triangle::{Alone, Finds};
use crate::simd::{Eight, Mask};

/// Tests the triangles of the leaf whose record begins at `record` in `words`, and says whether one was hit.
#[inline(always)]
pub fn visit<L: Eight, A: Alone>(
    flight: &mut Flight<A>,
    words: &[u32],
    record: usize,
    records: &[A::Record],
) -> bool {
    let mut found = false;
    let mut rest = words[record] as usize;
    let mut next = record + 1;
    let last = records.len() as u32 - 1;
    loop {
        // What follows the leaf's last triangle is of no account, but must be some triangle.
        let primitives: &[u32; 8] = words[next..].first_chunk().expect("words behind the last record");
        let mut triangles = [&records[0]; 8];
        for lane in 0..8 {
            triangles[lane] = &records[primitives[lane].min(last) as usize];
        }
        let lanes = (1 << rest.min(8)) - 1;
        let finds = flight.test.find::<L>(&triangles, flight.tnear, flight.tfar);
        let hits = finds.hits.bits() & lanes;
        if hits != 0 {
            found |= flight.take_nearest(&finds, hits, primitives);
        }
        let mut open = finds.open & lanes;
        while open != 0 {
            let lane = open.trailing_zeros() as usize & 7;
            open &= open - 1;
            let candidate = flight.test.test(triangles[lane], true);
            if candidate.inside && flight.tnear <= candidate.t {
                found |= flight.take(candidate.t, primitives[lane], [candidate.u, candidate.v]);
            }
        }
        if rest <= 8 {
            return found;
        }
        rest -= 8;
        next += 8;
    }
}

impl<A: Alone> Flight<A> {
    /// Takes a hit if it is nearer than what the ray has, or as near and of a lower id; says whether it is.
    #[inline(always)]
    fn take(&mut self, t: f32, primitive: u32, weights: [f32; 2]) -> bool {
        let nearer = t < self.tfar || t == self.tfar && primitive < self.primitive;
        if nearer {
            (self.tfar, self.primitive, self.weights) = (t, primitive, weights);
        }
        nearer
    }

    /// The same for the nearest of the lanes in `hits`, of which there is one at least.
    #[inline(always)]
    fn take_nearest<L: Eight>(&mut self, finds: &Finds<L>, hits: u32, primitives: &[u32; 8]) -> bool {
        let t = L::select(L::mask_from_bits(hits), finds.t, L::splat(f32::INFINITY));
        let least = t.least();
        let mut nearest = t.eq(L::splat(least)).bits() & hits;
        let mut lane = nearest.trailing_zeros() as usize & 7;
        nearest &= nearest.wrapping_sub(1);
        while nearest != 0 {
            let other = nearest.trailing_zeros() as usize & 7;
            nearest &= nearest - 1;
            if primitives[other] < primitives[lane] {
                lane = other;
            }
        }
        let [b, c, sum] = finds.weights;
        let (b, c, sum) = (b.store()[lane], c.store()[lane], sum.store()[lane]);
        self.take(least, primitives[lane], [b / sum, c / sum])
    }
}
