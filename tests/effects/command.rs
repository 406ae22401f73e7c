//! The command line: what a user sees of effects.

use assert_cmd::Command;
use serde_json::Value;
use std::fs;
use std::ops::Range;
use std::path::{Path, PathBuf};

const CAMERA: &str = "eye=0,1.9,6.6;at=0,1.5,0;fov=48";

fn raypack() -> Command {
    Command::new(assert_cmd::cargo::cargo_bin!("raypack"))
}

/// The room that the repository holds: one thing for each effect.
fn gallery() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/gallery/gallery.obj")
}

/// Runs a command that must succeed, and gives its report and what it said beside it.
fn report(command: &mut Command) -> (Value, String) {
    let output = command.args(["--json", "-"]).assert().success().get_output().clone();
    let report = serde_json::from_slice(&output.stdout).expect("a report");
    (report, String::from_utf8(output.stderr).expect("text"))
}

/// Runs a command that must fail, and gives its one line.
fn refusal(command: &mut Command) -> String {
    let output = command.assert().failure().code(1).get_output().clone();
    let message = String::from_utf8(output.stderr).expect("text");
    assert_eq!(message.lines().count(), 1, "{message}");
    assert!(output.stdout.is_empty());
    message
}

#[test]
fn effects_are_named_with_what_calls_for_them() {
    let (report, _) = report(raypack().arg("effects").arg(gallery()).args(["--camera", CAMERA]));
    let effects = report["effects"].as_array().expect("a list");
    let on = |name: &str| {
        let call = effects.iter().find(|call| call["name"] == name).unwrap_or_else(|| panic!("{name}"));
        let callers: Vec<&str> =
            call["called_for_by"].as_array().expect("a list").iter().filter_map(Value::as_str).collect();
        (call["on"].as_bool().expect("it is or is not"), callers.join("; "))
    };
    for (name, caller) in [
        ("textures", "material floor (gallery.mtl:"),
        ("bump", "material bricks (gallery.mtl:"),
        ("cut-outs", "material leaf (gallery.mtl:"),
        ("transparency", "material veil (gallery.mtl:"),
        ("soft-shadows", "material lamp (gallery.mtl:"),
        ("reflection", "material mirror (gallery.mtl:"),
        ("glossy", "material floor (gallery.mtl:"),
        ("refraction", "material glass (gallery.mtl:"),
        ("highlights", "material wood (gallery.mtl:"),
    ] {
        let (is_on, callers) = on(name);
        assert!(is_on && callers.contains(caller), "{name}: {callers}");
    }
    for name in ["shadows", "absorption", "ambient-occlusion", "environment", "depth-of-field"] {
        assert_eq!(on(name), (false, String::new()), "{name}");
    }
    assert_eq!(report["textures"], 3);
}

#[test]
fn a_render_says_what_each_effect_cost() {
    let folder = tempfile::tempdir().expect("a folder");
    let picture = folder.path().join("gallery.png");
    let mut command = raypack();
    command.arg("render").arg(gallery()).args(["--camera", CAMERA, "--size", "48x36", "--samples", "2"]);
    let (report, _) = report(command.arg("-o").arg(&picture));
    let costs = report["costs"].as_array().expect("a list");
    let rays = |name: &str| costs.iter().find(|cost| cost["effect"] == name).map(|cost| &cost["rays"]);
    assert!(rays("reflection").and_then(Value::as_u64).expect("it ran") > 0);
    assert_eq!(rays("shadows"), None, "the lamp is no point");
    for cost in costs {
        let number = |key: &str| cost[key].as_f64().unwrap_or_else(|| panic!("{key} of {cost}"));
        let (counted, other) = match cost["effect"].as_str().expect("a name") {
            "textures" | "bump" | "smooth-normals" | "emission" | "highlights" | "fresnel" => {
                ("uses", "rays")
            }
            "antialiasing" => panic!("it was not called for"),
            _ => ("rays", "uses"),
        };
        assert!(number(counted) >= 1.0 && number(other) == 0.0, "{cost}");
        assert!(number("seconds") >= 0.0 && number("share") >= 0.0 && number("rays_per_s") >= 0.0, "{cost}");
    }
    assert!(picture.is_file());
}

#[test]
fn a_scene_file_and_a_part_of_it_give_the_same_picture() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let scene = path("gallery.rpk");
    raypack().arg("build").arg(gallery()).arg("-o").arg(&scene).assert().success();
    let picture = |from: &Path, name: &str, memory: &[&str]| {
        let mut command = raypack();
        command.arg("render").arg(from).args(["--camera", CAMERA, "--size", "48x36", "--samples", "2"]);
        command.args(memory).arg("-o").arg(path(name)).assert().success();
        fs::read(path(name)).expect("a picture")
    };
    let expected = picture(&gallery(), "model.png", &[]);
    assert!(picture(&scene, "scene.png", &[]) == expected);
    // No other tree than the model's, and no path of it: the file stands alone.
    assert!(picture(&scene, "part.png", &["--memory", "64MiB"]) == expected);
    assert!(picture(&scene, "waiting.png", &["--memory", "64MiB", "--loading", "sync"]) == expected);
}

#[test]
fn heat_is_drawn_of_effects() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("heat.pfm");
    let heat = |effect: &str, mean: Range<f64>| {
        let mut command = raypack();
        command.arg("render").arg(gallery()).args(["--camera", CAMERA, "--size", "32x24", "--samples", "2"]);
        let (report, _) = report(command.args(["--heatmap", effect]).arg("-o").arg(&file));
        assert_eq!(report["heatmap"], effect);
        let spread = &report["spread"];
        assert!(spread["greatest"].as_f64().expect("a number") >= 1.0, "{spread}");
        assert!(mean.contains(&spread["mean"].as_f64().expect("a number")), "{effect}: {spread}");
        fs::remove_file(&file).expect("it was written");
    };
    // Most pixels see no mirror, and most of what they see has a picture on it, if only by way of other surfaces.
    heat("reflection", 0.0..1.0);
    heat("textures", 1.0..9.0);
    let mut command = raypack();
    command.arg("render").arg(gallery()).args(["--heatmap", "warmth"]).arg("-o").arg(&file);
    let message = refusal(&mut command);
    assert!(message.contains("--heatmap: \"warmth\" is not one of"), "{message}");
}

#[test]
fn shadows_of_plain_scenes_are_counted_too() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = |name: &str| folder.path().join(name);
    let scene = "v -5 0 -5\nv -5 0 5\nv 5 0 5\nv 5 0 -5\nf 1 2 3 4\nv -1 1 -1\nv -1 1 1\nv 1 1 1\nf 5 6 7\n";
    fs::write(path("plain.obj"), scene).expect("written");
    let render = |heat: &[&str], to: &str| {
        let mut command = raypack();
        command.arg("render").arg(path("plain.obj")).args(["--size", "32x32", "--samples", "2"]);
        report(command.args(heat).arg("-o").arg(path(to))).0
    };
    let plain = render(&[], "plain.png");
    let [cost] = &plain["costs"].as_array().expect("a list")[..] else { panic!("{plain}") };
    assert_eq!((&cost["effect"], &cost["rays"]), (&"shadows".into(), &plain["shadow"]["rays"]));
    assert!(cost["rays"].as_u64().expect("a number") > 0);
    let heat = render(&["--heatmap", "shadows"], "heat.pfm");
    let mean = heat["spread"]["mean"].as_f64().expect("a number");
    assert_eq!((mean * 2.0 * 32.0 * 32.0).round(), cost["rays"].as_f64().expect("a number"));
}

#[test]
fn nonsense_is_refused_before_any_work() {
    let refused = |options: &[&str]| {
        refusal(raypack().arg("render").arg(gallery()).args(options).args(["-o", "never.png"]))
    };
    assert!(refused(&["--effects", "shine"]).contains("--effects: there is no \"shine\""));
    assert!(refused(&["--effects", "shadows,-bump"]).contains("--effects: "));
    assert!(refused(&["--bounces", "5000"]).contains("--bounces: 5000"));
    assert!(refused(&["--error", "2"]).contains("--error: 2"));
    assert!(refused(&["--exposure", "1000"]).contains("--exposure: 1000"));
    assert!(refused(&["--environment", "nowhere.exr"]).contains("--environment: nowhere.exr is no file"));
    assert!(!Path::new("never.png").exists());
}

#[test]
fn pictures_that_are_not_there_are_reported_once_and_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    for name in ["gallery.obj", "gallery.mtl"] {
        fs::copy(gallery().with_file_name(name), folder.path().join(name)).expect("copied");
    }
    fs::write(folder.path().join("tiles.png"), b"\x89PNG\r\n\x1a\n broken").expect("written");
    let mut command = raypack();
    command.arg("render").arg(folder.path().join("gallery.obj"));
    command.args(["--camera", CAMERA, "--size", "16x12", "--samples", "1"]);
    let (_, said) = report(command.arg("-o").arg(folder.path().join("out.png")));
    for name in ["tiles.png", "bricks.png", "leaf.png"] {
        let lines = said.lines().filter(|line| line.contains("WARN") && line.contains(name)).count();
        assert_eq!(lines, 1, "{name}: {said}");
    }
}

#[test]
fn accuracy_weighs_bounces_and_samples() {
    let mut command = raypack();
    command.arg("accuracy").arg(gallery()).args(["--camera", CAMERA, "--size", "16x12", "--rays", "camera"]);
    command.args(["--samples", "1,4", "--bounces", "0,4", "--reference-samples", "32", "--seconds", "0"]);
    command.args(["--engines", "raypack", "--oracle-rays", "64"]);
    let (report, _) = report(&mut command);
    let rows = report["frames"].as_array().expect("a list");
    assert_eq!(rows.len(), 2 * 2 * 3, "samples, bounces, modes");
    let error = |samples: u64, bounces: u64| {
        let is_it = |row: &&Value| row["samples"] == samples && row["bounces"] == bounces;
        rows.iter().find(is_it).expect("a row")["rmse"].as_f64().expect("a number")
    };
    assert!(error(4, 4) < error(1, 4), "more samples are nearer to the reference");
    assert!(error(4, 4) < error(4, 0), "and so are more bounces");
}
