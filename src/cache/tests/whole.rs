//! Scenes for all of which there is room, before and after all of them has come.

use super::*;

/// Room for all of a scene.
const ALL: usize = 10_000;

fn options(loading: Loading, prefetch: Prefetch) -> CacheOptions {
    CacheOptions { block: 4096, loading, prefetch, ..CacheOptions::default() }
}

#[test]
fn a_scene_that_is_all_here_is_a_resident_one() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }] {
        let cached = scene.open(&options(loading, Prefetch::Off), ALL, 2, scene.source());
        let accel = Accel::of_cached(Arc::clone(&cached));
        let frames = || scene.frames(&accel, 2).expect("can be read");
        for _ in 0..2 {
            assert!(frames() == expected && !cached.is_whole(), "nobody asked for all of it");
            cached.fill().expect("can be read");
            cached.take_stats();
            assert!(frames() == expected && cached.is_whole());
            let stats = cached.take_stats();
            assert_eq!((stats.uses, stats.loads, stats.hit_ratio()), (0, 0, 1.0), "nothing was asked for");
            assert_eq!(cached.memory_bytes()[0], cached.blocks.layout.blocks() * 4096);
            // Then it goes, and comes again.
            cached.clear();
            assert!(!cached.is_whole() && cached.memory_bytes()[0] == 0);
        }
    }
}

#[test]
fn the_rest_comes_by_itself_when_half_is_here() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    let expected = scene.frames(&scene.resident, 2).expect("from memory");
    let loading = Loading::Asynchronous { loaders: 3 };
    for prefetch in Prefetch::ALL {
        for (loading, more) in [(loading, ALL), (loading, 10), (Loading::Synchronous, ALL)] {
            let cached = scene.open(&options(loading, prefetch), more, 2, scene.source());
            let accel = Accel::of_cached(Arc::clone(&cached));
            let has_room = cached.holds_all();
            assert_eq!(has_room, more == ALL);
            let half = cached.blocks.layout.blocks() / 2 * 4096;
            while has_room && cached.memory_bytes()[0] < half {
                assert!(!cached.blocks.lacks_few());
                assert!(cached.blocks.load_rest().expect("can be read") > 0);
            }
            assert_eq!(cached.blocks.lacks_few(), has_room);
            let comes = has_room && loading.loaders() > 0 && prefetch != Prefetch::Off;
            // Some of it for each second.
            for _ in 0..if comes { 1000 } else { 5 } {
                cached.loaders.wait_ahead();
                assert!(scene.frames(&accel, 2).expect("can be read") == expected);
                if cached.is_whole() {
                    break;
                }
                thread::sleep(Duration::from_millis(2));
            }
            assert_eq!(cached.is_whole(), comes, "{prefetch:?} {loading:?} {more}");
        }
    }
}

#[test]
fn uses_that_are_noted_down_are_noticed() {
    let scene = Scene::new(shapes::soup(4000, 5));
    let cached = scene.open(&options(Loading::Synchronous, Prefetch::Off), ALL, 1, scene.source());
    let accel = Accel::of_cached(Arc::clone(&cached));
    let frames = || scene.frames(&accel, 1).expect("can be read");
    cached.fill().expect("can be read");
    cached.begin_frame();
    assert!(cached.is_whole());
    cached.trace_uses(true);
    frames();
    assert!(!cached.is_whole() && !cached.take_uses().is_empty());
    cached.trace_uses(false);
    frames();
    assert!(cached.is_whole() && cached.take_uses().is_empty());
}

#[test]
fn a_rest_that_cannot_be_read_is_an_error_for_who_asks_for_it() {
    let scene = Scene::new(plant::generate(PlantParams { triangles: 100_000, seed: 3 }));
    for loading in [Loading::Synchronous, Loading::Asynchronous { loaders: 3 }] {
        let source = InMemory { fails_at: AtomicU64::new(3), ..scene.source() };
        let cached = scene.open(&options(loading, Prefetch::Beside), ALL, 2, source);
        let error = cached.fill().expect_err("the third read fails").to_string();
        assert_eq!(error, "cannot read scene.rpk: the disk is gone");
        cached.begin_frame();
        assert!(!cached.is_whole());
        // The next time it can be read.
        let frames = scene.frames(&Accel::of_cached(Arc::clone(&cached)), 2).expect("can be read");
        assert!(frames == scene.frames(&scene.resident, 2).expect("from memory"));
        cached.fill().expect("can be read");
        cached.begin_frame();
        assert!(cached.is_whole());
    }
}

#[test]
fn who_traces_while_all_goes_and_comes_sees_nothing_of_it() {
    let scene = Scene::new(shapes::soup(20_000, 5));
    let cached = scene.open(&options(Loading::Synchronous, Prefetch::Off), ALL, 3, scene.source());
    let accel = Accel::of_cached(Arc::clone(&cached));
    let bounds = scene.resident.bounds();
    let ray = |i: usize| {
        let at = |k: f32| (i as f32 * k).fract() * 2.0 - 1.0;
        let origin = bounds.center() + bounds.extent() * Vec3::new(at(0.618), at(0.755), at(0.57));
        Ray::new(origin, Vec3::new(at(0.31), at(0.47), at(0.83)))
    };
    let rays: Vec<Ray> = (0..400).map(ray).collect();
    let mut expected = vec![Hit::MISS; rays.len()];
    scene.resident.intersect_many(Kernel::Packet16, &rays, &mut expected);
    let is_over = AtomicBool::new(false);
    let mut was_whole = 0;
    thread::scope(|scope| {
        for _ in 0..3 {
            scope.spawn(|| {
                let mut hits = vec![Hit::MISS; rays.len()];
                while !is_over.load(Ordering::Relaxed) {
                    accel.intersect_many(Kernel::Packet16, &rays, &mut hits);
                    assert_eq!(hits, expected);
                    let corners = scene.mesh.corners(hits[0].primitive % 20_000);
                    let view = cached.view();
                    assert_eq!(view.corners_of(hits[0].primitive % 20_000).map(Vec3::from_array), corners);
                }
            });
        }
        for _ in 0..10_000 {
            cached.fill().expect("can be read");
            cached.begin_frame();
            was_whole += usize::from(cached.is_whole());
            thread::sleep(Duration::from_micros(500));
            cached.clear();
            if was_whole == 40 {
                break;
            }
        }
        is_over.store(true, Ordering::Relaxed);
    });
    assert_eq!(was_whole, 40, "it hardly ever came together");
}
