//! The kernel that is quickest for rays in a row, whatever they have in common.
//!
//! Who hands over a slice of rays may not know whether neighbours go the same way, and a file of rays may hold
//! both kinds. So streams are tried beside beams and packets, lot by lot: where rays have nothing in common they
//! are quickest, and where they have they are several times slower.

use super::{Accel, Choice, FRUGAL, Kernel, LEAST_RAYS, recorded};
use crate::geometry::{Hit, Ray};

/// The kernels that it chooses among for closest hits. All but the last are those for any hit.
const WAYS: [Kernel; 6] =
    [Kernel::Tile, Kernel::Packet16, Kernel::Packet8, Kernel::Stream, Kernel::Filter, Kernel::WideTile];
const ANY_WAYS: [Kernel; 5] = [WAYS[0], WAYS[1], WAYS[2], WAYS[3], WAYS[4]];

/// Rays that go to a kernel at once: as many as lists hold. While another kernel than the quickest is tried, as many as a
/// wide beam does; but lists are tried with as many as they hold, since they are the better, the more there are.
const LOT: usize = 4096;
const TRIAL: usize = 1024;

/// What the next of some rays do.
struct Next {
    way: usize,
    /// How many of them.
    rays: usize,
    /// Whether note is taken of how long it takes.
    counts: bool,
}

impl Next {
    fn choose<const N: usize>(
        accel: &Accel,
        ways: &[Kernel; N],
        choice: &mut Choice<N>,
        rays: usize,
    ) -> Self {
        if accel.cached().is_some_and(|cached| cached.is_short()) {
            return Self { way: FRUGAL, rays: rays.min(LOT), counts: false };
        }
        let quickest = choice.quickest();
        if rays < LEAST_RAYS {
            return Self { way: quickest, rays, counts: false };
        }
        let way = choice.next();
        let whole = way == quickest || ways[way] == Kernel::Filter;
        Self { way, rays: rays.min(if whole { LOT } else { TRIAL }), counts: true }
    }

    /// Has them traced.
    fn trace<const N: usize>(&self, accel: &Accel, choice: &mut Choice<N>, trace: impl FnOnce()) {
        if self.counts {
            recorded(accel, choice, self.way, self.rays, trace);
        } else {
            trace();
        }
    }
}

/// What one worker has learnt about which kernel is quickest for rays in slices: for closest hits, and for any
/// hit. One for each thread and, where several kinds of rays are told apart, for each kind.
#[derive(Clone, Copy, Debug, Default)]
pub struct SliceDispatch {
    closest: Choice<{ WAYS.len() }>,
    any: Choice<{ ANY_WAYS.len() }>,
    traced: [u64; WAYS.len()],
}

impl SliceDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        assert_eq!(rays.len(), hits.len(), "as many hits as rays");
        let (mut rays, mut hits) = (rays, hits);
        while !rays.is_empty() {
            let next = Next::choose(accel, &WAYS, &mut self.closest, rays.len());
            let (now, later) = rays.split_at(next.rays);
            let (hits_now, hits_later) = hits.split_at_mut(next.rays);
            let kernel = WAYS[next.way];
            next.trace(accel, &mut self.closest, || accel.intersect_many(kernel, now, hits_now));
            self.traced[next.way] += next.rays as u64;
            (rays, hits) = (later, hits_later);
        }
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        assert_eq!(rays.len(), occluded.len(), "as many answers as rays");
        let (mut rays, mut occluded) = (rays, occluded);
        while !rays.is_empty() {
            let next = Next::choose(accel, &ANY_WAYS, &mut self.any, rays.len());
            let (now, later) = rays.split_at(next.rays);
            let (found_now, found_later) = occluded.split_at_mut(next.rays);
            let kernel = ANY_WAYS[next.way];
            next.trace(accel, &mut self.any, || accel.occluded_many(kernel, now, found_now));
            self.traced[next.way] += next.rays as u64;
            (rays, occluded) = (later, found_later);
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
        let rays: Vec<Ray> = (0..120 * TRIAL + 5)
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
