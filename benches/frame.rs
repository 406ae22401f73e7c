//! Whole pictures, with all threads: tree in, pixels out.

mod scenes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use raypack::kdtree::BuildParams;
use raypack::render::{RenderSettings, Renderer, Size};
use raypack::scene::Lighting;
use raypack::traverse::Accel;

/// Side of the picture.
const SIZE: u32 = 128;

fn frame(c: &mut Criterion) {
    let size = Size::new(SIZE, SIZE).expect("a size that can be rendered");
    let mut group = c.benchmark_group("frame");
    group.throughput(Throughput::Elements(u64::from(SIZE * SIZE)));
    for scene in scenes::all() {
        let accel = Accel::build(&scene.mesh, &BuildParams::default()).expect("the scenes can be built");
        let lighting = Lighting::for_view(&scene.camera, &accel);
        let renderer =
            Renderer::new(&accel, &scene.mesh, RenderSettings::new(size)).expect("default settings");
        group.bench_function(&scene.name, |b| b.iter(|| renderer.frame(&scene.camera, &lighting)));
    }
}

criterion_group! { name = benches; config = scenes::quick(); targets = frame }
criterion_main!(benches);
