//! Ten million rays at the corners and edges of closed surfaces, from inside and outside: none
//! passes.

use crate::aim::at_seams;
use crate::meshes::{Closed, cube, globe, sphere, twisted_ring};
use crate::numbers::{Numbers, seeds};
use crate::scene::{CLOSED, Scene, show};
use rayon::prelude::*;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::simd::Isa;
use raypack::traverse::{Accel, Kernel};

/// Rays over all meshes, at least; each is traced in every mode.
const RAYS: usize = 10_000_000;

/// Rays that go through every kernel, over all meshes, at least.
const RAYS_EVERYWHERE: usize = 100_000;

/// Rays made and traced together.
const BATCH: usize = 4096;

/// Where Embree's own tests put their far meshes.
const FAR: Vec3 = Vec3::new(148_376.0, 1234.0, -223_423.0);

fn surfaces() -> Vec<Closed> {
    let (sphere, cube, globe, ring) = (sphere(4), cube(16), globe(20, 60), twisted_ring(48, 6, 1));
    vec![
        sphere.placed("far", 2.0, FAR),
        sphere.placed("large far", 100.0, FAR),
        cube.placed("far", 100.0, FAR),
        ring.placed("far", 100.0, FAR),
        ring.placed("small", 1e-3, Vec3::new(0.3, 0.1, -0.2)),
        twisted_ring(40, 5, 3),
        sphere,
        cube,
        globe,
        ring,
    ]
}

/// The batch of a number, always the same.
fn batch(closed: &Closed, seed: u64, number: usize) -> Vec<Ray> {
    let mut numbers = Numbers::new(seed, 1000 + number as u64);
    (0..BATCH).map(|_| at_seams(closed, &mut numbers)).collect()
}

#[test]
fn every_kernel_meets_the_seams_of_closed_surfaces() {
    let surfaces = surfaces();
    let rays = RAYS_EVERYWHERE.div_ceil(surfaces.len() * seeds().len());
    for closed in &surfaces {
        let mut scene = Scene::new(&closed.name, 0, closed.mesh.clone());
        for seed in seeds() {
            scene.seed = seed;
            let mut numbers = Numbers::new(seed, 1);
            let rays: Vec<Ray> = (0..rays).map(|_| at_seams(closed, &mut numbers)).collect();
            scene.check_closed(&rays);
        }
    }
}

/// Misses by mode, and the first ray that was missed in a mode that must not miss.
#[derive(Default)]
struct Misses {
    by_mode: [usize; Accuracy::ALL.len()],
    first: Option<String>,
}

impl Misses {
    fn joined(mut self, other: Self) -> Self {
        self.by_mode.iter_mut().zip(other.by_mode).for_each(|(a, b)| *a += b);
        self.first = self.first.or(other.first);
        self
    }
}

/// Traces the batches whose turn it is with one kernel on one instruction set in one mode.
fn misses(closed: &Closed, seed: u64, accel: &Accel, kernel: Kernel, batches: &[usize]) -> Misses {
    let trace = |&number: &usize| {
        let rays = batch(closed, seed, number);
        let mut hits = vec![Hit::MISS; rays.len()];
        accel.intersect_many(kernel, &rays, &mut hits);
        let mut misses = Misses::default();
        for (ray, _) in rays.iter().zip(&hits).filter(|(_, hit)| !hit.is_hit()) {
            misses.by_mode[accel.accuracy() as usize] += 1;
            let way = (accel.accuracy(), kernel, accel.isa());
            let report = || format!("{}, {way:?}, RAYPACK_SEED={seed}: {}", closed.name, show(ray));
            misses.first = misses.first.or_else(|| CLOSED.contains(&way.0).then(report));
        }
        misses
    };
    batches.par_iter().map(trace).reduce(Misses::default, Misses::joined)
}

#[test]
fn nothing_passes_a_closed_surface() {
    let ways: Vec<(Isa, Kernel)> =
        Isa::available().into_iter().flat_map(|isa| Kernel::ALL.map(|kernel| (isa, kernel))).collect();
    let (surfaces, seeds) = (surfaces(), seeds());
    // Every way gets the same number of batches.
    let rounds = RAYS.div_ceil(surfaces.len() * seeds.len() * ways.len() * BATCH);

    let mut table = format!("{:<24} {:>10}", "misses of rays at seams", "rays");
    Accuracy::ALL.iter().for_each(|accuracy| table += &format!(" {accuracy:>10}"));
    let mut total = Misses::default();
    let mut tried = 0;
    for closed in &surfaces {
        let mut accel = Accel::build(&closed.mesh, &BuildParams::default()).expect("builds");
        let mut found = Misses::default();
        for accuracy in Accuracy::ALL {
            accel.set_accuracy(accuracy);
            for (turn, &(isa, kernel)) in ways.iter().enumerate() {
                accel.set_isa(isa);
                let batches: Vec<usize> = (0..rounds).map(|round| round * ways.len() + turn).collect();
                for seed in seeds {
                    found = found.joined(misses(closed, seed, &accel, kernel, &batches));
                }
            }
        }
        let rays = seeds.len() * ways.len() * rounds * BATCH;
        tried += rays;
        table += &row(&closed.name, rays, &found);
        total = total.joined(found);
    }
    table += &row("all", tried, &total);
    println!("{table}\n{} ways to trace, each with {} of the rays", ways.len(), tried / ways.len());

    assert!(tried >= RAYS);
    assert_eq!(total.first, None, "{table}");
}

fn row(name: &str, rays: usize, misses: &Misses) -> String {
    let mut row = format!("\n{name:<24} {rays:>10}");
    misses.by_mode.iter().for_each(|count| row += &format!(" {count:>10}"));
    row
}
