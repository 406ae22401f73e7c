//! The widths of packets, and the kernels of each.
//!
//! A kernel is compiled for every instruction set, accuracy and storage: whoever calls one that is generic
//! over its width compiles all of that anew. So each width's calls are made here, once, and are never
//! inlined: other crates, and the other parts of this one, link to them.

use super::accel::Accel;
use super::lanes::{HitPacket, RayPacket};
use super::query::{IntersectPackets, OccludedPackets};
use crate::simd::{Lanes, Simd};

/// The widths that there are kernels for, and the vectors that they use: implemented for
/// `RayPacket<1>`, `<4>`, `<8>` and `<16>`.
pub trait PacketWidth<const W: usize> {
    /// `W` floats in an instruction set.
    type Lanes<S: Simd>: Lanes<W>;

    /// [`Accel::intersect_packets`] for this width; no bit beyond `W` may be set in `active`.
    #[doc(hidden)]
    fn intersect(accel: &Accel, rays: &[Self], active: &[u32], hits: &mut [HitPacket<W>])
    where
        Self: Sized;

    /// [`Accel::occluded_packets`] for this width; no bit beyond `W` may be set in `active`.
    #[doc(hidden)]
    fn occluded(accel: &Accel, rays: &[Self], active: &[u32], found: &mut [u32])
    where
        Self: Sized;
}

macro_rules! packet_width {
    ($width:literal, $lanes:ty, $intersect:ident, $occluded:ident) => {
        impl PacketWidth<$width> for RayPacket<$width> {
            type Lanes<S: Simd> = $lanes;

            #[inline(never)]
            fn intersect(accel: &Accel, rays: &[Self], active: &[u32], hits: &mut [HitPacket<$width>]) {
                $intersect(accel, rays, active, hits)
            }

            #[inline(never)]
            fn occluded(accel: &Accel, rays: &[Self], active: &[u32], found: &mut [u32]) {
                $occluded(accel, rays, active, found)
            }
        }
    };
}

packet_width!(1, f32, intersect_narrow, occluded_narrow);
packet_width!(4, S::F4, intersect_narrow, occluded_narrow);
packet_width!(8, S::F8, intersect, occluded);
packet_width!(16, S::F16, intersect, occluded);

#[inline(always)]
fn intersect<const W: usize>(accel: &Accel, rays: &[RayPacket<W>], active: &[u32], hits: &mut [HitPacket<W>])
where
    RayPacket<W>: PacketWidth<W>,
{
    accel.ask(IntersectPackets { rays, active, hits });
}

#[inline(always)]
fn occluded<const W: usize>(accel: &Accel, rays: &[RayPacket<W>], active: &[u32], found: &mut [u32])
where
    RayPacket<W>: PacketWidth<W>,
{
    accel.ask(OccludedPackets { rays, active, found });
}

/// The same for fewer rays than eight. In a scene that is in memory in part they go as eight: there, kernels
/// of their own would be compiled for the sake of a few rays that wait for the disk.
#[inline(always)]
fn intersect_narrow<const W: usize>(
    accel: &Accel,
    rays: &[RayPacket<W>],
    active: &[u32],
    hits: &mut [HitPacket<W>],
) where
    RayPacket<W>: PacketWidth<W>,
{
    if accel.cached().is_none() {
        return accel.ask_resident(IntersectPackets { rays, active, hits });
    }
    for ((rays, active), hits) in rays.iter().zip(active).zip(hits) {
        let mut wide = [HitPacket::<8>::miss()];
        PacketWidth::intersect(accel, &[widened(rays)], std::slice::from_ref(active), &mut wide);
        *hits = wide[0].first();
    }
}

#[inline(always)]
fn occluded_narrow<const W: usize>(accel: &Accel, rays: &[RayPacket<W>], active: &[u32], found: &mut [u32])
where
    RayPacket<W>: PacketWidth<W>,
{
    if accel.cached().is_none() {
        return accel.ask_resident(OccludedPackets { rays, active, found });
    }
    for ((rays, active), found) in rays.iter().zip(active).zip(found) {
        let found = std::slice::from_mut(found);
        PacketWidth::occluded(accel, &[widened(rays)], std::slice::from_ref(active), found);
    }
}

/// The rays as the first of eight.
fn widened<const W: usize>(rays: &RayPacket<W>) -> RayPacket<8> {
    let mut wide = RayPacket::empty();
    for lane in 0..W {
        wide.set(lane, &rays.get(lane));
    }
    wide
}
