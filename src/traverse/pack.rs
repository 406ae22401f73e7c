//! Rays in a row into packets of 16, and hits out of such, by whole registers.
//!
//! A ray is two fours of numbers, a hit one and three numbers more; of sixteen of them, rows and columns are exchanged.

use super::accel::Accel;
use super::lanes::{HitPacket, RayPacket, lanes_of};
use crate::geometry::{Hit, Ray};
use crate::simd::{Lanes, Simd, Sixteen, Task};

impl Accel {
    /// Puts rays into as many packets as they fill, and says of each which lanes hold one; how many packets these are.
    /// Panics if there are more rays than `packets` or `active` have room for.
    pub(crate) fn pack(&self, rays: &[Ray], packets: &mut [RayPacket<16>], active: &mut [u32]) -> usize {
        let (full, rest) = rays.as_chunks::<16>();
        let count = full.len() + usize::from(!rest.is_empty());
        let (packets, active) = (&mut packets[..count], &mut active[..count]);
        active.fill(lanes_of(16));
        if !rest.is_empty() {
            packets[full.len()] = RayPacket::of_slice(rest);
            active[full.len()] = lanes_of(rest.len());
        }
        self.chosen().run(Pack { rays: full, packets });
        count
    }

    /// Gives the hits of packets one by one, as many as there is room for.
    pub(crate) fn unpack(&self, packets: &[HitPacket<16>], hits: &mut [Hit]) {
        let (full, rest) = hits.as_chunks_mut::<16>();
        HitPacket::give(packets.get(full.len()..).unwrap_or_default(), rest);
        self.chosen().run(Unpack { packets, hits: full });
    }
}

/// Full packets of rays.
struct Pack<'a> {
    rays: &'a [[Ray; 16]],
    packets: &'a mut [RayPacket<16>],
}

impl Task for Pack<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let nowhere = &[0.0; 4];
        for (rays, packet) in self.rays.iter().zip(self.packets) {
            let (mut starts, mut ways) = ([nowhere; 16], [nowhere; 16]);
            for lane in 0..16 {
                let [start, way]: &[[f32; 4]; 2] = bytemuck::cast_ref(&rays[lane]);
                (starts[lane], ways[lane]) = (start, way);
            }
            let [x, y, z, tnear] = S::F16::of_fours(&starts);
            packet.origin = [x.store(), y.store(), z.store()];
            packet.tnear = tnear.store();
            let [x, y, z, tfar] = S::F16::of_fours(&ways);
            packet.direction = [x.store(), y.store(), z.store()];
            packet.tfar = tfar.store();
        }
    }
}

/// Hits of full packets.
struct Unpack<'a> {
    packets: &'a [HitPacket<16>],
    hits: &'a mut [[Hit; 16]],
}

impl Task for Unpack<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        for (packet, hits) in self.packets.iter().zip(self.hits) {
            let HitPacket { t, u, v, primitive, normal: [x, y, z] } = packet;
            let load = S::F16::load;
            let fours = S::F16::fours(&[load(t), load(u), load(v), load(bytemuck::cast_ref(primitive))]);
            let normals = S::F16::fours(&[load(x), load(y), load(z), load(z)]);
            for lane in 0..16 {
                let ([t, u, v, primitive], [x, y, z, _]) = (fours[lane], normals[lane]);
                hits[lane] = bytemuck::cast([t, u, v, primitive, x, y, z]);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::NO_PRIMITIVE;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use crate::simd::Isa;
    use glam::Vec3;

    #[test]
    fn what_is_packed_and_unpacked_is_the_same_lane_by_lane() {
        let accel = Accel::build(&shapes::soup(10, 1), &BuildParams::default()).expect("builds");
        let point = |i: usize| Vec3::new(i as f32, i as f32 + 0.25, i as f32 - 0.5);
        let ray = |i: usize| Ray::segment(point(i), -point(100 + i), i as f32 / 8.0, 1000.0 + i as f32);
        let rays: Vec<Ray> = (0..70).map(ray).collect();
        for isa in Isa::available() {
            let accel = accel.clone().with_isa(isa);
            for count in 0..70 {
                let (mut packets, mut active) = ([const { RayPacket::empty() }; 5], [0; 5]);
                let filled = accel.pack(&rays[..count], &mut packets, &mut active);
                let wanted: Vec<_> = rays[..count].chunks(16).map(RayPacket::of_slice).collect();
                assert_eq!(packets[..filled], wanted, "{count} rays on {isa}");
                assert!(
                    active[..filled]
                        .iter()
                        .map(|lanes| lanes.count_ones())
                        .eq(rays[..count].chunks(16).map(|rays| rays.len() as u32))
                );

                // Hits that are told apart by every number, some of them none.
                let mut hits = [const { HitPacket::miss() }; 5];
                for i in (0..80).filter(|i| i % 3 > 0) {
                    let (packet, lane) = (&mut hits[i / 16], i % 16);
                    (packet.t[lane], packet.u[lane], packet.v[lane]) =
                        (i as f32, i as f32 + 0.5, i as f32 - 0.5);
                    packet.primitive[lane] = u32::MAX / 2 - i as u32;
                    for axis in 0..3 {
                        packet.normal[axis][lane] = (100 * axis + i) as f32;
                    }
                }
                let mut given = vec![Hit::MISS; count];
                accel.unpack(&hits, &mut given);
                for (i, hit) in given.iter().enumerate() {
                    assert_eq!(*hit, hits[i / 16].get(i % 16), "hit {i} of {count} on {isa}");
                    assert_eq!(hit.primitive == NO_PRIMITIVE, i % 3 == 0);
                }
            }
        }
    }
}
