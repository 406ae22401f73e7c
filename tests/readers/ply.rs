//! Stanford PLY, read and written.

use super::{Folder, SQUARE_PLY, assert_says, read, refusal};
use raypack::Vec3;
use raypack::mesh::{self, Attributes, Colors, Mesh, Normal, ply};
use std::fs;

fn binary(big: bool) -> Vec<u8> {
    let name = if big { "binary_big_endian" } else { "binary_little_endian" };
    let header = SQUARE_PLY.replace("ascii", name);
    let mut file = header.split_inclusive("end_header\n").next().unwrap().as_bytes().to_vec();
    for x in [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0] {
        file.extend(if big { x.to_be_bytes() } else { x.to_le_bytes() });
    }
    file.push(4);
    for i in 0..4_i32 {
        file.extend(if big { i.to_be_bytes() } else { i.to_le_bytes() });
    }
    file
}

/// The file with its header changed.
fn header_with(file: &[u8], from: &str, to: &str) -> Vec<u8> {
    let end = file.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let mut changed = with(str::from_utf8(&file[..end]).unwrap(), from, to).into_bytes();
    changed.extend_from_slice(&file[end..]);
    changed
}

#[track_caller]
fn with(text: &str, from: &str, to: &str) -> String {
    assert!(text.contains(from), "no {from:?} in it");
    text.replace(from, to)
}

#[test]
fn all_encodings_mean_the_same() {
    let expected = read("a.ply", SQUARE_PLY);
    assert_eq!(expected.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(expected.mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(expected.report.polygons, 1);
    for big in [false, true] {
        let loaded = read("a.ply", binary(big));
        assert_eq!((loaded.mesh, loaded.report), (expected.mesh.clone(), expected.report.clone()));
    }
}

#[test]
fn headers_may_end_lines_in_any_way() {
    for ending in ["\r\n", "\r"] {
        assert_eq!(read("a.ply", with(SQUARE_PLY, "\n", ending)).report.triangles, 2);
        let report = read("a.ply", header_with(&binary(false), "\n", ending)).report;
        assert_eq!((report.triangles, report.trailing_bytes), (2, 0));
    }
}

#[test]
fn numbers_are_read_as_printf_writes_them() {
    let mesh = read("a.ply", with(SQUARE_PLY, "1 1 0\n", "1. .1e1 -0\n")).mesh;
    assert_eq!(mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
    let wrapped = with(SQUARE_PLY, "0 0 0\n1 0 0\n", "0 0\n 0 1\t0 0   \n");
    assert_eq!(read("a.ply", wrapped).report.triangles, 2);
    let mut foreign = SQUARE_PLY.as_bytes().to_vec();
    foreign.splice(4..4, b"comment M\xfcller\n".iter().copied());
    assert_eq!(read("a.ply", foreign).report.triangles, 2);
}

#[test]
fn every_type_of_index_is_understood() {
    for types in ["uchar uint", "int8 int16", "uint8 ushort", "ushort uchar", "int char"] {
        let to = format!("list {types} vertex_index\n");
        let file = with(SQUARE_PLY, "list uchar int vertex_indices\n", &to);
        assert_eq!(read("a.ply", file).report.triangles, 2);
    }
}

#[test]
fn what_is_not_known_is_skipped() {
    let file = "ply\nformat ascii 1.0\nelement camera 1\nproperty list uchar float view\nproperty int id\n\
                element vertex 3\nproperty double nx\nproperty double x\nproperty double y\n\
                property list uint8 short tags\nproperty double z\nelement nothing 5\n\
                element face 1\nproperty float quality\nproperty list uchar float texcoord\n\
                property list uchar int vertex_indices\nend_header\n\
                2 1.5 2.5 7\n9 0 0 1 5 0\n9 1 0 0 0\n9 0 1 2 8 8 0\n0.5 1 0.25 3 0 1 2\n";
    let loaded = read("a.ply", file);
    assert_eq!(loaded.mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    assert_eq!(loaded.report.summary(), "");
}

fn triangle(of_vertex: &str, of_face: &str, body: &str) -> String {
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
         {of_vertex}element face 1\nproperty list uchar int vertex_indices\n{of_face}end_header\n{body}"
    )
}

fn rgb(kind: &str, prefix: &str) -> String {
    ["red", "green", "blue"].map(|c| format!("property {kind} {prefix}{c}\n")).concat()
}

#[test]
fn face_colors_of_every_type() {
    for (kind, prefix, color) in [
        ("uchar", "", "255 128 0"),
        ("uchar", "diffuse_", "255 128 0"),
        ("int", "", "255 128 0"),
        ("ushort", "", "65535 32896 0"),
        ("float", "", "1 0.5 0"),
        ("double", "", "255 128 0"),
    ] {
        let body = format!("0 0 0\n1 0 0\n0 1 0\n3 0 1 2 {color}\n");
        let mesh = read("a.ply", triangle("", &rgb(kind, prefix), &body)).mesh;
        assert_eq!(mesh.colors, Colors::PerTriangle(vec![[255, 128, 0]]), "{kind} {prefix}");
    }
}

#[test]
fn vertex_colors_count_unless_faces_have_some() {
    let body = "0 0 0 255 0 0\n1 0 0 0 255 0\n0 1 0 0 0 255\n3 0 1 2";
    let mesh = read("a.ply", triangle(&rgb("uchar", ""), "", body)).mesh;
    assert_eq!(mesh.colors, Colors::PerVertex(vec![[255, 0, 0], [0, 255, 0], [0, 0, 255]]));
    let both = triangle(&rgb("uchar", ""), &rgb("uchar", ""), &format!("{body} 1 2 3\n"));
    assert_eq!(read("a.ply", both).mesh.colors, Colors::PerTriangle(vec![[1, 2, 3]]));
}

#[test]
fn polygons_share_their_color() {
    let file = with(SQUARE_PLY, "end_header", &format!("{}end_header", rgb("uchar", "")));
    let mesh = read("a.ply", with(&file, "4 0 1 2 3\n", "4 0 1 2 3 9 8 7\n")).mesh;
    assert_eq!(mesh.colors, Colors::PerTriangle(vec![[9, 8, 7]; 2]));
}

#[test]
fn faces_and_strips_side_by_side_share_what_colors_there_are() {
    let grey = [mesh::linear_to_srgb(0.7); 3];
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    let file = |face: &str, strip: &str, body: &str| {
        let header = format!("{face}{strips}{strip}end_header");
        with(&with(SQUARE_PLY, "end_header", &header), "4 0 1 2 3\n", body)
    };
    let faces = file(&rgb("uchar", ""), "", "3 0 1 2 9 8 7\n4 0 1 3 2\n");
    assert_eq!(read("a.ply", faces).mesh.colors, Colors::PerTriangle(vec![[9, 8, 7], grey, grey]));
    let strips = file("", &rgb("float", ""), "3 0 1 2\n4 0 1 3 2 1 0 0\n");
    let red = [255, 0, 0];
    assert_eq!(read("a.ply", strips).mesh.colors, Colors::PerTriangle(vec![grey, red, red]));
}

#[test]
fn strips_alternate_and_restart() {
    let strips = |kind: &str, list: &str| {
        let file = with(SQUARE_PLY, "element face 1\n", "element tristrips 1\n");
        let file = with(&file, "list uchar int", &format!("list int {kind}"));
        read("a.ply", with(&file, "4 0 1 2 3\n", list))
    };
    let loaded = strips("int", "9 0 1 3 2 -1 0 1 2 -1\n");
    assert_eq!(loaded.mesh.triangles, [[0, 1, 3], [3, 1, 2], [0, 1, 2]]);
    assert_says(&loaded.report.summary(), &["2 triangle strips unrolled"]);
    for i in 0..3 {
        let [a, b, c] = loaded.mesh.corners(i);
        assert!((b - a).cross(c - a).z > 0.0, "triangle {i} is turned over");
    }
    assert_eq!(strips("uint", "8 0 1 3 2 4294967295 0 1 2\n").mesh, loaded.mesh);
}

/// A triangle whose vertices have these properties too.
fn looking(names: &str, values: [&str; 3]) -> String {
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let [a, b, c] = values;
    format!(
        "ply\nformat ascii 1.0\nelement vertex 3\n{properties}property float x\nproperty float y\n\
         property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
         {a} 0 0 0\n{b} 1 0 0\n{c} 0 1 0\n3 2 0 1\n"
    )
}

#[test]
fn texture_coordinates_and_normals_come_along() {
    for names in ["s t", "u v", "texture_u texture_v"] {
        let mesh = read("a.ply", looking(names, ["0 1", "2 3", "4 5"])).mesh;
        let uv = [[4.0, 5.0], [0.0, 1.0], [2.0, 3.0]];
        assert_eq!(mesh.attributes, [Attributes { uv, ..Attributes::NONE }], "{names}");
    }
    let mesh = read("a.ply", looking("nz ny nx", ["1 0 0", "0 7 0", "0 0 -1e-30"])).mesh;
    let normals = [Vec3::NEG_X, Vec3::Z, Vec3::Y].map(Normal::encode);
    assert_eq!(mesh.attributes, [Attributes { normals, ..Attributes::NONE }]);
    assert!(read("a.ply", looking("nx ny u", ["1 0 0", "1 0 0", "1 0 0"])).mesh.attributes.is_empty());
    let loaded = read("a.ply", looking("u v nx ny nz", ["nan 1 0 0 0", "0 inf 1 0 0", "1 1 nan 0 0"]));
    assert_eq!(loaded.mesh.attributes[0].uv, [[1.0, 1.0], [0.0, 1.0], [0.0, 0.0]]);
    assert_eq!((loaded.report.bad_texture_coordinates, loaded.report.bad_normals), (2, 2));
}

#[test]
fn headers_that_lie_are_refused_before_memory_is_taken() {
    for file in [SQUARE_PLY.as_bytes().to_vec(), binary(false), binary(true)] {
        let lie = header_with(&file, "element vertex 4", "element vertex 4000000000");
        assert_says(&refusal("a.ply", lie), &["truncated", "4000000000", "vertex"]);
    }
    let many = with(SQUARE_PLY, "element vertex 4", "element vertex 4294967296");
    assert_says(&refusal("a.ply", many), &["4294967296", "at most"]);
    let huge = with(SQUARE_PLY, "element face 1", "element face 18446744073709551615");
    assert_says(&refusal("a.ply", huge), &["truncated", "face"]);
    let list = "element face 1\nproperty list uchar int vertex_indices\n";
    let empty = with(SQUARE_PLY, list, "element face 99999999999\n");
    assert_says(&refusal("a.ply", empty), &["face", "vertex_indices"]);
}

#[test]
fn truncated_files_are_refused_wherever_they_end() {
    // A text may lose its last line end, and no more.
    let text = SQUARE_PLY.trim_end().as_bytes().to_vec();
    for file in [binary(false), binary(true), text] {
        assert_eq!(read("a.ply", &file).report.triangles, 2);
        for length in 0..file.len() {
            let message = refusal("a.ply", &file[..length]);
            let known = ["truncated", "not a PLY file", "end_header"];
            assert!(known.iter().any(|w| message.contains(w)), "cut at {length}: {message}");
        }
    }
}

#[test]
fn lists_that_lie_are_refused() {
    let file = with(SQUARE_PLY, "list uchar int", "list uint int");
    let message = refusal("a.ply", with(&file, "4 0 1 2 3", "4000000000 0 1 2"));
    assert_says(&message, &["face 0 of 1", "line 16", "truncated", "4000000000"]);
    let file = with(SQUARE_PLY, "list uchar int", "list int int");
    let message = refusal("a.ply", with(&file, "4 0 1 2 3", "-4 0 1 2"));
    assert_says(&message, &["face 0 of 1", "length -4"]);
}

#[test]
fn bad_indices_are_refused_with_their_face() {
    for (bad, said) in [("4", "4"), ("-1", "-1"), ("1.5", "1.5"), ("nan", "NaN")] {
        let message = refusal("a.ply", with(SQUARE_PLY, "4 0 1 2 3", &format!("4 0 1 2 {bad}")));
        assert_says(&message, &["face 0 of 1", "line 16", "vertex index", said, "out of range"]);
    }
    let mut file = binary(false);
    let at = file.len() - 4;
    file[at..].copy_from_slice(&7_i32.to_le_bytes());
    assert_says(&refusal("a.ply", file), &["face 0 of 1", "vertex index 7", "4 vertices"]);
}

#[test]
fn words_that_are_no_numbers_are_refused_with_their_line() {
    let message = refusal("a.ply", with(SQUARE_PLY, "1 1 0\n", "1 one 0\n"));
    assert_says(&message, &["vertex 2 of 4", "line 14", "\"one\" is no number"]);
}

#[test]
fn vertices_that_are_not_finite_must_not_be_used() {
    let file = with(SQUARE_PLY, "1 1 0\n0 1 0\n", "nan 1 0\n0 inf 0\n");
    assert_says(&refusal("a.ply", &file), &["NaN or infinite", "2 vertices", "vertex 2"]);
    let unused = with(SQUARE_PLY, "0 1 0\n4 0 1 2 3", "0 -inf 0\n3 0 1 2");
    let loaded = read("a.ply", unused);
    assert_eq!((loaded.report.unused_non_finite, loaded.mesh.positions.len()), (1, 3));
}

#[test]
fn broken_headers_are_refused_with_their_line() {
    assert_says(&refusal("a.ply", "solid"), &["not a PLY file"]);
    assert_says(&refusal("a.ply", ""), &["not a PLY file"]);
    assert_says(&refusal("a.ply", "ply\nformat ascii 1.0\n"), &["header", "end_header"]);
    for (from, to, said) in [
        ("format ascii 1.0", "format utf8 1.0", "line 2: unknown format utf8"),
        ("format ascii 1.0\n", "", "no line \"format\""),
        ("float x", "real x", "line 6: unknown type real"),
        ("list uchar int", "list float int", "integer type"),
        ("element vertex 4", "element vertex four", "line 5: \"four\" is no number"),
        ("element vertex 4", "element vertex -4", "line 5: \"-4\" is no number"),
        ("element vertex", "element point", "no element \"vertex\""),
        ("element face", "element vertex", "line 9: a second element vertex"),
        ("comment", "comet", "line 3: \"comet a square\" is not understood"),
        ("property float z", "property float w", "no properties x, y and z"),
        ("vertex_indices", "corners", "vertex_indices"),
        ("element vertex 4\n", "", "line 5: a property before the first element"),
    ] {
        assert_says(&refusal("a.ply", with(SQUARE_PLY, from, to)), &[said]);
    }
}

#[test]
fn point_clouds_are_refused() {
    let file = with(SQUARE_PLY, "element face 1", "element face 0");
    assert_says(&refusal("a.ply", with(&file, "4 0 1 2 3\n", "")), &["no triangles", "4 vertices"]);
}

#[test]
fn bytes_after_the_end_are_counted() {
    let mut file = binary(true);
    file.extend_from_slice(b"tail");
    assert_eq!(read("a.ply", file).report.trailing_bytes, 4);
    assert_eq!(read("a.ply", format!("{SQUARE_PLY}\n\n")).report.trailing_bytes, 0);
    let loaded = read("a.ply", format!("{SQUARE_PLY}\n7 8"));
    assert_says(&loaded.report.summary(), &["3 bytes after the end of the data"]);
}

fn colored(colors: Colors) -> Mesh {
    let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::new(1e-40, -0.0, f32::MAX)];
    Mesh { positions, triangles: vec![[0, 1, 2], [3, 2, 1]], colors, ..Mesh::default() }
}

#[test]
fn what_is_written_is_read_again() {
    let folder = Folder::new();
    let path = folder.put("a.ply", "what was there before");
    for colors in [
        Colors::PerTriangle(vec![[1, 2, 3], [250, 251, 252]]),
        Colors::PerVertex(vec![[1, 2, 3], [4, 5, 6], [7, 8, 9], [0, 127, 255]]),
    ] {
        let mesh = colored(colors);
        ply::write(&path, &mesh).unwrap();
        let loaded = mesh::read(&path).unwrap();
        assert_eq!(loaded.mesh, mesh);
        assert_eq!(loaded.report.summary(), "");
    }
    let materials = [Vec3::X, Vec3::Y].map(|diffuse| mesh::Material::matt("m", diffuse));
    let mesh = colored(Colors::PerMaterial { materials: materials.into(), of_triangle: vec![1, 0] });
    ply::write(&path, &mesh).unwrap();
    let colors = mesh::read(&path).unwrap().mesh.colors;
    assert_eq!(colors, Colors::PerTriangle(vec![[0, 255, 0], [255, 0, 0]]));
    assert_eq!(fs::read_dir(folder.0.path()).unwrap().count(), 1, "no temporary file is left");
}

#[test]
fn failed_writes_leave_nothing() {
    let folder = Folder::new();
    fs::create_dir(folder.0.path().join("taken.ply")).unwrap();
    for path in ["taken.ply", "no/such/folder/a.ply"].map(|p| folder.0.path().join(p)) {
        let message = ply::write(&path, &colored(Colors::default())).unwrap_err().to_string();
        assert_says(&message, &["cannot write", path.to_str().unwrap()]);
    }
    assert_eq!(fs::read_dir(folder.0.path()).unwrap().count(), 1, "only the folder in the way");
}

#[test]
fn an_independent_reader_agrees_with_the_writer() {
    use ply_rs_bw::parser::Parser;
    use ply_rs_bw::ply::{DefaultElement, Property};
    let folder = Folder::new();
    let path = folder.put("a.ply", "");
    ply::write(&path, &colored(Colors::PerTriangle(vec![[1, 2, 3], [4, 5, 6]]))).unwrap();
    let parser = Parser::<DefaultElement>::new();
    let ply = parser.read_ply(&mut fs::File::open(path).unwrap()).unwrap();
    assert_eq!(ply.payload["vertex"].len(), 4);
    let face = &ply.payload["face"][1];
    assert!(matches!(&face["vertex_indices"], Property::ListInt(i) if *i == [3, 2, 1]));
    assert!(matches!(face["green"], Property::UChar(5)));
}
