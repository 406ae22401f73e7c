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

#[test]
fn triangles_of_an_stl_share_vertices_and_may_have_none_of_their_own() {
    let facet = |corners: [&str; 3]| {
        let lines = corners.map(|corner| format!("vertex {corner}\n")).concat();
        format!("facet normal 0 0 1\nouter loop\n{lines}endloop\nendfacet\n")
    };
    let facets = [["0 0 0", "1 0 0", "0 1 0"], ["1 0 0", "-0 0 0", "1 0 0"], ["1 0 0", "1 1 0", "0 1 -0.0"]];
    let loaded = read("a.stl", format!("solid\n{}endsolid\n", facets.map(facet).concat()));
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [1, 3, 2]]);
    assert_eq!((loaded.report.degenerate_triangles, loaded.report.unused_vertices), (1, 0));
    // One that only a dropped triangle has goes with it.
    let lonely = [["5 5 5", "5 5 5", "0 0 0"], ["0 0 0", "1 0 0", "0 1 0"]];
    let loaded = read("a.stl", format!("solid\n{}", lonely.map(facet).concat()));
    assert_eq!((loaded.mesh.positions.len(), loaded.report.unused_vertices), (3, 1));
    let nothing = refusal("a.stl", format!("solid\n{}", facet(["0 0 0", "0 0 0", "1 0 0"])));
    assert!(nothing.contains("no triangles: all 1 name a vertex twice"), "{nothing}");
    assert!(refusal("a.stl", [0; 84]).contains("no triangles (0 vertices)"));
    assert!(refusal("a.stl", [1; 84]).contains("announces 16843009 triangles"));
    let mut not_a_number = [0; 134];
    not_a_number[80] = 1;
    not_a_number[96..100].fill(0xff);
    not_a_number[108..112].copy_from_slice(&1.0_f32.to_le_bytes());
    assert!(refusal("a.stl", not_a_number).contains("NaN or infinite"));
}
