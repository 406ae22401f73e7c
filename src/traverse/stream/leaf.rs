//! One ray against the triangles of a leaf, eight at a time.
//!
//! The mode sifts eight triangles at once; those that may be hit go through its own test. So hits are what
//! packets find, bit for bit.

use super::flight::Flight;
use crate::geometry::triangle::Alone;
use crate::simd::Eight;

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
        let mut likely = flight.test.sift::<L>(&triangles, flight.tnear, flight.tfar) & lanes;
        while likely != 0 {
            let lane = likely.trailing_zeros() as usize & 7;
            likely &= likely - 1;
            let candidate = flight.test.test(triangles[lane], true);
            let (t, primitive) = (candidate.t, primitives[lane]);
            let nearer = t < flight.tfar || t == flight.tfar && primitive < flight.primitive;
            if candidate.inside && flight.tnear <= t && nearer {
                (flight.tfar, flight.primitive) = (t, primitive);
                flight.weights = [candidate.u, candidate.v];
                found = true;
            }
        }
        if rest <= 8 {
            return found;
        }
        rest -= 8;
        next += 8;
    }
}
