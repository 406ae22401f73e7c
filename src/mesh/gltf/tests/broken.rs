//! Files that are none.

use super::{buffer, changed, data_uri, glb, read, read_bytes, refusal, square};
use proptest::prelude::*;
use serde_json::{Value, json};
use std::path::Path;

#[test]
fn broken_documents_are_refused_in_words() {
    let cases = [
        ("/asset/version", json!("1.0"), "version \"1.0\""),
        ("/asset/minVersion", json!("2.1"), "version \"2.1\""),
        ("/nodes", json!([{ "mesh": 0, "children": [1] }, { "children": [0] }]), "reached twice"),
        ("/nodes", json!([{ "mesh": 0, "children": [0] }]), "reached twice"),
        ("/nodes/0/mesh", json!(7), "nodes[0].mesh: index out of bounds"),
        ("/scene", json!(3), "out of bounds"),
        ("/accessors/0/count", json!(4294967295_u32), "more than its view holds"),
        ("/accessors/0/count", json!(u64::MAX), "more than its view holds"),
        ("/accessors/0/byteOffset", json!(u64::MAX), "more than its view holds"),
        ("/accessors/0/type", json!("VEC2"), "positions"),
        ("/accessors/3/componentType", json!(5126), "indices"),
        ("/accessors/0/bufferView", json!(9), "out of bounds"),
        ("/accessors/1/count", json!(3), "3 normals for 4 vertices"),
        ("/bufferViews/0/byteOffset", json!(u64::MAX), "does not lie within"),
        ("/bufferViews/3/byteLength", json!(13), "does not lie within"),
        ("/bufferViews/0/byteStride", json!(4), "12 bytes every 4 bytes"),
        ("/buffers/0/byteLength", json!(141), "cut short"),
        ("/buffers/0/uri", json!("data:;base64,@@@@"), "broken base64"),
        ("/buffers/0/uri", json!("../data.bin"), "outside of the model's folder"),
        ("/buffers/0/uri", json!("/etc/hostname"), "outside of the model's folder"),
        ("/buffers/0/uri", json!("https://example.com/data.bin"), "nor a file in the model's folder"),
        ("/buffers/0", json!({ "byteLength": 140 }), "has no data"),
        ("/meshes/0/primitives/0/attributes/POSITION", json!(99), "no positions"),
        ("/meshes/0/primitives/0/attributes", json!({ "NORMAL": 1 }), "no positions"),
        ("/meshes/0/primitives/0/material", json!(5), "out of bounds"),
        ("/extensionsRequired", json!(["KHR_draco_mesh_compression"]), "KHR_draco_mesh_compression"),
        ("/materials/0", json!({ "emissiveFactor": [1e39, 0, 0] }), "out of range"),
        (
            "/materials/0",
            json!({ "emissiveFactor": [1e30, 0, 0],
                "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 1e30 } } }),
            "material 0: its emission",
        ),
    ];
    for (place, value, what) in cases {
        let error = refusal(&changed(&[(place, value.clone())]));
        assert!(error.contains(what), "{place} = {value}: {error}");
    }
    let mut bytes = buffer();
    bytes[128..130].copy_from_slice(&4_u16.to_le_bytes());
    let error = refusal(&changed(&[("/buffers/0/uri", json!(data_uri(&bytes)))]));
    assert_eq!(error, "index 4 is out of range, a primitive has 4 vertices");
}

#[test]
fn a_chain_of_nodes_may_be_long() {
    let count = 100_000;
    let mut nodes: Vec<Value> = (1..count).map(|next| json!({ "children": [next] })).collect();
    nodes.push(json!({ "mesh": 0 }));
    assert_eq!(read(&changed(&[("/nodes", nodes.into())])).0.triangles.len(), 2);
}

#[test]
fn too_many_triangles_are_counted_before_any_is_made() {
    // A strip of a hundred thousand corners, fifty thousand times.
    let nodes: Vec<Value> = (0..50_000).map(|_| json!({ "mesh": 0 })).collect();
    let all: Vec<usize> = (0..50_000).collect();
    let error = refusal(&changed(&[
        ("/nodes", nodes.into()),
        ("/scenes/0/nodes", json!(all)),
        ("/buffers", json!([{ "byteLength": 200_000, "uri": data_uri(&vec![0; 200_000]) }])),
        ("/bufferViews/3", json!({ "buffer": 0, "byteLength": 200_000 })),
        ("/accessors/3/count", json!(100_000)),
        ("/meshes/0/primitives/0/mode", json!(5)),
    ]));
    assert!(error.starts_with("4999900000 triangles, at most"), "{error}");
}

#[test]
fn broken_containers_are_refused_in_words() {
    let refused = |bytes: &[u8]| read_bytes(bytes, Path::new("model.gltf")).expect_err("it is broken");
    let whole = glb(2, &changed(&[("/buffers/0", json!({ "byteLength": 140 }))]), &buffer());
    assert!(refused(&glb(1, &json!({}), b"")).contains("GLB version 1"));
    assert!(refused(b"glTF\x02\0\0").contains("cut short"));
    assert!(refused(&whole[..whole.len() - 1]).contains("cut short"));
    let mut short = whole.clone();
    short[8..12].copy_from_slice(&5_u32.to_le_bytes());
    assert!(refused(&short).contains("announces 5 bytes"));
    let mut chunk = whole.clone();
    chunk[12..16].fill(0xff);
    assert!(refused(&chunk).contains("cut short or damaged"));
    assert!(refused(b"GLTF").starts_with("no glTF"));
    assert!(refused(b"").starts_with("no glTF"));
    assert!(refused(b"{}").contains("asset"));
    assert!(refused("[".repeat(100_000).as_bytes()).starts_with("no glTF"));
    let deep = format!(r#"{{"asset": {{"version": "2.0"}}, "extensions": {{"x": {}"#, "[".repeat(100_000));
    assert!(refused(deep.as_bytes()).starts_with("no glTF"));
}

proptest! {
    /// No bytes make the reader panic, and what it gives is a mesh.
    #[test]
    fn damage_is_survived(changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 1..8), packed: bool) {
        let mut bytes = match packed {
            true => glb(2, &changed(&[("/buffers/0", json!({ "byteLength": 140 }))]), &buffer()),
            false => square().to_string().into_bytes(),
        };
        for (at, byte) in changes {
            let at = at.index(bytes.len());
            bytes[at] = byte;
        }
        if let Ok((mesh, _)) = read_bytes(&bytes, Path::new("no such folder/model.gltf")) {
            let vertices = mesh.positions.len();
            prop_assert!(mesh.triangles.as_flattened().iter().all(|&vertex| (vertex as usize) < vertices));
            prop_assert!(mesh.attributes.is_empty() || mesh.attributes.len() == mesh.triangles.len());
            prop_assert!(mesh.attributes.iter().all(|a| a.uv.as_flattened().iter().all(|x| x.is_finite())));
        }
    }

    #[test]
    fn numbers_anywhere_are_survived(place: prop::sample::Index, number in prop_oneof![any::<u64>(), 0..300_u64]) {
        fn numbers<'a>(value: &'a mut Value, found: &mut Vec<&'a mut Value>) {
            match value {
                Value::Array(items) => items.iter_mut().for_each(|item| numbers(item, found)),
                Value::Object(items) => items.values_mut().for_each(|item| numbers(item, found)),
                Value::Number(_) => found.push(value),
                _ => {}
            }
        }
        let mut document = square();
        let mut found = Vec::new();
        numbers(&mut document, &mut found);
        let count = found.len();
        *found[place.index(count)] = json!(number);
        let _ = read_bytes(document.to_string().as_bytes(), Path::new("model.gltf"));
    }
}
