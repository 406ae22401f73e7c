//! The widths of packets, and the kernels of each.
//!
//! A kernel is compiled for every instruction set, accuracy and storage: whoever calls one that is generic
//! over its width compiles all of that anew. So each width's calls are made here, once, and are never
//! inlined: other crates, and the other parts of this one, link to them.

use super::accel::Accel;
use super::lanes::{HitPacket, RayPacket};
use super::query::{IntersectPacket, OccludedPacket};
use crate::simd::{Lanes, Simd};

/// The widths that there are kernels for, and the vectors that they use: implemented for
/// `RayPacket<1>`, `<4>`, `<8>` and `<16>`.
pub trait PacketWidth<const W: usize> {
    /// `W` floats in an instruction set.
    type Lanes<S: Simd>: Lanes<W>;

    /// [`Accel::intersect_packet`] for this width; no bit beyond `W` may be set in `active`.
    #[doc(hidden)]
    fn intersect(&self, accel: &Accel, active: u32) -> HitPacket<W>;

    /// [`Accel::occluded_packet`] for this width; no bit beyond `W` may be set in `active`.
    #[doc(hidden)]
    fn occluded(&self, accel: &Accel, active: u32) -> u32;
}

macro_rules! packet_width {
    ($width:literal, $lanes:ty) => {
        impl PacketWidth<$width> for RayPacket<$width> {
            type Lanes<S: Simd> = $lanes;

            #[inline(never)]
            fn intersect(&self, accel: &Accel, active: u32) -> HitPacket<$width> {
                accel.ask(IntersectPacket { rays: self, active })
            }

            #[inline(never)]
            fn occluded(&self, accel: &Accel, active: u32) -> u32 {
                accel.ask(OccludedPacket { rays: self, active })
            }
        }
    };
}

packet_width!(1, f32);
packet_width!(4, S::F4);
packet_width!(8, S::F8);
packet_width!(16, S::F16);
