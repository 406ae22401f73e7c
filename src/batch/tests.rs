//! Small checks; whole runs are in `tests/cast.rs`.

use super::*;
use crate::kdtree::BuildParams;
use crate::mesh::Mesh;
use glam::Vec3;

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
                assert!(kernel.is_none_or(|kernel| kernel == traced.kernel));
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
