//! How long trees take to build, in triangles a second.

mod scenes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use raypack::kdtree::BuildParams;
use raypack::traverse::Accel;

fn build(c: &mut Criterion) {
    let mut group = c.benchmark_group("build");
    for scene in scenes::all() {
        group.throughput(Throughput::Elements(scene.mesh.triangles.len() as u64));
        group.bench_function(&scene.name, |b| {
            b.iter(|| Accel::build(&scene.mesh, &BuildParams::default()).expect("the scenes can be built"));
        });
    }
}

criterion_group! { name = benches; config = scenes::quick(); targets = build }
criterion_main!(benches);
