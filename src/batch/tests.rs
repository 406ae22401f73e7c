//! Small checks; whole runs are in `tests/cast.rs`.

use super::*;
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use glam::Vec3;
use std::ops::Range;

/// A fence of triangles along x, each with a gap after it.
fn fence() -> Accel {
    let positions = (0..64u8)
        .flat_map(|i| [[0.0, 0.0], [0.5, 0.0], [0.0, 1.0]].map(|[x, y]| Vec3::new(f32::from(i) + x, y, 0.0)))
        .collect();
    let triangles = (0..64).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let mesh = Mesh { positions, triangles, ..Mesh::default() };
    Accel::build(&mesh, &BuildParams::default()).expect("builds")
}

/// Rays through posts and gaps in turn; some are none.
fn rays(count: usize) -> Vec<Ray> {
    (0..count)
        .map(|i| match i % 7 {
            6 => Ray::new(Vec3::NAN, -Vec3::Z),
            _ => Ray::new(Vec3::new((i % 129) as f32 * 0.5 + 0.125, 0.25, 1.0), -Vec3::Z),
        })
        .collect()
}

#[test]
fn a_batch_gives_what_each_ray_gives_by_itself() {
    let accel = fence();
    for count in [0, 1, 15, CHUNK, CHUNK + 1, 3 * CHUNK + 77] {
        let rays = rays(count);
        let alone: Vec<Hit> = rays.iter().map(|ray| accel.intersect(ray)).collect();
        for kernel in [None].into_iter().chain(Kernel::ALL.map(Some)) {
            for threads in [0, 1, 3] {
                let batch = Batch::new(&accel, &rays).with_kernel(kernel).with_threads(threads);
                let mut hits = vec![Hit::MISS; count];
                let traced = batch.intersect(&mut hits);
                assert!(hits == alone, "{count} rays, {kernel:?}, {threads} threads");
                assert!(kernel.is_none_or(|kernel| count == 0 || traced.kernels == [(kernel, count as u64)]));
                assert_eq!(traced.kernels.iter().map(|(_, rays)| rays).sum::<u64>(), count as u64);
                let mut occluded = vec![false; count];
                batch.occluded(&mut occluded);
                assert!(occluded.iter().zip(&alone).all(|(&any, hit)| any == hit.is_hit()));
                assert_eq!(batch.fraction(), if count == 0 { 0.0 } else { 1.0 });
            }
        }
    }
}

#[test]
#[should_panic(expected = "as many answers as rays")]
fn the_lengths_must_agree() {
    Batch::new(&fence(), &rays(3)).occluded(&mut [false; 2]);
}

#[test]
fn generated_rays_give_what_a_slice_of_them_gives() {
    let accel = fence();
    for count in [0, 1, CHUNK, 2 * CHUNK + 77] {
        let all = rays(count);
        let alone: Vec<Hit> = all.iter().map(|ray| accel.intersect(ray)).collect();
        let make = |numbers: Range<u64>, chunk: &mut Vec<Ray>| {
            chunk.extend_from_slice(&all[numbers.start as usize..numbers.end as usize]);
        };
        for kernel in [None, Some(Kernel::Packet8), Some(Kernel::Stream)] {
            let generated = Generated::new(&accel, count as u64).with_kernel(kernel).with_threads(3);
            let taken = AtomicUsize::new(0);
            generated.intersect(make, |numbers, chunk, hits| {
                let place = numbers.start as usize..numbers.end as usize;
                assert_eq!((hits, chunk.len()), (&alone[place], hits.len()));
                taken.fetch_add(hits.len(), Ordering::Relaxed);
            });
            let traced = generated.occluded(make, |numbers, _, occluded| {
                let place = numbers.start as usize..numbers.end as usize;
                assert!(occluded.iter().zip(&alone[place]).all(|(&any, hit)| any == hit.is_hit()));
                taken.fetch_add(occluded.len(), Ordering::Relaxed);
            });
            assert_eq!(taken.into_inner(), 2 * count, "each answer is taken once");
            assert_eq!(traced.kernels.iter().map(|(_, rays)| rays).sum::<u64>(), count as u64);
        }
    }
}

#[test]
#[should_panic(expected = "a ray for each number")]
fn as_many_rays_are_to_be_made_as_were_asked_for() {
    let accel = fence();
    Generated::new(&accel, 5).with_threads(1).intersect(|_, _| (), |_, _, _| ());
}

#[test]
fn who_takes_answers_may_trace_more() {
    let accel = fence();
    let all = rays(5);
    let make = |_, chunk: &mut Vec<Ray>| chunk.extend_from_slice(&all);
    let hits = AtomicUsize::new(0);
    Generated::new(&accel, 5).with_threads(1).intersect(make, |_, _, outer| {
        Generated::new(&accel, 5).with_threads(1).intersect(make, |_, _, inner| {
            assert_eq!(inner, outer);
            hits.fetch_add(inner.iter().filter(|hit| hit.is_hit()).count(), Ordering::Relaxed);
        });
    });
    assert!(hits.into_inner() > 0);
}
