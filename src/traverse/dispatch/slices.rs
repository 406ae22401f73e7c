//! The kernel that is quickest for rays in a row, whatever they have in common.
//!
//! Who hands over a slice of rays may not know whether neighbours go the same way, and a file of rays may hold
//! both kinds. Where rays have nothing in common, lists and streams are quickest and beams and packets are several times
//! slower; where they have, it is the other way round. So it is looked at first, lot by lot, whether rays are
//! [scattered](are_scattered), and each kind has its own kernels to choose from: none of them loses much, and what it takes
//! to find out is soon paid for. Whoever knows that rays are scattered has a [`ScatteredDispatch`].

use super::{Accel, Choice, FRUGAL, Kernel, LEAST_RAYS, leave_out_halves, recorded};
use crate::geometry::{Aabb, Hit, Ray};

/// Rays that go to a kernel at once: as many as lists hold. While another kernel than the quickest is tried, as many as a
/// wide beam does.
const LOT: usize = Kernel::Filter.width();
const TRIAL: usize = Kernel::WideTile.width();

/// How many rays in a row are looked at together, and how often in a lot, to tell whether they are scattered.
const NEIGHBOURS: usize = 8;
const LOOKS: usize = 16;

/// Neighbours are scattered if they come to lie farther apart than this part of the scene's diagonal.
const FAR_APART: f32 = 0.25;

/// Whether most rays of the next lot run far from those beside them: whether a ray, from where it starts to where it leaves
/// the scene, comes to be far from the first of its neighbours. Camera rays of a picture 64 pixels wide are not scattered,
/// the same rays shuffled are, and so are parallel ones that start anywhere. NaNs are far from nothing.
fn are_scattered(rays: &[Ray], bounds: &Aabb) -> bool {
    let diagonal = (bounds.max - bounds.min).length();
    let limit = FAR_APART * diagonal;
    let groups = rays[..rays.len().min(LOT)].chunks_exact(NEIGHBOURS);
    // Rows of a picture are as long as some power of two: what is looked at must not lie at the same place of each.
    let apart = groups.len().div_ceil(LOOKS) | 1;
    let (mut count, mut scattered) = (0, 0);
    for group in groups.step_by(apart) {
        let (first, others) = group.split_first().expect("a group has rays");
        let way = first.direction.normalize_or_zero();
        let is_far = |ray: &Ray| {
            let turned = diagonal * (ray.direction.normalize_or_zero() - way).length();
            (ray.origin - first.origin).length() + turned > limit
        };
        count += 1;
        scattered += usize::from(others.iter().any(is_far));
    }
    2 * scattered > count
}

/// Kernels that are chosen among, and what was learnt about them. The second is what is used where memory is short.
#[derive(Clone, Copy, Debug)]
struct Slices<const N: usize> {
    ways: [Kernel; N],
    choice: Choice<N>,
    /// How many rays each has traced.
    traced: [u64; N],
    /// With how many rays lists are tried where there are no pools.
    trial_of_lists: usize,
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
    fn among(ways: [Kernel; N], trial_of_lists: usize) -> Self {
        Self { ways, choice: Choice::default(), traced: [0; N], trial_of_lists }
    }

    /// Has the next lot of rays traced, and says how many they were; `trace` writes their answers.
    fn trace<A>(
        &mut self,
        accel: &Accel,
        rays: &[Ray],
        answers: &mut [A],
        trace: impl Fn(Kernel, &[Ray], &mut [A]),
    ) -> usize {
        let next = self.next(accel, rays.len());
        let (rays, answers) = (&rays[..next.rays], &mut answers[..next.rays]);
        let kernel = self.ways[next.way];
        if next.counts {
            let choice = &mut self.choice;
            recorded(accel, choice, next.way, next.rays, || trace(kernel, rays, answers));
        } else {
            trace(kernel, rays, answers);
        }
        self.traced[next.way] += next.rays as u64;
        next.rays
    }

    /// As [`Accel::intersect_many`] for the next lot; how many rays it was.
    fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) -> usize {
        self.trace(accel, rays, hits, |kernel, rays, hits| accel.intersect_many(kernel, rays, hits))
    }

    /// As [`Accel::occluded_many`], likewise.
    fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) -> usize {
        self.trace(accel, rays, occluded, |kernel, rays, found| accel.occluded_many(kernel, rays, found))
    }

    fn next(&mut self, accel: &Accel, rays: usize) -> Next {
        if accel.cached().is_some_and(|cached| cached.is_short()) {
            return Next { way: FRUGAL, rays: rays.min(LOT), counts: false };
        }
        leave_out_halves(accel, &self.ways, &mut self.choice);
        let quickest = self.choice.quickest();
        if rays < LEAST_RAYS {
            return Next { way: quickest, rays, counts: false };
        }
        let way = self.choice.next();
        let most = match self.ways[way] {
            _ if way == quickest => LOT,
            // Through pools, lists of rays that lie together are often the quickest, and the quicker the more rays there are.
            Kernel::Filter if accel.pools().is_some() => LOT,
            Kernel::Filter => self.trial_of_lists,
            _ => TRIAL,
        };
        Next { way, rays: rays.min(most), counts: true }
    }

    /// Kernels, and how many rays each has traced.
    fn traced(self) -> impl Iterator<Item = (Kernel, u64)> {
        self.ways.into_iter().zip(self.traced)
    }
}

/// Has rays traced lot by lot: `lot` does the next ones and says how many they were.
fn each_lot<A>(mut rays: &[Ray], mut answers: &mut [A], mut lot: impl FnMut(&[Ray], &mut [A]) -> usize) {
    assert_eq!(rays.len(), answers.len(), "as many answers as rays");
    while !rays.is_empty() {
        let done = lot(rays, answers);
        (rays, answers) = (&rays[done..], &mut std::mem::take(&mut answers)[done..]);
    }
}

/// What one worker has learnt about which kernel is quickest for rays in slices: for closest hits, and for any
/// hit. One for each thread and, where several kinds of rays are told apart, for each kind.
#[derive(Clone, Copy, Debug)]
pub struct SliceDispatch {
    closest: Slices<5>,
    any: Slices<4>,
    scattered: ScatteredDispatch,
}

impl Default for SliceDispatch {
    fn default() -> Self {
        use Kernel::{Filter, Packet8, Packet16, Tile, WideTile};
        // Without pools, lists of rays that lie together are several times slower than beams, or quicker than packets already
        // where few are tried.
        Self {
            closest: Slices::among([Tile, Packet16, Packet8, Filter, WideTile], TRIAL),
            any: Slices::among([Tile, Packet16, Packet8, Filter], TRIAL),
            scattered: ScatteredDispatch::default(),
        }
    }
}

impl SliceDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        let Self { closest, scattered, .. } = self;
        let bounds = accel.bounds();
        each_lot(rays, hits, |rays, hits| {
            if are_scattered(rays, &bounds) {
                scattered.closest.intersect(accel, rays, hits)
            } else {
                closest.intersect(accel, rays, hits)
            }
        });
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        let Self { any, scattered, .. } = self;
        let bounds = accel.bounds();
        each_lot(rays, occluded, |rays, occluded| {
            if are_scattered(rays, &bounds) {
                scattered.any.occluded(accel, rays, occluded)
            } else {
                any.occluded(accel, rays, occluded)
            }
        });
    }

    /// Kernels, and how many rays each has traced. One may be there more than once.
    pub fn traced(&self) -> impl Iterator<Item = (Kernel, u64)> + use<> {
        let Self { closest, any, scattered } = *self;
        closest.traced().chain(any.traced()).chain(scattered.closest.traced()).chain(scattered.any.traced())
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
        // Lists are the better, the more rays there are.
        Self {
            closest: Slices::among([Filter, Stream], LOT),
            any: Slices::among([Filter, Stream, Packet16], LOT),
        }
    }
}

impl ScatteredDispatch {
    /// As [`Accel::intersect_many`], by the kernel that is quickest.
    pub fn intersect(&mut self, accel: &Accel, rays: &[Ray], hits: &mut [Hit]) {
        each_lot(rays, hits, |rays, hits| self.closest.intersect(accel, rays, hits));
    }

    /// As [`Accel::occluded_many`], by the kernel that is quickest.
    pub fn occluded(&mut self, accel: &Accel, rays: &[Ray], occluded: &mut [bool]) {
        each_lot(rays, occluded, |rays, occluded| self.any.occluded(accel, rays, occluded));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use crate::simd::Isa;
    use glam::Vec3;
    use std::time::Duration;

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

    /// Rays of a camera, row by row.
    fn picture(width: usize, height: usize) -> Vec<Ray> {
        let pixel = |i: usize| {
            let x = (i % width) as f32 / width as f32 - 0.5;
            let y = (i / width) as f32 / height as f32 - 0.5;
            Ray::new(Vec3::new(0.5, 0.5, 3.0), Vec3::new(x, y, -2.0))
        };
        (0..width * height).map(pixel).collect()
    }

    fn shuffled(mut rays: Vec<Ray>) -> Vec<Ray> {
        let mut state = 1_u32;
        for i in (1..rays.len()).rev() {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            rays.swap(i, (state >> 8) as usize % (i + 1));
        }
        rays
    }

    #[test]
    fn lists_are_tried_with_as_many_rays_as_they_hold_where_there_are_pools() {
        for (pools, most) in [(false, TRIAL), (true, LOT)] {
            let accel = soup();
            if pools {
                accel.make_pools().expect("all is in memory");
            }
            let mut slices = SliceDispatch::default().any;
            let tried = (0..8).find_map(|_| {
                let Next { way, rays, .. } = slices.next(&accel, 3 * LOT);
                slices.choice.record(way, rays, Duration::from_micros(10));
                (slices.ways[way] == Kernel::Filter).then_some(rays)
            });
            assert_eq!(tried, Some(most), "pools: {pools}");
        }
    }

    #[test]
    fn rays_are_scattered_if_neighbours_run_far_from_one_another() {
        let bounds = soup().bounds();
        let are_scattered = |rays: &[Ray]| are_scattered(rays, &bounds);
        assert!(are_scattered(&rays(0, LOT)));
        assert!(!are_scattered(&picture(64, 64)));
        assert!(are_scattered(&shuffled(picture(64, 64))));
        // Wherever in a row a lot begins.
        let wide = picture(256, 32);
        assert!((0..256).all(|first| !are_scattered(&wide[first..])));
        // Parallel rays, in order and not.
        let mut parallel = picture(64, 64);
        for ray in &mut parallel {
            ray.origin += 2.0 * ray.direction;
            ray.direction = Vec3::NEG_Z;
        }
        assert!(!are_scattered(&parallel));
        assert!(are_scattered(&shuffled(parallel)));
        // Few rays, and rays that are none.
        assert!(!are_scattered(&[]));
        assert!(!are_scattered(&rays(0, NEIGHBOURS - 1)));
        assert!(!are_scattered(&[Ray::new(Vec3::NAN, Vec3::ZERO); LOT]));
    }

    #[test]
    fn every_ray_is_answered_as_by_itself_and_counted() {
        let mut rays = rays(0, 60 * TRIAL + 5);
        rays.extend(picture(256, 241));
        for isa in Isa::available() {
            let accel = soup().with_isa(isa);
            let mut dispatch = SliceDispatch::default();
            let (mut hits, mut occluded) = (vec![Hit::MISS; rays.len()], vec![false; rays.len()]);
            dispatch.intersect(&accel, &rays, &mut hits);
            dispatch.occluded(&accel, &rays, &mut occluded);
            check(&accel, &rays, &hits, &occluded);
            let traced: Vec<(Kernel, u64)> = dispatch.traced().collect();
            assert_eq!(traced.iter().map(|(_, rays)| rays).sum::<u64>(), 2 * rays.len() as u64);
            let is_out = |kernel| isa == Isa::Avx512 && kernel == Kernel::Packet8;
            assert!(traced.iter().all(|&(kernel, rays)| (rays > 0) != is_out(kernel)), "{isa}: {traced:?}");
        }
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
        let traced: Vec<(Kernel, u64)> = dispatch.closest.traced().chain(dispatch.any.traced()).collect();
        assert!(traced.iter().all(|&(_, rays)| rays > 0), "all ways are tried: {traced:?}");
    }
}
