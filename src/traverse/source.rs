//! Where a kernel's rays come from: a slice, or packets. (A branch for each sixteen of them costs nothing, and a kernel for each
//! would have to be compiled for every instruction set and mode.)

use super::columns::{columns, columns_by};
use super::lanes::RayPacket;
use super::walk::load3;
use crate::geometry::Ray;
use crate::simd::Sixteen;

/// Rays in places. A place may be empty.
#[derive(Clone, Copy)]
pub enum Source<'a> {
    /// One after the other.
    Slice(&'a [Ray]),
    /// Packets, and the lanes of each that hold a ray.
    Packets(&'a [RayPacket<16>], &'a [u32]),
}

impl<'a> Source<'a> {
    /// The number of places.
    #[inline(always)]
    pub fn places(self) -> usize {
        match self {
            Self::Slice(rays) => rays.len(),
            Self::Packets(rays, _) => 16 * rays.len(),
        }
    }

    /// The places from number `16 * sixteen` on, number by number: origins and `tnear`, directions and `tfar`; and a bit for each
    /// place in which there is a ray. What the others hold means nothing. Panics if there are none.
    #[inline(always)]
    pub fn sixteen<L: Sixteen>(self, sixteen: usize) -> ([[L; 4]; 2], u32) {
        let columns = match self {
            Self::Slice(rays) => columns(&rays[16 * sixteen..]),
            Self::Packets(rays, _) => {
                let rays = &rays[sixteen];
                let ([x, y, z], [dx, dy, dz]) = (load3(&rays.origin), load3(&rays.direction));
                [[x, y, z, L::load(&rays.tnear)], [dx, dy, dz, L::load(&rays.tfar)]]
            }
        };
        (columns, self.present(sixteen))
    }

    /// A bit for each of the places from number `16 * sixteen` on in which there is a ray.
    #[inline(always)]
    pub fn present(self, sixteen: usize) -> u32 {
        match self {
            Self::Slice(rays) => (1 << (rays.len() - 16 * sixteen).min(16)) - 1,
            Self::Packets(_, active) => active[sixteen] & 0xffff,
        }
    }

    /// The ray in a place. Panics if there is no such place.
    #[inline(always)]
    pub fn ray(self, place: usize) -> Ray {
        match self {
            Self::Slice(rays) => rays[place],
            Self::Packets(rays, _) => rays[place / 16].get(place % 16),
        }
    }

    /// The rays in some places, number by number as for [`sixteen`](Self::sixteen). Panics if there is no such place.
    #[inline(always)]
    pub fn in_places<L: Sixteen>(self, places: &[i32; 16]) -> [[L; 4]; 2] {
        match self {
            Self::Slice(rays) => columns_by(
                #[inline(always)]
                |lane| Some(&rays[places[lane] as usize]),
            ),
            Self::Packets(..) => {
                let rays = places.map(|place| self.ray(place as usize));
                columns(&rays)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Lanes, Simd, Task};
    use crate::traverse::columns::tests::rays;

    /// The rays in some places, number by number.
    struct InPlaces<'a>(Source<'a>, &'a [i32; 16]);

    impl Task for InPlaces<'_> {
        type Output = [[[f32; 16]; 4]; 2];

        #[inline(always)]
        fn run<S: Simd>(self) -> Self::Output {
            self.0.in_places::<S::F16>(self.1).map(|four| four.map(|column| column.store()))
        }
    }

    #[test]
    fn rays_come_from_any_places_of_a_slice_or_of_packets() {
        let rays = rays(48);
        let packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
        // One of them twice.
        let places = [47, 0, 5, 31, 16, 15, 20, 20, 1, 2, 40, 33, 9, 8, 7, 6];
        for isa in Isa::available() {
            for source in [Source::Slice(&rays), Source::Packets(&packets, &[0xffff; 3])] {
                let found = Chosen::new(isa).expect("it is available").run(InPlaces(source, &places));
                for (lane, place) in places.into_iter().enumerate() {
                    let expected: [[f32; 4]; 2] = bytemuck::cast(rays[place as usize]);
                    assert_eq!(found.map(|four| four.map(|column| column[lane])), expected, "{isa}, {place}");
                }
            }
        }
    }
}
