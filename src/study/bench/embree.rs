//! Embree as an engine: packet widths 1, 4, 8 and 16, each with and without the coherent flag, on a
//! medium, a high-quality and a robust high-quality build.
//!
//! Each width has its rays in Embree's own packets, made before the clock starts. A run copies a packet to
//! a buffer on the stack (Embree overwrites `tfar`), queries, and writes out `t u v`, primitive and normal.
//!
//! Threads that trace have denormals flushed to zero, as Embree's documentation recommends. Where a width is
//! wider than the instruction set (16 on AVX2), Embree takes such packets apart, so that the mode is another
//! way to trace single rays.

use super::engine::{Contender, Engine, Lot, Results, collect};
use crate::error::Result;
use crate::geometry::Ray;
use crate::mesh::Mesh;
use crate::simd::Isa;
use crate::study::peers::embree::{Build, Coherence, Device, PacketHits, Prepared, Scene};
use std::sync::Arc;

/// Embree with its scenes built.
#[derive(Debug)]
pub struct Embree {
    device: Arc<Device>,
    scenes: Vec<Scene>,
}

impl Embree {
    /// A device with one scene, already built.
    pub fn of_scene(device: Arc<Device>, scene: Scene) -> Self {
        Self { device, scenes: vec![scene] }
    }

    /// Loads the library and builds with all threads, a scene for each of `builds`. `isa` holds it to an
    /// instruction set.
    ///
    /// # Errors
    /// Embree is not here, or fails.
    pub fn new(mesh: &Mesh, isa: Option<Isa>, builds: &[Build]) -> Result<Self> {
        let device = Device::new(0, isa)?;
        let scenes = builds.iter().map(|&build| Scene::new(&device, mesh, build)).collect::<Result<_>>()?;
        Ok(Self { device, scenes })
    }

    fn of_width<'a, const N: usize>(
        &'a self,
        rays: &[Ray],
        any_hit: bool,
    ) -> impl Iterator<Item = Box<dyn Contender + 'a>> + use<'a, N> {
        let lots = Arc::new(Lot::cut(rays, any_hit, PacketHits::MISS, |n| n.div_ceil(N), Prepared::<N>::new));
        self.scenes.iter().flat_map(move |scene| {
            let lots = Arc::clone(&lots);
            Coherence::ALL.into_iter().map(move |coherence| {
                Box::new(Run::<N> { scene, coherence, lots: Arc::clone(&lots) }) as Box<dyn Contender>
            })
        })
    }
}

impl Engine for Embree {
    fn name(&self) -> &'static str {
        "embree"
    }

    fn version(&self) -> String {
        self.device.version().to_string()
    }

    fn isa(&self) -> String {
        self.device.isa().into()
    }

    fn contenders<'a>(&'a self, rays: &[Ray], any_hit: bool) -> Vec<Box<dyn Contender + 'a>> {
        let narrow = self.of_width::<1>(rays, any_hit).chain(self.of_width::<4>(rays, any_hit));
        let wide = self.of_width::<8>(rays, any_hit).chain(self.of_width::<16>(rays, any_hit));
        narrow.chain(wide).collect()
    }
}

struct Run<'a, const N: usize> {
    scene: &'a Scene,
    coherence: Coherence,
    lots: Arc<Vec<Lot<Prepared<N>, PacketHits<N>, u16>>>,
}

impl<const N: usize> Contender for Run<'_, N> {
    fn mode(&self) -> String {
        format!("{N}-wide {} {}", self.coherence.name(), self.scene.build().name())
    }

    fn build_seconds(&self) -> f64 {
        self.scene.build_seconds()
    }

    fn bytes(&self) -> u64 {
        self.scene.bytes()
    }

    fn fetch(&self, chunk: usize) {
        self.lots[chunk].fetch(Prepared::as_slice);
    }

    fn trace(&self, chunk: usize) {
        self.lots[chunk].trace(
            |rays, hits| self.scene.closest(rays, self.coherence, hits),
            |rays, flags| self.scene.any(rays, self.coherence, flags),
        );
    }

    fn results(&self) -> Results {
        collect(
            &self.lots,
            |packets, rays, all| all.extend((0..rays.rays()).map(|i| packets[i / N].get(i % N))),
            |packets, rays, all| all.extend((0..rays.rays()).map(|i| packets[i / N] >> (i % N) & 1 == 1)),
        )
    }
}
