//! `raypack tune` and what a tuner looks at, from end to end.

mod common;

use common::Place;
use predicates::prelude::*;
use serde_json::Value;
use std::fs;

/// A folder with a small plant in it.
fn plant() -> Place {
    let place = Place::new();
    place.succeed("generate plant --triangles 10k -o plant.ply");
    place
}

#[test]
fn a_search_writes_a_profile_that_render_takes() {
    let place = plant();
    place
        .raypack("tune plant.ply -o mine.toml --minutes 0.1 --size 48x48 --rays frame,ao --json r.json --plot p.svg")
        .assert()
        .success()
        .stdout(predicate::str::contains("build.traversal_cost").and(predicate::str::contains("SAH")));

    let report = place.json("r.json");
    let measured = report["measured"].as_array().expect("a list");
    assert!(!measured.is_empty(), "six seconds are enough for some candidates");
    for candidate in measured {
        let [low, time, high] = [0, 1, 2].map(|i| candidate["time"][i].as_f64().expect("a ratio"));
        assert!(0.0 < low && low <= time && time <= high, "{candidate}");
        assert!(candidate["pairs"].as_u64() >= Some(3), "{candidate}");
        assert!(candidate["predicted"].as_f64().expect("a ratio") > 0.0, "{candidate}");
    }
    // What was taken is what the best has, unless it was luck.
    let kept = report["kept"] == true;
    for value in report["values"].as_array().expect("a list") {
        if !kept {
            assert_eq!(value["start"], value["best"], "{value}");
            continue;
        }
        let taken = |m: &&Value| m["setting"] == value["setting"] && m["accepted"] == true;
        let last = measured.iter().rfind(taken).map_or(&value["start"], |m| &m["value"]);
        assert_eq!(last, &value["best"], "{value}");
    }

    let text = fs::read_to_string(place.path("mine.toml")).expect("written");
    for part in ["[build]", "[render]", "[tuned]", "processor", "isa", "date", "seed", "[[tuned.steps]]"] {
        assert!(text.contains(part), "{part} is missing");
    }
    let plot = fs::read_to_string(place.path("p.svg")).expect("written");
    assert!(plot.starts_with("<svg") && plot.contains("What settings are worth"), "a plot");
    place.raypack("render plant.ply --profile mine.toml -o a.png --size 32x32").assert().success();
    let loaded = raypack::profile::Profile::read(place.path("mine.toml")).expect("a profile");
    assert_eq!(loaded.tuned.expect("what was measured").steps.len(), measured.len());
}

#[cfg(unix)]
#[test]
fn an_interrupted_search_writes_the_best_so_far() {
    use std::time::{Duration, Instant};
    let place = plant();
    let tune = "tune plant.ply -o mine.toml --size 48x48 --minutes 60 --json r.json";
    // An interrupt ends the process until the model has been read, and the search from then on.
    let status = [1, 4, 16, 64].into_iter().map(|seconds| {
        let mut child = place.process(tune).spawn().expect("it runs");
        std::thread::sleep(Duration::from_secs(seconds));
        assert!(common::signal(&child, "INT"));
        let since = Instant::now();
        loop {
            match child.try_wait().expect("a status") {
                Some(status) => break status,
                None if since.elapsed() > Duration::from_secs(120) => panic!("it goes on"),
                None => std::thread::sleep(Duration::from_millis(50)),
            }
        }
    });
    let status = status.into_iter().find(|status| status.code() != Some(130)).expect("a search");
    assert!(status.success(), "{status}");
    assert_eq!(place.json("r.json")["interrupted"], true);
    raypack::profile::Profile::read(place.path("mine.toml")).expect("a profile");
}

#[test]
fn a_cap_on_memory_is_kept() {
    let place = plant();
    let little = "tune plant.ply -o mine.toml --minutes 0.1 --size 32x32 --memory 64KiB";
    place.fail(little, &["--memory: the model takes"]);
}

#[test]
fn bad_options_are_one_line_and_leave_nothing() {
    let place = plant();
    for (options, expected) in [
        ("-o mine.txt", "mine.txt: unknown kind of file"),
        ("-o no/such/folder/mine.toml", "cannot write no/such/folder/mine.toml"),
        ("-o mine.toml --minutes 0", "--minutes: 0 is not a time to search"),
        ("-o mine.toml --minutes -1", "--minutes: -1 is not a time"),
        ("-o mine.toml --goal speed", "--goal: \"speed\" is neither trace nor frames=N"),
        ("-o mine.toml --goal frames=0", "--goal: \"frames=0\""),
        ("-o mine.toml --rays frames", "frames"),
        ("-o mine.toml --camera eye=1", "--camera"),
        ("-o mine.toml --plot p.pdf", "p.pdf: unknown kind of file"),
        ("-o mine.toml --plot mine.toml", "unknown kind of file"),
        ("-o mine.toml --json mine.toml", "--json: this file is named twice"),
        ("-o mine.toml --profile nonsense", "profiles/nonsense.toml"),
    ] {
        place.fail(&format!("tune plant.ply {options}"), &[expected]);
    }
}

#[test]
fn heat_maps_are_pictures_of_costs() {
    let place = plant();
    for cost in ["steps", "tests", "leaves", "time"] {
        place
            .raypack(&format!(
                "render plant.ply -o {cost}.pfm --size 40x30 --heatmap {cost} --json {cost}.json"
            ))
            .assert()
            .success()
            .stdout(predicate::str::contains("traced alone"));
        let bytes = fs::read(place.path(&format!("{cost}.pfm"))).expect("written");
        let header = b"Pf\n40 30\n-1.0\n";
        assert!(bytes.starts_with(header), "{cost}");
        let (costs, rest) = bytes[header.len()..].as_chunks::<4>();
        assert!(costs.len() == 1200 && rest.is_empty());
        let greatest = costs.iter().fold(0.0, |most: f32, cost| most.max(f32::from_le_bytes(*cost)));
        let spread = &place.json(&format!("{cost}.json"))["spread"];
        assert_eq!(spread["greatest"].as_f64(), Some(f64::from(greatest)), "{cost}");
        assert!(greatest > 1.0, "{cost}: {greatest}");
    }
    place.raypack("render plant.ply -o heat.png --size 40x30 --heatmap tests").assert().success();
    let picture = image::open(place.path("heat.png")).expect("a picture").to_rgb8();
    assert_eq!(picture.dimensions(), (40, 30));
    assert!(picture.pixels().any(|pixel| pixel != picture.get_pixel(0, 0)), "it shows something");
    let unknown = "render plant.ply -o heat.png --heatmap warmth";
    place.fail(unknown, &["--heatmap: \"warmth\" is not one of steps"]);
}

#[test]
fn info_draws_what_a_tuner_looks_at() {
    let place = plant();
    let text = place.succeed("info plant.ply --json i.json");
    for title in ["leaf size", "depth", "in leaves", "area", "aspect"] {
        assert!(text.lines().any(|line| line.starts_with(title)), "{title}: {text}");
    }
    assert!(text.contains("expected to take") && text.contains("random ones"), "{text}");
    let report = place.json("i.json");
    let sum =
        |list: &Value| -> u64 { list.as_array().expect("a list").iter().filter_map(Value::as_u64).sum() };
    assert_eq!(Some(sum(&report["tree"]["depth_histogram"])), report["tree"]["leaves"].as_u64());
    assert!(sum(&report["tree"]["duplication_histogram"]) > 0, "triangles are in leaves");
    let without_area = report["shapes"]["without_area"].as_u64().expect("a number");
    assert_eq!(Some(sum(&report["shapes"]["by_area"]) + without_area), report["triangles"].as_u64());
    assert!(report["random_rays"]["tests"].as_f64() > Some(0.0));
}
