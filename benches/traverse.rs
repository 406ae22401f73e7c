//! Every kernel on every kind of ray, in rays a second on one thread.

mod scenes;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use raypack::geometry::Hit;
use raypack::kdtree::BuildParams;
use raypack::study::rays::RayKind;
use raypack::traverse::{Accel, Kernel};

/// Side of the camera's image: small, so that a sample takes milliseconds.
const SIZE: u32 = 96;

fn traverse(c: &mut Criterion) {
    for scene in scenes::all() {
        let accel = Accel::build(&scene.mesh, &BuildParams::default()).expect("the scenes can be built");
        let sets = scene.rays(&accel, SIZE);
        for kind in RayKind::ALL {
            let rays = sets.rays(kind);
            let mut group = c.benchmark_group(format!("traverse/{}/{}", scene.name, kind.name()));
            group.throughput(Throughput::Elements(rays.len() as u64));
            for kernel in Kernel::ALL {
                group.bench_function(BenchmarkId::from_parameter(kernel), |b| {
                    if kind.any_hit() {
                        let mut flags = vec![false; rays.len()];
                        b.iter(|| accel.occluded_many(kernel, &rays, &mut flags));
                    } else {
                        let mut hits = vec![Hit::MISS; rays.len()];
                        b.iter(|| accel.intersect_many(kernel, &rays, &mut hits));
                    }
                });
            }
        }
    }
}

criterion_group! { name = benches; config = scenes::quick(); targets = traverse }
criterion_main!(benches);
