//! What comes, or is drawn, before it is needed.

use super::*;
use crate::traverse::look_ahead;

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
