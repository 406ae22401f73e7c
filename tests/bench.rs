//! `raypack bench` end to end: what its reports hold, and what it says of bad options.

#![cfg(all(feature = "cli", feature = "peers"))]

use assert_cmd::Command;
use predicates::prelude::*;
use raypack::traverse::Kernel;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with a model of two walls at right angles and a floor.
fn model() -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("corner.obj");
    let text = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nv 4 0 4\nv 4 4 0\nv 0 4 4\n\
                f 1 2 6 3\nf 1 4 5 2\nf 1 3 7 4\n";
    fs::write(&path, text).unwrap();
    (folder, path)
}

fn bench(model: &PathBuf) -> Command {
    let mut command = Command::cargo_bin("raypack").unwrap();
    command.arg("bench").arg(model).env_remove("RAYPACK_EMBREE").env_remove("RAYPACK_ISA");
    command.args(["--size", "32", "--rounds", "3", "--seconds", "0"]);
    command.args(["--camera", "eye=9,8,7;at=1,1,1;fov=50"]);
    command
}

/// raypack's modes: its kernels, and the two choices among them.
const MODES: usize = Kernel::ALL.len() + 2;

#[test]
fn the_json_has_a_row_for_every_kernel_kind_and_thread_count() {
    let (folder, model) = model();
    let file = folder.path().join("report.json");
    let run = bench(&model)
        .args(["--engines", "raypack,obvhs", "--threads", "2", "--all-modes"])
        .arg("--json")
        .arg(&file)
        .assert();
    run.success().stdout(predicate::str::contains("raypack : obvhs"));
    let report: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(report["header"]["triangles"], 6);
    let rows = report["rows"].as_array().unwrap();
    for rays in ["camera", "shadow", "diffuse", "ao", "random"] {
        for threads in [1, 2] {
            let of = |engine: &str| {
                let matches =
                    |r: &&Value| r["engine"] == engine && r["rays"] == rays && r["threads"] == threads;
                rows.iter().filter(matches).count()
            };
            assert_eq!((of("raypack"), of("obvhs")), (MODES, 4), "{rays}, {threads} threads");
        }
    }
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"));
        assert!(0.0 < number("low") && number("low") <= number("mrays_per_s"), "{row}");
        assert!(number("mrays_per_s") <= number("high") && number("hits") <= number("count"), "{row}");
        assert_eq!(row.get("accuracy").is_some(), row["engine"] == "raypack", "{row}");
        assert!(row["mode"].is_string() && row["isa"].is_string() && number("bytes") > 0.0, "{row}");
    }
    for agreement in report["agreements"].as_array().unwrap() {
        assert_eq!(agreement["disagreements"], 0, "{agreement}");
    }
}

#[test]
fn where_rays_went_is_told_of_modes_that_choose() {
    let (_folder, model) = model();
    let options = ["--engines", "raypack", "--rays", "camera,diffuse", "--threads", "2"];
    let run = bench(&model).args(options).args(["--json", "-"]).assert();
    let report: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
    let choices = report["choices"].as_array().unwrap();
    let told: Vec<_> = choices.iter().map(|told| [&told["rays"], &told["mode"]]).collect();
    assert_eq!(told, [["camera", "auto"], ["camera", "mixed"], ["diffuse", "auto"], ["diffuse", "mixed"]]);
    for told in choices {
        let is_row = |row: &&Value| row["rays"] == told["rays"] && row["mode"] == told["mode"];
        let rows: Vec<&Value> = report["rows"].as_array().unwrap().iter().filter(is_row).collect();
        let timed: u64 =
            rows.iter().map(|row| row["count"].as_u64().unwrap() * row["rounds"].as_u64().unwrap()).sum();
        let kernels = told["kernels"].as_array().unwrap();
        let went: u64 = kernels.iter().map(|share| share["rays"].as_u64().unwrap()).sum();
        assert!(rows.len() == 2 && went > timed, "{told}: of {timed} and what warms up");
        assert!(kernels.iter().all(|share| share["kernel"].is_string() && share["rays"] != 0), "{told}");
    }
    // A named kernel has no choice.
    let run = bench(&model).args(options).args(["--modes", "tile,packet16"]).assert();
    run.success().stdout(predicate::str::contains("raypack chooses").not());
    let run = bench(&model).args(options).args(["--modes", "tile,auto"]).assert();
    run.success().stdout(predicate::str::is_match("raypack chooses\n\nrays +mode").unwrap());
}

#[test]
fn json_on_standard_output_is_nothing_but_json() {
    let (_folder, model) = model();
    let run = bench(&model)
        .args(["--engines", "raypack", "--rays", "camera", "--threads", "1", "--json", "-"])
        .assert();
    let report: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
    let modes: Vec<&str> =
        report["rows"].as_array().unwrap().iter().map(|row| row["mode"].as_str().unwrap()).collect();
    let kernels = Kernel::ALL.iter().map(|kernel| kernel.name());
    assert_eq!(modes, kernels.chain(["auto", "mixed"]).collect::<Vec<_>>());
    let beams = report["beams"].as_array().unwrap();
    assert!(beams[0]["rays"] == "camera" && beams[0]["counts"]["nodes"].as_u64() > Some(0), "{beams:?}");
}

#[test]
fn kernels_can_be_given_rays_in_a_row() {
    let (_folder, model) = model();
    let options = ["--engines", "raypack", "--rays", "camera,shadow", "--threads", "1", "--slices"];
    let run = bench(&model).args(options).args(["--json", "-"]).assert();
    let report: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
    assert_eq!(report["header"]["slices"], true);
    let rows = report["rows"].as_array().unwrap();
    let modes = rows.iter().map(|row| row["mode"].as_str().unwrap());
    let kernels = Kernel::ALL.iter().map(|kernel| kernel.name()).chain(["mixed"]);
    assert!(modes.eq(kernels.clone().chain(kernels)), "{rows:?}");
    assert!(
        rows.iter()
            .all(|row| row["hits"] == rows[if row["rays"] == "camera" { 0 } else { MODES - 1 }]["hits"])
    );
    let run = bench(&model).args(options).assert();
    run.success().stdout(predicate::str::contains("all kernels are given rays in a row"));
    let run = bench(&model).args(options).args(["--modes", "tile,auto"]).assert();
    run.failure().code(1).stderr(predicate::str::contains("--slices: auto takes squares of a picture"));
}

#[test]
fn pools_are_counted_with_the_tree() {
    let (_folder, model) = model();
    let options = ["--engines", "raypack", "--rays", "random", "--threads", "1", "--json", "-"];
    let report = |more: &[&str]| -> Value {
        let run = bench(&model).args(options).args(more).assert();
        serde_json::from_slice(&run.success().get_output().stdout).unwrap()
    };
    let [without, with] = [report(&[]), report(&["--pools"])];
    assert_eq!((&without["header"]["pools"], &with["header"]["pools"]), (&false.into(), &true.into()));
    let bytes = |report: &Value| report["rows"][0]["bytes"].as_u64().unwrap();
    assert!(bytes(&with) > bytes(&without));
    for (a, b) in with["rows"].as_array().unwrap().iter().zip(without["rows"].as_array().unwrap()) {
        assert_eq!((&a["mode"], &a["hits"]), (&b["mode"], &b["hits"]));
    }
    let refused = bench(&model).args(options).args(["--pools", "--accuracy", "fast"]).assert();
    refused.failure().code(1).stderr(predicate::str::contains("--pools: --accuracy fast has no use"));
}

#[test]
fn every_accuracy_can_be_raced() {
    let (_folder, model) = model();
    for accuracy in ["fast", "watertight", "exact"] {
        let run = bench(&model)
            .args(["--engines", "raypack", "--rays", "camera,ao", "--threads", "1", "--accuracy", accuracy])
            .args(["--json", "-"])
            .assert();
        let report: Value = serde_json::from_slice(&run.success().get_output().stdout).unwrap();
        assert_eq!(report["header"]["accuracy"], accuracy);
        let rows = report["rows"].as_array().unwrap();
        assert!(rows.len() == 2 * MODES && rows.iter().all(|row| row["accuracy"] == accuracy));
    }
    let run = bench(&model).args(["--engines", "raypack", "--rays", "camera", "--threads", "1"]).assert();
    run.success().stdout(predicate::str::contains("raypack's accuracy: watertight"));
}

#[test]
fn bad_options_are_one_line_and_leave_no_report() {
    let (folder, model) = model();
    let file = folder.path().join("report.json");
    for (option, value, said) in [
        ("--engines", "raypack,optix", "--engines"),
        ("--rays", "camera,primary", "--rays"),
        ("--size", "32x16", "--size"),
        ("--camera", "eye=1", "--camera"),
        ("--accuracy", "precise", "--accuracy: \"precise\""),
        ("--profile", "no-such-profile", "no-such-profile"),
        ("--preset", "quick", "--preset: \"quick\" is not one of preview, standard, best"),
        ("--memory", "1KiB", "--memory: the model takes"),
    ] {
        let mut command = Command::cargo_bin("raypack").unwrap();
        let run = command.arg("bench").arg(&model).args([option, value]).arg("--json").arg(&file).assert();
        run.failure()
            .code(1)
            .stderr(predicate::str::contains(said).and(predicate::str::is_match("^[^\n]+\n$").unwrap()));
        assert!(!file.exists());
    }
}

#[test]
fn builds_are_measured_in_every_preset() {
    let (folder, model) = model();
    let file = folder.path().join("report.json");
    let profile = folder.path().join("mine.toml");
    fs::write(&profile, "[build]\npreset = \"preview\"\nmin_leaf = 3\n").unwrap();
    let run = bench(&model)
        .args(["--build", "--build-rounds", "2", "--engines", "raypack,obvhs", "--rays", "camera,ao"])
        .arg("--profile")
        .arg(&profile)
        .arg("--json")
        .arg(&file)
        .assert();
    run.success().stdout(predicate::str::contains("Mtris/s").and(predicate::str::contains("camera steps")));
    let report: Value = serde_json::from_str(&fs::read_to_string(&file).unwrap()).unwrap();
    assert_eq!(report["header"]["triangles"], 6);
    let rows = report["rows"].as_array().unwrap();
    let modes = |engine: &str| -> Vec<&str> {
        let of_engine = rows.iter().filter(|row| row["engine"] == engine);
        of_engine.map(|row| row["mode"].as_str().unwrap()).collect()
    };
    assert_eq!(modes("raypack"), ["preview", "standard", "best", "profile"]);
    assert_eq!(modes("obvhs").len(), 4);
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"));
        assert!(0.0 < number("low") && number("low") <= number("seconds"), "{row}");
        assert!(number("seconds") <= number("high") && number("rounds") == 2.0, "{row}");
        assert!(number("mtriangles_per_s") > 0.0 && number("bytes_per_triangle") > 0.0, "{row}");
        let rays = row["rays"].as_array().unwrap();
        assert_eq!(rays.len(), 2, "{row}");
        for rate in rays {
            assert!(rate["mrays_per_s"].as_f64().unwrap() > 0.0, "{row}");
            assert_eq!(rate["tests"].is_number(), row["engine"] == "raypack", "{row}");
        }
        if row["engine"] == "raypack" {
            assert!(number("counted_peak_bytes") <= number("announced_peak_bytes"), "{row}");
            assert!(number("counted_peak_bytes") >= number("bytes") && number("sah_cost") > 0.0, "{row}");
        }
    }
    for agreement in report["agreements"].as_array().unwrap() {
        assert_eq!(agreement["disagreements"], 0, "{agreement}");
    }
}

#[test]
fn an_embree_that_is_not_where_it_is_said_to_be_is_an_error() {
    let (folder, model) = model();
    let run =
        bench(&model).env("RAYPACK_EMBREE", folder.path()).args(["--engines", "raypack,embree"]).assert();
    run.failure().code(1).stderr(predicate::str::contains("RAYPACK_EMBREE"));
}

fn scaling() -> Command {
    let mut command = Command::cargo_bin("raypack").unwrap();
    command.arg("scaling").env_remove("RAYPACK_EMBREE").env_remove("RAYPACK_ISA");
    command.args(["--engines", "raypack,obvhs", "--modes", "stream,packet8", "--rays", "random"]);
    command.args(["--size", "16", "--rounds", "1"]);
    command
}

#[test]
fn the_growth_of_a_rays_time_is_measured_and_drawn() {
    let folder = tempfile::tempdir().unwrap();
    let [json, plot] = ["report.json", "plot.svg"].map(|name| folder.path().join(name));
    let run =
        scaling().args(["--triangles", "10k,15k"]).arg("--json").arg(&json).arg("--plot").arg(&plot).assert();
    run.success().stdout(predicate::str::contains("greatest plant beside smallest: raypack "));
    let report: Value = serde_json::from_str(&fs::read_to_string(&json).unwrap()).unwrap();
    let steps = report["steps"].as_array().unwrap();
    assert_eq!(steps.len(), 2);
    for (step, wanted) in steps.iter().zip([10e3, 15e3]) {
        let triangles = step["triangles"].as_f64().unwrap();
        assert!((triangles / wanted - 1.0).abs() < 0.05, "{triangles}");
        let times = step["times"].as_array().unwrap();
        assert_eq!(times.iter().map(|time| &time["engine"]).collect::<Vec<_>>(), ["raypack", "obvhs"]);
        assert!(times.iter().all(|time| time["ns_per_ray"].as_f64().unwrap() > 0.0));
    }
    let text = fs::read_to_string(&plot).unwrap();
    assert!(text.contains("random rays") && text.contains("obvhs") && text.contains("ns a ray"));
}

#[test]
fn sizes_that_make_no_sense_are_named() {
    for (options, message) in [
        (["--triangles", "9999"], "--triangles: \"9999\" is not a number"),
        (["--triangles", "20k,10k"], "--triangles: 20000 does not grow to 10000"),
        (["--engines", "obvhs"], "--engines: raypack must be among them"),
        (["--modes", "best"], "--modes: \"best\" is not one of"),
        (["--rounds", "0"], "--rounds: 0 rounds measure nothing"),
        (["--plot", "plot.txt"], "plot.txt: unknown kind of file (.txt); a plot is a .svg or .png file"),
    ] {
        let mut command = Command::cargo_bin("raypack").unwrap();
        let run = command.arg("scaling").args(options).assert();
        run.failure().stderr(predicate::str::contains(message)).stdout("");
    }
}
