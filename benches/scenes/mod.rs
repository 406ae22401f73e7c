//! Scenes that the benches and tests/embree.rs share: small generated ones, and with `RAYPACK_MODELS=DIR`
//! real models by their standard views.

#![allow(dead_code)] // Each bench uses a part of it.

use raypack::geometry::{Hit, Ray};
use raypack::mesh::Mesh;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::mesh::generate::shapes;
use raypack::scene::Camera;
use raypack::study::rays::{RaySets, Setup};
use raypack::study::views;
use raypack::traverse::{Accel, Kernel};
use std::path::Path;

/// A mesh and where it is looked at from.
pub struct Scene {
    pub name: String,
    pub mesh: Mesh,
    pub camera: Camera,
}

impl Scene {
    /// The scene's rays; `accel` traces the camera's.
    pub fn rays(&self, accel: &Accel, size: u32) -> RaySets {
        RaySets::new(Setup::new(self.camera, size, self.mesh.bounds(), 1), &self.mesh, |rays: &[Ray]| {
            let mut hits = vec![Hit::MISS; rays.len()];
            accel.intersect_many(Kernel::Packet8, rays, &mut hits);
            hits
        })
    }
}

/// What every bench runs on.
pub fn all() -> Vec<Scene> {
    let mut scenes = generated();
    if let Some(folder) = std::env::var_os("RAYPACK_MODELS") {
        scenes.extend(models(Path::new(&folder)));
    }
    scenes
}

/// Four kinds of geometry that trouble a tree in different ways, each seen as a whole.
pub fn generated() -> Vec<Scene> {
    let framed = |name: &str, mesh: Mesh| {
        let camera = Camera::framing(&mesh.bounds(), 1.0);
        Scene { name: name.into(), mesh, camera }
    };
    vec![
        framed("plant", plant::generate(PlantParams { triangles: 50_000, seed: 1 })),
        framed("sphere", shapes::sphere(6)),
        framed("voxels", shapes::boxes(20_000, 3)),
        framed("soup", shapes::soup(12_000, 7)),
    ]
}

/// Those of the standard views whose models lie in `folder`, each in a folder of its own.
fn models(folder: &Path) -> Vec<Scene> {
    let there = views::STANDARD.iter().filter(|view| view.is_in(folder));
    there
        .map(|view| {
            let mesh = view.read(folder).unwrap_or_else(|e| panic!("{e}"));
            Scene { name: view.name.into(), mesh, camera: view.camera() }
        })
        .collect()
}

/// Criterion's settings for a suite that runs in minutes.
pub fn quick() -> criterion::Criterion {
    // Criterion's plots are drawn by the same plotters, which has the fonts that it is given.
    #[cfg(feature = "accuracy")]
    raypack::study::plot::register_font();
    use std::time::Duration;
    criterion::Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500))
        .configure_from_args()
}
