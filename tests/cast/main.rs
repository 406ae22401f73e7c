//! `raypack cast` from end to end. NumPy's files are made and taken apart here byte by byte, so that not
//! the same code stands on both sides.

#[path = "../common/mod.rs"]
mod common;
mod numpy;

use common::Place;
use numpy::{Npz, npy, npy_of};
use raypack::geometry::{Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::traverse::Accel;
use raypack::{Vec3, mesh};
use serde_json::Value;
use std::fs;

/// A unit square in the plane z = 0: triangles 0 (below the diagonal) and 1, of two materials.
const SQUARE: &str = "mtllib square.mtl
v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0
usemtl lower\nf 1 2 3\nusemtl upper\nf 1 3 4\n";

const INF: f32 = f32::INFINITY;
const NAN: f32 = f32::NAN;

/// A hit: t, u, v, primitive.
type Expected = Option<(f32, f32, f32, i64)>;

/// Rays at the square, and what each gives.
const CASES: [([f32; 8], Expected); 14] = [
    // Through the middle of each triangle; t counts in lengths of the direction.
    ([0.75, 0.25, 2.0, 0.0, 0.0, 0.0, -1.0, INF], Some((2.0, 0.5, 0.25, 0))),
    ([0.25, 0.75, 2.0, 0.0, 0.0, 0.0, -4.0, INF], Some((0.5, 0.25, 0.5, 1))),
    // From behind.
    ([0.75, 0.25, -1.0, 0.0, 0.0, 0.0, 1.0, INF], Some((1.0, 0.5, 0.25, 0))),
    // On the diagonal and on the corners that the triangles share, the lower id.
    ([0.5, 0.5, 1.0, 0.0, 0.0, 0.0, -1.0, INF], Some((1.0, 0.0, 0.5, 0))),
    ([0.0, 0.0, 1.0, 0.0, 0.0, 0.0, -1.0, INF], Some((1.0, 0.0, 0.0, 0))),
    // The interval's ends count, and nothing beyond them.
    ([0.75, 0.25, 1.0, 1.0, 0.0, 0.0, -1.0, 1.0], Some((1.0, 0.5, 0.25, 0))),
    ([0.75, 0.25, 1.0, 0.0, 0.0, 0.0, -1.0, 0.999_999_94], None),
    ([0.75, 0.25, 1.0, 1.000_000_1, 0.0, 0.0, -1.0, INF], None),
    ([0.75, 0.25, 1.0, 2.0, 0.0, 0.0, -1.0, 0.5], None),
    // Beside it, and away from it.
    ([1.5, 0.25, 1.0, 0.0, 0.0, 0.0, -1.0, INF], None),
    ([0.75, 0.25, 1.0, 0.0, 0.0, 0.0, 1.0, INF], None),
    // What is no ray.
    ([0.75, NAN, 1.0, 0.0, 0.0, 0.0, -1.0, INF], None),
    ([0.75, 0.25, 1.0, 0.0, 0.0, 0.0, 0.0, INF], None),
    ([0.75, 0.25, 1.0, 0.0, 0.0, 0.0, -INF, INF], None),
];

/// A folder with the square and its rays.
fn square() -> Place {
    let place = Place::new();
    place.write("square.mtl", "newmtl lower\nKd 1 0 0\nnewmtl upper\nKd 0 0 1\n");
    place.write("square.obj", SQUARE);
    place.write("rays.npy", npy(&CASES.map(|(ray, _)| ray)));
    place
}

/// Runs `raypack cast square.obj` to success and returns what it printed.
fn cast(place: &Place, arguments: &str) -> String {
    place.succeed(&format!("cast square.obj {arguments}"))
}

/// Runs `raypack cast` to failure.
fn fail(place: &Place, arguments: &str, expected: &[&str]) {
    place.fail(&format!("cast {arguments}"), expected);
}

/// Refuses what `rays` holds.
fn refuse(place: &Place, rays: impl AsRef<[u8]>, expected: &[&str]) {
    place.write("bad.npy", rays);
    let all: Vec<&str> = ["bad.npy: "].iter().chain(expected).copied().collect();
    fail(place, "square.obj --rays bad.npy -o hits.npz", &all);
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).expect("JSON")
}

#[test]
fn hits_are_what_they_are_documented_to_be() {
    for accuracy in ["fast", "watertight", "exact"] {
        let place = square();
        cast(&place, &format!("--rays rays.npy -o hits.npz --accuracy {accuracy}"));
        let hits = Npz::parse(&place.read("hits.npz"));
        assert_eq!(hits.names(), ["t", "primitive", "geometry", "u", "v", "normal"]);
        let count = CASES.len();
        assert_eq!(hits.shape("normal"), [count, 3]);
        for name in ["t", "primitive", "geometry", "u", "v"] {
            assert_eq!(hits.shape(name), [count], "{name}");
        }
        for (i, (ray, expected)) in CASES.iter().enumerate() {
            let (t, u, v, primitive) = expected.unwrap_or((INF, 0.0, 0.0, -1));
            let found = (hits.f32s("t")[i], hits.f32s("u")[i], hits.f32s("v")[i], hits.i64s("primitive")[i]);
            assert_eq!(found, (t, u, v, primitive), "{accuracy}, ray {i}: {ray:?}");
            // Each triangle has a material of its own, in the order of their names here.
            assert_eq!(hits.i64s("geometry")[i], primitive, "{accuracy}, ray {i}");
            let z = if expected.is_some() { 1.0 } else { 0.0 };
            assert_eq!(hits.f32s("normal")[3 * i..][..3], [0.0, 0.0, z], "{accuracy}, ray {i}");
        }
    }
}

#[test]
fn geometry_numbers_the_materials_that_info_lists() {
    let place = square();
    let info = place.raypack("info square.obj --json -").assert().success();
    let report = json(&String::from_utf8_lossy(&info.get_output().stdout));
    assert_eq!(report["colors"]["materials"][0]["name"], "lower");
    assert_eq!(report["colors"]["materials"][1]["name"], "upper");

    place.write("square.obj", SQUARE.replace("mtllib", "#").replace("usemtl", "\n#"));
    cast(&place, "--rays rays.npy -o hits.npz");
    let hits = Npz::parse(&place.read("hits.npz"));
    assert!(hits.i64s("geometry").iter().zip(hits.i64s("primitive")).all(|(&g, p)| g == p.min(0)));
}

#[test]
fn any_says_what_has_a_hit() {
    for accuracy in ["fast", "watertight", "exact"] {
        let place = square();
        cast(&place, &format!("--rays rays.npy -o any.npz --any --accuracy {accuracy}"));
        let answers = Npz::parse(&place.read("any.npz"));
        assert_eq!((answers.names(), answers.shape("occluded")), (vec!["occluded"], &[CASES.len()][..]));
        assert_eq!(answers.bools("occluded"), CASES.map(|(_, hit)| hit.is_some()), "{accuracy}");
    }
}

#[test]
fn every_order_of_bytes_and_items_is_read() {
    let place = square();
    cast(&place, "--rays rays.npy -o expected.npz");
    let rays = CASES.map(|(ray, _)| ray);
    let rows: Vec<f32> = rays.concat();
    let columns: Vec<f32> = (0..8).flat_map(|c| rays.map(|ray| ray[c])).collect();
    let shape = format!("({}, 8)", rays.len());
    let little = |floats: &[f32]| floats.iter().flat_map(|x| x.to_le_bytes()).collect::<Vec<_>>();
    let big = |floats: &[f32]| floats.iter().flat_map(|x| x.to_be_bytes()).collect::<Vec<_>>();
    let mut followed = npy(&rays);
    followed.extend(npy(&rays[..2]));
    for (what, file) in [
        ("Fortran order", npy_of(1, "'<f4'", true, &shape, &little(&columns))),
        ("big-endian", npy_of(1, "'>f4'", false, &shape, &big(&rows))),
        ("big-endian in Fortran order", npy_of(1, "'>f4'", true, &shape, &big(&columns))),
        ("version 2", npy_of(2, "'<f4'", false, &shape, &little(&rows))),
        ("version 3", npy_of(3, "'<f4'", false, &shape, &little(&rows))),
        ("Python 2's long integers", npy_of(1, "'<f4'", false, "(14L, 8L)", &little(&rows))),
        ("another array after it", followed),
    ] {
        place.write("other.npy", file);
        cast(&place, "--rays other.npy -o other.npz");
        assert!(place.read("other.npz") == place.read("expected.npz"), "{what}");
    }
}

#[test]
fn no_rays_give_no_hits() {
    let place = square();
    for fortran in [false, true] {
        place.write("none.npy", npy_of(1, "'<f4'", fortran, "(0, 8)", &[]));
        let report = json(&cast(&place, "--rays none.npy -o none.npz --json -"));
        assert_eq!((report["rays"].as_u64(), report["hits"].as_u64()), (Some(0), Some(0)));
        let hits = Npz::parse(&place.read("none.npz"));
        assert_eq!((hits.shape("t"), hits.shape("normal")), (&[0][..], &[0, 3][..]));
        cast(&place, "--rays none.npy -o none.npz --any");
        assert_eq!(Npz::parse(&place.read("none.npz")).shape("occluded"), [0]);
    }
}

#[test]
fn one_ray_may_be_flagged_either_way() {
    let place = square();
    let (ray, _) = CASES[0];
    let bytes: Vec<u8> = ray.iter().flat_map(|x| x.to_le_bytes()).collect();
    for fortran in [false, true] {
        place.write("one.npy", npy_of(1, "'<f4'", fortran, "(1, 8)", &bytes));
        cast(&place, "--rays one.npy -o one.npz");
        assert_eq!(Npz::parse(&place.read("one.npz")).f32s("t"), [2.0]);
    }
}

/// Rays over the square and beyond, enough for a sample of them to choose the kernel.
fn many() -> Vec<[f32; 8]> {
    let place = |i: u32, step: u32| (i.wrapping_mul(step) >> 16) as f32 / 65536.0 * 1.5 - 0.25;
    (0..70_001)
        .map(|i| {
            let (x, y) = (place(i, 2_654_435_769), place(i, 2_246_822_519));
            [x, y, 1.0, 0.0, 0.25 - x * 0.1, 0.1, -1.0 - y * y, INF]
        })
        .collect()
}

#[test]
fn threads_packets_and_instruction_sets_change_nothing() {
    let place = square();
    let rows = many();
    place.write("many.npy", npy(&rows));
    cast(&place, "--rays many.npy -o expected.npz");
    let expected = place.read("expected.npz");
    for tuning in [
        "--threads 1 --packet 1",
        "--threads 3 --packet 4",
        "--threads 0 --packet 8",
        "--packet 16",
        "--pools",
        "--pools --packet 64",
    ] {
        cast(&place, &format!("--rays many.npy -o other.npz {tuning}"));
        assert!(place.read("other.npz") == expected, "{tuning}");
    }
    let mut portable = place.raypack("cast square.obj --rays many.npy -o other.npz");
    portable.env("RAYPACK_ISA", "portable").assert().success();
    assert!(place.read("other.npz") == expected, "portable");

    let model = mesh::read(place.path("square.obj")).expect("a model").mesh;
    let accel = Accel::build(&model, &BuildParams::default()).expect("builds");
    let hits = Npz::parse(&expected);
    for (i, row) in rows.iter().enumerate() {
        let [ox, oy, oz, tnear, dx, dy, dz, tfar] = *row;
        let ray = Ray::segment(Vec3::new(ox, oy, oz), Vec3::new(dx, dy, dz), tnear, tfar);
        let Hit { t, primitive, .. } = accel.intersect(&ray);
        let id = if t < INF { i64::from(primitive) } else { -1 };
        assert_eq!((hits.f32s("t")[i], hits.i64s("primitive")[i]), (t, id), "{ray:?}");
    }
}

/// Rays down on a plant of some 150 m, and through it.
fn over_a_plant(count: u32) -> Vec<[f32; 8]> {
    let place = |i: u32, step: u32| (i.wrapping_mul(step) >> 16) as f32 / 65536.0 * 160.0 - 80.0;
    (0..count)
        .map(|i| {
            let (x, z) = (place(i, 2_654_435_769), place(i, 2_246_822_519));
            [x, 60.0, z, 0.0, z * 0.01, -1.0, x * 0.01, INF]
        })
        .collect()
}

#[test]
fn hits_are_the_same_within_the_memory_given() {
    const RAYS: u32 = 70_000;
    const BUDGET: u64 = 52 << 20;
    let place = Place::new();
    place.succeed("generate plant --triangles 400k --seed 5 -o plant.ply");
    place.succeed("build plant.ply -o plant.rpk");
    place.write("rays.npy", npy(&over_a_plant(RAYS)));
    let alone = "--loading sync --policy lru --packet 8";
    let large = "--packet 16 --block 16384";
    for (any, how) in [("", ""), ("", alone), ("", large), ("--any", "")] {
        place.succeed(&format!("cast plant.rpk --rays rays.npy -o whole.npz {any} --packet 8"));
        let cast = format!("cast plant.rpk --rays rays.npy -o part.npz {any} --threads 2 {how}");
        place.succeed(&format!("{cast} --memory 52MiB --json part.json"));
        assert!(place.read("part.npz") == place.read("whole.npz"), "{any} {how}");
        let report = place.json("part.json");
        let cache = &report["cache"];
        let number = |key: &str| cache[key].as_u64().unwrap_or_else(|| panic!("{key} in {cache}"));
        assert_eq!((number("budget"), &report["threads"]), (BUDGET, &2.into()));
        assert!(report["hits"].as_u64() > Some(u64::from(RAYS) / 4), "{report}");
        assert!(number("peak_blocks") < number("data"), "{cache}");
        assert!(number("loads") > 0 && number("bytes_read") >= number("loads") * 1000, "{cache}");
        let hits = cache["hit_ratio"].as_f64().expect("a share");
        assert!((0.0..1.0).contains(&hits) && cache["stalled"].is_f64(), "{cache}");
        if cfg!(target_os = "linux") {
            assert!(number("peak_resident") <= BUDGET, "{any} {how}: {cache}");
        }
    }
    let whole = place.succeed("cast plant.rpk --rays rays.npy -o whole.npz --json whole.json");
    assert!(whole.lines().last().expect("lines").ends_with(" at most; no budget was given"), "{whole}");
    assert!(place.json("whole.json")["memory"]["budget"].is_null());
    let text = place.succeed("cast plant.rpk --rays rays.npy -o part.npz --memory 52MiB");
    assert!(text.contains("of 52.0 MiB at most") && text.contains("% of uses hit"), "{text}");

    // Rays and hits count: four million of them take 240 MB.
    place.write("many.npy", npy_of(1, "'<f4'", false, "(4000000, 8)", &vec![0; 4_000_000 * 32]));
    let cast = |memory: &str, any: &str| {
        format!("cast plant.rpk --rays many.npy -o part.npz --threads 2 --memory {memory} {any}")
    };
    place.fail(&cast("200MiB", ""), &["--memory: 200 MiB is too little for this scene", "at least 2"]);
    place.succeed(&cast("200MiB", "--any"));
    let refused = "--accuracy: fast keeps a record";
    place.fail(&cast("1GiB", "--accuracy fast"), &[refused]);
    let mut headed = npy_of(1, "'<f4'", false, "(1000000000000, 8)", &[0; 64]);
    headed.truncate(192);
    let mut piped = place.raypack("cast plant.rpk --rays /dev/stdin -o a.npz --memory 1GiB");
    let output = piped.write_stdin(headed).assert().code(1).get_output().clone();
    let message = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(message.contains("--memory: 1024 MiB is too little"), "{message}");
}

#[test]
fn the_report_says_how_it_went() {
    let place = square();
    let text = cast(&place, "--rays rays.npy -o hits.npz --threads 1 --pools");
    assert!(text.contains("\npools      "), "{text}");
    let text = cast(&place, "--rays rays.npy -o hits.npz --threads 1");
    assert!(!text.contains("\npools      "), "{text}");
    for expected in ["square.obj", "rays       14, ", "watertight", "(chosen)", "1 thread", "closest hit"] {
        assert!(text.contains(expected), "\"{expected}\" is not in:\n{text}");
    }
    assert!(text.contains("\nhits       6\n") && text.contains("\nwrote      hits.npz in "), "{text}");
    let report = json(&cast(&place, "--rays rays.npy -o a.npz --any --packet 4 --accuracy exact --json -"));
    assert_eq!(report["triangles"], 2);
    assert_eq!((&report["rays"], &report["hits"], &report["packet"]), (&14.into(), &6.into(), &4.into()));
    assert_eq!((&report["any"], &report["accuracy"]), (&true.into(), &"exact".into()));
    assert_eq!(report["kernels"], serde_json::json!({ "packet4": 14 }));
    assert!(report["seconds"].as_f64() > Some(0.0) && report["rays_per_s"].as_f64() > Some(0.0));
    assert!(
        report["isa"].is_string() && report["threads"].is_u64() && report["engine"]["version"].is_string()
    );
}

#[test]
#[cfg(unix)]
fn rays_may_come_through_a_pipe() {
    let place = square();
    cast(&place, "--rays rays.npy -o expected.npz");
    let mut piped = place.raypack("cast square.obj --rays /dev/stdin -o hits.npz");
    piped.write_stdin(place.read("rays.npy")).assert().success();
    assert!(place.read("hits.npz") == place.read("expected.npz"));
    let mut cut = place.raypack("cast square.obj --rays /dev/stdin -o cut.npz");
    let mut start = place.read("rays.npy");
    start.truncate(300);
    let output = cut.write_stdin(start).assert().code(1).stdout("");
    let message = String::from_utf8_lossy(&output.get_output().stderr).into_owned();
    assert!(message.contains("/dev/stdin: truncated") && !place.path("cut.npz").exists(), "{message}");
}

#[test]
fn shapes_that_are_no_rays_are_refused() {
    let place = square();
    for (shape, floats, expected) in [
        ("()", 1, "a single number"),
        ("(8,)", 8, "of shape 8"),
        ("(3, 6)", 18, "of shape 3 x 6"),
        ("(8, 3)", 24, "of shape 8 x 3"),
        ("(2, 1, 8)", 16, "of shape 2 x 1 x 8"),
        ("(0,)", 0, "of shape 0"),
        ("(0, 7)", 0, "of shape 0 x 7"),
    ] {
        let file = npy_of(1, "'<f4'", false, shape, &vec![0; floats * 4]);
        refuse(&place, file, &[expected, "N x 8", "tnear"]);
    }
}

#[test]
fn types_that_are_not_float32_are_refused() {
    let place = square();
    for descr in ["'<f8'", "'>f8'", "'<f2'", "'<i4'", "'<i8'", "'|u1'", "'|b1'", "'<c8'", "'|O'", "'<U4'"] {
        let file = npy_of(1, descr, false, "(3, 8)", &[0; 3 * 8 * 16]);
        refuse(&place, file, &[descr, "float32", "save rays.astype(np.float32)"]);
    }
    let fields = npy_of(1, "[('o', '<f4', (3,)), ('n', '<f4')]", false, "(3, 8)", &[0; 512]);
    refuse(&place, fields, &["float32"]);
}

#[test]
fn files_that_are_cut_short_are_refused() {
    let place = square();
    let whole = place.read("rays.npy");
    for length in [whole.len() - 1, whole.len() - 32, 130, 128] {
        refuse(&place, &whole[..length], &["truncated", "14 rays"]);
    }
    for length in [100, 12, 11, 10, 9, 7, 5, 1, 0] {
        refuse(&place, &whole[..length], &[]);
    }
}

#[test]
fn what_is_no_npy_file_is_refused() {
    let place = square();
    refuse(&place, "0.5 0.5 1 0 0 0 -1 9\n", &["not a .npy file", "np.save"]);
    cast(&place, "--rays rays.npy -o hits.npz");
    refuse(&place, place.read("hits.npz"), &["archive", "np.save"]);
    refuse(&place, npy_of(9, "'<f4'", false, "(0, 8)", &[]), &["header"]);
    for header in
        ["", "(", "{}", "{'descr': '<f4'}", "{'descr': 4, 'fortran_order': 1, 'shape': 2}", "\0\u{ff}"]
    {
        let mut file = b"\x93NUMPY\x01\x00".to_vec();
        file.extend((header.len() as u16).to_le_bytes());
        file.extend(header.bytes());
        refuse(&place, file, &["header"]);
    }
    for count in ["-1", "18446744073709551616", "2305843009213693952", "1000000000000"] {
        refuse(&place, npy_of(1, "'<f4'", false, &format!("({count}, 8)"), &[0; 64]), &[]);
    }
    fail(&place, "square.obj --rays nowhere.npy -o hits.npz", &["cannot read nowhere.npy"]);
    fs::create_dir(place.path("folder.npy")).expect("created");
    fail(&place, "square.obj --rays folder.npy -o hits.npz", &["cannot read folder.npy"]);
}

#[test]
fn outputs_that_cannot_be_are_refused() {
    let place = square();
    for output in ["hits.npy", "hits", "hits.", "hits.zip"] {
        fail(&place, &format!("square.obj --rays rays.npy -o {output}"), &[output, "hits go to a .npz file"]);
    }
    fs::create_dir(place.path("folder.npz")).expect("created");
    fail(&place, "square.obj --rays rays.npy -o no/hits.npz", &["cannot write no/hits.npz"]);
    fail(&place, "square.obj --rays rays.npy -o folder.npz", &["cannot write folder.npz"]);
    fail(&place, "square.obj --rays rays.npy -o hits.npz --json no/r.json", &["cannot write no/r.json"]);
    fail(&place, "square.obj --rays rays.npy -o a.npz --json a.npz", &["a.npz is named twice"]);
    place.write("rays.npz", place.read("rays.npy"));
    fail(&place, "square.obj --rays rays.npz -o rays.npz", &["rays.npz is named twice"]);
    fail(&place, "square.obj --rays rays.npz -o ./rays.npz", &["rays.npz is named twice"]);
}

#[test]
fn options_without_sense_are_refused() {
    let place = square();
    for (option, expected) in [
        ("--packet 5", "--packet: 5 is not one of 1, 4, 8, 16, 64, 256, 1024, 4096"),
        ("--threads 1025", "--threads: 1025"),
        ("--accuracy precise", "--accuracy: \"precise\""),
        ("--profile nowhere", "--profile: there is no"),
        ("--pools --accuracy fast", "--pools: --accuracy fast has no use for them"),
        ("--pools --memory 1GiB", "--pools: --memory does not count them"),
    ] {
        fail(&place, &format!("square.obj --rays rays.npy -o hits.npz {option}"), &[expected]);
    }
    fail(&place, "nowhere.obj --rays rays.npy -o hits.npz", &["cannot read nowhere.obj"]);
    for arguments in
        ["cast", "cast square.obj", "cast square.obj --rays rays.npy", "cast --rays a.npy -o a.npz"]
    {
        place.raypack(arguments).assert().code(2).stdout("");
    }
}

#[test]
fn what_was_there_before_stays_until_it_is_replaced() {
    let place = square();
    place.write("hits.npz", "precious");
    fail(&place, "nowhere.obj --rays rays.npy -o hits.npz", &["nowhere.obj"]);
    refuse(&place, "no rays", &[]);
    assert_eq!(place.read("hits.npz"), b"precious");
    cast(&place, "--rays rays.npy -o hits.npz");
    assert_eq!(Npz::parse(&place.read("hits.npz")).shape("t"), [CASES.len()]);
}
