//! Rays and hits component by component, as the packet kernels take and give them.

use crate::geometry::{Hit, NO_PRIMITIVE, Ray};
use glam::Vec3;

/// `W` rays, component by component. `W` is 1, 4, 8 or 16.
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct RayPacket<const W: usize> {
    /// Origins: `origin[axis][lane]`.
    pub origin: [[f32; W]; 3],
    /// Directions, of any length but zero: `direction[axis][lane]`.
    pub direction: [[f32; W]; 3],
    /// Least parameters that count.
    pub tnear: [f32; W],
    /// Greatest parameters that count.
    pub tfar: [f32; W],
}

/// The first `count` lanes, at most 16.
pub(super) const fn lanes_of(count: usize) -> u32 {
    (1 << count) - 1
}

impl<const W: usize> RayPacket<W> {
    /// A packet of rays with empty intervals, which hit nothing.
    pub const fn empty() -> Self {
        Self { origin: [[0.0; W]; 3], direction: [[1.0; W]; 3], tnear: [0.0; W], tfar: [-1.0; W] }
    }

    /// The rays of a slice in order, at most `W`; lanes beyond its end are empty.
    #[inline]
    pub fn of_slice(rays: &[Ray]) -> Self {
        let mut packet = Self::empty();
        for (lane, ray) in rays.iter().enumerate() {
            packet.set(lane, ray);
        }
        packet
    }

    /// Puts a ray into a lane. Panics if there is no such lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        self.tnear[lane] = ray.tnear;
        self.tfar[lane] = ray.tfar;
    }

    /// The ray in a lane. Panics if there is no such lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Ray {
        let vector = |v: &[[f32; W]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]);
        Ray {
            origin: vector(&self.origin),
            tnear: self.tnear[lane],
            direction: vector(&self.direction),
            tfar: self.tfar[lane],
        }
    }

    /// The `N` lanes from `part * N` on. Panics if there are not as many.
    #[inline(always)]
    pub(super) fn part<const N: usize>(&self, part: usize) -> RayPacket<N> {
        let row = |row: &[f32; W]| row.as_chunks::<N>().0[part];
        RayPacket {
            origin: [row(&self.origin[0]), row(&self.origin[1]), row(&self.origin[2])],
            direction: [row(&self.direction[0]), row(&self.direction[1]), row(&self.direction[2])],
            tnear: row(&self.tnear),
            tfar: row(&self.tfar),
        }
    }
}

/// `W` hits, component by component; a miss as in [`Hit::MISS`].
#[derive(Clone, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct HitPacket<const W: usize> {
    /// Parameters, infinite for misses.
    pub t: [f32; W],
    /// Barycentric weights of the second corner.
    pub u: [f32; W],
    /// Barycentric weights of the third corner.
    pub v: [f32; W],
    /// Primitive ids.
    pub primitive: [u32; W],
    /// Geometric normals, not normalised: `normal[axis][lane]`.
    pub normal: [[f32; W]; 3],
}

/// Says one by one which lanes of packets of `W` are set, as many as there is room for.
pub(crate) fn give_lanes<const W: usize>(packets: &[u32], flags: &mut [bool]) {
    for (lanes, flags) in packets.iter().zip(flags.chunks_mut(W)) {
        flags.iter_mut().enumerate().for_each(|(lane, flag)| *flag = lanes >> lane & 1 == 1);
    }
}

impl<const W: usize> HitPacket<W> {
    /// A packet of misses.
    pub const fn miss() -> Self {
        Self {
            t: [f32::INFINITY; W],
            u: [0.0; W],
            v: [0.0; W],
            primitive: [NO_PRIMITIVE; W],
            normal: [[0.0; W]; 3],
        }
    }

    /// The hit in a lane. Panics if there is no such lane.
    #[inline(always)]
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            normal: Vec3::new(self.normal[0][lane], self.normal[1][lane], self.normal[2][lane]),
        }
    }

    /// Gives the hits of packets one by one, as many as there is room for.
    pub(crate) fn give(packets: &[Self], hits: &mut [Hit]) {
        for (packet, hits) in packets.iter().zip(hits.chunks_mut(W)) {
            hits.iter_mut().enumerate().for_each(|(lane, hit)| *hit = packet.get(lane));
        }
    }

    /// The first `N` hits.
    pub(super) fn first<const N: usize>(&self) -> HitPacket<N> {
        let row = |row: &[f32; W]| row.as_chunks::<N>().0[0];
        HitPacket {
            t: row(&self.t),
            u: row(&self.u),
            v: row(&self.v),
            primitive: self.primitive.as_chunks::<N>().0[0],
            normal: [row(&self.normal[0]), row(&self.normal[1]), row(&self.normal[2])],
        }
    }

    /// Puts those of `N` hits whose bit is set in `lanes` into the lanes from `part * N` on. Panics if there are not as many.
    #[inline(always)]
    pub(super) fn set_part<const N: usize>(&mut self, part: usize, hits: &HitPacket<N>, lanes: u32) {
        if lanes == lanes_of(N) {
            self.t.as_chunks_mut::<N>().0[part] = hits.t;
            self.u.as_chunks_mut::<N>().0[part] = hits.u;
            self.v.as_chunks_mut::<N>().0[part] = hits.v;
            self.primitive.as_chunks_mut::<N>().0[part] = hits.primitive;
            for axis in 0..3 {
                self.normal[axis].as_chunks_mut::<N>().0[part] = hits.normal[axis];
            }
        } else {
            for lane in (0..N).filter(|lane| lanes >> lane & 1 == 1) {
                self.set(part * N + lane, &hits.get(lane));
            }
        }
    }

    /// Puts a hit into a lane. Panics if there is no such lane.
    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, hit: &Hit) {
        self.t[lane] = hit.t;
        self.u[lane] = hit.u;
        self.v[lane] = hit.v;
        self.primitive[lane] = hit.primitive;
        for axis in 0..3 {
            self.normal[axis][lane] = hit.normal[axis];
        }
    }
}

impl HitPacket<1> {
    /// One hit as a packet.
    pub fn of_hit(hit: &Hit) -> Self {
        let Hit { t, u, v, primitive, normal } = *hit;
        let normal = normal.to_array().map(|coordinate| [coordinate]);
        Self { t: [t], u: [u], v: [v], primitive: [primitive], normal }
    }
}
