//! Triangles with holes: a hit may turn out to be none.
//!
//! Where a picture cuts holes into surfaces, whether a ray hits one is known only when the picture was looked up. A
//! ray that stopped at each hole and were started again behind it would walk the tree once for every leaf of a
//! tree in its way. So the packet kernel asks a [`Sieve`] at each triangle that it is about to take, and goes on as
//! if the triangle were not there when the sieve lets the ray through. Kernels without a sieve are other
//! instances, in which nothing of this is left.

use super::accel::Accel;
use super::lanes::{HitPacket, RayPacket, give_lanes, lanes_of};
use super::query::{IntersectPackets, OccludedPackets};
use super::records::{Records, Resident};
use crate::geometry::triangle::{Candidate, Mode, Test};
use crate::geometry::{Aabb, Hit, Ray};
use crate::kdtree::{Node, Scale, Tree};
use crate::simd::{Lanes, Mask};

/// What says where triangles have holes.
///
/// It is asked through a pointer: a look-up in a picture costs many times such a call, and it is only made for
/// triangles that may have holes, at places where a ray meets them before all else that is known.
pub trait Sieve: Sync {
    /// Whether a triangle has any holes.
    fn has_holes(&self, primitive: u32) -> bool;

    /// Whether there is something of the triangle where the barycentric weights of its second and third corner are
    /// `u` and `v`.
    fn is_there(&self, primitive: u32, u: f32, v: f32) -> bool;
}

/// A tree in memory whose triangles have holes.
pub(super) struct Sifted<'a, R> {
    pub resident: Resident<'a, R>,
    pub sieve: &'a dyn Sieve,
}

impl<R> Tree for Sifted<'_, R> {
    #[inline(always)]
    fn scale(&self) -> Scale {
        self.resident.scale()
    }

    #[inline(always)]
    fn bounds(&self) -> &Aabb {
        self.resident.bounds()
    }

    #[inline(always)]
    fn root(&self) -> Node {
        self.resident.root()
    }

    #[inline(always)]
    fn children(&self, inner: Node) -> [Node; 2] {
        self.resident.children(inner)
    }

    #[inline(always)]
    fn primitives(&self, leaf: Node) -> &[u32] {
        self.resident.primitives(leaf)
    }

    #[inline(always)]
    fn upper(&self, place: usize) -> Node {
        self.resident.upper(place)
    }

    #[inline(always)]
    fn beneath(&self, place: usize) -> Node {
        self.resident.beneath(place)
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        self.resident.page(leaf)
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &crate::geometry::triangle::Triangle {
        self.resident.triangle(primitive)
    }
}

impl<M: Mode> Records<M> for Sifted<'_, M::Record> {
    const SIFTS: bool = true;

    #[inline(always)]
    fn record_of(&self, primitive: u32) -> &M::Record {
        Records::<M>::record_of(&self.resident, primitive)
    }

    #[inline(always)]
    fn fetch(&self, primitive: u32) {
        Records::<M>::fetch(&self.resident, primitive);
    }

    #[inline(always)]
    fn fetch_children(&self, node: Node) {
        Records::<M>::fetch_children(&self.resident, node);
    }

    #[inline(always)]
    fn sieve(&self) -> Option<&dyn Sieve> {
        Some(self.sieve)
    }
}

/// Takes the lanes out of a candidate that go through a hole, of those in `live` that would take it: whose `t` is in
/// the interval from `tnear` to `tfar`.
#[inline(always)]
pub(super) fn sift<const W: usize, L: Lanes<W>, T: Records<M>, M: Mode>(
    tree: &T,
    candidate: &mut Candidate<W, L>,
    primitive: u32,
    [tnear, tfar]: [L; 2],
    live: L::Mask,
) {
    let Some(sieve) = tree.sieve() else { return };
    let asked = candidate.inside & live & tnear.le(candidate.t) & candidate.t.le(tfar);
    if !asked.any() || !sieve.has_holes(primitive) {
        return;
    }
    let [u, v] = M::Test::<W, L>::weights(tree.record_of(primitive), candidate.u, candidate.v).map(L::store);
    let mut there = asked.bits();
    let mut rest = there;
    while rest != 0 {
        let lane = rest.trailing_zeros() as usize % W;
        rest &= rest - 1;
        if !sieve.is_there(primitive, u[lane], v[lane]) {
            there &= !(1 << lane);
        }
    }
    candidate.inside = candidate.inside & L::mask_from_bits(there);
}

impl Accel {
    /// The closest hits of rays on what a sieve leaves of the triangles. Panics if the slices' lengths differ, or
    /// the scene is not all in memory.
    #[inline(never)]
    pub fn intersect_sifted(&self, sieve: &dyn Sieve, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        for (rays, hits) in rays.chunks(8).zip(hits.chunks_mut(8)) {
            let (packet, active) = (RayPacket::<8>::of_slice(rays), lanes_of(rays.len()));
            let mut found = [HitPacket::<8>::miss()];
            let query = IntersectPackets { rays: &[packet], active: &[active], hits: &mut found };
            self.ask_sifted(sieve, query);
            HitPacket::give(&found, hits);
        }
    }

    /// Whether anything that a sieve leaves of the triangles lies in each ray's interval. Panics likewise.
    #[inline(never)]
    pub fn occluded_sifted(&self, sieve: &dyn Sieve, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        for (rays, occluded) in rays.chunks(8).zip(occluded.chunks_mut(8)) {
            let (packet, active) = (RayPacket::<8>::of_slice(rays), lanes_of(rays.len()));
            let mut found = [0];
            let query = OccludedPackets { rays: &[packet], active: &[active], found: &mut found };
            self.ask_sifted(sieve, query);
            give_lanes::<8>(&found, occluded);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Accuracy;
    use crate::kdtree::BuildParams;
    use crate::mesh::Mesh;
    use crate::simd::Isa;
    use glam::Vec3;

    /// Leaves a part of each triangle but every third.
    struct Halves;

    impl Sieve for Halves {
        fn has_holes(&self, primitive: u32) -> bool {
            primitive % 3 != 2
        }

        fn is_there(&self, primitive: u32, u: f32, _: f32) -> bool {
            assert!(self.has_holes(primitive), "asked only where there may be holes");
            u < 0.35
        }
    }

    /// Triangles behind one another, each across the whole of a unit square and askew.
    fn curtain(layers: u32) -> Mesh {
        let corner = |layer: u32, x: f32, y: f32| Vec3::new(x, y, -(layer as f32) - 0.3 * x);
        let positions = (0..layers)
            .flat_map(|i| [corner(i, -1.0, -1.0), corner(i, 3.0, -1.0), corner(i, -1.0, 3.0)])
            .collect();
        let triangles = (0..layers).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn rays_go_through_holes_and_stop_at_what_is_there() {
        let mesh = curtain(40);
        let rays: Vec<Ray> = (0..500)
            .map(|i| {
                let (x, y) = (i % 25, i / 25);
                let origin = Vec3::new(x as f32 * 0.04, y as f32 * 0.05, 1.0);
                let begin = if i % 7 == 0 { 3.5 } else { 0.0 };
                let end = if i % 5 == 0 { 2.2 } else { f32::INFINITY };
                Ray::segment(origin, Vec3::new(0.01, 0.02, -1.0), begin, end)
            })
            .collect();
        for accuracy in Accuracy::ALL {
            for isa in Isa::available() {
                let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
                let accel = accel.with_isa(isa).with_accuracy(accuracy);
                // The oracle starts rays anew behind each hole.
                let first_there = |ray: &Ray| {
                    let mut ray = *ray;
                    loop {
                        let hit = accel.intersect(&ray);
                        if !hit.is_hit() || !Halves.has_holes(hit.primitive) || hit.u < 0.35 {
                            return hit;
                        }
                        ray.tnear = hit.t.next_up();
                    }
                };
                let expected: Vec<Hit> = rays.iter().map(first_there).collect();
                let passed =
                    rays.iter().zip(&expected).filter(|(ray, hit)| accel.intersect(ray) != **hit).count();
                assert!(passed > 100, "rays go through holes: {passed}");
                let mut hits = vec![Hit::MISS; rays.len()];
                accel.intersect_sifted(&Halves, &rays, &mut hits);
                assert_eq!(hits, expected, "{accuracy} on {isa}");
                let mut occluded = vec![false; rays.len()];
                accel.occluded_sifted(&Halves, &rays, &mut occluded);
                assert!(occluded.iter().zip(&expected).all(|(&occluded, hit)| occluded == hit.is_hit()));
                assert!(occluded.contains(&false) && occluded.contains(&true));
            }
        }
    }
}
