//! Files that are cut short while they are open: a command ends with an error that names the file, never by a signal.

use super::common::{Place, end_of, wait_for};
use std::fs::{self, File};
use std::io::Read;
use std::process::{Child, Stdio};

/// Begins a command.
fn begin(place: &Place, command: &str) -> Child {
    place.process(command).stderr(Stdio::piped()).spawn().expect("it starts")
}

/// Leaves nothing in a file.
fn cut(place: &Place, name: &str) {
    File::options().write(true).open(place.path(name)).expect("there").set_len(0).expect("cut");
}

/// How a command ended, and what it said. No file is left that is not complete.
fn end(place: &Place, mut process: Child) -> (Option<i32>, String) {
    let code = end_of(&mut process).code();
    let mut said = String::new();
    process.stderr.take().expect("piped").read_to_string(&mut said).expect("text");
    assert!(place.files().iter().all(|name| !name.starts_with(".raypack-")), "{:?}", place.files());
    (code, said)
}

/// The files of a path of pictures that goes on for hours.
fn pictures(place: &Place) -> usize {
    place.files().iter().filter(|name| name.starts_with("out_")).count()
}

#[test]
fn a_scene_file_that_is_cut_short_while_it_is_drawn_is_an_error() {
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("build plant.ply -o whole.rpk");
    let mapped = "cannot read scene.rpk: it was cut short while it was open, or its disk fails";
    let read = "cannot read scene.rpk: it has become shorter since it was opened; build it again";
    for (options, expected) in [
        ("", mapped),
        ("--threads 7 --tile 8", mapped),
        ("--memory 48MiB", read),
        ("--memory 48MiB --loading sync", read),
    ] {
        fs::copy(place.path("whole.rpk"), place.path("scene.rpk")).expect("copied");
        let command = format!("render scene.rpk -o out.png --size 64x48 --orbit 9999 {options}");
        let mut process = begin(&place, &command);
        wait_for(&mut process, "a picture", |process| {
            assert!(process.try_wait().expect("it is ours").is_none(), "it has ended");
            (pictures(&place) > 0).then_some(())
        });
        cut(&place, "scene.rpk");
        let (code, said) = end(&place, process);
        assert_eq!(code, Some(1), "{options}: {said}");
        assert!(said.starts_with(&format!("raypack: error: {expected}")), "{options}: {said}");
        assert_eq!(said.matches('\n').count(), 1, "{options}: {said}");
        let drawn = place.files();
        let drawn = drawn.iter().filter(|name| name.starts_with("out_"));
        drawn.for_each(|name| fs::remove_file(place.path(name)).expect("removed"));
    }
}

#[test]
fn a_model_that_is_cut_short_while_it_is_read_is_an_error() {
    let place = Place::new();
    let vertices: String = (0..300_000).map(|i| format!("v {} {} {}\n", i % 631, i / 631, i % 7)).collect();
    let faces: String = (1..=299_000).map(|i| format!("f {} {} {}\n", i, i + 1, i + 700)).collect();
    let model = vertices + &faces;
    // Whoever is quick has read it all before it is cut: then it is tried again.
    let mut said = String::new();
    for _ in 0..50 {
        place.write("model.obj", &model);
        let mut process = begin(&place, "info model.obj");
        let maps = format!("/proc/{}/maps", process.id());
        let has_ended = wait_for(&mut process, "the map", |process| {
            let is_mapped = fs::read_to_string(&maps).is_ok_and(|maps| maps.contains("model.obj"));
            let has_ended = process.try_wait().expect("it is ours").is_some();
            (is_mapped || has_ended).then_some(has_ended)
        });
        if !has_ended {
            cut(&place, "model.obj");
        }
        let code;
        (code, said) = end(&place, process);
        if code == Some(1) {
            break;
        }
        assert_eq!(code, Some(0), "{said}");
    }
    let expected = "raypack: error: cannot read model.obj: it was cut short while it was open";
    assert!(said.starts_with(expected) && said.matches('\n').count() == 1, "{said}");
}

#[test]
fn another_signal_of_that_kind_ends_the_process_as_ever() {
    let place = Place::new();
    place.succeed("generate plant --triangles 10k -o plant.ply");
    place.succeed("build plant.ply -o scene.rpk");
    let mut process = begin(&place, "render scene.rpk -o out.png --size 64x48 --orbit 9999");
    wait_for(&mut process, "a picture", |_| (pictures(&place) > 0).then_some(()));
    super::common::signal(&process, "BUS");
    let code = end_of(&mut process).code();
    assert_eq!(code, None, "it is no fault of a file");
}
