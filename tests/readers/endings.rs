//! A file's ending says how it is read.

use super::{read, refusal};

/// A triangle; neither names its normals.
const STL: &str =
    "solid\nfacet normal 0 0 0\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\n";
const GLTF: &str = r#"{
    "asset": { "version": "2.0" },
    "nodes": [{ "mesh": 0 }],
    "meshes": [{ "primitives": [{ "attributes": { "POSITION": 0 } }] }],
    "accessors": [{ "bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3" }],
    "bufferViews": [{ "buffer": 0, "byteLength": 36 }],
    "buffers": [{ "byteLength": 36, "uri": "data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA" }]
}"#;

#[test]
fn the_same_triangle_from_every_format() {
    let expected = read("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n").mesh;
    for (name, content) in [("a.stl", STL), ("A.STL", STL), ("a.gltf", GLTF), ("a.glb", GLTF)] {
        assert_eq!(read(name, content).mesh, expected, "{name}");
    }
}

#[test]
fn errors_name_the_file() {
    for name in ["a.stl", "a.gltf", "a.glb"] {
        refusal(name, "neither\nof them");
    }
}

#[test]
fn not_a_number_is_refused() {
    let message = refusal("a.gltf", GLTF.replacen("AACAPw", "AADAfw", 1));
    assert!(message.contains("NaN or infinite"), "{message}");
    assert!(refusal("a.stl", STL.replacen("vertex 1", "vertex nan", 1)).contains("line 5"));
}
