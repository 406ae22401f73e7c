//! The triangle test alone: one triangle against a packet, for every width and instruction set.

mod scenes;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use glam::Vec3;
use raypack::geometry::Ray;
use raypack::geometry::triangle::fast::Projected;
use raypack::geometry::triangle::{Corners, Exact, Fast, Mode, Test, Triangle, Watertight};
use raypack::mesh::generate::shapes;
use raypack::simd::{Chosen, Isa, Lanes, Mask, Simd, Task};
use raypack::traverse::{PacketWidth, RayPacket};
use std::hint::black_box;

/// Tests every triangle against one packet and counts the lanes inside.
struct Count<'a, const W: usize, M: Mode> {
    packet: &'a RayPacket<W>,
    triangles: &'a [M::Record],
}

impl<const W: usize, M: Mode> Task for Count<'_, W, M>
where
    RayPacket<W>: PacketWidth<W>,
{
    type Output = u32;

    #[inline(always)]
    fn run<S: Simd>(self) -> u32 {
        count::<W, <RayPacket<W> as PacketWidth<W>>::Lanes<S>, M>(self.packet, self.triangles)
    }
}

#[inline(always)]
fn count<const W: usize, L: Lanes<W>, M: Mode>(packet: &RayPacket<W>, triangles: &[M::Record]) -> u32 {
    let lanes = |rows: &[[f32; W]; 3]| [L::load(&rows[0]), L::load(&rows[1]), L::load(&rows[2])];
    let test = M::Test::<W, L>::new(&lanes(&packet.origin), &lanes(&packet.direction), u32::MAX);
    let mut inside = 0;
    let all = L::mask_from_bits(u32::MAX);
    for triangle in triangles {
        inside += test.test(triangle, all).inside.bits().count_ones();
    }
    inside
}

fn width<const W: usize, M: Mode>(c: &mut Criterion, isa: Chosen, triangles: &[M::Record])
where
    RayPacket<W>: PacketWidth<W>,
{
    let ray = |i: usize| Ray::new(Vec3::new(0.5, 0.5, 3.0), Vec3::new(i as f32 * 0.01, 0.02, -1.0));
    let packet = RayPacket::<W>::of_slice(&(0..W).map(ray).collect::<Vec<_>>());
    let mut group = c.benchmark_group(format!("intersect/{}", M::ACCURACY));
    group.throughput(Throughput::Elements((triangles.len() * W) as u64));
    group.bench_function(format!("{W} rays, {:?}", isa.isa()), |b| {
        b.iter(|| isa.run(Count::<W, M> { packet: black_box(&packet), triangles: black_box(triangles) }));
    });
}

fn intersect(c: &mut Criterion) {
    let mesh = shapes::soup(4096, 1);
    let corners = |i| mesh.corners(i).map(|p| p.to_array());
    let corners: Vec<Corners> = (0..mesh.triangles.len() as u32).map(corners).collect();
    let projected: Vec<Projected> = corners.iter().map(Projected::new).collect();
    let triangles: Vec<Triangle> = corners.into_iter().map(Triangle::new).collect();
    for isa in Isa::ALL.into_iter().filter_map(Chosen::new) {
        widths::<Fast>(c, isa, &projected);
        widths::<Watertight>(c, isa, &triangles);
        widths::<Exact>(c, isa, &triangles);
    }
}

fn widths<M: Mode>(c: &mut Criterion, isa: Chosen, triangles: &[M::Record]) {
    width::<1, M>(c, isa, triangles);
    width::<4, M>(c, isa, triangles);
    width::<8, M>(c, isa, triangles);
    width::<16, M>(c, isa, triangles);
}

criterion_group! { name = benches; config = scenes::quick(); targets = intersect }
criterion_main!(benches);
