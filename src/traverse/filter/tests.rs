//! What lists of rays are to be, and that none is lost.

use super::ground::{Ground, OfBoxes, OfLines};
use super::lists::{Entries, Heads, List};
use super::lot::{LOT, Lot};
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::{BuildParams, Exit, Tree};
use crate::mesh::Mesh;
use crate::mesh::generate::shapes;
use crate::simd::{Chosen, Isa, Simd, TAGS, Task};
use crate::traverse::pool::ways::Ways;
use crate::traverse::source::Source;
use crate::traverse::{Accel, HitPacket, Kernel, RayPacket};
use glam::Vec3;
use std::collections::HashSet;
use std::ops::Range;

/// Numbers between -1 and 1 that look like chance.
struct Numbers(f64);

impl Numbers {
    fn next(&mut self) -> f32 {
        self.0 = (self.0 * 1.3 + 0.618_033_988_749_895).fract();
        (self.0 * 2.0 - 1.0) as f32
    }

    fn vector(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

/// Rays from near one another, that run everywhere or into one octant; some of them end soon.
fn rays(count: usize, everywhere: bool, seed: f64) -> Vec<Ray> {
    let mut numbers = Numbers(seed);
    (0..count)
        .map(|i| {
            let origin = Vec3::splat(0.5) + numbers.vector() * if i % 5 == 0 { 2.0 } else { 0.3 };
            let way = numbers.vector();
            let way = if everywhere { way } else { way.abs() * Vec3::new(1.0, -1.0, 1.0) };
            let end = [f32::INFINITY, 0.3][i % 2];
            Ray::segment(origin, way, [0.0, 0.05][i / 2 % 2], end)
        })
        .collect()
}

/// What waits after lists of some lengths were cut at the first lines of a tree, or nodes of boxes: exit, ray, and the bits of
/// its interval; by eights, by sixteens, and each ray alone.
struct Cuts<'a>(&'a Accel, &'a [Ray], Kind);

#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Lines,
    Boxes,
    /// Boxes of rays that ask for any hit.
    BoxesOfAny,
}

type Waiting = Vec<(i32, i32, [u32; 2])>;

impl Task for Cuts<'_> {
    type Output = Vec<[Waiting; 3]>;

    #[inline(always)]
    fn run<S: Simd>(self) -> Self::Output {
        let tree = self.0.tree();
        if self.2 == Kind::Lines {
            let lines = (0..tree.lines().len()).map(|line| Exit::of_line(line).0).take(40);
            return self.through::<S, _, false>(&OfLines(tree), lines);
        }
        // Not many rays come to those that lie deeper.
        let nodes = (0..4).cycle().take(40);
        let boxes = OfBoxes(Ways::new(tree.pools().expect("they were made")));
        if self.2 == Kind::Boxes {
            self.through::<S, _, false>(&boxes, nodes)
        } else {
            self.through::<S, _, true>(&boxes, nodes)
        }
    }
}

impl Cuts<'_> {
    #[inline(always)]
    fn through<S: Simd, G: Ground, const ANY: bool>(
        &self,
        ground: &G,
        places: impl Iterator<Item = i32> + Clone,
    ) -> Vec<[Waiting; 3]> {
        let Self(accel, rays, kind) = self;
        let mut lot = Box::new(Lot::new());
        let sixteens = 0..rays.len().div_ceil(16);
        lot.prepare::<S::F16, false, ANY>(Source::Slice(rays), sixteens, accel.tree().bounds());
        let (mut entries, mut heads, mut found) = (Entries::new(), Heads::new(), Vec::new());
        for octant in 0..8 {
            let (ids, tmax) = (lot.octant(octant).ids(), lot.octant(octant).tmax());
            for (i, exit) in places.clone().enumerate() {
                let len = [1, 2, 3, 4, 8, 9, 15, 16, 17, 40, 300][i % 11].min(ids.len());
                let begin = |entries: &mut Entries, rays: Range<usize>| {
                    entries.begin(&ids[rays.clone()], Some(&tmax[rays.clone()]), 0);
                    List { exit, at: 0, len: rays.len() as u32 }
                };
                let list = begin(&mut entries, 0..len);
                ground.cut::<8, S::F8, S::F8, ANY>(octant, &lot, &mut entries, &mut heads, &list);
                let by_eights = all(&entries, &mut heads);
                let list = begin(&mut entries, 0..len);
                ground.cut::<16, S::F16, S::F8, ANY>(octant, &lot, &mut entries, &mut heads, &list);
                let by_sixteens = all(&entries, &mut heads);
                if len <= G::SEVERAL as usize {
                    let list = begin(&mut entries, 0..len);
                    ground.cut_few::<S::F16, ANY>(octant, &lot, &mut entries, &mut heads, &list);
                    assert_eq!(all(&entries, &mut heads), by_eights, "{len} rays");
                }
                let mut alone = Vec::new();
                for ray in 0..len {
                    let list = begin(&mut entries, ray..ray + 1);
                    ground.take_one::<S::F8, ANY>(&lot, &mut entries, &mut heads, &list);
                    alone.extend(all(&entries, &mut heads));
                }
                found.push([by_eights, by_sixteens, alone].map(|mut all| {
                    for (.., [tmin, tmax]) in &mut all {
                        // What is not kept.
                        *tmin = if *kind == Kind::BoxesOfAny { 0 } else { *tmin };
                        *tmax = if *kind == Kind::Lines { *tmax } else { 0 };
                    }
                    all.sort_unstable();
                    all
                }));
            }
        }
        found
    }
}

/// Takes all lists off the stack, entry by entry.
fn all(entries: &Entries, heads: &mut Heads) -> Waiting {
    let mut all = Vec::new();
    while let Some(list) = heads.pop() {
        for i in 0..list.len {
            let (word, tmin, tmax) = entries.one((list.at + i) as usize);
            all.push((list.exit, word & TAGS, [tmin.to_bits(), tmax.to_bits()]));
        }
    }
    all
}

#[test]
fn a_list_is_cut_as_each_of_its_rays_is() {
    let accel = Accel::build(&shapes::soup(3000, 1), &BuildParams::default()).expect("a soup has a tree");
    let rays = rays(2000, true, 0.3);
    for isa in Isa::available() {
        let found = Chosen::new(isa).expect("it is available").run(Cuts(&accel, &rays, Kind::Lines));
        assert!(
            found.iter().map(|[alone, ..]| alone.len()).sum::<usize>() > 10_000,
            "there is something to cut"
        );
        for (i, [by_eights, by_sixteens, alone]) in found.into_iter().enumerate() {
            assert_eq!(by_eights, alone, "{isa}, by eights, cut {i}");
            assert_eq!(by_sixteens, alone, "{isa}, by sixteens, cut {i}");
        }
    }
}

/// A soup's tree, with pools and without.
fn trees(triangles: usize, seed: u64) -> [Accel; 2] {
    [false, true].map(|has_pools| {
        let accel = Accel::build(&shapes::soup(triangles, seed), &BuildParams::default());
        let accel = accel.expect("a soup has a tree");
        if has_pools {
            accel.make_pools().expect("all is in memory");
        }
        accel
    })
}

#[test]
fn a_list_meets_boxes_as_each_of_its_rays_does() {
    let [_, accel] = trees(3000, 1);
    let rays = rays(2000, true, 0.3);
    let kinds = [Kind::Boxes, Kind::BoxesOfAny];
    for (isa, kind) in Isa::available().into_iter().flat_map(|isa| kinds.map(|kind| (isa, kind))) {
        let found = Chosen::new(isa).expect("it is available").run(Cuts(&accel, &rays, kind));
        let (mut all, mut other) = (0, 0);
        for (i, [by_eights, by_sixteens, alone]) in found.into_iter().enumerate() {
            assert_eq!(by_eights, by_sixteens, "{isa}, node {i}");
            // By itself, a ray's numbers are rounded otherwise.
            let places = |waiting: &Waiting| -> HashSet<(i32, i32)> {
                waiting.iter().map(|&(way, id, _)| (way, id)).collect()
            };
            let (together, alone) = (places(&by_eights), places(&alone));
            all += together.len();
            other += together.symmetric_difference(&alone).count();
        }
        assert!(all > 2000, "{isa}: {all} entries");
        assert!(other * 500 < all, "{isa}: {other} of {all} differ");
    }
}

#[test]
fn nothing_is_left_of_an_earlier_lot() {
    for (large, small) in trees(3000, 3).into_iter().zip(trees(1, 3)) {
        nothing_is_left_of(&large, &small);
    }
}

fn nothing_is_left_of(large: &Accel, small: &Accel) {
    let rays = rays(LOT, true, 0.7);
    let mut hits = vec![Hit::MISS; LOT];
    large.intersect_many(Kernel::Filter, &rays, &mut hits);
    assert!(hits.iter().any(|hit| hit.is_hit() && hit.primitive > 0));
    for count in 1..20 {
        let (mut alone, mut hits) = (vec![Hit::MISS; count], vec![Hit::MISS; count]);
        small.intersect_many(Kernel::Single, &rays[..count], &mut alone);
        small.intersect_many(Kernel::Filter, &rays[..count], &mut hits);
        assert_eq!(hits, alone);
    }
}

#[test]
fn every_ray_of_every_lot_is_answered_as_alone() {
    let trees = trees(3000, 2);
    let mut odd = rays(61, true, 0.9);
    for (i, ray) in odd.iter_mut().enumerate() {
        match i % 6 {
            0 => ray.direction *= 1e-37,
            1 => ray.direction *= 1e36,
            2 => ray.origin.y = f32::NAN,
            3 => ray.tnear = ray.tfar + 1.0,
            4 => ray.direction = Vec3::ZERO,
            _ => ray.tnear = -3.0,
        }
    }
    let sets = [
        rays(2 * LOT + 37, true, 0.1),
        // As many as a lot holds run into one octant.
        rays(LOT, false, 0.2),
        rays(3, true, 0.4),
        Vec::new(),
        odd,
    ];
    for (rays, tree) in sets.iter().flat_map(|rays| trees.iter().map(move |tree| (rays, tree))) {
        for isa in Isa::available() {
            for accuracy in Accuracy::ALL {
                let accel = tree.clone().with_isa(isa).with_accuracy(accuracy);
                let (mut alone, mut hits) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
                accel.intersect_many(Kernel::Single, rays, &mut alone);
                accel.intersect_many(Kernel::Filter, rays, &mut hits);
                assert!(hits == alone, "{} rays on {isa}, {accuracy}", rays.len());
                let mut occluded = vec![false; rays.len()];
                accel.occluded_many(Kernel::Filter, rays, &mut occluded);
                assert!(occluded.iter().zip(&alone).all(|(&occluded, hit)| occluded == hit.is_hit()));
            }
        }
    }
    let mut hits = vec![Hit::MISS; LOT];
    trees[0].intersect_many(Kernel::Filter, &sets[1], &mut hits);
    assert!(hits.iter().filter(|hit| hit.is_hit()).count() > 100, "there is something to hit");
}

#[test]
fn rays_that_may_hit_more_than_can_wait_are_answered_as_alone() {
    // Triangles in one place: a ray that hits one for certain, or passes through an edge or a corner, may hit all of them.
    let corners = [Vec3::ZERO, Vec3::X, Vec3::Y];
    let mesh = Mesh { positions: corners.to_vec(), triangles: vec![[0, 1, 2]; 60], ..Mesh::default() };
    let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
    accel.make_pools().expect("all is in memory");
    let rays: Vec<Ray> = (0..LOT)
        .map(|i| {
            let (x, y) = ((i % 64) as f32 / 63.0, (i / 64) as f32 / 128.0);
            Ray::new(Vec3::new(x, if i % 2 == 0 { 0.0 } else { y }, 1.0), Vec3::NEG_Z)
        })
        .collect();
    for isa in Isa::available() {
        for accuracy in [Accuracy::Watertight, Accuracy::Exact] {
            let accel = accel.clone().with_isa(isa).with_accuracy(accuracy);
            let (mut alone, mut hits) = (vec![Hit::MISS; LOT], vec![Hit::MISS; LOT]);
            accel.intersect_many(Kernel::Single, &rays, &mut alone);
            accel.intersect_many(Kernel::Filter, &rays, &mut hits);
            assert!(hits == alone, "{isa}, {accuracy}");
            let mut occluded = vec![false; LOT];
            accel.occluded_many(Kernel::Filter, &rays, &mut occluded);
            assert!(occluded.iter().zip(&alone).all(|(&occluded, hit)| occluded == hit.is_hit()));
            let found = hits.iter().filter(|hit| hit.is_hit()).count();
            assert!((3000..LOT).contains(&found), "{found} hits");
        }
    }
}

#[test]
fn lanes_of_packets_are_answered_as_alone_and_no_others() {
    let trees = trees(3000, 2);
    let mut rays = rays(LOT + 16 * 7, true, 0.6);
    for ray in rays.iter_mut().step_by(29) {
        ray.direction *= 1e36;
    }
    let mut packets: Vec<RayPacket<16>> = rays.chunks(16).map(RayPacket::of_slice).collect();
    let active: Vec<u32> =
        (0..packets.len() as u32).map(|i| (i.wrapping_mul(0x9e37_79b9) >> 16) & 0xffff).collect();
    let is_active = |i: usize| active[i / 16] >> (i % 16) & 1 == 1;
    // What is in the other lanes is of no account.
    for i in (0..rays.len()).filter(|&i| !is_active(i)) {
        let nothing = [Vec3::NAN, Vec3::splat(1e30), Vec3::ZERO][i % 3];
        packets[i / 16].set(i % 16, &Ray::new(nothing, Vec3::ONE));
    }
    for (isa, tree) in Isa::available().iter().flat_map(|&isa| trees.iter().map(move |tree| (isa, tree))) {
        for accuracy in Accuracy::ALL {
            let accel = tree.clone().with_isa(isa).with_accuracy(accuracy);
            let mut occluded = vec![!0; packets.len()];
            accel.occluded_lists(&packets, &active, &mut occluded);
            for (i, ray) in rays.iter().enumerate() {
                let found = occluded[i / 16] >> (i % 16) & 1 == 1;
                assert_eq!(found, is_active(i) && accel.occluded(ray), "ray {i} on {isa}, {accuracy}");
            }
            assert!(occluded.iter().all(|lanes| lanes >> 16 == 0));
            let found: u32 = occluded.iter().map(|lanes| lanes.count_ones()).sum();
            assert!((100..2000).contains(&found), "{found} of {} rays", rays.len());

            let of_another = HitPacket::of_hit(&Hit { t: 0.0, primitive: 7, ..Hit::MISS });
            let mut hits = vec![HitPacket::miss(); packets.len()];
            hits.iter_mut().for_each(|hits| hits.set_part(3, &of_another, 1));
            accel.intersect_lists(&packets, &active, &mut hits);
            for (i, ray) in rays.iter().enumerate() {
                let expected = if is_active(i) { accel.intersect(ray) } else { Hit::MISS };
                assert_eq!(hits[i / 16].get(i % 16), expected, "ray {i} on {isa}, {accuracy}");
            }
        }
    }
}
