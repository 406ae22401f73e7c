//! What the fuzzers run, on stable and in every test run: the same functions, on the seeds and on what
//! proptest makes of them. `fuzz/` drives them with libFuzzer.
//!
//! An input that a fuzzer has found goes into `seeds/` and is tried here ever after.

mod readers;
mod trace;

use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::{Index, select};
use std::fs;
use std::path::Path;

/// The seeds of a target.
fn seeds(target: &str) -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/fuzzing/seeds").join(target);
    let files = fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").path());
    let mut files: Vec<_> = files.collect();
    files.sort();
    assert!(!files.is_empty(), "{target} has no seeds");
    files.iter().map(|file| fs::read(file).expect("a seed")).collect()
}

/// A seed with some of its bytes changed, cut out, doubled or put elsewhere.
fn mutant(target: &str) -> impl Strategy<Value = Vec<u8>> {
    let change = (0..5u8, any::<Index>(), any::<Index>(), any::<u8>(), select(TOKENS));
    (select(seeds(target)), vec(change, 0..12)).prop_map(|(mut bytes, changes)| {
        for (what, a, b, byte, token) in changes {
            let (a, b) = (a.index(bytes.len() + 1), b.index(bytes.len() + 1));
            let (a, b) = (a.min(b), a.max(b).min(a.min(b) + 40));
            match what {
                0 if a < bytes.len() => bytes[a] = byte,
                1 => bytes.truncate(bytes.len() - (b - a)),
                2 => drop(bytes.drain(a..b)),
                3 => {
                    let piece = bytes[a..b].to_vec();
                    bytes.splice(b..b, piece);
                }
                _ => drop(bytes.splice(a..b, token.bytes())),
            }
        }
        bytes
    })
}

/// What text formats stumble on.
const TOKENS: &[&str] = &[
    "\n",
    "\r",
    "\\\n",
    " ",
    "\t",
    "0",
    "-1",
    "4294967296",
    "18446744073709551615",
    "1e39",
    "nan",
    "inf",
    ".",
    "-0",
    "1e-46",
    "9/9/9",
    "//",
    "f 1 2 3\n",
    "v 0 0 0 1 1 1\n",
    "usemtl a\n",
    "mtllib m.mtl\n",
    "newmtl a\n",
    "Kd 1\n",
    "illum 7\n",
    "Tf 1\n",
    "map_Kd -s 1 a.png\n",
    "-bm 1e38",
    "..\\",
    "1/1/1",
    "vt 0 nan\n",
    "vn 0 0 0\n",
    "element face 9\n",
    "property list uchar int vertex_indices\n",
    "property float x\n",
    "end_header\n",
    "\u{e9}",
    "'shape': (2, 8)",
    "'<f4'",
    "True",
    "(",
    "{",
    "}",
    "solid\n",
    "endloop\n",
    "vertex 0 0 0\n",
    "\"count\":4294967295,",
    "\"byteOffset\":1,",
    "\"children\":[0],",
    "\"sparse\":{",
];

proptest! {
    #[test]
    fn obj(bytes in mutant("obj")) {
        readers::obj(&bytes);
    }

    #[test]
    fn mtl(bytes in mutant("mtl")) {
        readers::mtl(&bytes);
    }

    #[test]
    fn ply(bytes in mutant("ply")) {
        readers::ply(&bytes);
    }

    #[test]
    fn stl(bytes in mutant("stl")) {
        readers::stl(&bytes);
    }

    #[test]
    fn gltf(bytes in mutant("gltf")) {
        readers::gltf(&bytes);
    }

    #[test]
    fn npy(bytes in mutant("npy")) {
        readers::npy(&bytes);
    }

    #[test]
    fn trace_mutants(bytes in mutant("trace")) {
        trace::build_and_trace(&bytes);
    }

    #[test]
    fn trace_noise(bytes in vec(any::<u8>(), 0..400)) {
        trace::build_and_trace(&bytes);
    }
}

#[test]
fn seeds_are_sound() {
    for (target, run) in [
        ("obj", readers::obj as fn(&[u8])),
        ("mtl", readers::mtl),
        ("ply", readers::ply),
        ("stl", readers::stl),
        ("gltf", readers::gltf),
        ("npy", readers::npy),
        ("trace", trace::build_and_trace),
    ] {
        seeds(target).iter().for_each(|seed| run(seed));
    }
}
