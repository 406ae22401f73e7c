//! Readers on any bytes: what comes back keeps its promises, or is an error of one line.

use raypack::Error;
use raypack::batch::numpy::read_rays_from;
use raypack::mesh::{self, Colors, Loaded};
use std::path::Path;

/// An OBJ file, with MTL files that are not there.
pub fn obj(bytes: &[u8]) {
    check(mesh::parse(bytes, "no such folder/model.obj"));
}

/// A MTL file, beside an OBJ that uses it.
pub fn mtl(bytes: &[u8]) {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("m.mtl"), bytes).expect("written");
    let obj = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\nusemtl b c\nf 3 2 1\n";
    let path = folder.path().join("model.obj");
    // From a mapped file, but for Miri, which has none.
    let loaded = if cfg!(miri) {
        mesh::parse(obj, path)
    } else {
        std::fs::write(&path, obj).expect("written");
        mesh::read(path)
    };
    assert!(loaded.is_ok(), "materials are never fatal: {loaded:?}");
    check(loaded);
}

/// A PLY file.
pub fn ply(bytes: &[u8]) {
    check(mesh::parse(bytes, "model.ply"));
}

/// An STL file.
pub fn stl(bytes: &[u8]) {
    check(mesh::parse(bytes, "model.stl"));
}

/// A glTF file, as JSON or GLB; files that it names are not there.
pub fn gltf(bytes: &[u8]) {
    check(mesh::parse(bytes, "no such folder/model.gltf"));
}

/// A `.npy` file of rays, of known length and from a pipe.
pub fn npy(bytes: &[u8]) {
    let path = Path::new("rays.npy");
    let known = read_rays_from(bytes, Some(bytes.len() as u64), path);
    let piped = read_rays_from(bytes, None, path);
    match (known, piped) {
        (Ok(known), Ok(piped)) => {
            assert!(known.len() * 32 <= bytes.len());
            assert!(known.iter().zip(&piped).all(|(a, b)| bits(a) == bits(b)) && known.len() == piped.len());
        }
        (Err(known), Err(piped)) => [known, piped].iter().for_each(check_error),
        (known, piped) => panic!("{known:?} of a file, {piped:?} of a pipe"),
    }
}

fn bits(ray: &raypack::geometry::Ray) -> [u32; 8] {
    let ([ox, oy, oz], [dx, dy, dz]) = (ray.origin.to_array(), ray.direction.to_array());
    [ox, oy, oz, ray.tnear, dx, dy, dz, ray.tfar].map(f32::to_bits)
}

fn check(loaded: Result<Loaded, Error>) {
    let Loaded { mesh, report } = match loaded {
        Ok(loaded) => loaded,
        Err(error) => return check_error(&error),
    };
    let (vertices, triangles) = (mesh.positions.len(), mesh.triangles.len());
    assert!(triangles > 0);
    assert_eq!((report.vertices, report.triangles), (vertices as u64, triangles as u64));
    assert!(mesh.positions.iter().all(|position| position.is_finite()));
    for [a, b, c] in &mesh.triangles {
        assert!([a, b, c].iter().all(|&&index| (index as usize) < vertices));
        assert!(a != b && b != c && c != a);
    }
    match &mesh.colors {
        Colors::Uniform(_) => {}
        Colors::PerTriangle(colors) => assert_eq!(colors.len(), triangles),
        Colors::PerVertex(colors) => assert_eq!(colors.len(), vertices),
        Colors::PerMaterial { materials, of_triangle } => {
            assert_eq!(of_triangle.len(), triangles);
            assert!(of_triangle.iter().all(|&material| (material as usize) < materials.len()));
            for material in materials {
                assert_eq!(material.fault(), None, "{material:?}");
                let images = mesh.images.len();
                assert!(material.maps.all().all(|map| (map.image as usize) < images), "{material:?}");
            }
        }
    }
    assert!(mesh.attributes.is_empty() || mesh.attributes.len() == triangles);
    assert!(
        mesh.attributes.iter().flat_map(|attributes| attributes.uv.as_flattened()).all(|x| x.is_finite())
    );
    let last = triangles as u32 - 1;
    assert!(mesh.color(0, 0.25, 0.25).is_finite() && mesh.color(last, 0.25, 0.25).is_finite());
    assert!(!report.summary().contains('\n'), "{:?}", report.summary());
}

fn check_error(error: &Error) {
    let message = error.to_string();
    assert!(!message.contains(char::is_control), "{message:?}");
    assert!(message.contains("model.") || message.contains("rays.npy"), "{message} names no file");
}
