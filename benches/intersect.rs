//! The triangle test alone: one triangle against a packet, for every width and instruction set.

mod scenes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use raypack::geometry::Ray;
use raypack::geometry::triangle::Corners;
use raypack::geometry::triangle::watertight::Shear;
use raypack::mesh::generate::shapes;
use raypack::simd::{Chosen, Isa, Lanes, Mask, Simd, Task};
use raypack::traverse::{PacketWidth, RayPacket};
use std::hint::black_box;

/// Tests every triangle against one packet and counts the lanes inside.
struct Count<'a, const W: usize> {
    packet: &'a RayPacket<W>,
    triangles: &'a [Corners],
}

impl<const W: usize> Task for Count<'_, W>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        count::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>>(self.packet, self.triangles)
    }
}

#[inline(always)]
fn count<const W: usize, L: Lanes<W>>(packet: &RayPacket<W>, triangles: &[Corners]) -> u32 {
    let lanes = |rows: &[[f32; W]; 3]| [L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2])];
    let shear = Shear::<W, L>::new(&lanes(&packet.origin), &lanes(&packet.direction), u32::MAX);
    let mut inside = 0;
    for corners in triangles {
        inside += shear.test(corners).inside.bits().count_ones();
    }
    inside
}

fn width<const W: usize>(c: &mut Criterion, isa: Chosen, triangles: &[Corners])
where
    RayPacket<W>: PacketWidth<W>,
{
    let ray = |i: usize| Ray::new(Vec3::new(0.5, 0.5, 3.0), Vec3::new(i as f32 * 0.01, 0.02, -1.0));
    let packet = RayPacket::<W>::of_slice(&(0..W).map(ray).collect::<Vec<_>>());
    let mut group = c.benchmark_group("intersect/watertight");
    group.throughput(Throughput::Elements((triangles.len() * W) as u64));
    group.bench_function(format!("{W} rays, {:?}", isa.isa()), |b| {
        b.iter(|| isa.run(Count { packet: black_box(&packet), triangles: black_box(triangles) }));
    });
}

fn intersect(c: &mut Criterion) {
    let mesh = shapes::soup(4096, 1);
    let corners = |i| mesh.corners(i).map(|p| p.to_array());
    let triangles: Vec<Corners> = (0..mesh.triangles.len() as u32).map(corners).collect();
    for isa in Isa::ALL.into_iter().filter_map(Chosen::new) {
        width::<1>(c, isa, &triangles);
        width::<4>(c, isa, &triangles);
        width::<8>(c, isa, &triangles);
        width::<16>(c, isa, &triangles);
    }
}

criterion_group! { name = benches; config = scenes::quick(); targets = intersect }
criterion_main!(benches);
