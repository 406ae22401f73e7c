//! Rays, and triangles that they may hit: tested eight pairs at a time.
//!
//! Few of the triangles that a ray meets are left when they have been sifted, mostly one, so that one ray never has
//! eight to be tested together. But the rays in flight have, together.

use super::IN_FLIGHT;
use super::flight::Flight;
use crate::geometry::triangle::Alone;
use crate::simd::Eight;
use std::hint::select_unpredictable;

/// All that rays in flight can have at a time, and room for eight to be written at once.
const ROOM: usize = 8 * IN_FLIGHT + 8;

/// Pairs of rays and triangles.
pub struct Pairs {
    flights: [i32; ROOM],
    primitives: [i32; ROOM],
    len: usize,
}

impl Pairs {
    /// None.
    pub const fn new() -> Self {
        Self { flights: [0; ROOM], primitives: [0; ROOM], len: 0 }
    }

    /// Adds what a ray may hit of the eight triangles that it has.
    #[inline(always)]
    pub fn add<L: Eight, A>(&mut self, number: usize, flight: &Flight<A>) {
        let (primitives, open) = flight.leaf.left_open();
        let flights = self.flights[self.len..].first_chunk_mut::<8>().expect("room for eight");
        *flights = [number as i32; 8];
        let to = self.primitives[self.len..].first_chunk_mut().expect("room for eight");
        L::ids_compact(L::ids_load(primitives), open, to);
        self.len += open.count_ones() as usize;
    }

    /// Tests all that were added, and each ray takes its nearest hit. Then there are none.
    #[inline(always)]
    pub fn settle<L: Eight, A: Alone>(
        &mut self,
        flights: &mut [Flight<A>; IN_FLIGHT],
        records: &[A::Record],
    ) {
        let mut first = 0;
        while first < self.len {
            let here = (self.len - first).min(8);
            let numbers = self.flights[first..].first_chunk::<8>().expect("room behind the last");
            let primitives = self.primitives[first..].first_chunk::<8>().expect("room behind the last");
            // Beyond the last one, the first of them again.
            let mut lanes = [0; 8];
            for lane in 0..8 {
                lanes[lane] = select_unpredictable(lane < here, lane, 0);
            }
            let (mut rays, mut triangles) = ([&flights[0].test; 8], [&records[0]; 8]);
            for lane in 0..8 {
                rays[lane] = &flights[numbers[lanes[lane]] as usize % IN_FLIGHT].test;
                triangles[lane] = &records[primitives[lanes[lane]] as usize];
            }
            let mut finds = A::test_eight::<L>(&rays, &triangles);
            let mut open = finds.open & ((1 << here) - 1);
            while open != 0 {
                let lane = open.trailing_zeros() as usize % 8;
                open &= open - 1;
                let candidate = rays[lane].test(triangles[lane], true);
                finds.hits |= u32::from(candidate.inside) << lane;
                finds.t[lane] = candidate.t;
            }
            for lane in 0..here {
                let flight = &mut flights[numbers[lane] as usize % IN_FLIGHT];
                flight.take(finds.hits >> lane & 1 == 1, finds.t[lane], primitives[lane] as u32);
            }
            first += here;
        }
        self.len = 0;
    }
}
