//! Scene files of models that are larger than the memory given: those that memory would have made.

use super::common::Place;
use super::report;
use serde_json::{Value, json};

/// Sees to it that two scene files are the same but for `meta` and the order of sections.
pub fn same_sections(place: &Place, one: &str, other: &str) {
    let sections = |file: &str| {
        let info = report(place, &format!("info {file}"));
        let (file, sections) = (place.read(file), info["file"]["sections"].clone());
        let mut arrays: Vec<(String, Vec<u8>)> = Vec::new();
        for section in sections.as_array().expect("a list") {
            let number = |key: &str| section[key].as_u64().expect("a number") as usize;
            let kind = section["kind"].as_str().expect("a name").to_owned();
            if kind != "meta" {
                arrays.push((kind, file[number("offset")..][..number("bytes")].to_vec()));
            }
        }
        arrays.sort();
        arrays
    };
    let [one, other] = [one, other].map(sections);
    assert_eq!(one.len(), other.len());
    for ((kind, bytes), (other_kind, other_bytes)) in one.into_iter().zip(other) {
        assert!(kind == other_kind && bytes == other_bytes, "{kind}, {other_kind}");
    }
}

/// What `build` says of a scene that was built piece by piece within so many MiB, as it was.
fn built_within(place: &Place, build: &str, mebibytes: u64) -> Value {
    let built = report(place, &format!("{build} --memory {mebibytes}MiB"));
    assert!(built["parts"].as_u64().expect("it was built in parts") >= 2, "{built}");
    let memory = &built["build_memory"];
    assert_eq!(memory["announced"], mebibytes << 20);
    if cfg!(target_os = "linux") {
        assert!(memory["resident"].as_u64().expect("the system says") <= mebibytes << 20, "{memory}");
    }
    built
}

#[test]
fn models_larger_than_the_memory_given_are_built_piece_by_piece() {
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("build plant.ply -o whole.rpk");
    let build = "build plant.ply -o parts.rpk --memory 120MiB";
    let text = place.succeed(build);
    assert!(text.contains(" parts; the builder held ") && text.contains("of 120 MiB given"), "{text}");
    built_within(&place, "build plant.ply -o parts.rpk", 120);
    place.succeed("info parts.rpk --verify");
    same_sections(&place, "whole.rpk", "parts.rpk");
    // A scene file is a model as well, and a generated one goes without that.
    built_within(&place, "build whole.rpk -o again.rpk", 120);
    same_sections(&place, "whole.rpk", "again.rpk");
    let plant = "generate plant --triangles 400k --seed 5 -o plant.rpk";
    let generated = built_within(&place, plant, 120);
    assert_eq!(generated["triangles"], report(&place, "info whole.rpk")["triangles"]);
    place.succeed("info plant.rpk --verify");
    same_sections(&place, "whole.rpk", "plant.rpk");
    let files = place.files();
    assert_eq!(
        files,
        ["again.rpk", "parts.rpk", "plant.ply", "plant.rpk", "whole.rpk"],
        "nothing else is left"
    );
    place.fail(&format!("{plant} --memory 60MiB"), &["--memory: building ", "MiB: give "]);
    place.fail("generate plant -o a.ply --memory 1GiB", &["--memory: only a .rpk has a tree"]);
    place.fail("generate plant -o a.obj", &["a.obj", ".ply", ".rpk"]);
    let refused = ["--memory: building ", "triangles piece by piece takes", "MiB: give "];
    place.fail("build plant.ply -o parts.rpk --memory 60MiB", &refused);
}

/// The height of a corner of a grid.
fn height(x: usize, z: usize) -> f32 {
    ((x * 7 + z * 13) % 31 + (x * x + z) % 17) as f32 * 0.05
}

/// An OBJ of hills: a grid of so many squares each way, with texture coordinates, normals and materials.
fn hills(place: &Place, side: usize) {
    place.write(
        "hills.mtl",
        "newmtl grass\nKd 0.2 0.5 0.1\nnewmtl rock\nKd 0.4\nKs 0.3\nNs 20\nmap_Kd no.png\n",
    );
    let mut file = String::from("mtllib hills.mtl\nvn 0 1 0\nvn 0.3 1 -0.2\n");
    for z in 0..=side {
        for x in 0..=side {
            file += &format!("v {x} {} {z}\nvt {} {}\n", height(x, z), x % 8, z % 8);
        }
    }
    for z in 0..side {
        file += ["usemtl grass\n", "o strip\n", "usemtl rock\n", "usemtl nowhere\n"][z % 4];
        for x in 0..side {
            let [a, b, c, d] =
                [[x, z], [x, z + 1], [x + 1, z + 1], [x + 1, z]].map(|[x, z]| z * (side + 1) + x + 1);
            match (x + z) % 3 {
                0 => file += &format!("f {a}/{a}/1 {b}/{b}/2 {c}/{c}/1 {d}/{d}\n"),
                1 => file += &format!("f {a} {b} {c}\nf {a}/{a} {c}/{c} {c}/{c}\nf {a}//2 {c}//1 {d}//2\n"),
                _ => file += &format!("f {a}/{a} {b}/{b} {c}/{c} {d}/{d}\n"),
            }
        }
    }
    place.write("hills.obj", file);
}

/// A binary STL of hills, with a facet here and there that is none.
fn solid_hills(place: &Place, side: usize) {
    let corner = |x: usize, z: usize| [x as f32, height(x, z), z as f32];
    let mut facets: Vec<[[f32; 3]; 3]> = Vec::new();
    for z in 0..side {
        for x in 0..side {
            let [a, b, c, d] = [corner(x, z), corner(x, z + 1), corner(x + 1, z + 1), corner(x + 1, z)];
            facets.extend([[a, b, c], if x % 9 == 8 { [a, c, a] } else { [a, c, d] }]);
        }
    }
    let mut file = [&[b' '; 80][..], &(facets.len() as u32).to_le_bytes()].concat();
    for facet in facets {
        file.extend(
            [[0.0; 3], facet[0], facet[1], facet[2]]
                .as_flattened()
                .iter()
                .flat_map(|x: &f32| x.to_le_bytes()),
        );
        file.extend([0; 2]);
    }
    place.write("hills.stl", file);
}

/// A GLB of hills, there twice, with texture coordinates, normals, materials, and a picture in its buffer. One of its
/// two primitives has all vertices, the other those of the first rows.
fn twin_hills(place: &Place, side: usize) {
    let corners = || (0..=side).flat_map(|z| (0..=side).map(move |x| (x, z)));
    let mut carried: Vec<u8> = Vec::new();
    let (mut views, mut accessors) = (Vec::new(), Vec::new());
    let mut add = |bytes: Vec<u8>, kind: &str, component: u32, size: usize| {
        views.push(json!({ "buffer": 0, "byteOffset": carried.len(), "byteLength": bytes.len() }));
        let count = bytes.len() / size;
        accessors.push(json!({ "bufferView": accessors.len(), "componentType": component, "count": count, "type": kind }));
        carried.extend(bytes);
    };
    let floats = |values: Vec<f32>| values.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<u8>>();
    let places = corners().flat_map(|(x, z)| [x as f32, height(x, z), z as f32]).collect();
    add(floats(places), "VEC3", 5126, 12);
    add(
        floats(corners().flat_map(|(x, z)| [x as f32 % 7.0 - 3.0, 9.0, z as f32 % 5.0]).collect()),
        "VEC3",
        5126,
        12,
    );
    add(floats(corners().flat_map(|(x, z)| [x as f32 / 8.0, z as f32 / 8.0]).collect()), "VEC2", 5126, 8);
    let squares = |rows: usize| (0..rows).flat_map(move |z| (0..side).map(move |x| z * (side + 1) + x));
    let faces = |rows: usize| {
        let face = |a: usize| [a, a + side + 1, a + side + 2, a, a + side + 2, a + 1];
        squares(rows).flat_map(face).flat_map(|index| (index as u32).to_le_bytes()).collect()
    };
    add(faces(side), "SCALAR", 5125, 4);
    add(faces(side / 9), "SCALAR", 5125, 4);
    add(b"no picture".to_vec(), "SCALAR", 5121, 1);
    carried.resize(carried.len().next_multiple_of(4), 0);

    let attributes = json!({ "POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2 });
    let textured = json!({ "pbrMetallicRoughness": { "baseColorTexture": { "index": 0 } } });
    let document = json!({
        "asset": { "version": "2.0" },
        "nodes": [{ "mesh": 0 }, { "mesh": 0, "translation": [0, 50, 1], "scale": [1, -1, 0.5] }],
        "meshes": [{ "primitives": [
            { "attributes": attributes, "indices": 3, "material": 0 },
            { "attributes": attributes, "indices": 4 },
        ] }],
        "materials": [textured],
        "textures": [{ "source": 0 }],
        "images": [{ "bufferView": 5, "mimeType": "image/png" }],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{ "byteLength": carried.len() }],
    });
    let mut text = document.to_string().into_bytes();
    text.resize(text.len().next_multiple_of(4), b' ');
    let word = |number: usize| (number as u32).to_le_bytes();
    let length = 12 + 8 + text.len() + 8 + carried.len();
    let header = [*b"glTF", word(2), word(length), word(text.len()), *b"JSON"].concat();
    let carried = [&word(carried.len())[..], b"BIN\0", &carried].concat();
    place.write("hills.glb", [header, text, carried].concat());
}

/// Builds a model in memory and piece by piece, within so many MiB, and sees to it that both give the same.
fn same_both_ways(place: &Place, model: &str, mebibytes: u64) {
    let whole = report(place, &format!("build {model} -o whole.rpk"));
    let built = built_within(place, &format!("build {model} -o parts.rpk"), mebibytes);
    place.succeed("info parts.rpk --verify");
    same_sections(place, "whole.rpk", "parts.rpk");
    let read = |report: &Value| {
        let mut model = report["models"][0].clone();
        model.as_object_mut().expect("a model").remove("read_seconds");
        model
    };
    assert_eq!((read(&whole), &whole["tree"]), (read(&built), &built["tree"]));
    let info = report(place, "info parts.rpk");
    assert_eq!(info["colors"], report(place, "info whole.rpk")["colors"]);
}

#[test]
fn obj_models_larger_than_the_memory_given_are_built_piece_by_piece() {
    let place = Place::new();
    hills(&place, 420);
    same_both_ways(&place, "hills.obj", 120);
    built_within(&place, "build whole.rpk -o again.rpk", 120);
    same_sections(&place, "whole.rpk", "again.rpk");
    assert_eq!(place.files(), ["again.rpk", "hills.mtl", "hills.obj", "parts.rpk", "whole.rpk"]);
}

/// Builds models in memory and piece by piece, within so many MiB, and sees to it that both give the same.
fn same_of_several(place: &Place, models: &[&str], mebibytes: u64) {
    let models = models.join(" ");
    let whole = report(place, &format!("build {models} -o whole.rpk"));
    let built = built_within(place, &format!("build {models} -o parts.rpk"), mebibytes);
    place.succeed("info parts.rpk --verify");
    same_sections(place, "whole.rpk", "parts.rpk");
    let read = |report: &Value| {
        let mut models = report["models"].clone();
        for model in models.as_array_mut().expect("a list") {
            model.as_object_mut().expect("a model").remove("read_seconds");
        }
        (models, report["triangles"].clone(), report["vertices"].clone())
    };
    assert_eq!((read(&whole), &whole["tree"]), (read(&built), &built["tree"]));
    let [one, other] = ["whole.rpk", "parts.rpk"].map(|file| report(place, &format!("info {file}")));
    assert_eq!((&one["colors"], &one["file"]["source"]), (&other["colors"], &other["file"]["source"]));
}

/// A PLY of a few triangles by vertex colour, one of which has no area.
const COLORED: &str = "ply\nformat ascii 1.0\nelement vertex 5\nproperty float x\nproperty float y\nproperty float z\n\
                       property uchar red\nproperty uchar green\nproperty uchar blue\nelement face 3\n\
                       property list uchar int vertex_indices\nend_header\n0 90 0 255 0 0\n9 90 0 0 255 0\n\
                       0 90 9 0 0 255\n18 90 0 9 9 9\n0 99 0 200 100 50\n3 0 1 2\n3 0 1 3\n3 0 2 4\n";

#[test]
fn several_models_larger_than_the_memory_given_are_built_piece_by_piece() {
    let place = Place::new();
    hills(&place, 260);
    solid_hills(&place, 260);
    twin_hills(&place, 180);
    place.write("few.ply", COLORED);
    // Materials, texture coordinates, normals and pictures beside models that have colours, or nothing.
    same_of_several(&place, &["few.ply", "hills.obj", "hills.stl", "hills.glb", "few.ply"], 120);
    // One of them a scene file; and colours by vertex, which all become.
    place.succeed("build hills.stl few.ply -o some.rpk");
    same_of_several(&place, &["some.rpk", "hills.stl", "hills.stl"], 120);
    same_of_several(&place, &["hills.obj", "some.rpk"], 120);
    let files =
        ["few.ply", "hills.glb", "hills.mtl", "hills.obj", "hills.stl", "parts.rpk", "some.rpk", "whole.rpk"];
    assert_eq!(place.files(), files);
    // Together they are too much, which is told with what would do.
    let refused = ["--memory: building ", "triangles piece by piece takes", "MiB: give "];
    place.fail("build hills.stl hills.glb -o parts.rpk --memory 60MiB", &refused);
}

#[test]
fn stl_models_larger_than_the_memory_given_are_built_piece_by_piece() {
    let place = Place::new();
    solid_hills(&place, 440);
    same_both_ways(&place, "hills.stl", 120);
    assert_eq!(place.files(), ["hills.stl", "parts.rpk", "whole.rpk"]);
}

#[test]
fn glb_models_larger_than_the_memory_given_are_built_piece_by_piece() {
    let place = Place::new();
    twin_hills(&place, 300);
    same_both_ways(&place, "hills.glb", 120);
    assert_eq!(place.files(), ["hills.glb", "parts.rpk", "whole.rpk"]);
}
