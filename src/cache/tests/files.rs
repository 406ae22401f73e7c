//! Scenes that come from files: their surfaces, and what becomes of the files.

use super::*;
use crate::mesh::{Attributes, Colors, Material, Normal};
use crate::scene::{CachedSurface, Look, Surface};

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
        let accel = Accel::of_cached(Arc::clone(&cached));
        let frame = || frame_of(&accel, &surface, &scene.resident).expect("can be read");
        assert!(!cached.is_whole() && frame() == expected, "{:?}", file.meta().colors);
        cached.fill().expect("can be read");
        assert!(frame() == expected && cached.is_whole(), "{:?}", file.meta().colors);
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
