//! Scene files on the command line: built once, and taken by every command as the model itself would be.

#[path = "../common/mod.rs"]
mod common;
#[cfg(target_os = "linux")]
mod cut_short;
#[cfg(unix)]
mod interrupted;
mod large;
#[cfg(unix)]
mod stages;
mod together;

use common::Place;
use serde_json::Value;
use std::fs;

/// A roof of two slopes over a floor; what vertices and faces have beside goes in.
fn house(vertex: &str, vertex_color: impl Fn(usize) -> String, face: &str, face_colors: [&str; 3]) -> String {
    let corners = ["-3 0 -3", "3 0 -3", "3 0 3", "-3 0 3", "-1 1 -1", "1 1 -1", "0 2 1", "-1 1 1"];
    let vertices: String =
        corners.iter().enumerate().map(|(i, corner)| format!("{corner}{}\n", vertex_color(i))).collect();
    let [floor, left, right] = face_colors;
    format!(
        "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n{vertex}\
         element face 3\nproperty list uchar int vertex_indices\n{face}end_header\n{vertices}\
         4 3 2 1 0 {floor}\n3 4 6 5 {left}\n3 4 7 6 {right}\n"
    )
}

const COLOR: &str = "property uchar red\nproperty uchar green\nproperty uchar blue\n";

/// The models, one for each kind of colours.
const MODELS: [&str; 4] = ["plain.ply", "faces.ply", "vertices.ply", "materials.obj"];

/// A folder to run in, with models of each kind of colours.
fn models() -> Place {
    let place = Place::new();
    let none = |_| String::new();
    place.write("plain.ply", house("", none, "", [""; 3]));
    place.write("faces.ply", house("", none, COLOR, ["200 200 190", "220 60 50", "60 90 200"]));
    let rainbow = |i: usize| format!(" {} {} {}", 30 * i, 255 - 20 * i, 77);
    place.write("vertices.ply", house(COLOR, rainbow, "", [""; 3]));
    place.write("m.mtl", "newmtl brick\nKd 0.5 0.1 0.1\nnewmtl slate\nKd 0.2 0.25 0.3\n");
    place.write(
        "materials.obj",
        "mtllib m.mtl\nv -1 1 -1\nv 1 1 -1\nv 0 2 1\nv -1 1 1\nusemtl slate\nf 1 3 2\nusemtl brick\nf 1 4 3\n",
    );
    place
}

/// Runs it to success and returns its report.
fn report(place: &Place, arguments: &str) -> Value {
    serde_json::from_str(&place.succeed(&format!("{arguments} --json -"))).expect("JSON")
}

#[test]
fn pictures_of_a_model_and_of_its_scene_file_are_the_same() {
    let place = models();
    for model in MODELS {
        place.succeed(&format!("build {model} -o scene.rpk"));
        let options = "--size 61x43 --samples 2 --depth depth.exr --normals normals.exr";
        let pictures = |scene: &str| {
            place.succeed(&format!("render {scene} -o color.exr {options}"));
            ["color.exr", "depth.exr", "normals.exr"].map(|name| place.read(name))
        };
        assert!(pictures(model) == pictures("scene.rpk"), "{model}");
        let heat = |scene: &str| {
            place.succeed(&format!("render {scene} -o heat.pfm --size 16x16 --heatmap steps"));
            place.read("heat.pfm")
        };
        assert!(heat(model) == heat("scene.rpk"), "{model}");
    }
}

/// A NumPy file of a hundred rays from above.
fn rays() -> Vec<u8> {
    let rays: Vec<f32> = (0..100)
        .flat_map(|i| {
            [(i % 10) as f32 * 0.3 - 1.4, 9.0, (i / 10) as f32 * 0.3 - 1.4, 0.0, 0.0, -1.0, 0.0, 99.0]
        })
        .collect();
    let header = "{'descr': '<f4', 'fortran_order': False, 'shape': (100, 8), }";
    let mut npy = b"\x93NUMPY\x01\x00".to_vec();
    npy.extend(118u16.to_le_bytes());
    npy.extend(format!("{header:<117}\n").as_bytes());
    npy.extend(rays.iter().flat_map(|x| x.to_le_bytes()));
    npy
}

#[test]
fn hits_of_a_model_and_of_its_scene_file_are_the_same() {
    let place = models();
    place.write("rays.npy", rays());
    for model in MODELS {
        place.succeed(&format!("build {model} -o scene.rpk"));
        for any in ["", "--any"] {
            let hits = |scene: &str| {
                let said = report(&place, &format!("cast {scene} --rays rays.npy -o hits.npz {any}"));
                assert!(said["hits"].as_u64() > Some(20), "{said}");
                place.read("hits.npz")
            };
            assert!(hits(model) == hits("scene.rpk"), "{model} {any}");
        }
    }
}

#[test]
fn build_says_what_it_did() {
    let place = models();
    let text = place.succeed("build faces.ply -o scene.rpk --preset best");
    for expected in
        ["faces.ply", "triangles  4 with 8 vertices", "repaired", "build ", "tree ", "scene.rpk, "]
    {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    let said = report(&place, "build faces.ply -o scene.rpk --preset best");
    assert_eq!(said["bytes"], fs::metadata(place.path("scene.rpk")).expect("there").len());
    assert_eq!(said["build_params"]["preset"], "best");
    assert_eq!(said["models"][0]["read_report"]["polygons"], 1);
    assert!(said["tree"]["nodes"].as_u64() > Some(0) && said["build_seconds"].as_f64() > Some(0.0));
    let sections = said["sections"].as_array().expect("a list");
    assert!(sections.iter().any(|section| section["kind"] == "meta"), "{sections:?}");
}

#[test]
fn pools_are_kept_in_a_scene_file() {
    let place = models();
    let built = report(&place, "build faces.ply -o with.rpk --pools");
    assert!(built["pool_bytes"].as_u64() > Some(0));
    let sections = built["sections"].as_array().expect("a list");
    assert!(sections.iter().any(|section| section["kind"] == "pool-nodes"), "{sections:?}");
    assert!(place.succeed("build faces.ply -o with.rpk --pools").contains("\npools "));
    assert!(report(&place, "build faces.ply -o without.rpk").get("pool_bytes").is_none());
    place.write("rays.npy", rays());
    let trace = |scene: &str, more: &str| {
        let drawn = report(&place, &format!("render {scene} -o a.png --size 40x40 {more}"));
        place.succeed(&format!("cast {scene} --rays rays.npy -o hits.npz {more}"));
        (drawn["tree"]["pool_bytes"].clone(), place.read("a.png"), place.read("hits.npz"))
    };
    let (none, picture, hits) = trace("without.rpk", "");
    assert!(none.is_null());
    for (scene, more) in [("with.rpk", ""), ("with.rpk", "--pools"), ("without.rpk", "--pools")] {
        let (pools, same_picture, same_hits) = trace(scene, more);
        assert_eq!(pools, built["pool_bytes"], "{scene} {more}");
        assert!(same_picture == picture && same_hits == hits, "{scene} {more}");
    }
    // Who has no use for them leaves them where they are.
    let (none, same_picture, same_hits) = trace("with.rpk", "--memory 64MiB");
    assert!(none.is_null() && same_picture == picture && same_hits == hits);
    assert!(trace("with.rpk", "--accuracy fast").0.is_null());
    let proved = place.succeed("info with.rpk --verify --validate");
    assert!(proved.contains("pool-words") && proved.contains("valid "), "{proved}");
    place
        .fail("build faces.ply -o a.rpk --pools --memory 1GiB", &["--pools", "--memory does not count them"]);
}

#[test]
fn several_models_become_one_scene() {
    let place = models();
    let text = place.succeed("build plain.ply faces.ply materials.obj -o scene.rpk");
    assert!(text.contains("3 models") && text.contains("10 with 20 vertices"), "{text}");
    let said = report(&place, "info scene.rpk");
    assert_eq!(said["triangles"], 10);
    assert_eq!(said["source"], "plain.ply, faces.ply, materials.obj");
    assert_eq!(said["colors"]["kind"], "per material");
    let said = report(&place, "build scene.rpk vertices.ply -o more.rpk");
    assert_eq!((&said["triangles"], &said["models"][0]["triangles"]), (&14.into(), &10.into()));
    assert_eq!(report(&place, "info more.rpk")["colors"]["kind"], "per vertex");
}

#[test]
fn info_shows_and_proves_what_is_in_a_scene_file() {
    let place = models();
    place.succeed("build vertices.ply -o scene.rpk --preset preview");
    let text = place.succeed("info scene.rpk --verify --validate");
    for expected in [
        "opened ",
        "made of vertices.ply by raypack ",
        "per vertex",
        "corner-colors",
        "preset preview, ",
        "empty_bonus 0.2, ",
        "verified ",
        "valid ",
    ] {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    let [model, scene] =
        ["info vertices.ply --preset preview", "info scene.rpk"].map(|command| report(&place, command));
    for same in ["tree", "colors", "shapes", "random_rays", "bounds", "triangles", "vertices"] {
        assert_eq!(model[same], scene[same], "{same}");
    }
    assert_eq!((&model["file"], &scene["file"]["verified"]), (&Value::Null, &false.into()));
    assert_eq!(scene["file"]["build_params"]["preset"], "preview");
    assert!(scene.get("build_seconds").is_none() && scene["open_seconds"].as_f64() > Some(0.0));
}

#[test]
fn commands_that_build_take_the_mesh() {
    let place = models();
    place.succeed("build faces.ply -o scene.rpk");
    let bench = "--size 16 --rays camera --engines raypack --modes single --threads 1 --seconds 0 --rounds 3";
    let said = report(&place, &format!("bench scene.rpk {bench} --preset best"));
    assert_eq!(said["header"]["triangles"], 4);
    let accuracy = "--size 8x8 --rays camera --engines raypack --samples 1 --seconds 0 --oracle-rays 64";
    report(&place, &format!("accuracy scene.rpk {accuracy}"));
    place.succeed("tune scene.rpk -o tuned.toml --minutes 0.05 --size 16x16");
}

#[test]
fn a_damaged_scene_file_is_refused_by_every_command() {
    let place = models();
    place.succeed("build faces.ply -o scene.rpk");
    let bytes = place.read("scene.rpk");
    place.write("rays.npy", rays());
    // All that take a scene, and those that take one in another way within --memory.
    let commands = [
        "render broken.rpk -o a.png",
        "render broken.rpk -o a.png --memory 1GiB",
        "render broken.rpk -o a.png --heatmap steps",
        "info broken.rpk",
        "info broken.rpk --verify",
        "effects broken.rpk",
        "bench broken.rpk",
        "bench broken.rpk --build",
        "accuracy broken.rpk",
        "tune broken.rpk -o a.toml",
        "cast broken.rpk --rays rays.npy -o a.npz",
        "cast broken.rpk --rays rays.npy -o a.npz --memory 1GiB",
        "cache broken.rpk",
        "build broken.rpk -o a.rpk",
        "build broken.rpk -o a.rpk --memory 1MiB",
        "build faces.ply broken.rpk -o a.rpk",
    ];
    let refused = |bytes: &[u8], expected: &str| {
        place.write("broken.rpk", bytes);
        for command in commands {
            place.fail(command, &["broken.rpk: ", expected]);
        }
    };
    refused(b"", "it is empty");
    refused(b"ply\n", "it is no raypack scene file");
    refused(&bytes[..1000], "it is cut short");
    refused(&bytes[..bytes.len() - 1], "it is cut short");
    let mut newer = bytes.clone();
    newer[12] = 200;
    refused(&newer, "it has version 200 of the format");
    let mut damaged = bytes.clone();
    // The section in front of the checksum table, of which the header tells where it begins.
    let table = u64::from_le_bytes(bytes[40..48].try_into().expect("eight")) as usize;
    damaged[table - 4096] ^= 1;
    refused(&damaged, "its section meta is damaged");
    place.fail("render nowhere.rpk -o a.png", &["cannot read nowhere.rpk"]);

    // A bit between two sections matters to nobody but --verify.
    let mut padding = bytes.clone();
    padding[65_535] ^= 1;
    place.write("broken.rpk", &padding);
    place.succeed("render broken.rpk -o a.png --size 8x8");
    place.fail("info broken.rpk --verify", &["it is damaged between two sections", "bytes 61440 to 65535"]);
}

#[test]
fn options_that_a_built_tree_cannot_have_are_refused() {
    let place = models();
    place.succeed("build faces.ply -o scene.rpk");
    let refused = |command: &str, option: &str, value: &str| {
        place.fail(&format!("{command} {option} {value}"), &[option, "scene.rpk is built already"]);
    };
    for command in ["render scene.rpk -o a.png", "info scene.rpk", "cast scene.rpk --rays r.npy -o h.npz"] {
        refused(command, "--preset", "best");
    }
    refused("info scene.rpk", "--memory", "1GiB");
    place.fail("info faces.ply --verify", &["--verify", "faces.ply has no checksums"]);
}

#[test]
fn build_refuses_before_it_works() {
    let place = models();
    place.fail("build nowhere.ply -o scene.ply", &["scene.ply", ".rpk"]);
    place.fail("build nowhere.ply -o no/scene.rpk", &["cannot write no/scene.rpk"]);
    place.fail("build nowhere.ply -o scene.rpk", &["cannot read nowhere.ply"]);
    place.fail("build faces.ply nowhere.obj -o scene.rpk", &["cannot read nowhere.obj"]);
    place.fail("build faces.ply -o scene.rpk --preset quick", &["--preset"]);
    place.fail("build faces.ply -o scene.rpk --json scene.rpk", &["scene.rpk is named twice"]);
    place.fail("build m.mtl -o scene.rpk", &["m.mtl", ".obj", ".ply", ".rpk"]);
    place.raypack("build -o scene.rpk").assert().code(2);
    place.succeed("build faces.ply -o scene.rpk");
    let before = place.read("scene.rpk");
    place.fail("build scene.rpk -o scene.rpk", &["scene.rpk is named twice"]);
    place.fail("build nowhere.ply -o scene.rpk", &["cannot read nowhere.ply"]);
    assert!(place.read("scene.rpk") == before, "what was there stays");
}
