//! Builds that are interrupted: the scene file is the old one or the new one, whenever it happens.

use super::common::{Place, signal};
use super::large::same_sections;
use std::process::{Child, Stdio};
use std::thread;
use std::time::Instant;

/// When builds are interrupted, in sixteenths of the time that one takes.
const WHEN: [u32; 8] = [0, 1, 3, 5, 7, 9, 11, 14];

/// Begins to build a scene of a plant piece by piece, in the stead of what has its name.
fn begin(place: &Place) -> Child {
    let mut build = place.process("build plant.ply -o scene.rpk --memory 120MiB");
    build.stderr(Stdio::null()).spawn().expect("it starts")
}

/// Sends builds a signal at all of their stages, after which drafts may stay or may not. How many it ended
/// before the new scene was there.
fn interrupt(how: &str, drafts_stay: bool) -> usize {
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("generate plant --triangles 10k -o small.ply");
    place.succeed("build small.ply -o old.rpk");
    let build = |_| {
        let start = Instant::now();
        assert!(begin(&place).wait().expect("it ends").success());
        start.elapsed()
    };
    let time = (0..3).map(build).min().expect("there are three");
    let old = place.read("old.rpk");
    place.write("new.rpk", place.read("scene.rpk"));
    let mut interrupted = 0;
    for when in WHEN {
        place.write("scene.rpk", &old);
        let before = place.files();
        let mut build = begin(&place);
        thread::sleep(time * when / 16);
        signal(&build, how);
        let succeeded = build.wait().expect("it ends").success();
        // The signal may come when the new file is in its place and the process has not ended.
        let is_old = place.read("scene.rpk") == old;
        assert!(!is_old || !succeeded, "{how} after {when}/16");
        if !is_old {
            // A new one says how much memory its build took, which is not always the same.
            place.succeed("info scene.rpk --verify");
            same_sections(&place, "new.rpk", "scene.rpk");
        }
        interrupted += usize::from(is_old);
        let (drafts, others): (Vec<_>, Vec<_>) =
            place.files().into_iter().partition(|name| name.starts_with(".raypack-"));
        assert_eq!(others, before, "{how} after {when}/16");
        assert!(drafts.is_empty() || drafts_stay, "{how} after {when}/16: {drafts:?}");
        drafts.iter().for_each(|draft| std::fs::remove_file(place.path(draft)).expect("removed"));
    }
    interrupted
}

#[test]
fn an_interrupted_build_leaves_the_old_file_and_nothing_else() {
    let interrupted = interrupt("INT", false);
    assert!(interrupted >= 2, "{interrupted}");
}

#[test]
fn a_killed_build_leaves_the_old_file() {
    let interrupted = interrupt("KILL", true);
    assert!(interrupted >= 2, "{interrupted}");
}
