//! The command line from end to end: what it prints, what it writes, and how it fails.

mod common;

use common::Place;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;

/// A roof of two slopes over a floor, with a colour for each face.
const HOUSE: &str = "ply
format ascii 1.0
element vertex 8
property float x
property float y
property float z
element face 3
property list uchar int vertex_indices
property uchar red
property uchar green
property uchar blue
end_header
-3 0 -3
3 0 -3
3 0 3
-3 0 3
-1 1 -1
1 1 -1
0 2 1
-1 1 1
4 3 2 1 0 200 200 190
3 4 6 5 220 60 50
3 4 7 6 60 90 200
";

/// A folder to run in, with a model.
fn house() -> Place {
    let place = Place::new();
    place.write("house.ply", HOUSE);
    place
}

fn dimensions(place: &Place, name: &str) -> (u32, u32) {
    image::image_dimensions(place.path(name)).expect("a picture")
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn render_writes_the_picture_and_says_what_it_did() {
    let place = house();
    let text = place.succeed("render house.ply -o out.png --size 40x30 --threads 2");
    assert_eq!(dimensions(&place, "out.png"), (40, 30));
    for expected in [
        "house.ply",
        "triangles  4 ",
        "nodes",
        "camera     1,200 rays",
        "shadow ",
        "total ",
        "2 threads",
        "beams of 1024",
        "40x30",
    ] {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    assert_eq!(place.files(), ["house.ply", "out.png"]);
}

#[test]
fn the_demo_scene_needs_no_arguments() {
    let place = house();
    let report = json(&place.succeed("render -o plant.png --size 64x36 --json -"));
    assert!(report["triangles"].as_u64().expect("a number") >= 250_000);
    assert_eq!(dimensions(&place, "plant.png"), (64, 36));
}

#[test]
fn json_on_standard_output_stands_alone() {
    let place = house();
    let report = json(
        &place.succeed("render house.ply -o out.pfm --size 8x8 --samples 2 --packet 4 --tile 3 --json -"),
    );
    assert_eq!(report["triangles"], 4);
    assert_eq!(report["camera"]["rays"], 128);
    assert_eq!((report["packet"].as_u64(), report["tile"].as_u64()), (Some(4), Some(3)));
    assert_eq!(report["frames"].as_array().map(Vec::len), Some(1));
    assert_eq!(report["read_report"]["polygons"], 1);
    assert!(report["tree"]["nodes"].as_u64() > Some(0));

    let text = place.succeed("render house.ply -o out.pfm --size 8x8 --json report.json");
    assert!(text.contains("camera "));
    assert_eq!(json(&fs::read_to_string(place.path("report.json")).expect("written"))["samples"], 1);
}

#[test]
fn every_tuning_gives_the_same_file() {
    let place = house();
    place.succeed("render house.ply -o a.exr --size 33x21 --threads 1 --packet 1 --tile 1024");
    let expected = fs::read(place.path("a.exr")).expect("written");
    for tuning in [
        "--threads 3 --packet 4 --tile 5",
        "--threads 0 --packet 8",
        "--pin --packet 16 --tile 1",
        "--pools --packet 64",
    ] {
        place.succeed(&format!("render house.ply -o b.exr --size 33x21 {tuning}"));
        assert!(fs::read(place.path("b.exr")).expect("written") == expected, "{tuning}");
    }
    let mut portable = place.raypack("render house.ply -o b.exr --size 33x21");
    portable.env("RAYPACK_ISA", "portable").assert().success().stdout(predicate::str::contains("portable"));
    assert!(fs::read(place.path("b.exr")).expect("written") == expected);
}

#[test]
fn every_accuracy_renders_and_is_reported() {
    let place = house();
    for accuracy in ["fast", "watertight", "exact"] {
        let arguments = format!("render house.ply -o {accuracy}.png --size 40x30 --accuracy {accuracy}");
        let text = place.succeed(&arguments);
        assert!(text.contains(&format!(", {accuracy}, ")), "{text}");
        let report = json(&place.succeed(&format!("{arguments} --json -")));
        assert_eq!(report["accuracy"], accuracy);
    }
    let report = json(&place.succeed("render house.ply -o default.png --size 40x30 --json -"));
    assert_eq!(report["accuracy"], "watertight");
}

#[test]
fn depth_and_normals_come_on_request() {
    let place = house();
    let camera = "--camera eye=0,5,0;at=0,0,0;fov=20";
    place.succeed(&format!("render house.ply -o c.png {camera} --size 5x5 --depth d.exr --normals n.exr"));
    let middle = |name| image::open(place.path(name)).expect("a picture").to_rgb32f().get_pixel(2, 2).0;
    // Straight down onto the ridge between the slopes, 3.5 below.
    assert!((middle("d.exr")[0] - 3.5).abs() < 1e-5, "{:?}", middle("d.exr"));
    let [x, y, z] = middle("n.exr");
    assert!((x * x + y * y + z * z - 1.0).abs() < 1e-5 && y > 0.5);
}

#[test]
fn an_orbit_is_a_numbered_row_of_pictures() {
    let place = house();
    let text = place.succeed("render house.ply -o o.png --size 12x12 --orbit 3 --step 30 --depth o.pfm");
    assert_eq!(
        place.files(),
        ["house.ply", "o_000.pfm", "o_000.png", "o_001.pfm", "o_001.png", "o_002.pfm", "o_002.png"]
    );
    assert!(text.contains("time ms") && text.contains("median") && text.contains("o_002.png"), "{text}");
    let read = |name| fs::read(place.path(name)).expect("written");
    assert_ne!(read("o_000.png"), read("o_001.png"));
}

#[test]
fn an_old_picture_is_replaced() {
    let place = house();
    place.write("out.png", "something old");
    place.succeed("render house.ply -o out.png --size 4x4");
    assert_eq!(dimensions(&place, "out.png"), (4, 4));
}

#[test]
fn a_camera_may_be_a_file() {
    let place = house();
    place.write("camera.toml", "eye = [4, 3, 2]\nat = [0, 1, 0]\nfov = 50\n");
    place.succeed("render house.ply -o a.png --size 16x16 --camera camera.toml");
    place.succeed("render house.ply -o b.png --size 16x16 --camera eye=4,3,2;at=0,1,0;fov=50");
    assert_eq!(fs::read(place.path("a.png")).expect("a"), fs::read(place.path("b.png")).expect("b"));
}

#[test]
fn info_says_what_is_in_a_model() {
    let place = house();
    let text = place.succeed("info house.ply --validate");
    for expected in
        ["triangles  4 with 8 vertices", "bounds", "-3,0,-3 to 3,2,3", "per triangle", "memory", "valid "]
    {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    let report = json(&place.succeed("info house.ply --json -"));
    assert_eq!(report["bounds"][1], serde_json::json!([3.0, 2.0, 3.0]));
    assert_eq!(report["memory"]["indices"], 48);
    assert_eq!(report["validated"], false);
}

#[test]
fn materials_of_an_obj_are_listed() {
    let place = house();
    place.write("m.mtl", "newmtl brick\nKd 0.5 0.1 0.1\nnewmtl spare\nKd 1 1 1\n");
    place.write("m.obj", "mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl brick\nf 1 2 3\n");
    let text = place.succeed("info m.obj");
    assert!(text.contains("brick") && text.contains("1 triangle"), "{text}");
    place.succeed("render m.obj -o m.png --size 9x9");
}

#[test]
fn a_generated_plant_comes_back() {
    let place = house();
    place.succeed("generate plant --triangles 12k --seed 3 -o plant.ply");
    let report = json(&place.succeed("info plant.ply --json -"));
    let triangles = report["triangles"].as_f64().expect("a number");
    assert!((triangles / 12_000.0 - 1.0).abs() < 0.05, "{triangles}");
}

#[test]
fn a_profile_sets_what_the_options_leave_open() {
    let place = house();
    fs::create_dir(place.path("profiles")).expect("created");
    place.write("profiles/mine.toml", "[render]\npacket = 4\ntile = 8\nthreads = 3\n");
    let report =
        json(&place.succeed("render house.ply -o a.png --size 9x9 --profile mine --tile 5 --json -"));
    let number = |key: &str| report[key].as_u64();
    assert_eq!((number("packet"), number("tile"), number("threads")), (Some(4), Some(5), Some(3)));
    assert_eq!(report["profile"], "mine");
    place.succeed("render house.ply -o a.png --size 9x9 --profile profiles/mine.toml");
    place.succeed("render house.ply -o a.png --size 9x9 --profile default");
}

#[test]
#[cfg(unix)]
fn a_closed_pipe_is_no_failure() {
    use std::process::Stdio;
    let place = house();
    let mut child = place
        .process("info house.ply")
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .expect("started");
    drop(child.stdout.take());
    let output = child.wait_with_output().expect("ended");
    assert_eq!(String::from_utf8_lossy(&output.stderr), "");
    assert!(output.status.success());
}

#[test]
fn a_command_line_without_sense_is_a_usage_error() {
    let place = house();
    for arguments in [
        "",
        "rander house.ply",
        "render house.ply",
        "render house.ply -o a.png --sice 3x3",
        "render house.ply -o a.png --samples x",
        "render house.ply -o a.png --samples -1",
        "render house.ply -o a.png --step 2",
        "info",
        "generate castle -o a.ply",
    ] {
        place.raypack(arguments).assert().code(2).stdout("").stderr(predicate::str::is_empty().not());
    }
    assert_eq!(place.files(), ["house.ply"]);
    place.raypack("--version").assert().success().stdout(predicate::str::contains(env!("CARGO_PKG_VERSION")));
}

mod bad_input {
    use super::*;

    /// `render` and `info` refuse a model alike.
    fn refused(place: &Place, model: &str, expected: &[&str]) {
        place.fail(&format!("render {model} -o out.png --size 8x8"), expected);
        place.fail(&format!("info {model}"), expected);
    }

    #[test]
    fn missing_file() {
        refused(&house(), "nowhere.ply", &["cannot read nowhere.ply"]);
    }

    #[test]
    fn wrong_ending() {
        let place = house();
        place.write("model.txt", HOUSE);
        refused(&place, "model.txt", &["model.txt", "(.txt)", ".obj", ".ply"]);
    }

    #[test]
    fn a_folder_is_no_model() {
        let place = house();
        fs::create_dir(place.path("folder.ply")).expect("created");
        refused(&place, "folder.ply", &["cannot read folder.ply"]);
    }

    #[test]
    fn truncated_ply() {
        let place = house();
        for length in [HOUSE.len() - 40, HOUSE.len() / 2, 30, 0] {
            place.write("cut.ply", &HOUSE[..length]);
            refused(&place, "cut.ply", &["cut.ply: "]);
        }
    }

    #[test]
    fn index_out_of_range() {
        let place = house();
        place.write("far.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 9\n");
        refused(&place, "far.obj", &["far.obj: ", "9"]);
        place.write("far.ply", HOUSE.replace("3 4 7 6 60", "3 4 8 6 60"));
        refused(&place, "far.ply", &["far.ply: ", "8"]);
    }

    #[test]
    fn vertices_that_are_not_finite() {
        let place = house();
        for bad in ["nan", "inf", "-inf", "1e39"] {
            place.write("bad.ply", HOUSE.replace("0 2 1\n", &format!("0 {bad} 1\n")));
            refused(&place, "bad.ply", &["bad.ply: "]);
            place.write("bad.obj", format!("v 0 0 0\nv 1 {bad} 0\nv 0 1 0\nf 1 2 3\n"));
            refused(&place, "bad.obj", &["bad.obj: "]);
        }
    }

    #[test]
    fn no_triangles() {
        let place = house();
        place.write("points.obj", "v 0 0 0\nv 1 0 0\n");
        refused(&place, "points.obj", &["points.obj: ", "no triangles"]);
        place.write("empty.obj", "");
        refused(&place, "empty.obj", &["empty.obj: ", "no triangles"]);
    }

    #[test]
    fn output_that_cannot_be_written() {
        let place = house();
        fs::create_dir(place.path("folder.png")).expect("created");
        for (output, expected) in [("no/such/out.png", "no/such/out.png"), ("folder.png", "folder.png")] {
            place.fail(&format!("render house.ply -o {output}"), &["cannot write", expected]);
        }
        place.fail("render house.ply -o out.png --depth no/d.exr", &["cannot write no/d.exr"]);
        place.fail("render house.ply -o out.png --json no/r.json", &["cannot write no/r.json"]);
        place.fail("info house.ply --json no/r.json", &["cannot write no/r.json"]);
        place.fail("generate plant -o no/plant.ply", &["cannot write no/plant.ply"]);
    }

    #[test]
    fn output_of_an_unknown_kind() {
        let place = house();
        for output in ["out.jpg", "out", "out."] {
            place.fail(&format!("render house.ply -o {output}"), &[output, ".png, .exr or .pfm"]);
        }
        place.fail("render house.ply -o out.png --normals n.txt", &["n.txt"]);
        place.fail("generate plant -o plant.obj", &["plant.obj", ".ply"]);
    }

    #[test]
    fn outputs_that_would_overwrite_one_another() {
        let place = house();
        place.fail("render house.ply -o a.png --depth a.png", &["a.png is named twice"]);
        place.fail("render house.ply -o a.png --json a.png", &["a.png is named twice"]);
        place.fail("generate plant -o a.ply --json a.ply", &["--json"]);
    }

    #[test]
    fn zero_or_absurd_sizes() {
        let place = house();
        for size in ["0x8", "8x0", "40000x8", "99999999999999999999x8", "32768x32768", "8", "-8x8", "axb"] {
            place.fail(&format!("render house.ply -o a.png --size {size}"), &["--size", size]);
        }
    }

    #[test]
    fn options_without_sense() {
        let place = house();
        for (option, expected) in [
            ("--samples 0", "--samples: 0"),
            ("--tile 0", "--tile: 0"),
            ("--tile 1025", "--tile: 1025"),
            ("--threads 1025", "--threads: 1025"),
            ("--accuracy precise", "--accuracy: \"precise\" is not one of fast, watertight, exact"),
            ("--packet 5", "--packet: 5 is not one of 1, 4, 8, 16, 64, 256, 1024, 4096"),
            ("--orbit 0", "--orbit: 0"),
            ("--orbit 4 --step inf", "--step: inf"),
            ("--camera eye=1,2,3", "--camera: at is missing"),
            ("--camera eye=0,0,0;at=0,0,0", "--camera: eye and at"),
            ("--camera eye=0,0,9;at=0,0,0;fov=0", "--camera: fov=0"),
            ("--camera nowhere.toml", "nowhere.toml"),
            ("--profile nowhere", "--profile: there is no profiles/nowhere.toml"),
        ] {
            place.fail(&format!("render house.ply -o a.png {option}"), &[expected]);
        }
        place.fail("generate plant -o a.ply --triangles 12", &["--triangles: \"12\""]);
        place.fail("generate plant -o a.ply --triangles 201M", &["--triangles: \"201M\"", "200,000,000"]);
        let mut command = place.raypack("render house.ply -o a.png");
        command.env("RAYPACK_ISA", "sse9");
        place.fail_with(command, "RAYPACK_ISA=sse9", &["RAYPACK_ISA", "portable"]);
    }

    #[test]
    fn profiles_without_sense() {
        let place = house();
        for (text, expected) in [
            ("[render]\ntyle = 3\n", "p.toml: line 2: unknown field `tyle`"),
            ("[render]\ntile = 0\n", "p.toml: render.tile: 0"),
            ("[build]\nbins = 1\n", "p.toml: build.bins"),
            ("[render\n", "p.toml: line 1"),
        ] {
            place.write("p.toml", text);
            place.fail("render house.ply -o a.png --profile p.toml", &[expected]);
            place.fail("info house.ply --profile p.toml", &[expected]);
        }
    }

    #[test]
    fn nothing_is_read_before_the_options_are_checked() {
        // The model does not exist, but it is the output that is complained about.
        house().fail("render nowhere.ply -o a.jpg", &["a.jpg"]);
    }

    #[test]
    fn what_was_there_before_stays() {
        let place = house();
        place.write("out.png", "precious");
        place.fail("render nowhere.ply -o out.png", &["nowhere.ply"]);
        assert_eq!(fs::read_to_string(place.path("out.png")).expect("there"), "precious");
    }

    #[test]
    fn a_broken_file_is_never_half_a_model() {
        let place = house();
        place.write("bad.ply", HOUSE.replace("format ascii 1.0", "format binary_little_endian 1.0"));
        refused(&place, "bad.ply", &["bad.ply: "]);
    }
}
