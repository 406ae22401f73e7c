//! Where lists' rays come from: a slice, or packets. (A branch for each eight of them costs nothing, and a kernel for each
//! would have to be compiled for every instruction set and mode.)

use crate::geometry::Ray;
use crate::traverse::lanes::RayPacket;

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

    /// The rays from number `8 * eight` on, if they lie one after the other and are eight.
    #[inline(always)]
    pub fn row(self, eight: usize) -> Option<&'a [Ray; 8]> {
        match self {
            Self::Slice(rays) => rays[8 * eight..].first_chunk(),
            Self::Packets(..) => None,
        }
    }

    /// The places from number `8 * eight` on, and a bit for each in which there is a ray. Panics if there are none.
    #[inline(always)]
    pub fn eight(self, eight: usize) -> (RayPacket<8>, u32) {
        if let Some(rays) = self.row(eight) {
            return (RayPacket::of_slice(rays), 0xff);
        }
        match self {
            Self::Slice(rays) => {
                let rays = &rays[8 * eight..];
                (RayPacket::of_slice(rays), (1 << rays.len()) - 1)
            }
            Self::Packets(rays, active) => {
                let half = eight % 2;
                (rays[eight / 2].part(half), active[eight / 2] >> (8 * half) & 0xff)
            }
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
}
