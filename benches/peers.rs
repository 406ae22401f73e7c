//! The rivals on the same scenes and rays: Embree in the modes that tend to be its best, obvhs in all.
//!
//! `raypack bench` is the fair comparison, with every mode and interleaved rounds; this is for flame graphs
//! and for seeing a change of version.

mod scenes;

#[cfg(feature = "peers")]
mod rivals {
    use super::scenes;
    use criterion::measurement::WallTime;
    use criterion::{BenchmarkGroup, Criterion, Throughput};
    use raypack::geometry::{Hit, Ray};
    use raypack::kdtree::BuildParams;
    use raypack::study::peers::embree::{Build, Coherence, Device, PacketHits, Prepared, Scene};
    use raypack::study::peers::obvhs;
    use raypack::study::rays::RayKind;
    use raypack::traverse::Accel;
    use std::sync::Arc;

    const SIZE: u32 = 96;

    type Group<'a> = BenchmarkGroup<'a, WallTime>;

    pub fn peers(c: &mut Criterion) {
        let device = Device::new(0, None).map_err(|e| eprintln!("peers: without Embree: {e}")).ok();
        for scene in scenes::all() {
            let accel = Accel::build(&scene.mesh, &BuildParams::default()).expect("the scenes can be built");
            let sets = scene.rays(&accel, SIZE);
            let embree = device.as_ref().map(|device: &Arc<Device>| {
                Scene::new(device, &scene.mesh, Build::High).expect("the scenes can be built")
            });
            let trees = obvhs::ALL.map(|(layout, preset)| {
                let name = format!("obvhs {} {}", layout.name(), preset.name());
                (name, obvhs::Scene::new(&scene.mesh, layout, preset))
            });
            for kind in RayKind::ALL {
                let rays = sets.rays(kind);
                let mut group = c.benchmark_group(format!("peers/{}/{}", scene.name, kind.name()));
                group.throughput(Throughput::Elements(rays.len() as u64));
                if let Some(embree) = &embree {
                    width::<1>(&mut group, embree, &rays, kind.any_hit(), Coherence::Incoherent);
                    width::<8>(&mut group, embree, &rays, kind.any_hit(), Coherence::Coherent);
                    width::<16>(&mut group, embree, &rays, kind.any_hit(), Coherence::Coherent);
                }
                let rays = obvhs::Prepared::new(&rays);
                for (name, tree) in &trees {
                    group.bench_function(name, |b| {
                        if kind.any_hit() {
                            let mut flags = vec![false; rays.len()];
                            b.iter(|| tree.any(&rays, &mut flags));
                        } else {
                            let mut hits = vec![Hit::MISS; rays.len()];
                            b.iter(|| tree.closest(&rays, &mut hits));
                        }
                    });
                }
            }
        }
    }

    fn width<const N: usize>(
        group: &mut Group<'_>,
        scene: &Scene,
        rays: &[Ray],
        any_hit: bool,
        coherence: Coherence,
    ) {
        let rays = Prepared::<N>::new(rays);
        group.bench_function(format!("embree {N}-wide {}", coherence.name()), |b| {
            if any_hit {
                let mut flags = vec![0; rays.packets()];
                b.iter(|| scene.any(&rays, coherence, &mut flags));
            } else {
                let mut hits = vec![PacketHits::MISS; rays.packets()];
                b.iter(|| scene.closest(&rays, coherence, &mut hits));
            }
        });
    }
}

#[cfg(feature = "peers")]
criterion::criterion_group! { name = benches; config = scenes::quick(); targets = rivals::peers }
#[cfg(feature = "peers")]
criterion::criterion_main!(benches);

#[cfg(not(feature = "peers"))]
fn main() {
    eprintln!("peers: built without the feature `peers`");
}
