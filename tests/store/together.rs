//! Builds of one scene file at the same time: it is one of theirs, whole.

use super::common::{Place, end_of};
use super::report;

#[test]
fn of_builders_of_one_file_one_has_the_last_word_and_all_of_it() {
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("generate plant --triangles 30k -o small.ply");
    // Piece by piece, and in memory.
    let builds = ["build plant.ply --memory 120MiB", "build small.ply", "build small.ply --preset best"];
    let what_it_is = || {
        let info = report(&place, "info scene.rpk --verify");
        (info["triangles"].clone(), info["tree"]["nodes"].clone())
    };
    let mut alone = Vec::new();
    for build in builds {
        place.succeed(&format!("{build} -o scene.rpk"));
        alone.push(what_it_is());
    }
    assert!(alone[0] != alone[1] && alone[1] != alone[2], "they can be told apart: {alone:?}");
    let before = place.files();
    for round in 0..3 {
        let begin = |build| place.process(&format!("{build} -o scene.rpk")).spawn().expect("it starts");
        for mut process in [0, 1, 2].map(|i| begin(builds[(i + round) % 3])) {
            assert!(end_of(&mut process).success(), "round {round}");
        }
        let scene = what_it_is();
        assert!(alone.contains(&scene), "round {round}: {scene:?}");
        assert_eq!(place.files(), before, "round {round}");
    }
}
