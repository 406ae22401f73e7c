//! Tracing rays through a tree. (STUB: brute force behind the final interface.)

use crate::error::Result;
use crate::geometry::{Aabb, Hit, Ray};
use crate::kdtree::{BuildParams, TreeStats};
use crate::mesh::Mesh;
use crate::simd::Isa;

/// A way of tracing rays. All give the same hits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// One ray at a time.
    Single,
    /// Four rays in SIMD lanes.
    Packet4,
    /// Eight.
    Packet8,
    /// Sixteen.
    Packet16,
}

impl Kernel {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Single, Self::Packet4, Self::Packet8, Self::Packet16];

    /// `single`, `packet4`, `packet8` or `packet16`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Packet4 => "packet4",
            Self::Packet8 => "packet8",
            Self::Packet16 => "packet16",
        }
    }
}

/// `W` rays, component by component. `W` is 4, 8 or 16.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
#[allow(missing_docs)]
pub struct RayPacket<const W: usize> {
    pub origin: [[f32; W]; 3],
    pub direction: [[f32; W]; 3],
    pub tnear: [f32; W],
    pub tfar: [f32; W],
}

impl<const W: usize> RayPacket<W> {
    /// A packet of empty rays.
    pub const fn empty() -> Self {
        Self { origin: [[0.0; W]; 3], direction: [[1.0; W]; 3], tnear: [0.0; W], tfar: [-1.0; W] }
    }

    /// Puts a ray into a lane.
    #[inline]
    pub fn set(&mut self, lane: usize, ray: &Ray) {
        for axis in 0..3 {
            self.origin[axis][lane] = ray.origin[axis];
            self.direction[axis][lane] = ray.direction[axis];
        }
        self.tnear[lane] = ray.tnear;
        self.tfar[lane] = ray.tfar;
    }

    /// The ray in a lane.
    #[inline]
    pub fn get(&self, lane: usize) -> Ray {
        let p = |a: &[[f32; W]; 3]| glam::Vec3::new(a[0][lane], a[1][lane], a[2][lane]);
        Ray {
            origin: p(&self.origin),
            tnear: self.tnear[lane],
            direction: p(&self.direction),
            tfar: self.tfar[lane],
        }
    }
}

/// `W` hits, component by component.
#[derive(Clone, Debug)]
#[repr(C, align(64))]
#[allow(missing_docs)]
pub struct HitPacket<const W: usize> {
    pub t: [f32; W],
    pub u: [f32; W],
    pub v: [f32; W],
    pub primitive: [u32; W],
    pub normal: [[f32; W]; 3],
}

impl<const W: usize> HitPacket<W> {
    /// A packet of misses.
    pub const fn miss() -> Self {
        Self {
            t: [f32::INFINITY; W],
            u: [0.0; W],
            v: [0.0; W],
            primitive: [u32::MAX; W],
            normal: [[0.0; W]; 3],
        }
    }

    /// The hit in a lane.
    #[inline]
    pub fn get(&self, lane: usize) -> Hit {
        Hit {
            t: self.t[lane],
            u: self.u[lane],
            v: self.v[lane],
            primitive: self.primitive[lane],
            normal: glam::Vec3::new(self.normal[0][lane], self.normal[1][lane], self.normal[2][lane]),
        }
    }
}

/// A mesh made ready for tracing: a tree and the triangles that it sorts.
#[derive(Debug)]
pub struct Accel {
    corners: Vec<[glam::Vec3; 3]>,
    bounds: Aabb,
    isa: Isa,
}

impl Accel {
    /// Builds the tree.
    pub fn build(mesh: &Mesh, _params: &BuildParams) -> Result<Self> {
        if mesh.triangles.is_empty() {
            return Err(crate::Error::Mesh("it has no triangles".into()));
        }
        Ok(Self {
            corners: (0..mesh.triangles.len() as u32).map(|i| mesh.corners(i)).collect(),
            bounds: mesh.bounds(),
            isa: Isa::detect(),
        })
    }

    /// The same, traced with another instruction set (which this machine must have).
    pub fn with_isa(mut self, isa: Isa) -> Self {
        self.set_isa(isa);
        self
    }

    /// Chooses the instruction set. Panics if this machine lacks it.
    pub fn set_isa(&mut self, isa: Isa) {
        assert!(Isa::available().contains(&isa));
        self.isa = isa;
    }

    /// The instruction set in use.
    pub fn isa(&self) -> Isa {
        self.isa
    }

    /// The box around all triangles.
    pub fn bounds(&self) -> Aabb {
        self.bounds
    }

    /// Figures about the tree.
    pub fn stats(&self) -> TreeStats {
        TreeStats { triangles: self.corners.len() as u64 }
    }

    /// The closest hit of one ray.
    pub fn intersect(&self, ray: &Ray) -> Hit {
        let mut best = Hit::MISS;
        for (i, c) in self.corners.iter().enumerate() {
            let (e1, e2) = (c[1] - c[0], c[2] - c[0]);
            let p = ray.direction.cross(e2);
            let det = e1.dot(p);
            let s = ray.origin - c[0];
            let q = s.cross(e1);
            let (u, v, t) = (s.dot(p) / det, ray.direction.dot(q) / det, e2.dot(q) / det);
            if u >= 0.0 && v >= 0.0 && u + v <= 1.0 && t >= ray.tnear && t <= ray.tfar && t < best.t {
                best = Hit { t, u, v, primitive: i as u32, normal: e1.cross(e2) };
            }
        }
        best
    }

    /// Whether anything lies in one ray's interval.
    pub fn occluded(&self, ray: &Ray) -> bool {
        self.intersect(ray).is_hit()
    }

    /// The closest hits of the lanes whose bit is set in `active`; the others' hits are misses.
    pub fn intersect_packet<const W: usize>(&self, rays: &RayPacket<W>, active: u32) -> HitPacket<W> {
        let mut hits = HitPacket::miss();
        for lane in (0..W).filter(|l| active >> l & 1 == 1) {
            let h = self.intersect(&rays.get(lane));
            (hits.t[lane], hits.u[lane], hits.v[lane], hits.primitive[lane]) = (h.t, h.u, h.v, h.primitive);
            for a in 0..3 {
                hits.normal[a][lane] = h.normal[a];
            }
        }
        hits
    }

    /// A bit for each lane set in `active` in whose interval anything lies.
    pub fn occluded_packet<const W: usize>(&self, rays: &RayPacket<W>, active: u32) -> u32 {
        (0..W)
            .filter(|l| active >> l & 1 == 1)
            .fold(0, |m, l| m | u32::from(self.occluded(&rays.get(l))) << l)
    }

    /// The closest hit of each ray, by the kernel named. Panics if the slices' lengths differ.
    pub fn intersect_many(&self, _kernel: Kernel, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len());
        for (r, h) in rays.iter().zip(hits) {
            *h = self.intersect(r);
        }
    }

    /// Whether each ray is occluded, by the kernel named. Panics if the slices' lengths differ.
    pub fn occluded_many(&self, _kernel: Kernel, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len());
        for (r, o) in rays.iter().zip(occluded) {
            *o = self.occluded(r);
        }
    }
}
