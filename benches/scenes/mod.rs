//! Scenes that the benches and tests/embree.rs share: small generated ones, and with `RAYPACK_MODELS=DIR`
//! real models by their standard views.

#![allow(dead_code)] // Each bench uses a part of it.

use raypack::geometry::{Hit, Ray};
use raypack::mesh::Mesh;
use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::mesh::generate::shapes;
use raypack::scene::Camera;
use raypack::study::rays::{RaySets, Setup};
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

/// The standard views: what figures are compared by from one day to the next.
const MODELS: [(&str, &str, &str); 14] = [
    ("obvhs-kitchen", "obvhs-kitchen/kitchen.obj", "eye=3,1.6,1.9;at=0,0.7,-0.8;fov=65"),
    ("sibenik", "sibenik/sibenik.obj", "eye=-16,-9,0.3;at=0,-8,0;fov=75"),
    ("bunny", "bunny/bun_zipper.ply", "eye=-0.05,0.2,0.3;at=-0.017,0.11,0;fov=35"),
    ("teapot", "teapot/teapot-full.obj", "eye=23.17,15.71,-0.17;at=0,2.8,0;fov=20"),
    ("lost-empire", "lost-empire/lost_empire.obj", "eye=20,30,40;at=-5,18,-5;fov=70"),
    ("coffee", "coffee/coffee.obj", "eye=-0.003,0.198,0.828;at=-0.002,0.194,0.728;fov=25"),
    ("sponza", "sponza/sponza.obj", "eye=1150,180,-40;at=0,330,10;fov=70"),
    ("sports-car", "sports-car/sportsCar.obj", "eye=2.6,1.3,4.2;at=0,0.4,0;fov=35"),
    ("conference", "conference/conference.obj", "eye=1100,250,-250;at=300,120,150;fov=75"),
    ("armadillo", "armadillo/Armadillo.ply", "eye=0,30,-260;at=0,20,0;fov=45"),
    ("atlas", "atlas/atlas.ply", "eye=22,14,34;at=0,0,0;fov=50"),
    ("kitchen", "kitchen/kitchen.obj", "eye=1.2110,1.8047,3.8524;at=0.7729,1.7631,2.9544;fov=60"),
    (
        "powerplant-outside",
        "powerplant/powerplant.ply",
        "eye=110000,40000,160000;at=10000,40000,50000;fov=60",
    ),
    ("powerplant-inside", "powerplant/powerplant.ply", "eye=15000,12000,80000;at=-20000,30000,20000;fov=70"),
];

/// Those of the standard models that lie in `folder`, each in a folder of its own.
fn models(folder: &Path) -> Vec<Scene> {
    let there = MODELS.iter().filter(|(_, file, _)| folder.join(file).is_file());
    there
        .map(|(name, file, view)| {
            let mesh = raypack::mesh::read(folder.join(file)).unwrap_or_else(|e| panic!("{e}")).mesh;
            let camera = Camera::parse(view).expect("the standard views are well-formed");
            Scene { name: (*name).into(), mesh, camera }
        })
        .collect()
}

/// Criterion's settings for a suite that runs in minutes.
pub fn quick() -> criterion::Criterion {
    use std::time::Duration;
    criterion::Criterion::default()
        .sample_size(10)
        .warm_up_time(Duration::from_millis(200))
        .measurement_time(Duration::from_millis(500))
        .configure_from_args()
}
