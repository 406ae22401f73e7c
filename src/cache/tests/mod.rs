//! Pictures and hits through caches of all kinds: the same as from memory, to the bit.

mod ahead;
mod files;
mod whole;

use super::policy::Replacement;
use super::*;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::{Arrays, BuildParams, KdTree, Tree};
use crate::mesh::Mesh;
use crate::mesh::generate::plant::{self, PlantParams};
use crate::mesh::generate::shapes;
use crate::render::{Frame, RenderSettings, Renderer, Size};
use crate::scene::{Camera, Lighting};
use crate::traverse::{Accel, Kernel};
use bytemuck::cast_slice;
use glam::Vec3;
use std::io;
use std::sync::atomic::{AtomicU64, AtomicUsize};
use std::thread;

/// A tree's arrays as a source, which may be slow or fail.
#[derive(Debug, Default)]
struct InMemory {
    arrays: [Vec<u8>; Array::ALL.len()],
    /// The longest that a read takes, in microseconds.
    slow: u64,
    /// The read that fails, counted from 1; 0 for none.
    fails_at: AtomicU64,
    reads: AtomicU64,
    /// Reads that are under way.
    now: AtomicUsize,
    most: Arc<AtomicUsize>,
}

impl Source for InMemory {
    fn read(&self, array: Array, byte: usize, into: &mut [u8]) -> Result<()> {
        let read = self.reads.fetch_add(1, Ordering::SeqCst) + 1;
        self.most.fetch_max(self.now.fetch_add(1, Ordering::SeqCst) + 1, Ordering::SeqCst);
        if self.slow > 0 {
            thread::sleep(Duration::from_micros(read.wrapping_mul(0x9e37_79b9) % self.slow));
        }
        self.now.fetch_sub(1, Ordering::SeqCst);
        if read == self.fails_at.load(Ordering::SeqCst) {
            let source = io::Error::other("the disk is gone");
            return Err(Error::Read { path: "scene.rpk".into(), source });
        }
        let data = &self.arrays[array as usize][byte..];
        let count = data.len().min(into.len());
        into[..count].copy_from_slice(&data[..count]);
        Ok(())
    }
}

/// A mesh with its tree, to be opened in many ways.
struct Scene {
    mesh: Mesh,
    resident: Accel,
}

impl Scene {
    fn new(mesh: Mesh) -> Self {
        let resident = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        Self { mesh, resident }
    }

    fn source(&self) -> InMemory {
        let Arrays { nodes, references, pages, triangles, .. } = self.resident.tree().arrays();
        let arrays = [
            cast_slice(nodes).to_vec(),
            cast_slice(references).to_vec(),
            cast_slice(pages).to_vec(),
            cast_slice(triangles).to_vec(),
            Vec::new(),
            Vec::new(),
        ];
        InMemory { arrays, ..InMemory::default() }
    }

    /// Of the memory that it takes at least, and so many blocks more, of 4 KiB at least.
    fn open(&self, options: &CacheOptions, more: usize, threads: usize, source: InMemory) -> Arc<Cached> {
        let tree: &KdTree = self.resident.tree();
        let arrays = tree.arrays();
        let resident = || Resident {
            scale: tree.scale(),
            bounds: *tree.bounds(),
            root: tree.root(),
            upper: arrays.upper.to_vec(),
            beneath: arrays.beneath.to_vec(),
            bytes: source.arrays.each_ref().map(Vec::len),
            spread: tree.spread(),
        };
        let refused = Cached::new(resident(), Box::new(InMemory::default()), options, 1, 0, threads);
        let message = refused.expect_err("nothing fits a byte").to_string();
        let least =
            message.split("at least ").nth(1).and_then(|rest| rest.split(' ').next()).expect(&message);
        let least = least.parse::<usize>().expect(&message) << 20;
        let memory = least + more * options.block.max(4096);
        Arc::new(
            Cached::new(resident(), Box::new(source), options, memory, 0, threads)
                .expect("the least will do"),
        )
    }

    fn camera(&self) -> Camera {
        Camera::framing(&self.resident.bounds(), 1.0)
    }

    /// Frames of a short path.
    fn frames(&self, accel: &Accel, threads: usize) -> Result<Vec<Frame>> {
        self.frames_in(accel, threads, 32)
    }

    /// The same with tiles of so many pixels a side.
    fn frames_in(&self, accel: &Accel, threads: usize, tile: u32) -> Result<Vec<Frame>> {
        let mut settings = RenderSettings::new(Size { width: 96, height: 80 });
        (settings.tuning.threads, settings.tuning.tile) = (threads, tile);
        let renderer = Renderer::new(accel, &self.mesh, settings).expect("sensible");
        let camera = self.camera();
        let lighting = Lighting::for_view(&camera, &self.resident);
        (0..3)
            .map(|step| {
                let camera = Camera { eye: camera.eye + Vec3::X * step as f32, ..camera };
                Ok(renderer.frame_with_progress(&camera, &lighting, &AtomicUsize::new(0))?.0)
            })
            .collect()
    }
}

/// Caches of all kinds.
fn kinds() -> impl Iterator<Item = CacheOptions> {
    let policies = Replacement::ALL.into_iter().enumerate();
    policies.flat_map(|(i, policy)| {
        let loading = [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }];
        loading.map(|loading| CacheOptions {
            block: [4096, 512, 16_384, 1024][i % 4],
            ways: [1, 2, 32, 7][i % 4],
            stripes: [1, 5, 16][i % 3],
            policy,
            nodes: (i % 3 == 1).then_some((0.3, Replacement::Lru)),
            loading,
            direct: false,
            prefetch: Prefetch::ALL[i % 3],
        })
    })
}

#[test]
fn pictures_are_those_of_the_resident_scene() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    let mut prefetched = 0;
    for (i, options) in kinds().enumerate() {
        for more in [0, 40, 300, 10_000] {
            let threads = 1 + (i + more) % 4;
            let cached = scene.open(&options, more, threads, scene.source());
            let accel = Accel::of_cached(Arc::clone(&cached));
            let tile = [8, 32][i / 2 % 2];
            let frames = scene.frames_in(&accel, threads, tile).expect("can be read");
            assert!(frames == expected, "{options:?}, {more} more, {threads} threads");
            cached.loaders.wait_ahead();
            let stats = cached.take_stats();
            let asked = stats.misses + stats.prefetched;
            assert!(stats.loads > 0 && asked >= stats.loads, "{stats:?}");
            // What came ahead of need may go unused.
            assert!(stats.uses + stats.prefetched > stats.loads, "{stats:?}");
            prefetched += stats.prefetched;
            let gone = stats.prefetched_used + stats.prefetched_unused;
            assert!(gone <= stats.prefetched, "{stats:?}");
            assert!(
                stats.prefetched == 0 || options.prefetch != Prefetch::Off && options.loading.loaders() > 0,
                "{options:?}"
            );
            let [now, most] = cached.memory_bytes();
            assert!(now <= most && most <= cached.plan().all * options.block, "{now}, {most}: {options:?}");
            if more == 10_000 {
                assert!(
                    stats.evictions == 0 || options.nodes.is_some(),
                    "{stats:?} {options:?} {:?}",
                    cached.plan()
                );
                // Smaller blocks are read by the piece that each is a part of.
                let reads = 4096_usize.div_ceil(options.block) * cached.data_bytes();
                assert!(
                    stats.evictions + stats.prefetched_unused > 0 || stats.bytes_read <= reads as u64,
                    "each block once"
                );
            } else if more == 0 && options.block >= 4096 {
                // What the least is rounded up by holds all that is needed of small blocks.
                assert!(stats.evictions > 0, "{options:?}");
            }
        }
    }
    assert!(prefetched > 0, "nothing came ahead of need");
}

#[test]
fn hits_are_the_same_by_every_kernel_and_mode() {
    let scene = Scene::new(shapes::soup(40_000, 5));
    let rays: Vec<Ray> = (0..700)
        .map(|i| {
            let at = |k: f32| (i as f32 * k).fract() * 2.0 - 1.0;
            let bounds = scene.resident.bounds();
            let origin = bounds.center() + bounds.extent() * Vec3::new(at(0.618), at(0.755), at(0.57));
            Ray::new(origin, Vec3::new(at(0.31), at(0.47), at(0.83)))
        })
        .collect();
    let options = CacheOptions { block: 4096, ways: 3, ..CacheOptions::default() };
    let cached = scene.open(&options, 0, 1, scene.source());
    for accuracy in [Accuracy::Watertight, Accuracy::Exact] {
        let resident = scene.resident.clone().with_accuracy(accuracy);
        let accel = Accel::of_cached(Arc::clone(&cached)).with_accuracy(accuracy);
        for kernel in Kernel::ALL {
            let (mut hits, mut expected) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
            accel.intersect_many(kernel, &rays, &mut hits);
            resident.intersect_many(kernel, &rays, &mut expected);
            assert_eq!(hits, expected, "{kernel:?}, {accuracy}");
            let (mut found, mut expected) = (vec![false; rays.len()], vec![true; rays.len()]);
            accel.occluded_many(kernel, &rays, &mut found);
            resident.occluded_many(kernel, &rays, &mut expected);
            assert_eq!(found, expected, "{kernel:?}, {accuracy}");
        }
    }
    assert!(cached.take_stats().evictions > 0);
    assert!(hits_some(&scene.resident, &rays));
}

fn hits_some(accel: &Accel, rays: &[Ray]) -> bool {
    let hits = rays.iter().filter(|ray| accel.intersect(ray).is_hit()).count();
    hits > 50 && hits < rays.len()
}

#[test]
fn slow_reads_are_waited_for_and_overlap() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 6 }] {
        let source = InMemory { slow: 300, ..scene.source() };
        let most = Arc::clone(&source.most);
        let options = CacheOptions { block: 4096, ways: 4, loading, ..CacheOptions::default() };
        let cached = scene.open(&options, 20, 2, source);
        let frames = scene.frames(&Accel::of_cached(Arc::clone(&cached)), 2).expect("can be read");
        assert!(frames == expected, "{loading:?}");
        let most = most.load(Ordering::SeqCst);
        match loading {
            Loading::Synchronous => assert!(most <= 2, "{most} threads wait"),
            Loading::Asynchronous { .. } => assert!((3..=6).contains(&most), "{most} loaders at a time"),
        }
        assert!(cached.take_stats().stalled > 0.0);
    }
}

#[test]
fn a_read_that_fails_ends_the_frame_with_its_error() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }] {
        for fails_at in [1, 2, 17, 60] {
            let source = InMemory { fails_at: AtomicU64::new(fails_at), slow: 50, ..scene.source() };
            // Of what is only asked for ahead of need, nobody is told that it cannot be read.
            let prefetch = Prefetch::Off;
            let options = CacheOptions { block: 4096, ways: 4, loading, prefetch, ..CacheOptions::default() };
            let cached = scene.open(&options, 20, 3, source);
            let accel = Accel::of_cached(Arc::clone(&cached));
            let Err(error) = scene.frames(&accel, 3) else {
                panic!("{:?}: {loading:?} {fails_at}", cached.take_stats())
            };
            let error = error.to_string();
            assert_eq!(error, "cannot read scene.rpk: the disk is gone");
            // Nothing is left in disorder: the next time it can be read.
            assert!(
                scene.frames(&accel, 3).expect("can be read again") == expected,
                "{loading:?} {fails_at}"
            );
        }
    }
}

#[test]
fn what_is_cleared_comes_again() {
    let scene = Scene::new(shapes::soup(4000, 5));
    let options = CacheOptions { prefetch: Prefetch::Off, ..CacheOptions::default() };
    let cached = scene.open(&options, 10_000, 1, scene.source());
    let accel = Accel::of_cached(Arc::clone(&cached));
    let expected = scene.frames(&accel, 1).expect("can be read");
    let cold = cached.take_stats().loads;
    assert!(scene.frames(&accel, 1).expect("can be read") == expected);
    assert_eq!(cached.take_stats().loads, 0, "all is here");
    cached.clear();
    assert_eq!(cached.memory_bytes()[0], 0);
    assert!(scene.frames(&accel, 1).expect("can be read") == expected);
    assert_eq!(cached.take_stats().loads, cold);
}

#[test]
fn too_little_memory_says_how_much_will_do() {
    let scene = Scene::new(shapes::soup(4000, 5));
    let arrays = scene.resident.tree().arrays();
    let resident = Resident {
        scale: scene.resident.tree().scale(),
        bounds: scene.resident.bounds(),
        root: scene.resident.tree().root(),
        upper: arrays.upper.to_vec(),
        beneath: arrays.beneath.to_vec(),
        bytes: [1 << 20; Array::ALL.len()],
        spread: [130, 70, 40, 20, 10],
    };
    let options = CacheOptions::default();
    let error = Cached::new(resident, Box::new(scene.source()), &options, 1 << 20, 5 << 20, 2);
    let error = error.expect_err("too little").to_string();
    assert!(error.starts_with("--memory: 1 MiB is too little for this scene: it takes at least "), "{error}");
}
