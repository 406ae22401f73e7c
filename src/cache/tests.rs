//! Pictures and hits through caches of all kinds: the same as from memory, to the bit.

use super::policy::Replacement;
use super::*;
use crate::geometry::{Accuracy, Hit, Ray};
use crate::kdtree::{Arrays, BuildParams, KdTree, Tree};
use crate::mesh::generate::plant::{self, PlantParams};
use crate::mesh::generate::shapes;
use crate::mesh::{Attributes, Colors, Material, Mesh, Normal};
use crate::render::{Frame, RenderSettings, Renderer, Size};
use crate::scene::{CachedSurface, Camera, Lighting, Look, Surface};
use crate::traverse::{Accel, Kernel, look_ahead};
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

    /// Of the memory that it takes at least, and so many blocks more.
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
        let memory = least + more * options.block;
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
            block: [4096, 16_384][i % 2],
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
            assert!(stats.loads > 0 && asked >= stats.loads && stats.uses > stats.loads, "{stats:?}");
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
                assert!(
                    stats.evictions + stats.prefetched_unused > 0
                        || stats.bytes_read <= cached.data_bytes() as u64,
                    "each block once"
                );
            } else if more == 0 {
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
fn a_read_that_fails_while_blocks_come_ahead_of_need_fails_the_frame_or_nothing() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    let loading = Loading::Asynchronous { loaders: 3 };
    let options = CacheOptions { loading, prefetch: Prefetch::Ahead, ..CacheOptions::default() };
    for fails_at in (1..400).step_by(57) {
        let source = InMemory { fails_at: AtomicU64::new(fails_at), slow: 50, ..scene.source() };
        let cached = scene.open(&options, 300, 3, source);
        let accel = Accel::of_cached(Arc::clone(&cached));
        let mut failures = 0;
        for _ in 0..2 {
            match scene.frames_in(&accel, 3, 8) {
                Ok(frames) => assert!(frames == expected, "{fails_at}"),
                Err(error) => {
                    failures += 1;
                    assert_eq!(error.to_string(), "cannot read scene.rpk: the disk is gone");
                }
            }
        }
        assert!(failures <= 1, "it fails once");
    }
}

#[test]
fn what_is_looked_for_ahead_of_need_is_what_rays_need() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let view = scene.camera().view(24, 24);
    let rays = || (0..9).map(|i| view.ray(4 + i % 3 * 8, 4 + i / 3 * 8, [0.5, 0.5]));
    let options = CacheOptions { prefetch: Prefetch::Ahead, ..CacheOptions::default() };
    for in_beams in [false, true] {
        let cached = scene.open(&options, 10_000, 1, scene.source());
        let accel = Accel::of_cached(Arc::clone(&cached));
        let trace = || {
            let _: Vec<_> = rays().map(|ray| accel.intersect(&ray)).collect();
            cached.take_stats()
        };
        let cold = trace();
        assert!(cold.misses > 0 && cold.prefetched == 0, "{cold:?}");
        cached.clear();
        cached.take_stats();
        // Each look goes on where the last one had to stop.
        let looks = (0..100).map(|_| {
            look_ahead(&cached, rays(), in_beams);
            cached.loaders.wait_ahead();
            cached.take_stats()
        });
        let looks: Vec<CacheStats> = looks.take_while(|stats| stats.prefetched > 0).collect();
        assert!(looks.len() > 1 && looks.len() < 100, "{} looks", looks.len());
        assert!(looks.iter().all(|stats| stats.uses == 0 && stats.misses == 0), "to look is not to use");
        let warm = trace();
        // Some rays go on beyond the leaves that were looked at.
        let most = cold.misses * 2 / 3;
        assert!(in_beams || warm.misses < most, "{} misses of {}", warm.misses, cold.misses);
        assert!(warm.prefetched_used > 0, "{warm:?}");
    }
}

#[test]
fn nobody_looks_ahead_where_nothing_can_come() {
    let scene = Scene::new(shapes::soup(4000, 5));
    let looks_ahead = |accel: &Accel| {
        let settings = RenderSettings::new(Size { width: 8, height: 8 });
        Renderer::new(accel, &scene.mesh, settings).expect("sensible").looks_ahead()
    };
    assert!(!looks_ahead(&scene.resident), "all is in memory");
    for prefetch in Prefetch::ALL {
        let options = CacheOptions { prefetch, ..CacheOptions::default() };
        let cached = scene.open(&options, 1000, 1, scene.source());
        assert_eq!(looks_ahead(&Accel::of_cached(cached)), prefetch == Prefetch::Ahead);
    }
}

#[test]
fn slow_reads_ahead_of_need_change_no_picture_and_keep_their_bounds() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    let mut prefetched = 0;
    for (loaders, more, slow) in [(1, 250, 200), (2, 400, 500), (8, 600, 900), (6, 10_000, 300)] {
        let source = InMemory { slow, ..scene.source() };
        let most = Arc::clone(&source.most);
        let loading = Loading::Asynchronous { loaders };
        let options = CacheOptions { loading, prefetch: Prefetch::Ahead, ..CacheOptions::default() };
        let cached = scene.open(&options, more, 2, source);
        let accel = Accel::of_cached(Arc::clone(&cached));
        let frames = scene.frames_in(&accel, 2, 8).expect("can be read");
        assert!(frames == expected, "{loaders} loaders, {more} more");
        assert!(most.load(Ordering::SeqCst) <= loaders);
        cached.loaders.wait_ahead();
        let stats = cached.take_stats();
        prefetched += stats.prefetched;
        let left = stats.prefetched - stats.prefetched_used - stats.prefetched_unused;
        assert!(left <= cached.plan().ahead as u64, "{stats:?}, {:?}", cached.plan());
        cached.clear();
        assert_eq!(cached.memory_bytes()[0], 0);
    }
    assert!(prefetched > 0, "nothing came ahead of need");
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

/// A scene file of a mesh, in a folder of its own.
fn file_of(mesh: &Mesh) -> (tempfile::TempDir, std::path::PathBuf) {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("scene.rpk");
    let tree = KdTree::build(mesh, &BuildParams::default(), None).expect("builds");
    crate::store::write(&path, mesh, &tree, "a test", &|_| ()).expect("written");
    (folder, path)
}

/// A frame of what is open.
fn frame_of<S: Surface>(accel: &Accel, surface: &S, bounds_of: &Accel) -> Result<Frame> {
    let mut settings = RenderSettings::new(Size { width: 64, height: 48 });
    settings.tuning.threads = 2;
    let camera = Camera::framing(&bounds_of.bounds(), 1.0);
    let lighting = Lighting::for_view(&camera, bounds_of);
    let renderer = Renderer::new(accel, surface, settings).expect("sensible");
    Ok(renderer.frame_with_progress(&camera, &lighting, &AtomicUsize::new(0))?.0)
}

#[test]
fn colors_of_all_kinds_come_from_files_as_they_were() {
    let mut mesh = shapes::soup(3000, 9);
    let byte = |i: usize, k: usize| (i * k % 251) as u8;
    let rgb = |i: usize| [byte(i, 7), byte(i, 31), byte(i, 101)];
    let material = |i: usize| Material::matt(format!("m{i}"), Vec3::splat(0.1 + 0.2 * i as f32));
    let count = mesh.triangles.len();
    for colors in [
        Colors::Uniform(Vec3::new(0.2, 0.5, 0.7)),
        Colors::PerTriangle((0..count).map(rgb).collect()),
        Colors::PerVertex((0..mesh.positions.len()).map(rgb).collect()),
        Colors::PerMaterial {
            materials: (0..4).map(material).collect(),
            of_triangle: (0..count as u32).map(|i| i * 7 % 4).collect(),
        },
    ] {
        mesh.colors = colors;
        let scene = Scene::new(mesh.clone());
        let expected = frame_of(&scene.resident, &mesh, &scene.resident).expect("in memory");
        let (_folder, path) = file_of(&mesh);
        let file = crate::store::File::open(&path).expect("opens");
        let cached = Cached::open(&file, &CacheOptions::default(), 4 << 20, 0, 2).expect("enough");
        let cached = Arc::new(cached);
        let surface = CachedSurface::new(Arc::clone(&cached), &file).expect("whole");
        let frame = frame_of(&Accel::of_cached(cached), &surface, &scene.resident).expect("can be read");
        assert!(frame == expected, "{:?}", file.meta().colors);
    }
}

/// What a scene takes at least, as the refusal of less says.
fn least_mebibytes(file: &crate::store::File) -> usize {
    let refused = Cached::open(file, &CacheOptions::default(), 1, 0, 1).expect_err("nothing fits a byte");
    let message = refused.to_string();
    let least = message.split("at least ").nth(1).and_then(|rest| rest.split(' ').next());
    least.and_then(|least| least.parse().ok()).expect(&message)
}

#[test]
fn texture_coordinates_and_normals_come_and_go_in_blocks() {
    let mut mesh = shapes::soup(40_000, 5);
    let count = mesh.triangles.len();
    let normal = |i: usize| Normal::encode(Vec3::new(i as f32 - 777.0, (i % 13) as f32, 5.0));
    let attributes =
        |i| Attributes { uv: [[i as f32, 0.5], [0.0, -(i as f32)], [1e9, 1.0]], normals: [normal(i); 3] };
    mesh.attributes = (0..count).map(attributes).collect();
    let material = |i: usize| Material::matt(format!("m{i}"), Vec3::splat(0.1 + 0.2 * i as f32));
    let of_triangle = (0..count as u32).map(|i| i * 7 % 4).collect();
    mesh.colors = Colors::PerMaterial { materials: (0..4).map(material).collect(), of_triangle };

    let (_folder, path) = file_of(&mesh);
    let file = crate::store::File::open(&path).expect("opens");
    let memory = least_mebibytes(&file) << 20;
    let options = CacheOptions::default();
    let cached = Arc::new(Cached::open(&file, &options, memory, 0, 1).expect("the least will do"));
    assert!(cached.data_bytes() > count * 40 + memory, "all of it fits");
    let surface = CachedSurface::new(Arc::clone(&cached), &file).expect("whole");
    let same = |primitive| {
        let (ours, theirs) =
            ((&mesh).detail(primitive, 0.2, 0.3), surface.reader().detail(primitive, 0.2, 0.3));
        assert_eq!(ours, theirs, "{primitive}");
    };
    cached.or_error(|| (0..count as u32).chain(0..count as u32).step_by(3).for_each(same)).expect("readable");
    assert!(cached.take_stats().evictions > 0);
    assert!(cached.memory_bytes()[1] <= memory);
}

#[test]
fn materials_have_their_part_of_the_memory() {
    let mut mesh = shapes::soup(100, 5);
    let mut least = |bytes: usize| {
        let material = Material::matt("m".repeat(bytes), Vec3::ONE);
        mesh.colors = Colors::PerMaterial { materials: vec![material], of_triangle: vec![0; 100] };
        let (_folder, path) = file_of(&mesh);
        least_mebibytes(&crate::store::File::open(&path).expect("opens"))
    };
    let [few, many] = [least(10), least(10 + (9 << 20))];
    // Beside the name, what is more is the checksums of the file, which is longer.
    assert!((few + 9..few + 11).contains(&many), "{few} and {many} MiB");
}

#[test]
fn a_file_that_is_replaced_stays_and_one_that_is_cut_is_an_error() {
    let scene = Scene::new(shapes::soup(3000, 9));
    let expected = frame_of(&scene.resident, &scene.mesh, &scene.resident).expect("in memory");
    let (folder, path) = file_of(&scene.mesh);
    let open = || {
        let file = crate::store::File::open(&path).expect("opens");
        Arc::new(Cached::open(&file, &CacheOptions::default(), 4 << 20, 0, 2).expect("enough"))
    };
    let cached = open();
    let length = std::fs::metadata(&path).expect("there").len();
    std::fs::OpenOptions::new().write(true).open(&path).expect("there").set_len(length / 4).expect("cut");
    let error = frame_of(&Accel::of_cached(cached), &scene.mesh, &scene.resident).expect_err("it is cut");
    assert!(error.to_string().contains("it has become shorter since it was opened"), "{error}");

    let (_other, whole) = file_of(&scene.mesh);
    std::fs::copy(whole, &path).expect("whole again");
    let cached = open();
    let new = folder.path().join("new");
    std::fs::write(&new, "another file").expect("written");
    std::fs::rename(new, &path).expect("replaced");
    let frame = frame_of(&Accel::of_cached(cached), &scene.mesh, &scene.resident).expect("it is still open");
    assert!(frame == expected);
}

#[test]
fn a_first_picture_is_there_before_all_blocks_are_and_the_last_is_the_same() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 60_000, seed: 3 }));
    let mut settings = RenderSettings::new(Size { width: 96, height: 80 });
    settings.aovs.depth = true;
    settings.tuning.threads = 2;
    let camera = scene.camera();
    let lighting = Lighting::for_view(&camera, &scene.resident);
    let expected = Renderer::new(&scene.resident, &scene.mesh, settings.clone())
        .expect("sensible")
        .frame(&camera, &lighting)
        .0;
    for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }] {
        let options = CacheOptions { loading, ..CacheOptions::default() };
        let source = InMemory { slow: 2000, ..scene.source() };
        let cached = scene.open(&options, 300, 2, source);
        let accel = Accel::of_cached(Arc::clone(&cached));
        let renderer = Renderer::new(&accel, &scene.mesh, settings.clone()).expect("sensible");
        let draw = |limit| {
            let done = AtomicUsize::new(0);
            let drawn = renderer.bounded_frame(&camera, &lighting, &done, limit).expect("can be read");
            assert_eq!(done.into_inner(), renderer.tile_count());
            drawn
        };
        let (first, frame, _) = draw(Duration::from_millis(1));
        assert!(frame == expected, "{loading:?}");
        let first = first.expect("time was limited");
        assert!(first.stats.stand_ins > 0.1, "{:?}", first.stats);
        assert!(first.frame.color != expected.color);
        // A box is never farther than what is in it.
        let depths = |frame: &Frame| frame.depth.clone().expect("asked for");
        let pairs = depths(&first.frame).into_iter().zip(depths(&expected));
        let farther = pairs.clone().filter(|(first, last)| *first > last * 1.001).count();
        assert!(farther < 8, "{farther} pixels, which rays through their middle may miss");
        assert!(pairs.filter(|(first, last)| *first < last * 0.999).count() > 500, "boxes are larger");

        // Now that time is enough, nothing has to stand for anything.
        let (first, frame, _) = draw(Duration::from_secs(3600));
        let first = first.expect("time was limited");
        assert!(first.frame == expected && frame == expected && first.stats.stand_ins == 0.0);
        // Nor does an earlier deadline hold on.
        assert!(renderer.frame(&camera, &lighting).0 == expected);
    }
    // A scene that is all in memory has no first picture.
    let renderer = Renderer::new(&scene.resident, &scene.mesh, settings).expect("sensible");
    let drawn = renderer.bounded_frame(&camera, &lighting, &AtomicUsize::new(0), Duration::from_millis(1));
    let (first, frame, _) = drawn.expect("in memory");
    assert!(first.is_none() && frame == expected);
}

#[test]
fn a_ray_enters_the_first_page_before_it_hits() {
    let mut small = shapes::soup(800, 4);
    small.positions.iter_mut().for_each(|position| *position *= 1e-36);
    for mesh in [shapes::soup(3000, 7), small] {
        let scene = Scene::new(mesh);
        let cached = scene.open(&CacheOptions::default(), 0, 1, scene.source());
        let bounds = scene.resident.bounds();
        let mut state = 0.0_f32;
        let mut random = || {
            state = (state + 0.618_034).fract();
            state
        };
        let (mut hits, mut misses) = (0, 0);
        for i in 0..4000 {
            let mut point = |by: f32| {
                let at = Vec3::new(random(), random(), random()) - 0.5;
                bounds.center() + bounds.extent() * at * by
            };
            // From far outside, so that no ray begins in a page; some along an axis.
            let (from, mut to) = (
                bounds.center()
                    + (point(1.0) - bounds.center()).normalize_or(Vec3::X)
                        * bounds.extent().max_element()
                        * 3.0,
                point(1.2),
            );
            if i % 5 == 0 {
                to = from;
                to[i % 3] = bounds.center()[i % 3];
            }
            if from == to {
                continue;
            }
            let ray = Ray::new(from, to - from);
            let (hit, entry) = (scene.resident.intersect(&ray), crate::traverse::first_page(&cached, &ray));
            if hit.is_hit() {
                hits += 1;
                let entry = entry.unwrap_or_else(|| panic!("{ray:?} hits at {}", hit.t));
                assert!(entry.t <= hit.t * 1.00001 && entry.axis < 3, "{entry:?}, {}", hit.t);
            } else if entry.is_none() {
                misses += 1;
            }
        }
        assert!(hits > 500 && misses > 20, "{hits} hits, {misses} misses");
    }
}
