//! The kernel that is quickest for rays that have little in common.
//!
//! Lists of rays win where many of these visit the same places, streams where each goes its own way through a large scene,
//! and packets where rays end soon. None of them loses much, so that what it takes to find out is soon paid for.

use super::{Accel, Choice, Kernel, timed};
use crate::geometry::{Hit, Ray};

/// The kernels that it chooses among for any hit. The first two of them are those for closest hits.
const WAYS: [Kernel; 3] = [Kernel::Filter, Kernel::Stream, Kernel::Packet16];
const CLOSEST_WAYS: [Kernel; 2] = [WAYS[0], WAYS[1]];

/// Rays that go to a kernel at once, at most: as many as lists hold.
const LOT: usize = 4096;

/// What one worker has learnt about which kernel is quickest for rays of one kind that bounce off something: for closest
/// hits, and for any hit.
#[derive(Clone, Copy, Debug, Default)]
pub struct ScatteredDispatch {
    closest: Choice<{ CLOSEST_WAYS.len() }>,
    any: Choice<{ WAYS.len() }>,
}

impl ScatteredDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        for (rays, hits) in rays.chunks(LOT).zip(hits.chunks_mut(LOT)) {
            let trace = |kernel| accel.intersect_many(kernel, rays, hits);
            timed(accel, &CLOSEST_WAYS, &mut self.closest, None, rays.len(), trace);
        }
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        for (rays, occluded) in rays.chunks(LOT).zip(occluded.chunks_mut(LOT)) {
            let trace = |kernel| accel.occluded_many(kernel, rays, occluded);
            timed(accel, &WAYS, &mut self.any, None, rays.len(), trace);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use glam::Vec3;

    #[test]
    fn rays_are_answered_as_by_themselves_whichever_kernel_they_go_to() {
        let accel = Accel::build(&shapes::soup(200, 1), &BuildParams::default()).expect("a soup has a tree");
        let mut dispatch = ScatteredDispatch::default();
        for lot in 0..20 {
            let part = |i: usize, k: f32| ((lot * 701 + i) as f32 * k).fract();
            let rays: Vec<Ray> = (0..200 + 17 * lot)
                .map(|i| {
                    let origin = Vec3::new(part(i, 0.618), part(i, 0.755), part(i, 0.57)) * 2.0 - 0.5;
                    Ray::new(origin, Vec3::new(part(i, 0.31), part(i, 0.87), part(i, 0.13)) - 0.5)
                })
                .collect();
            let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            dispatch.intersect(&accel, &rays, &mut hits);
            dispatch.occluded(&accel, &rays, &mut occluded);
            for ((ray, hit), occluded) in rays.iter().zip(&hits).zip(&occluded) {
                assert_eq!(*hit, accel.intersect(ray));
                assert_eq!(*occluded, hit.is_hit());
            }
        }
        assert!(!dispatch.closest.is_beginning() && !dispatch.any.is_beginning(), "all ways were tried");
    }
}
