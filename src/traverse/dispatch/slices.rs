//! The kernel that is quickest for rays in a row, whatever they have in common.
//!
//! Who hands over a slice of rays may not know whether neighbours go the same way, and a file of rays may hold
//! both kinds. So lists and streams are tried beside beams and packets, lot by lot: where rays have nothing in common they
//! are quickest, and where they have they are several times slower. Of rays that are known to have little in common
//! ([`ScatteredDispatch`]), fewer kernels are tried: none of them loses much, and what it takes to find out is soon paid for.

use super::{Accel, Choice, FRUGAL, Kernel, LEAST_RAYS, recorded};
use crate::geometry::{Hit, Ray};

/// Rays that go to a kernel at once: as many as lists hold. While another kernel than the quickest is tried, as many as a
/// wide beam does; but lists are tried with as many as they hold, since they are the better, the more there are.
const LOT: usize = Kernel::Filter.width();
const TRIAL: usize = Kernel::WideTile.width();

/// Kernels that are chosen among, and what was learnt about them. The second is what is used where memory is short.
#[derive(Clone, Copy, Debug)]
struct Slices<const N: usize> {
    ways: [Kernel; N],
    choice: Choice<N>,
    /// How many rays each has traced.
    traced: [u64; N],
}

/// What the next of some rays do.
struct Next {
    way: usize,
    /// How many of them.
    rays: usize,
    /// Whether note is taken of how long it takes.
    counts: bool,
}

impl<const N: usize> Slices<N> {
    fn among(ways: [Kernel; N]) -> Self {
        Self { ways, choice: Choice::default(), traced: [0; N] }
    }

    /// Has rays traced lot by lot; `trace` writes a lot's answers.
    fn trace<A>(
        &mut self,
        accel: &Accel,
        mut rays: &[Ray],
        mut answers: &mut [A],
        trace: impl Fn(Kernel, &[Ray], &mut [A]),
    ) {
        assert_eq!(rays.len(), answers.len(), "as many answers as rays");
        while !rays.is_empty() {
            let next = self.next(accel, rays.len());
            let (now, later) = rays.split_at(next.rays);
            let (answers_now, answers_later) = answers.split_at_mut(next.rays);
            let kernel = self.ways[next.way];
            if next.counts {
                let choice = &mut self.choice;
                recorded(accel, choice, next.way, next.rays, || trace(kernel, now, answers_now));
            } else {
                trace(kernel, now, answers_now);
            }
            self.traced[next.way] += next.rays as u64;
            (rays, answers) = (later, answers_later);
        }
    }

    fn next(&mut self, accel: &Accel, rays: usize) -> Next {
        if accel.cached().is_some_and(|cached| cached.is_short()) {
            return Next { way: FRUGAL, rays: rays.min(LOT), counts: false };
        }
        let quickest = self.choice.quickest();
        if rays < LEAST_RAYS {
            return Next { way: quickest, rays, counts: false };
        }
        let way = self.choice.next();
        let whole = way == quickest || self.ways[way] == Kernel::Filter;
        Next { way, rays: rays.min(if whole { LOT } else { TRIAL }), counts: true }
    }
}

/// What one worker has learnt about which kernel is quickest for rays in slices: for closest hits, and for any
/// hit. One for each thread and, where several kinds of rays are told apart, for each kind.
#[derive(Clone, Copy, Debug)]
pub struct SliceDispatch {
    closest: Slices<6>,
    any: Slices<5>,
}

impl Default for SliceDispatch {
    fn default() -> Self {
        use Kernel::{Filter, Packet8, Packet16, Stream, Tile, WideTile};
        Self {
            closest: Slices::among([Tile, Packet16, Packet8, Stream, Filter, WideTile]),
            any: Slices::among([Tile, Packet16, Packet8, Stream, Filter]),
        }
    }
}

impl SliceDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        self.closest.trace(accel, rays, hits, |kernel, rays, hits| accel.intersect_many(kernel, rays, hits));
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        self.any.trace(accel, rays, occluded, |kernel, rays, found| accel.occluded_many(kernel, rays, found));
    }

    /// Kernels, and how many rays each has traced. One may be there twice: for closest hits, and for any hit.
    pub fn traced(&self) -> impl Iterator<Item = (Kernel, u64)> {
        let Self { closest, any } = *self;
        closest.ways.into_iter().zip(closest.traced).chain(any.ways.into_iter().zip(any.traced))
    }
}

/// What one worker has learnt about which kernel is quickest for rays of one kind that bounce off something: for closest
/// hits, and for any hit.
#[derive(Clone, Copy, Debug)]
pub struct ScatteredDispatch {
    closest: Slices<2>,
    any: Slices<3>,
}

impl Default for ScatteredDispatch {
    fn default() -> Self {
        use Kernel::{Filter, Packet16, Stream};
        Self { closest: Slices::among([Filter, Stream]), any: Slices::among([Filter, Stream, Packet16]) }
    }
}

impl ScatteredDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        self.closest.trace(accel, rays, hits, |kernel, rays, hits| accel.intersect_many(kernel, rays, hits));
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        self.any.trace(accel, rays, occluded, |kernel, rays, found| accel.occluded_many(kernel, rays, found));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use glam::Vec3;

    fn soup() -> Accel {
        Accel::build(&shapes::soup(200, 1), &BuildParams::default()).expect("a soup has a tree")
    }

    fn rays(first: usize, count: usize) -> Vec<Ray> {
        let ray = |i: usize| {
            let part = |k: f32| (i as f32 * k).fract();
            let origin = Vec3::new(part(0.618), part(0.755), part(0.57)) * 2.0 - 0.5;
            Ray::new(origin, Vec3::new(part(0.31) - 0.5, part(0.87) - 0.5, part(0.13) - 0.5))
        };
        (first..first + count).map(ray).collect()
    }

    /// Every ray is answered as by itself; some hit, and some do not.
    fn check(accel: &Accel, rays: &[Ray], hits: &[Hit], occluded: &[bool]) {
        for ((ray, hit), occluded) in rays.iter().zip(hits).zip(occluded) {
            assert_eq!(*hit, accel.intersect(ray));
            assert_eq!(*occluded, hit.is_hit());
        }
        assert!(hits.iter().any(Hit::is_hit) && !hits.iter().all(Hit::is_hit));
    }

    #[test]
    fn every_ray_is_answered_as_by_itself_and_counted() {
        let accel = soup();
        let rays = rays(0, 120 * TRIAL + 5);
        let mut dispatch = SliceDispatch::default();
        let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
        dispatch.intersect(&accel, &rays, &mut hits);
        dispatch.occluded(&accel, &rays, &mut occluded);
        check(&accel, &rays, &hits, &occluded);
        let traced: Vec<(Kernel, u64)> = dispatch.traced().collect();
        assert_eq!(traced.iter().map(|(_, rays)| rays).sum::<u64>(), 2 * rays.len() as u64);
        assert!(traced.iter().all(|&(_, rays)| rays > 0), "all ways are tried: {traced:?}");
    }

    #[test]
    fn scattered_rays_are_answered_as_by_themselves_whichever_kernel_they_go_to() {
        let accel = soup();
        let mut dispatch = ScatteredDispatch::default();
        for lot in 0..20 {
            let rays = rays(lot * 701, 200 + 17 * lot);
            let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            dispatch.intersect(&accel, &rays, &mut hits);
            dispatch.occluded(&accel, &rays, &mut occluded);
            check(&accel, &rays, &hits, &occluded);
        }
        let Slices { traced: closest, .. } = dispatch.closest;
        let Slices { traced: any, .. } = dispatch.any;
        assert!(closest.iter().chain(&any).all(|&rays| rays > 0), "all ways are tried: {closest:?} {any:?}");
    }
}
