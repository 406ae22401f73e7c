//! Small files made here: what they become, and what is said of those that are broken.

mod broken;
mod looks;

use super::{parse, parse_to};
use crate::geometry::Aabb;
use crate::mesh::lists::InFiles;
use crate::mesh::spooled::{SpooledMesh, Whole};
use crate::mesh::{Colors, Image, ImageSource, Mesh, Normal, ReadReport};
use base64::Engine;
use base64::prelude::BASE64_STANDARD;
use glam::{Vec2, Vec3};
use serde_json::{Value, json};
use std::cell::Cell;
use std::fs;
use std::path::Path;

/// The corners of a square, its normals, texture coordinates (v downward), and two triangles.
const CORNERS: [[f32; 3]; 4] = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
const UV: [[f32; 2]; 4] = [[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]];
const INDICES: [u16; 6] = [0, 1, 2, 0, 2, 3];

fn buffer() -> Vec<u8> {
    let mut bytes: Vec<u8> = CORNERS.iter().flatten().flat_map(|x| x.to_le_bytes()).collect();
    bytes.extend([[0.0_f32, 0.0, 1.0]; 4].iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(UV.iter().flatten().flat_map(|x| x.to_le_bytes()));
    bytes.extend(INDICES.iter().flat_map(|i| i.to_le_bytes()));
    bytes
}

fn data_uri(bytes: &[u8]) -> String {
    format!("data:application/octet-stream;base64,{}", BASE64_STANDARD.encode(bytes))
}

/// A document with the square as its only mesh, in one node.
fn square() -> Value {
    json!({
        "asset": { "version": "2.0" },
        "scene": 0,
        "scenes": [{ "nodes": [0] }],
        "nodes": [{ "mesh": 0 }],
        "meshes": [{ "primitives": [{
            "attributes": { "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "_OF_ITS_OWN": 0 },
            "indices": 3,
            "material": 0,
        }] }],
        "materials": [{ "name": "paint", "pbrMetallicRoughness": { "metallicFactor": 0 } }],
        "accessors": [
            { "bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 1, "componentType": 5126, "count": 4, "type": "VEC3" },
            { "bufferView": 2, "componentType": 5126, "count": 4, "type": "VEC2" },
            { "bufferView": 3, "componentType": 5123, "count": 6, "type": "SCALAR" },
        ],
        "bufferViews": [
            { "buffer": 0, "byteOffset": 0, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 48, "byteLength": 48 },
            { "buffer": 0, "byteOffset": 96, "byteLength": 32 },
            { "buffer": 0, "byteOffset": 128, "byteLength": 12 },
        ],
        "buffers": [{ "byteLength": 140, "uri": data_uri(&buffer()) }],
    })
}

/// The square with changes, each at a place in its document.
fn changed(changes: &[(&str, Value)]) -> Value {
    let mut document = square();
    for (place, value) in changes {
        let (parent, key) = place.rsplit_once('/').expect("a slash");
        match document.pointer_mut(parent).expect("its parent") {
            Value::Array(items) => match key.parse::<usize>() {
                Ok(index) if index < items.len() => items[index] = value.clone(),
                _ => items.push(value.clone()),
            },
            parent => parent[key] = value.clone(),
        }
    }
    document
}

/// What a file's bytes become, in memory and in files alike.
fn read_bytes(bytes: &[u8], path: &Path) -> Result<(Mesh, ReadReport), String> {
    let mut report = ReadReport::default();
    let read = parse(bytes, path, &mut report, &|_| ()).map(|mesh| (mesh, report));
    assert_eq!(read_to_files(bytes, path, &|| ()), read);
    read
}

/// What they become in files. `let_go` is called now and then.
fn read_to_files(bytes: &[u8], path: &Path, let_go: &dyn Fn()) -> Result<(Mesh, ReadReport), String> {
    let lists = InFiles::new(std::env::temp_dir());
    let mut report = ReadReport::default();
    let raw = parse_to(&lists, bytes, path, &mut report, &|_| (), Some(let_go))?;
    let Whole { positions, triangles, colors, attributes, images } = Whole::of_gltf(raw).expect("room");
    let in_memory = |Image { name, source }| match source {
        ImageSource::Bytes(_) => panic!("{name} is in memory"),
        source @ ImageSource::Packed(_) => {
            let bytes = source.read().expect("readable");
            Image { name, source: ImageSource::Bytes((*bytes).into()) }
        }
        source => Image { name, source },
    };
    let images = images.into_iter().map(in_memory).collect();
    let mesh = SpooledMesh { positions, triangles, colors, attributes, images, bounds: Aabb::EMPTY };
    Ok((mesh.to_mesh().expect("readable"), report))
}

#[track_caller]
fn read(document: &Value) -> (Mesh, ReadReport) {
    read_bytes(document.to_string().as_bytes(), Path::new("model.gltf")).expect("it can be read")
}

#[track_caller]
fn refusal(document: &Value) -> String {
    read_bytes(document.to_string().as_bytes(), Path::new("model.gltf")).expect_err("it is broken")
}

/// A GLB file's bytes.
fn glb(version: u32, json: &Value, carried: &[u8]) -> Vec<u8> {
    let mut text = json.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let mut chunks = [&(text.len() as u32).to_le_bytes()[..], b"JSON", &text].concat();
    if !carried.is_empty() {
        let padded = carried.len().next_multiple_of(4);
        chunks.extend((padded as u32).to_le_bytes().iter().chain(b"BIN\0").chain(carried));
        chunks.resize(chunks.len() + padded - carried.len(), 0);
    }
    let length = 12 + chunks.len() as u32;
    [b"glTF", &version.to_le_bytes()[..], &length.to_le_bytes(), &chunks].concat()
}

#[test]
fn a_square() {
    let (mesh, report) = read(&square());
    assert_eq!(mesh.positions, CORNERS.map(Vec3::from_array));
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    let [first, second] = mesh.attributes[..] else { panic!("{:?}", mesh.attributes) };
    assert_eq!(first.uv, [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0]], "v runs upward");
    assert_eq!(second.uv_at(0.0, 1.0), Vec2::new(0.0, 1.0));
    assert_eq!(second.normals, [Normal::encode(Vec3::Z); 3]);
    assert_eq!(report, ReadReport::default());
}

#[test]
fn buffers_are_carried_or_beside() {
    let expected = read(&square());
    let carried = glb(2, &changed(&[("/buffers/0", json!({ "byteLength": 140 }))]), &buffer());
    assert_eq!(read_bytes(&carried, Path::new("model.gltf")), Ok(expected.clone()));
    let (mesh, report) =
        read_bytes(&[&carried[..], b"more"].concat(), Path::new("model.gltf")).expect("it can be read");
    assert_eq!((mesh, report.trailing_bytes), (expected.0.clone(), 4));

    let folder = tempfile::tempdir().expect("a folder");
    let beside = changed(&[("/buffers/0/uri", json!("da%20ta.bin"))]).to_string();
    let path = folder.path().join("model.gltf");
    let error = read_bytes(beside.as_bytes(), &path).expect_err("no buffer yet");
    assert_eq!(error, "buffer 0: da%20ta.bin not found");
    fs::write(folder.path().join("da ta.bin"), buffer()).expect("written");
    assert_eq!(read_bytes(beside.as_bytes(), &path), Ok(expected));
    fs::write(folder.path().join("da ta.bin"), &buffer()[1..]).expect("written");
    assert!(read_bytes(beside.as_bytes(), &path).expect_err("cut").contains("cut short"));
}

#[test]
fn nodes_move_turn_mirror_and_repeat() {
    let nodes = json!([
        { "children": [1, 2], "translation": [10, 0, 0] },
        { "mesh": 0, "rotation": [0, 0.70710677, 0, 0.70710677] },
        { "mesh": 0, "matrix": [-1,0,0,0, 0,2,0,0, 0,0,1,0, 0,0,5,1] },
        { "mesh": 0, "scale": [9, 9, 9] },
    ]);
    let (mesh, _) = read(&changed(&[("/nodes", nodes)]));
    assert_eq!(mesh.triangles.len(), 4, "node 3 is not in the scene");
    let near = |a: Vec3, b: [f32; 3]| assert!(a.distance(b.into()) < 1e-5, "{a} {b:?}");
    // A quarter turn around y takes x to -z, and z to x.
    near(mesh.corners(0)[1], [10.0, 0.0, -1.0]);
    near(mesh.attributes[0].normals[0].decode(), [1.0, 0.0, 0.0]);
    // The mirror keeps fronts in front.
    let [a, b, c] = mesh.corners(2);
    near(c, [9.0, 0.0, 5.0]);
    near(b, [9.0, 2.0, 5.0]);
    let face = (b - a).cross(c - a).normalize();
    assert_eq!(face, mesh.attributes[2].normal_at(0.3, 0.3).expect("a normal"));
    assert_eq!(mesh.attributes[2].uv[2], [1.0, 0.0], "corners keep what they have");
}

#[test]
fn normals_stay_upright_where_scales_differ() {
    let tilted = [[1.0_f32, 1.0, 0.0]; 4];
    let mut bytes = buffer();
    bytes[48..96].copy_from_slice(bytemuck::bytes_of(&tilted));
    let (mesh, _) =
        read(&changed(&[("/buffers/0/uri", json!(data_uri(&bytes))), ("/nodes/0/scale", json!([4, 1, 1]))]));
    let normal = mesh.attributes[0].normals[0].decode();
    assert!(normal.distance(Vec3::new(0.25, 1.0, 0.0).normalize()) < 1e-4, "{normal}");
}

#[test]
fn without_a_scene_roots_are_shown() {
    let mut document = changed(&[("/nodes", json!([{ "mesh": 0 }, { "children": [0] }]))]);
    let object = document.as_object_mut().expect("an object");
    object.remove("scene");
    object.remove("scenes");
    assert_eq!(read(&document).0.triangles.len(), 2, "node 0 is a child, and there once");
}

#[test]
fn strips_and_fans_become_triangles_and_lines_are_counted() {
    let primitive = |mode: u32| json!({ "attributes": { "POSITION": 0 }, "mode": mode });
    let (mesh, report) = read(&changed(&[(
        "/meshes/0/primitives",
        json!([primitive(5), primitive(6), primitive(0), primitive(2), primitive(3)]),
    )]));
    let first = [[0, 1, 2], [1, 3, 2]];
    let second = [[4, 5, 6], [4, 6, 7]];
    assert_eq!(mesh.triangles, [first, second].concat());
    assert_eq!((report.strips, report.points, report.lines), (2, 4, 4 + 3));
    assert!(mesh.attributes.is_empty());
    assert_eq!(mesh.colors, Colors::default());
}

#[test]
fn sparse_accessors_change_elements() {
    // Corner 2 is moved; the bytes for that are those of corner 1, and index 2 is the third of the indices.
    let sparse = |values: u32| {
        json!({
            "count": 1,
            "indices": { "bufferView": 3, "byteOffset": 4, "componentType": 5123 },
            "values": { "bufferView": 0, "byteOffset": values },
        })
    };
    let (mesh, _) = read(&changed(&[("/accessors/0/sparse", sparse(12))]));
    assert_eq!(mesh.positions[2], Vec3::X);
    // Without a base, the others are zero.
    let accessor = json!({ "componentType": 5126, "count": 4, "type": "VEC3", "sparse": sparse(24) });
    let (mesh, _) = read(&changed(&[("/accessors/0", accessor)]));
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::ZERO, Vec3::new(1.0, 1.0, 0.0), Vec3::ZERO]);
    for (place, value) in
        [("/count", json!(9)), ("/indices/byteOffset", json!(11)), ("/values/byteOffset", json!(40))]
    {
        let place = format!("/accessors/0/sparse{place}");
        let mut document = changed(&[("/accessors/0/sparse", sparse(12))]);
        *document.pointer_mut(&place).expect("it") = value;
        assert!(refusal(&document).contains("sparse"), "{place}");
    }
    let all = json!({ "componentType": 5126, "count": 4294967295_u32, "type": "VEC3", "sparse": sparse(24) });
    assert!(refusal(&changed(&[("/accessors/0", all)])).contains("almost none"));
}

#[test]
fn quantized_meshes_are_read() {
    let mut bytes = buffer();
    let corners: [[i16; 4]; 4] = [[0, 0, 0, 9], [100, 0, 0, 9], [100, 100, 0, 9], [0, 100, 0, 9]];
    bytes[..32].copy_from_slice(bytemuck::bytes_of(&corners));
    let (mesh, report) = read(&changed(&[
        ("/buffers/0/uri", json!(data_uri(&bytes))),
        ("/extensionsRequired", json!(["KHR_mesh_quantization"])),
        ("/accessors/0/componentType", json!(5122)),
        ("/bufferViews/0/byteStride", json!(8)),
        ("/nodes/0/scale", json!([0.01, 0.01, 0.01])),
    ]));
    for (position, corner) in mesh.positions.iter().zip(CORNERS) {
        assert!(position.distance(corner.into()) < 1e-6, "{position}");
    }
    assert_eq!(report, ReadReport::default());
}

#[test]
fn vertices_keep_their_order_and_those_that_nothing_uses_are_left_out() {
    let mut bytes = buffer();
    bytes[128..140].copy_from_slice(bytemuck::bytes_of(&[3_u16, 1, 2, 2, 1, 3]));
    let (mesh, _) = read(&changed(&[("/buffers/0/uri", json!(data_uri(&bytes)))]));
    assert_eq!(mesh.positions, [1, 2, 3].map(|vertex: usize| Vec3::from_array(CORNERS[vertex])));
    assert_eq!(mesh.triangles, [[2, 0, 1], [1, 0, 2]]);
}

#[test]
fn not_much_of_a_buffer_is_in_memory_at_any_time() {
    // A million vertices of 12 bytes, and triangles whose corners all lie far from one another.
    const VERTICES: u32 = 1 << 20;
    const TRIANGLES: u32 = 70_000;
    let mut carried: Vec<u8> =
        (0..VERTICES).flat_map(|v| [v as f32, v as f32 / 2.0, 7.0]).flat_map(f32::to_le_bytes).collect();
    let vertex = |corner: u32| corner.wrapping_mul(2_654_435_761) >> 12;
    carried.extend((0..3 * TRIANGLES).map(vertex).flat_map(u32::to_le_bytes));
    let (floats, indices) = (12 * VERTICES, 12 * TRIANGLES);
    let document = changed(&[
        ("/buffers/0", json!({ "byteLength": floats + indices })),
        ("/bufferViews/0", json!({ "buffer": 0, "byteLength": floats, "byteStride": 12 })),
        ("/bufferViews/3", json!({ "buffer": 0, "byteOffset": floats, "byteLength": indices })),
        ("/accessors/0/count", json!(VERTICES)),
        (
            "/accessors/2",
            json!({ "bufferView": 0, "componentType": 5126, "count": VERTICES, "type": "VEC2" }),
        ),
        (
            "/accessors/3",
            json!({ "bufferView": 3, "componentType": 5125, "count": 3 * TRIANGLES, "type": "SCALAR" }),
        ),
        ("/meshes/0/primitives/0/attributes", json!({ "POSITION": 0, "TEXCOORD_0": 2 })),
    ]);
    let bytes = glb(2, &document, &carried);
    let let_go = Cell::new(0);
    let count = || let_go.set(let_go.get() + 1);
    let (mesh, _) = read_to_files(&bytes, Path::new("model.glb"), &count).expect("it can be read");
    for (triangle, primitive) in mesh.triangles.iter().zip(0..) {
        let corners = [0, 1, 2].map(|corner| vertex(3 * primitive + corner) as f32);
        assert_eq!(triangle.map(|place| mesh.positions[place as usize].x), corners);
        assert_eq!(mesh.attributes[primitive as usize].uv, corners.map(|v| [v, 1.0 - v / 2.0]));
    }
    // Positions are looked at in their order, texture coordinates twice, and indices three times.
    let blocks = |bytes: u32| bytes.div_ceil(1 << 16);
    let looks = 3 * blocks(floats) + 3 * blocks(indices);
    assert!((looks / 128 - 1..=looks / 128 + 1).contains(&let_go.get()), "{} times", let_go.get());
}
