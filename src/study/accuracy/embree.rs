//! Embree's answers, in the two accuracies that it has.

use super::census::CHUNK;
use crate::error::Result;
use crate::geometry::{Hit, Ray};
use crate::mesh::Mesh;
use crate::study::bench::Results;
use crate::study::peers::embree::{Build, Coherence, Device, PacketHits, Prepared, Scene};
use crate::study::rays::RayKind;
use rayon::prelude::*;

/// Rays that Embree is asked at a time.
const WIDTH: usize = 8;

/// Embree in one of its modes.
pub struct Rival {
    mode: &'static str,
    scene: Scene,
}

/// Embree in all of its modes: `fast` without and `robust` with the flag of that name.
///
/// # Errors
/// Embree is not here, or fails.
pub fn rivals(mesh: &Mesh) -> Result<Vec<Rival>> {
    let device = Device::new(0, None)?;
    let modes = [("fast", Build::High), ("robust", Build::RobustHigh)];
    modes
        .into_iter()
        .map(|(mode, build)| Ok(Rival { mode, scene: Scene::new(&device, mesh, build)? }))
        .collect()
}

impl Rival {
    /// The mode's name.
    pub fn mode(&self) -> &'static str {
        self.mode
    }

    /// Answers to rays of a kind, by all threads.
    pub fn answers(&self, kind: RayKind, rays: &[Ray]) -> Results {
        if kind.any_hit() {
            Results::Any(rays.par_chunks(CHUNK).flat_map_iter(|rays| self.any(rays)).collect())
        } else {
            Results::Closest(rays.par_chunks(CHUNK).flat_map_iter(|rays| self.closest(rays)).collect())
        }
    }

    fn closest(&self, rays: &[Ray]) -> Vec<Hit> {
        let prepared = Prepared::<WIDTH>::new(rays);
        let mut packets = vec![PacketHits::MISS; prepared.packets()];
        self.scene.closest(&prepared, Coherence::Incoherent, &mut packets);
        (0..rays.len()).map(|i| packets[i / WIDTH].get(i % WIDTH)).collect()
    }

    fn any(&self, rays: &[Ray]) -> Vec<bool> {
        let prepared = Prepared::<WIDTH>::new(rays);
        let mut packets = vec![0; prepared.packets()];
        self.scene.any(&prepared, Coherence::Incoherent, &mut packets);
        (0..rays.len()).map(|i| packets[i / WIDTH] >> (i % WIDTH) & 1 == 1).collect()
    }
}
