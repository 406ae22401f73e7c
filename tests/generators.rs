//! Generated models: the same every time, as large as asked for, and sound.

use raypack::mesh::generate::plant::{self, PlantParams};
use raypack::mesh::generate::shapes;
use raypack::mesh::{self, Colors, Mesh, ply};
use std::cell::RefCell;
use std::collections::HashMap;

/// FNV-1a over everything that makes up a mesh.
fn hash(mesh: &Mesh) -> u64 {
    let materials: &[u32] = match &mesh.colors {
        Colors::PerMaterial { of_triangle, .. } => of_triangle,
        _ => &[],
    };
    let positions = mesh.positions.iter().flat_map(|p| p.to_array()).map(f32::to_bits);
    positions
        .chain(mesh.triangles.iter().flatten().copied())
        .chain(materials.iter().copied())
        .fold(0xCBF2_9CE4_8422_2325, |h, word| (h ^ u64::from(word)).wrapping_mul(0x100_0000_01B3))
}

fn assert_sound(mesh: &Mesh) {
    assert!(mesh.positions.iter().all(|p| p.is_finite()));
    let vertices = mesh.positions.len() as u32;
    assert!(mesh.triangles.iter().flatten().all(|&i| i < vertices));
    assert!(mesh.triangles.iter().all(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
    if let Colors::PerMaterial { materials, of_triangle } = &mesh.colors {
        assert_eq!(of_triangle.len(), mesh.triangles.len());
        assert!(of_triangle.iter().all(|&m| (m as usize) < materials.len()));
    }
}

#[test]
fn plants_are_as_large_as_asked_for_and_sound() {
    for triangles in [10_000, 17_000, 49_999, 50_000, 150_000, 299_999, 1_000_000, 3_000_000] {
        for seed in [1, 2] {
            let mesh = plant::generate(PlantParams { triangles, seed });
            let part = mesh.triangles.len() as f64 / triangles as f64;
            assert!((0.95..=1.05).contains(&part), "{} instead of {triangles}", mesh.triangles.len());
            assert_sound(&mesh);
            let bounds = mesh.bounds();
            assert!(bounds.min.y >= -1.0 && bounds.max.y < 60.0, "{bounds:?}");
            assert!(bounds.center().with_y(0.0).length() < 1.0, "centred: {bounds:?}");
        }
    }
}

#[test]
fn the_smallest_plants_are_sound_too() {
    for triangles in [0, 1, 24, 100, 1000] {
        let mesh = plant::generate(PlantParams { triangles, seed: 3 });
        assert!(!mesh.triangles.is_empty());
        assert!(mesh.triangles.len() as u64 <= triangles.max(24));
        assert_sound(&mesh);
    }
}

#[test]
fn a_streamed_plant_is_the_one_in_memory_byte_for_byte() {
    let folder = tempfile::tempdir().expect("a folder");
    let [streamed, whole] = ["streamed.ply", "whole.ply"].map(|name| folder.path().join(name));
    for (triangles, seed) in [(24, 1), (10_000, 1), (60_000, 2), (300_000, 3), (1_000_000, 1)] {
        let params = PlantParams { triangles, seed };
        let mesh = plant::generate(params);
        ply::write(&whole, &mesh).expect("written");
        let told = RefCell::new(vec![0.0]);
        let size = plant::write(&streamed, params, &|part| told.borrow_mut().push(part)).expect("written");
        let bytes = |path| std::fs::read(path).expect("readable");
        assert!(bytes(&streamed) == bytes(&whole), "{params:?}");
        assert_eq!(size, plant::size(params));
        assert_eq!(size.triangles, mesh.triangles.len() as u64);
        assert_eq!(size.vertices, mesh.positions.len() as u64);
        let told = told.into_inner();
        assert!(told.is_sorted() && told.len() > 2 && told.last() <= Some(&1.0), "{told:?}");
    }
    let read = mesh::read(&streamed).expect("well-formed");
    let mesh = plant::generate(PlantParams { triangles: 1_000_000, seed: 1 });
    assert_eq!((read.mesh.positions, read.mesh.triangles), (mesh.positions, mesh.triangles));
    assert_eq!(read.report.summary(), "", "there is nothing to repair");
}

#[test]
fn a_streamed_plant_that_cannot_be_written_leaves_nothing() {
    let folder = tempfile::tempdir().expect("a folder");
    let params = PlantParams { triangles: 10_000, seed: 1 };
    let path = folder.path().join("taken.ply");
    std::fs::create_dir(&path).expect("created");
    for path in [path, folder.path().join("no/plant.ply")] {
        let message = plant::write(&path, params, &|_| {}).expect_err("it cannot be written").to_string();
        assert!(message.starts_with(&format!("cannot write {}: ", path.display())), "{message}");
        assert!(!message.contains('\n'), "{message}");
    }
    assert_eq!(std::fs::read_dir(folder.path()).expect("readable").count(), 1);
}

#[test]
fn a_plant_is_a_function_of_its_parameters() {
    let make = |seed| hash(&plant::generate(PlantParams { triangles: 60_000, seed }));
    assert_eq!(make(5), make(5));
    assert_ne!(make(5), make(6));
}

/// Pictures and figures refer to this very model: a change of the generator that moves a vertex of
/// it must be meant, and then these numbers change with it.
#[test]
fn the_demo_is_always_the_same() {
    let mesh = plant::demo();
    assert!(mesh.triangles.len() >= 250_000);
    assert_sound(&mesh);
    let Colors::PerMaterial { materials, of_triangle } = &mesh.colors else { panic!() };
    let used = (0..materials.len() as u32).filter(|m| of_triangle.contains(m)).count();
    assert!(used >= 12, "only {used} of the materials are used");
    assert_eq!((mesh.triangles.len(), hash(&mesh)), (299_954, 0x8107_BC25_03B0_A083));
}

#[test]
fn a_plant_is_no_block_repeated() {
    // Heights do not depend on where a cell lies: in a tiling every slanted triangle's would recur.
    let mesh = plant::generate(PlantParams { triangles: 1_000_000, seed: 1 });
    let mut slants: Vec<[u32; 3]> = (0..mesh.triangles.len() as u32)
        .map(|i| mesh.corners(i).map(|p| p.y.to_bits()))
        .filter(|y| y[0] != y[1] && y[1] != y[2] && y[2] != y[0])
        .collect();
    let all = slants.len();
    slants.sort_unstable();
    slants.dedup();
    assert!(all > 100_000 && slants.len() * 3 > all, "{} kinds among {all}", slants.len());
}

#[test]
fn the_demo_view_looks_down_at_the_plant() {
    let (view, bounds) = (plant::demo_view(), plant::demo().bounds());
    assert!(bounds.contains(view.at) && bounds.contains(view.eye));
    assert!(view.eye.y > 2.0 && view.at.y < view.eye.y);
    assert!((view.sun.length() - 1.0).abs() < 1e-6 && view.sun.y > 0.2);
}

#[test]
fn shapes_are_sound_and_deterministic() {
    let make = |seed| {
        [
            shapes::soup(500, seed),
            shapes::slivers(500, seed),
            shapes::boxes(500, seed),
            shapes::lattice(500, seed),
        ]
    };
    for ((once, again), other) in make(1).iter().zip(&make(1)).zip(&make(2)) {
        assert_sound(once);
        assert_eq!(once, again);
        assert_ne!(once, other);
    }
    for mesh in [shapes::sphere(3), shapes::grid(9), shapes::coincident(7)] {
        assert_sound(&mesh);
    }
}

#[test]
fn shapes_have_the_sizes_that_they_promise() {
    assert_eq!(shapes::soup(123, 1).triangles.len(), 123);
    assert_eq!(shapes::slivers(123, 1).triangles.len(), 123);
    assert_eq!(shapes::coincident(123).triangles.len(), 123);
    assert_eq!(shapes::lattice(123, 1).triangles.len(), 246);
    assert_eq!(shapes::grid(11).triangles.len(), 242);
    assert_eq!(shapes::sphere(4).triangles.len(), 8 * 256);
    let city = shapes::boxes(10_000, 1).triangles.len();
    assert!((10_000..11_000).contains(&city), "{city}");
}

#[test]
fn the_sphere_is_closed_and_faces_outwards() {
    let mesh = shapes::sphere(2);
    let mut edges = HashMap::new();
    for (i, t) in (0..).zip(&mesh.triangles) {
        for k in 0..3 {
            *edges.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
        }
        let [a, b, c] = mesh.corners(i);
        assert!((b - a).cross(c - a).dot(a) > 0.0);
    }
    assert!(edges.iter().all(|((a, b), n)| *n == 1 && edges.contains_key(&(*b, *a))));
}

#[test]
fn grids_face_up() {
    let mesh = shapes::grid(8);
    for i in 0..mesh.triangles.len() as u32 {
        let [a, b, c] = mesh.corners(i);
        assert!((b - a).cross(c - a).y > 0.0);
    }
}

#[test]
fn axis_aligned_shapes_are_axis_aligned() {
    for mesh in [shapes::boxes(1000, 1), shapes::lattice(500, 1)] {
        for i in 0..mesh.triangles.len() as u32 {
            let [a, b, c] = mesh.corners(i);
            let normal = (b - a).cross(c - a);
            assert_eq!(normal.to_array().iter().filter(|x| **x != 0.0).count(), 1);
        }
    }
}
