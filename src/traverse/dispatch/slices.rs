//! The kernel that is quickest for rays in a row, whatever they have in common.
//!
//! Who hands over a slice of rays may not know whether neighbours go the same way, and a file of rays may hold
//! both kinds. So streams are tried beside beams and packets, lot by lot: where rays have nothing in common they
//! are quickest, and where they have they are several times slower.

use super::{Accel, Choice, Kernel, timed};
use crate::geometry::{Hit, Ray};

/// The kernels that it chooses among.
const WAYS: [Kernel; 4] = [Kernel::Tile, Kernel::Packet16, Kernel::Packet8, Kernel::Stream];

/// Rays that go to a kernel at once: enough for streams to be in flight most of the time.
const LOT: usize = 1024;

/// What one worker has learnt about which kernel is quickest for rays in slices: for closest hits, and for any
/// hit. One for each thread and, where several kinds of rays are told apart, for each kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct SliceDispatch {
    closest: Choice<{ WAYS.len() }>,
    any: Choice<{ WAYS.len() }>,
    traced: [u64; WAYS.len()],
}

impl SliceDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        for (rays, hits) in rays.chunks(LOT).zip(hits.chunks_mut(LOT)) {
            let trace = |kernel| accel.intersect_many(kernel, rays, hits);
            let way = timed(accel, &WAYS, &mut self.closest, None, rays.len(), trace);
            self.traced[way] += rays.len() as u64;
        }
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        for (rays, occluded) in rays.chunks(LOT).zip(occluded.chunks_mut(LOT)) {
            let trace = |kernel| accel.occluded_many(kernel, rays, occluded);
            let way = timed(accel, &WAYS, &mut self.any, None, rays.len(), trace);
            self.traced[way] += rays.len() as u64;
        }
    }

    /// How many rays each kernel has traced.
    pub fn traced(&self) -> [(Kernel, u64); WAYS.len()] {
        std::array::from_fn(|way| (WAYS[way], self.traced[way]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use glam::Vec3;

    #[test]
    fn every_ray_is_answered_as_by_itself_and_counted() {
        let accel = Accel::build(&shapes::soup(200, 1), &BuildParams::default()).expect("a soup has a tree");
        let rays: Vec<Ray> = (0..30 * LOT + 5)
            .map(|i| {
                let part = |k: f32| (i as f32 * k).fract();
                let origin = Vec3::new(part(0.618), part(0.755), part(0.57)) * 2.0 - 0.5;
                Ray::new(origin, Vec3::new(part(0.31) - 0.5, part(0.87) - 0.5, part(0.13) - 0.5))
            })
            .collect();
        let mut dispatch = SliceDispatch::default();
        let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        dispatch.intersect(&accel, &rays, &mut hits);
        dispatch.occluded(&accel, &rays, &mut occluded);
        for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(&occluded) {
            assert_eq!(*hit, accel.intersect(ray));
            assert_eq!(*occluded, hit.is_hit());
        }
        assert!(hits.iter().any(Hit::is_hit) && !hits.iter().all(Hit::is_hit));
        let traced = dispatch.traced();
        assert_eq!(traced.iter().map(|(_, rays)| rays).sum::<u64>(), 2 * rays.len() as u64);
        assert!(traced.iter().all(|&(_, rays)| rays > 0), "all ways are tried: {traced:?}");
    }
}
