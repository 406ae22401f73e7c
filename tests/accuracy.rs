//! `raypack accuracy` end to end: what its reports and plots hold, what it picks, and what it refuses.

#![cfg(feature = "cli")]

use assert_cmd::Command;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder to run in, with a model: a room's corner and a box in it.
struct Place {
    folder: TempDir,
}

const MODEL: &str = "v 0 0 0\nv 4 0 0\nv 0 4 0\nv 0 0 4\nv 4 0 4\nv 4 4 0\nv 0 4 4\n\
                     v 1 0.5 1\nv 2 0.5 1\nv 2 0.5 2\nv 1 0.5 2\nv 1 1.5 1\nv 2 1.5 1\nv 2 1.5 2\nv 1 1.5 2\n\
                     f 1 2 6 3\nf 1 4 5 2\nf 1 3 7 4\n\
                     f 8 9 10 11\nf 12 15 14 13\nf 8 12 13 9\nf 10 14 15 11\nf 9 13 14 10\nf 8 11 15 12\n";

impl Place {
    fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("corner.obj"), MODEL).unwrap();
        Self { folder }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// The command, with few rays, small pictures and no rivals.
    fn accuracy(&self, arguments: &str) -> Command {
        let mut command = Command::cargo_bin("raypack").unwrap();
        command.current_dir(self.folder.path()).env_remove("RAYPACK_EMBREE").env_remove("RAYPACK_ISA");
        command.args(["accuracy", "corner.obj", "--camera", "eye=9,8,7;at=1,1,1;fov=50"]);
        command.args(["--engines", "raypack", "--rounds", "3", "--seconds", "0", "--threads", "2"]);
        command.args(arguments.split_whitespace());
        command
    }

    fn report(&self, arguments: &str) -> Value {
        let run = self.accuracy(&format!("{arguments} --json -")).assert().success().stderr("");
        serde_json::from_slice(&run.get_output().stdout).unwrap()
    }

    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).unwrap();
        let mut names: Vec<String> =
            entries.map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned()).collect();
        names.sort();
        names
    }
}

fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or_else(|| panic!("{key} of {row}"))
}

#[test]
fn the_json_has_a_row_for_every_mode_and_kind_and_for_every_setting() {
    let place = Place::new();
    let report = place.report("--size 48x32 --samples 1,4 --oracle-rays 500");
    let header = &report["header"];
    assert_eq!((&header["triangles"], &header["threads"]), (&18.into(), &2.into()));
    assert_eq!((&header["default"], &header["oracle_rays"]), (&"watertight".into(), &500.into()));
    for key in ["model", "machine", "isa", "raypack", "build", "date", "camera"] {
        assert!(header[key].is_string(), "{key} of {header}");
    }

    let rows = report["rays"].as_array().unwrap();
    let modes = ["fast", "watertight", "exact"];
    assert_eq!(rows.len(), 5 * modes.len());
    for (i, kind) in ["camera", "shadow", "diffuse", "ao", "random"].into_iter().enumerate() {
        let of_kind = &rows[i * modes.len()..][..modes.len()];
        for (row, mode) in of_kind.iter().zip(modes) {
            assert_eq!((&row["rays"], &row["mode"]), (&kind.into(), &mode.into()));
            assert_eq!((&row["engine"], &row["threads"]), (&"raypack".into(), &2.into()));
            assert_eq!(row["default"], mode == "watertight");
            assert!(row["kernel"].is_string() && row["isa"].is_string());
            let (low, ns, high) = (number(row, "ns_low"), number(row, "ns_per_ray"), number(row, "ns_high"));
            assert!(0.0 < low && low <= ns && ns <= high, "{row}");
            assert!((ns * number(row, "mrays_per_s") / 1e3 - 1.0).abs() < 1e-9, "{row}");
            let checked = number(&row["errors"], "count");
            assert_eq!(checked, number(row, "count").min(500.0), "{row}");
            let total: f64 =
                ["missed", "false_hits", "wrong_primitive"].iter().map(|e| number(&row["errors"], e)).sum();
            assert!((number(&row["per_million"], "total") - total * 1e6 / checked).abs() < 1e-6, "{row}");
        }
        assert!(of_kind.iter().any(|row| row["pareto"] == true), "{kind}");
        // Exact is exact.
        assert_eq!(number(&of_kind[2]["per_million"], "total"), 0.0, "{kind}");
    }

    assert_eq!(
        (&report["reference"]["accuracy"], &report["reference"]["samples"]),
        (&"exact".into(), &64.into())
    );
    let frames = report["frames"].as_array().unwrap();
    assert_eq!(frames.len(), 2 * modes.len());
    for (i, samples) in [1, 4].into_iter().enumerate() {
        for (row, mode) in frames[i * modes.len()..].iter().zip(modes) {
            assert_eq!((&row["accuracy"], &row["samples"]), (&mode.into(), &samples.into()));
            assert_eq!(row["default"], mode == "watertight" && samples == 1);
            assert_eq!(row["size"], serde_json::json!({ "width": 48, "height": 32 }));
            assert!(number(row, "rays") >= f64::from(48 * 32 * samples));
            assert!(0.0 < number(row, "ms_low") && number(row, "ms_low") <= number(row, "ms"));
            let rmse = number(row, "rmse");
            assert!(0.0 < rmse && (number(row, "psnr") + 20.0 * rmse.log10()).abs() < 1e-9, "{row}");
            assert!(number(row, "ssimulacra2") < 100.0);
        }
        // More samples come nearer to the reference.
        assert!(number(&frames[0], "rmse") > number(&frames[modes.len()], "rmse"));
    }
    assert!(report.get("within").is_none());
}

#[test]
fn the_picture_of_the_reference_has_no_error() {
    let place = Place::new();
    let report = place.report("--size 16x16 --rays random --samples 4 --reference-samples 4");
    let exact = &report["frames"][2];
    assert_eq!((number(exact, "rmse"), number(exact, "ssimulacra2")), (0.0, 100.0));
    assert!(exact["psnr"].is_null());
}

#[test]
fn the_text_says_what_the_figures_belong_to() {
    let place = Place::new();
    let run = place.accuracy("--size 16x16 --rays camera,ao --samples 1").assert().success();
    let text = String::from_utf8(run.get_output().stdout.clone()).unwrap();
    for expected in [
        "corner.obj: 18 triangles",
        "16x16",
        "2 threads of",
        concat!("raypack ", env!("CARGO_PKG_VERSION"), " ("),
        "seed 1",
        "errors/M",
        "watertight",
        "exact, 16 samples per pixel",
        "SSIMULACRA2",
    ] {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    assert_eq!(place.files(), ["corner.obj"]);
}

#[test]
fn plots_are_pictures() {
    let place = Place::new();
    let few = "--size 16x16 --rays camera,shadow --samples 1,2";
    place.accuracy(&format!("{few} --plot plot.svg --json report.json")).assert().success();
    let svg = place.read("plot.svg");
    assert!(svg.starts_with("<svg ") && svg.trim_end().ends_with("</svg>"), "{svg}");
    for expected in [
        "What accuracy costs: corner.obj",
        "18 triangles",
        "2 threads",
        "camera rays",
        "shadow rays",
        "ns per ray",
        "ms per frame",
        "watertight",
        "exact",
        "fast",
        "2 spp",
    ] {
        assert!(svg.contains(expected), "\"{expected}\" is not in the plot");
    }
    assert!(!svg.contains("diffuse rays") && !svg.contains("Embree"));
    let report: Value = serde_json::from_str(&place.read("report.json")).unwrap();
    assert_eq!(report["rays"].as_array().unwrap().len(), 6);

    place.accuracy(&format!("{few} --plot plot.PNG")).assert().success();
    let png = image::load_from_memory(&fs::read(place.path("plot.PNG")).unwrap()).unwrap().to_rgb8();
    assert!(png.width() > 1000 && png.height() > 700);
    let dark = png.pixels().filter(|p| p.0.iter().all(|&c| c < 110)).count();
    assert!(dark > 2000, "text and lines are drawn: {dark} dark pixels");
    assert_eq!(place.files(), ["corner.obj", "plot.PNG", "plot.svg", "report.json"]);
}

#[test]
fn within_picks_the_most_accurate_that_fits() {
    let place = Place::new();
    let few = "--size 16x16 --rays random --oracle-rays 10";
    let report = place.report(&format!("{few} --samples 1,4 --within 100s"));
    let within = &report["within"];
    assert_eq!((&within["fits"], &within["next"]), (&true.into(), &Value::Null));
    assert_eq!((&within["picked"]["accuracy"], &within["picked"]["samples"]), (&"exact".into(), &4.into()));
    assert!(number(&within["picked"], "ms") <= number(within, "budget_ms"));

    let report = place.report(&format!("{few} --samples 1,4 --within 0.001us"));
    let within = &report["within"];
    assert_eq!(within["fits"], false);
    // Whichever that was in this run: frames of 16 by 16 take so little that noise may decide.
    let frames = report["frames"].as_array().unwrap().iter();
    let quickest = frames.min_by(|a, b| number(a, "ms").total_cmp(&number(b, "ms"))).unwrap();
    for key in ["accuracy", "samples"] {
        assert_eq!(within["picked"][key], quickest[key], "{key}");
    }
    assert!(number(&within["picked"], "ms") > number(within, "budget_ms"));

    let run = place.accuracy(&format!("{few} --samples 1 --within 0.001us")).assert().success();
    run.stdout(predicate::str::contains("nothing fits; the quickest is --accuracy"));
    let run = place.accuracy(&format!("{few} --samples 1 --within 100s")).assert().success();
    run.stdout(predicate::str::contains("gave up: nothing"));
}

#[test]
fn what_makes_no_sense_is_refused_in_one_line_and_leaves_nothing() {
    let place = Place::new();
    for (arguments, said) in [
        ("--plot plot.jpg", "plot.jpg: unknown kind of file (.jpg); a plot is a .svg or .png file"),
        ("--plot no/plot.svg", "cannot write no/plot.svg"),
        ("--plot same.svg --json same.svg", "--plot: this is the report's file too"),
        ("--json no/report.json", "cannot write no/report.json"),
        ("--within 33", "--within: \"33\" is not a time"),
        ("--within -1ms", "--within: \"-1ms\" is not a time"),
        ("--samples 0", "--samples: 0"),
        ("--oracle-rays 0", "--oracle-rays: 0"),
        ("--reference-samples 1", "--reference-samples: 1 is not from 16"),
        ("--size 0x5", "--size: 0x5"),
        ("--rays camera,primary", "--rays: \"primary\""),
        ("--profile nowhere", "--profile: there is no profiles/nowhere.toml"),
        ("--seconds -1", "--seconds: -1"),
        ("--rounds 0", "--rounds: 0"),
    ] {
        let mut command = place.accuracy("");
        // The later of two options would be an error of its own.
        if arguments.starts_with("--rounds") || arguments.starts_with("--seconds") {
            command = Command::cargo_bin("raypack").unwrap();
            command.current_dir(place.folder.path()).args(["accuracy", "corner.obj"]);
        }
        let run = command.args(arguments.replace("--seconds -1", "--seconds=-1").split(' ')).assert();
        let line = predicate::str::is_match("^raypack: error: [^\n]+\n$").unwrap();
        run.code(1).stdout("").stderr(predicate::str::contains(said).and(line));
        assert_eq!(place.files(), ["corner.obj"], "{arguments}");
    }
    // Options are checked before the model is read.
    let mut command = Command::cargo_bin("raypack").unwrap();
    let run = command.args(["accuracy", "nowhere.obj", "--within", "soon"]).assert();
    run.code(1).stderr(predicate::str::contains("--within"));
    let mut command = Command::cargo_bin("raypack").unwrap();
    let run = command.args(["accuracy", "nowhere.obj"]).assert();
    run.code(1).stderr(predicate::str::contains("cannot read nowhere.obj"));
}

#[test]
#[cfg(feature = "peers")]
fn an_embree_that_is_not_where_it_is_said_to_be_is_an_error() {
    let place = Place::new();
    let mut command = Command::cargo_bin("raypack").unwrap();
    command.current_dir(place.folder.path()).env("RAYPACK_EMBREE", place.folder.path());
    let run = command.args(["accuracy", "corner.obj", "--size", "8x8"]).assert();
    run.code(1).stderr(predicate::str::contains("RAYPACK_EMBREE"));
}
