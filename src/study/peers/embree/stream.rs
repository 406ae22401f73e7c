//! Tracing a run of rays: packets prepared in Embree's layout, records written out in full.

use super::abi::{Arguments, Hits, INVALID_ID, RayHits, Rays, Valid};
use super::flush::FlushDenormals;
use super::scene::{Scene, blank};
use crate::geometry::{Hit, Ray};
use glam::Vec3;

/// Which of Embree's traversals the ray query flags ask for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coherence {
    /// The default.
    Incoherent,
    /// For packets of rays that go the same way.
    Coherent,
}

impl Coherence {
    /// Both.
    pub const ALL: [Self; 2] = [Self::Incoherent, Self::Coherent];

    /// `incoherent` or `coherent`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Incoherent => "incoherent",
            Self::Coherent => "coherent",
        }
    }
}

/// Rays in Embree's own packets of `N` (1, 4, 8 or 16), ready to be copied into a query.
#[derive(Clone, Debug)]
pub struct Prepared<const N: usize> {
    packets: Vec<Rays<N>>,
    rays: usize,
}

/// The full record of `N` closest hits: what a renderer needs, 28 bytes a ray.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct PacketHits<const N: usize> {
    t: [f32; N],
    u: [f32; N],
    v: [f32; N],
    primitive: [u32; N],
    normal: [[f32; N]; 3],
}

impl<const N: usize> Prepared<N> {
    /// Packs rays in their order. The last packet's lanes beyond them never take part.
    pub fn new(rays: &[Ray]) -> Self {
        let packets = rays.chunks(N).map(|lanes| {
            let mut packet = blank::<N>();
            for (lane, ray) in lanes.iter().enumerate() {
                for axis in 0..3 {
                    packet.origin[axis][lane] = ray.origin[axis];
                    packet.direction[axis][lane] = ray.direction[axis];
                }
                packet.tnear[lane] = ray.tnear;
                packet.tfar[lane] = ray.tfar;
            }
            packet
        });
        Self { packets: packets.collect(), rays: rays.len() }
    }

    /// How many rays.
    pub fn rays(&self) -> usize {
        self.rays
    }

    /// Where they are.
    pub fn as_slice(&self) -> &[impl Sized + use<N>] {
        &self.packets
    }

    /// How many packets.
    pub fn packets(&self) -> usize {
        self.packets.len()
    }

    /// The packets, each with the mask of its lanes.
    #[inline(always)]
    fn masked(&self) -> impl Iterator<Item = (&Rays<N>, Valid<N>)> {
        self.packets.iter().enumerate().map(|(i, packet)| {
            let left = self.rays - i * N;
            let lane = |l| if l < left { -1 } else { 0 };
            // Every packet but the last is full; the branch is foreseen and saves the mask's making.
            let mask = if left >= N { [-1; N] } else { std::array::from_fn(lane) };
            (packet, Valid(mask))
        })
    }
}

impl<const N: usize> PacketHits<N> {
    /// Misses.
    pub const MISS: Self = Self {
        t: [f32::INFINITY; N],
        u: [0.0; N],
        v: [0.0; N],
        primitive: [INVALID_ID; N],
        normal: [[0.0; N]; 3],
    };

    /// The hit in a lane.
    pub fn get(&self, lane: usize) -> Hit {
        if self.primitive[lane] == INVALID_ID {
            return Hit::MISS;
        }
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            normal: Vec3::from_array([0, 1, 2].map(|axis: usize| self.normal[axis][lane])),
        }
    }
}

impl Scene {
    /// The closest hits, one record for each packet. Panics if `hits` is shorter than the packets.
    pub fn closest<const N: usize>(
        &self,
        rays: &Prepared<N>,
        coherence: Coherence,
        hits: &mut [PacketHits<N>],
    ) {
        assert!(hits.len() >= rays.packets());
        let _flush = FlushDenormals::new();
        let arguments = Arguments::new(coherence == Coherence::Coherent);
        let mut query = fresh::<N>();
        for ((packet, valid), out) in rays.masked().zip(hits) {
            query.rays = *packet;
            query.hits.geometry = [INVALID_ID; N];
            query.hits.primitive = [INVALID_ID; N];
            self.intersect(&valid, &mut query, &arguments);
            *out = PacketHits {
                t: query.rays.tfar,
                u: query.hits.u,
                v: query.hits.v,
                primitive: query.hits.primitive,
                normal: query.hits.normal,
            };
        }
    }

    /// A bit for each packet's lanes: whether anything is hit. Panics if `occluded` is shorter than the
    /// packets.
    pub fn any<const N: usize>(&self, rays: &Prepared<N>, coherence: Coherence, occluded: &mut [u16]) {
        assert!(occluded.len() >= rays.packets());
        let _flush = FlushDenormals::new();
        let arguments = Arguments::new(coherence == Coherence::Coherent);
        let mut query = fresh::<N>();
        for ((packet, valid), out) in rays.masked().zip(occluded) {
            query.rays = *packet;
            self.occluded(&valid, &mut query, &arguments);
            // A padding lane's tfar is finite, so its bit stays clear.
            let bits = query.rays.tfar.iter().enumerate();
            *out = bits.fold(0, |m, (lane, &t)| m | u16::from(t == f32::NEG_INFINITY) << lane);
        }
    }
}

/// A query's memory, reused from packet to packet.
fn fresh<const N: usize>() -> RayHits<N> {
    let none = [INVALID_ID; N];
    let hits = Hits {
        normal: [[0.0; N]; 3],
        u: [0.0; N],
        v: [0.0; N],
        primitive: none,
        geometry: none,
        instance: none,
        instance_primitive: none,
    };
    RayHits { rays: blank(), hits }
}
