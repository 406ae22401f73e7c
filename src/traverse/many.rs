//! Rays in slices, by the kernel named.

use super::accel::Accel;
use super::kernel::Kernel;
use super::lanes::{HitPacket, RayPacket, give_lanes, lanes_of};
use super::tile::{PACKETS, WIDE};
use super::width::PacketWidth;
use crate::geometry::{Hit, Ray};

/// So many rays at once have numbers of 31 bits, which streams and lists give them.
const NUMBERED: usize = 1 << 30;

/// Rays and their answers, as many at a time as have numbers.
fn numbered<'a, A>(rays: &'a [Ray], answers: &'a mut [A]) -> impl Iterator<Item = (&'a [Ray], &'a mut [A])> {
    rays.chunks(NUMBERED).zip(answers.chunks_mut(NUMBERED))
}

impl Accel {
    /// The closest hit of each ray, by the kernel named: for packets, rays that follow one
    /// another go together. Panics if the slices' lengths differ.
    pub fn intersect_many(&self, kernel: Kernel, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        match kernel {
            Kernel::Single => {
                for (ray, hit) in rays.iter().zip(hits) {
                    *hit = self.intersect(ray);
                }
            }
            Kernel::Packet4 => self.intersect_slices::<4>(rays, hits),
            Kernel::Packet8 => self.intersect_slices::<8>(rays, hits),
            Kernel::Packet16 => self.intersect_slices::<16>(rays, hits),
            Kernel::Stream if self.cached().is_some() => self.intersect_slices::<8>(rays, hits),
            Kernel::Stream => {
                numbered(rays, hits).for_each(|(rays, hits)| self.intersect_streaming(rays, hits));
            }
            Kernel::Filter if self.cached().is_some() => self.intersect_slices::<8>(rays, hits),
            Kernel::Filter => {
                numbered(rays, hits).for_each(|(rays, hits)| self.intersect_filtered(rays, hits));
            }
            Kernel::Tile => self.intersect_tiles::<1>(rays, hits),
            Kernel::WideTile => self.intersect_tiles::<WIDE>(rays, hits),
        }
    }

    /// Whether anything lies in each ray's interval, by the kernel named. Panics if the slices'
    /// lengths differ.
    pub fn occluded_many(&self, kernel: Kernel, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        match kernel {
            Kernel::Single => {
                for (ray, occluded) in rays.iter().zip(occluded) {
                    *occluded = self.occluded(ray);
                }
            }
            Kernel::Packet4 => self.occluded_slices::<4>(rays, occluded),
            Kernel::Packet8 => self.occluded_slices::<8>(rays, occluded),
            Kernel::Packet16 => self.occluded_slices::<16>(rays, occluded),
            Kernel::Stream if self.cached().is_some() => self.occluded_slices::<8>(rays, occluded),
            Kernel::Stream => {
                numbered(rays, occluded).for_each(|(rays, found)| self.occluded_streaming(rays, found));
            }
            Kernel::Filter if self.cached().is_some() => self.occluded_slices::<8>(rays, occluded),
            Kernel::Filter => {
                numbered(rays, occluded).for_each(|(rays, found)| self.occluded_filtered(rays, found));
            }
            Kernel::Tile | Kernel::WideTile => self.occluded_tiles(rays, occluded),
        }
    }

    fn intersect_slices<const W: usize>(&self, rays: &[Ray], hits: &mut [Hit])
    where
        RayPacket<W>: PacketWidth<W>,
    {
        for (rays, hits) in rays.chunks(W).zip(hits.chunks_mut(W)) {
            let found = self.intersect_packet(&RayPacket::<W>::of_slice(rays), lanes_of(rays.len()));
            HitPacket::give(&[found], hits);
        }
    }

    fn occluded_slices<const W: usize>(&self, rays: &[Ray], occluded: &mut [bool])
    where
        RayPacket<W>: PacketWidth<W>,
    {
        for (rays, occluded) in rays.chunks(W).zip(occluded.chunks_mut(W)) {
            let found = self.occluded_packet(&RayPacket::<W>::of_slice(rays), lanes_of(rays.len()));
            give_lanes::<W>(&[found], occluded);
        }
    }

    /// By beams of `K` squares.
    fn intersect_tiles<const K: usize>(&self, rays: &[Ray], hits: &mut [Hit]) {
        let size = K * PACKETS * 16;
        let mut squares = Squares::<K>::new();
        let mut found = [const { [const { HitPacket::miss() }; PACKETS] }; K];
        let found = found.as_flattened_mut();
        for (rays, hits) in rays.chunks(size).zip(hits.chunks_mut(size)) {
            let (packets, active) = squares.fill(self, rays);
            self.intersect_tile(packets, active, &mut found[..packets.len()]);
            self.unpack(found, hits);
        }
    }

    fn occluded_tiles(&self, rays: &[Ray], occluded: &mut [bool]) {
        let mut squares = Squares::<1>::new();
        let mut found = [0; PACKETS];
        for (rays, occluded) in rays.chunks(PACKETS * 16).zip(occluded.chunks_mut(PACKETS * 16)) {
            let (packets, active) = squares.fill(self, rays);
            self.occluded_tile(packets, active, &mut found[..packets.len()]);
            give_lanes::<16>(&found, occluded);
        }
    }
}

/// Room for `K` squares' rays as packets. It is filled again and again, since it is too large to be handed around.
struct Squares<const K: usize> {
    packets: [[RayPacket<16>; PACKETS]; K],
    /// The lanes that hold a ray.
    active: [[u32; PACKETS]; K],
}

impl<const K: usize> Squares<K> {
    const fn new() -> Self {
        Self { packets: [const { [const { RayPacket::empty() }; PACKETS] }; K], active: [[0; PACKETS]; K] }
    }

    /// Takes up rays, no more than there is room for, and gives the packets that they fill, with their lanes.
    fn fill(&mut self, accel: &Accel, rays: &[Ray]) -> (&[RayPacket<16>], &[u32]) {
        let (packets, active) = (self.packets.as_flattened_mut(), self.active.as_flattened_mut());
        let count = accel.pack(rays, packets, active);
        (&packets[..count], &active[..count])
    }
}
