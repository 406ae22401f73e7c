//! Builds that are interrupted at each of their stages, by name: `RAYPACK_STOP_AT` has a build say that it begins a stage
//! and then wait there for a signal (see `src/stage.rs`; it is a look at a variable a few times in a build). So no clock
//! decides where the signal comes.

use super::common::{LONG, Place, end_of, signal};
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::sync::mpsc;
use std::thread;

/// A build of `scene.rpk`, and its stages in order.
struct Build {
    command: &'static str,
    stages: &'static [&'static str],
}

const BUILDS: [Build; 4] = [
    Build {
        command: "build plant.ply -o scene.rpk --memory 120MiB",
        stages: &[
            "reading",
            "checking",
            "surfaces",
            "splitting",
            "building",
            "joining",
            "writing",
            "pictures",
            "closing",
            "syncing",
            "renaming",
            "named",
        ],
    },
    Build {
        command: "build small.ply -o scene.rpk",
        stages: &[
            "reading", "checking", "building", "writing", "pictures", "closing", "syncing", "renaming",
            "named",
        ],
    },
    Build {
        command: "generate plant --triangles 30k -o scene.rpk",
        stages: &[
            "generating",
            "checking",
            "surfaces",
            "building",
            "joining",
            "writing",
            "pictures",
            "closing",
            "syncing",
            "renaming",
            "named",
        ],
    },
    Build {
        command: "generate plant --triangles 400k --seed 5 -o scene.rpk --memory 120MiB",
        stages: &["splitting"],
    },
];

/// Begins a build and waits until it is at a stage.
fn at_stage(place: &Place, command: &str, stage: &str) -> Child {
    let mut process = place.process(command);
    let mut process =
        process.env("RAYPACK_STOP_AT", stage).stderr(Stdio::piped()).spawn().expect("it starts");
    let said = BufReader::new(process.stderr.take().expect("piped"));
    let (tell, told) = mpsc::channel();
    thread::spawn(move || tell.send(said.lines().next()));
    let line = told.recv_timeout(LONG).unwrap_or_else(|_| {
        let _ = process.kill();
        panic!("{command} does not come to {stage}")
    });
    let line = line.unwrap_or_else(|| panic!("{command} ends before {stage}")).expect("text");
    assert_eq!(line, format!("stopped at {stage}"), "{command}");
    process
}

/// Sends a signal to builds at each of their stages, over an older scene file and where there is none.
fn interrupt(how: &str) {
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("generate plant --triangles 30k --seed 2 -o small.ply");
    place.succeed("generate plant --triangles 10k -o old.rpk");
    let old = place.read("old.rpk");
    for (number, Build { command, stages }) in BUILDS.iter().enumerate() {
        place.succeed(command);
        for (turn, stage) in stages.iter().enumerate() {
            let what = format!("{how}, {command} at {stage}");
            let has_old = (turn + number) % 2 == 0;
            match has_old {
                true => place.write("scene.rpk", &old),
                false => std::fs::remove_file(place.path("scene.rpk")).expect("it was there"),
            }
            let mut process = at_stage(&place, command, stage);
            assert!(signal(&process, how), "{what}");
            let code = end_of(&mut process).code();
            assert_eq!(code, (how == "INT").then_some(130), "{what}");

            let (drafts, others): (Vec<_>, Vec<_>) =
                place.files().into_iter().partition(|name| name.starts_with(".raypack-"));
            // Who is killed cannot tidy up.
            assert!(drafts.is_empty() || how == "KILL", "{what}: {drafts:?}");
            drafts.iter().for_each(|draft| std::fs::remove_file(place.path(draft)).expect("removed"));
            let is_there = others.iter().any(|name| name == "scene.rpk");
            assert_eq!(is_there, has_old || *stage == "named", "{what}");
            assert_eq!(others.len(), 3 + usize::from(is_there), "{what}: {others:?}");
            if is_there {
                // A new one says how much memory its build took, which is not always the same.
                assert_eq!(place.read("scene.rpk") == old, *stage != "named", "{what}");
                place.succeed("info scene.rpk --verify");
            }
            place.write("scene.rpk", &old);
        }
    }
}

#[test]
fn a_build_that_is_interrupted_at_any_stage_leaves_the_old_file_or_none() {
    interrupt("INT");
}

#[test]
fn a_build_that_is_killed_at_any_stage_leaves_the_old_file_or_none() {
    interrupt("KILL");
}

#[test]
fn stages_have_names() {
    let place = Place::new();
    let mut command = place.raypack("generate plant -o plant.rpk");
    command.env("RAYPACK_STOP_AT", "somewhere");
    let expected = ["RAYPACK_STOP_AT: \"somewhere\" is not one of ", "splitting", "; unset it"];
    place.fail_with(command, "a stage that is none", &expected);
}
