//! Materials and pictures.

use super::{CORNERS, INDICES, changed, data_uri, read, read_bytes};
use crate::mesh::{Channel, Colors, ImageSource, Map, Material, Mesh, ReadReport};
use glam::Vec3;
use serde_json::{Value, json};
use std::fs;

/// The square's material with other contents, and what else was read.
#[track_caller]
fn material(changes: Value) -> (Material, Mesh, ReadReport) {
    let (mesh, report) = read(&changed(&[("/materials/0", changes)]));
    let Colors::PerMaterial { materials, of_triangle } = &mesh.colors else { panic!("{:?}", mesh.colors) };
    assert_eq!(of_triangle, &[0, 0]);
    (materials[0].clone(), mesh, report)
}

#[test]
fn vertex_colors_count_where_there_are_no_materials() {
    let primitive = json!({ "attributes": { "POSITION": 0, "COLOR_0": 0 }, "indices": 3 });
    let document = changed(&[("/meshes/0/primitives/0", primitive)]);
    let (mesh, _) = read(&document);
    assert_eq!(mesh.colors, Colors::PerVertex(CORNERS.map(|c| c.map(|x| (x * 255.0) as u8)).to_vec()));
    let mut with_material = document;
    with_material["meshes"][0]["primitives"][0]["material"] = json!(0);
    assert!(read(&with_material).1.summary().contains("vertex colours ignored"));
}

#[test]
fn metals_and_others() {
    let (gold, ..) = material(json!({ "name": "gold",
        "pbrMetallicRoughness": { "baseColorFactor": [1.0, 0.5, 0.25, 1], "roughnessFactor": 0.5 } }));
    assert_eq!((gold.diffuse, gold.specular), (Vec3::ZERO, Vec3::new(1.0, 0.5, 0.25)));
    assert_eq!((gold.roughness, gold.reflects, gold.opacity), (0.25, true, 1.0));
    assert_eq!((&*gold.name, &*gold.place), ("gold", "model.gltf: material 0"));
    let (paint, ..) = material(json!({ "pbrMetallicRoughness": { "metallicFactor": 0 } }));
    assert!((paint.specular - 0.04).abs().max_element() < 1e-7, "{}", paint.specular);
    assert_eq!((paint.diffuse, paint.reflects, paint.fresnel), (Vec3::ONE, false, true));
    let (lacquer, ..) = material(json!({
        "pbrMetallicRoughness": { "metallicFactor": 0, "roughnessFactor": 0.1 },
        "extensions": { "KHR_materials_ior": { "ior": 2 }, "KHR_materials_specular": { "specularFactor": 0.5 } },
    }));
    assert!((lacquer.specular - 1.0 / 18.0).abs().max_element() < 1e-7 && lacquer.reflects);
}

#[test]
fn glass_bends_where_it_is_thick() {
    let glass = |extensions: Value| {
        let pbr = json!({ "metallicFactor": 0, "roughnessFactor": 0, "baseColorFactor": [0.5, 0.5, 0.5, 1] });
        material(json!({ "pbrMetallicRoughness": pbr, "extensions": extensions })).0
    };
    let sheet = glass(json!({ "KHR_materials_transmission": { "transmissionFactor": 1 } }));
    assert_eq!((sheet.transmission, sheet.diffuse, sheet.ior), (Vec3::splat(0.5), Vec3::ZERO, 1.0));
    let half = glass(json!({ "KHR_materials_transmission": { "transmissionFactor": 0.5 } }));
    let scattered = half.diffuse * (Vec3::ONE - half.transmission);
    assert!((scattered - 0.25).abs().max_element() < 1e-6, "half of what enters is scattered: {scattered}");
    let ball = glass(json!({
        "KHR_materials_transmission": { "transmissionFactor": 1 },
        "KHR_materials_ior": { "ior": 1.4 },
        "KHR_materials_volume": { "thicknessFactor": 1, "attenuationDistance": 2, "attenuationColor": [1, 0.5, 0] },
    }));
    assert_eq!((ball.ior, ball.fresnel), (1.4, true));
    let left = (-ball.absorption * 2.0).exp();
    assert!(left.distance(Vec3::new(1.0, 0.5, 1e-4)) < 1e-6, "{left}");
}

#[test]
fn lights_holes_and_the_older_model() {
    let (lamp, ..) = material(json!({ "emissiveFactor": [1, 0.5, 0],
        "extensions": { "KHR_materials_emissive_strength": { "emissiveStrength": 8 } } }));
    assert_eq!(lamp.emission, Vec3::new(8.0, 4.0, 0.0));
    let pbr = json!({ "baseColorFactor": [1, 1, 1, 0.25] });
    let alpha = |mode: &str| {
        let (material, ..) = material(json!({ "alphaMode": mode, "pbrMetallicRoughness": pbr }));
        (material.opacity, material.cutoff)
    };
    assert_eq!(["OPAQUE", "BLEND", "MASK"].map(alpha), [(1.0, None), (0.25, None), (0.25, Some(0.5))]);
    let (old, ..) = material(json!({ "extensions": { "KHR_materials_pbrSpecularGlossiness": {
        "diffuseFactor": [0.2, 0.3, 0.4, 1], "specularFactor": [0.1, 0.1, 0.1], "glossinessFactor": 0.5 } } }));
    assert_eq!(
        (old.diffuse, old.specular, old.roughness),
        (Vec3::new(0.2, 0.3, 0.4), Vec3::splat(0.1), 0.25)
    );
    let (flat, ..) = material(json!({ "extensions": { "KHR_materials_unlit": {} } }));
    assert!(flat.unlit && flat.specular == Vec3::ZERO && !flat.reflects);
}

#[test]
fn pictures_are_named_not_opened() {
    let transform = json!({ "KHR_texture_transform": { "offset": [0.25, 0.5], "scale": [2, 4] } });
    let mut document = changed(&[
        (
            "/materials/0",
            json!({
                "alphaMode": "MASK",
                "pbrMetallicRoughness": {
                    "metallicFactor": 0,
                    "baseColorTexture": { "index": 0, "extensions": transform },
                    "metallicRoughnessTexture": { "index": 1 },
                },
                "normalTexture": { "index": 2, "scale": 0.5, "extensions": transform },
                "emissiveTexture": { "index": 3 },
                "emissiveFactor": [1, 1, 1],
            }),
        ),
        (
            "/textures",
            json!([{ "source": 0, "sampler": 0 }, { "source": 1 }, { "source": 2 }, { "source": 0 }]),
        ),
        ("/samplers", json!([{ "wrapS": 33071, "wrapT": 33071 }])),
        (
            "/images",
            json!([
                { "uri": "wood.png" },
                { "uri": data_uri(b"bytes") },
                { "bufferView": 3, "mimeType": "image/png" },
            ]),
        ),
    ]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("model.gltf");
    fs::write(folder.path().join("wood.png"), "not opened").expect("written");
    let (mesh, report) = read_bytes(document.to_string().as_bytes(), &path).expect("it can be read");
    assert_eq!(report, ReadReport::default());
    let sources: Vec<_> = mesh.images.iter().map(|image| image.source.clone()).collect();
    let indices = bytemuck::cast_slice(&INDICES);
    assert_eq!(
        sources,
        [
            ImageSource::File(folder.path().join("wood.png")),
            ImageSource::Bytes(b"bytes"[..].into()),
            ImageSource::Bytes(indices.into()),
        ]
    );
    let Colors::PerMaterial { materials, .. } = &mesh.colors else { panic!() };
    let maps = &materials[0].maps;
    let picked = |map: &Option<Map>| map.as_ref().map(|map| (map.image, map.channel, map.clamp));
    assert_eq!(picked(&maps.diffuse), Some((0, Channel::Color, true)));
    assert_eq!(picked(&maps.opacity), Some((0, Channel::Alpha, true)));
    assert_eq!(picked(&maps.roughness), Some((1, Channel::Green, false)));
    assert_eq!(picked(&maps.normal), Some((2, Channel::Data, false)));
    assert_eq!(picked(&maps.emission), Some((0, Channel::Color, false)));
    for map in [&maps.diffuse, &maps.normal] {
        let map = map.as_ref().expect("a map");
        // At (u, v) = (0.5, 0.25) downward the picture is asked at (1.25, 1.5) downward.
        let [u, v] = [0, 1].map(|i| [0.5, 0.75][i] * map.scale[i] + map.offset[i]);
        assert_eq!([u, v], [1.25, 1.0 - 1.5]);
    }
    assert_eq!(maps.normal.as_ref().map(|map| map.strength), Some(0.5));

    document["images"][0]["uri"] = json!("../wood.png");
    let (mesh, report) =
        read_bytes(document.to_string().as_bytes(), &path).expect("pictures are never fatal");
    assert_eq!(report.summary(), "picture ../wood.png lies outside of the model's folder");
    assert!(matches!(mesh.images[0].source, ImageSource::Missing(_)));
}

#[test]
fn what_is_not_followed_is_said() {
    let (mesh, report) = read(&changed(&[
        (
            "/materials/0",
            json!({ "pbrMetallicRoughness": {
            "metallicRoughnessTexture": { "index": 0, "texCoord": 1,
                "extensions": { "KHR_texture_transform": { "rotation": 1 } } },
            "baseColorTexture": { "index": 1 },
        } }),
        ),
        ("/samplers", json!([{ "wrapS": 33648 }])),
        (
            "/textures",
            json!([{ "sampler": 0, "extensions": { "EXT_texture_webp": { "source": 0 } } }, { "source": 0 }]),
        ),
        ("/images", json!([{ "uri": "gone\n.png" }])),
        ("/extensionsUsed", json!(["KHR_materials_clearcoat", "KHR_materials_ior"])),
        ("/skins", json!([{ "joints": [77] }])),
        ("/nodes/0/skin", json!(0)),
    ]));
    let summary = report.summary();
    for part in [
        "extension KHR_materials_clearcoat ignored",
        "skins ignored",
        "metalness maps ignored",
        "rotation of pictures ignored",
        "mirrored repetition",
        "several sets of texture coordinates",
        "picture gone\\n.png not found",
        "store them as PNG or JPEG",
    ] {
        assert!(summary.contains(part), "{part:?} is not in {summary:?}");
    }
    assert!(!summary.contains("KHR_materials_ior") && !summary.contains('\n'));
    assert_eq!(mesh.images.len(), 2);
}
