//! Wavefront OBJ.

use super::{Folder, SQUARE, assert_says, read, refusal, same_in_files};
use raypack::Vec3;
use raypack::mesh::{self, Attributes, Colors, Normal};

#[test]
fn polygons_become_fans() {
    let loaded = read("a.obj", format!("{SQUARE}f 1 2 3 4\n"));
    assert_eq!(loaded.mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(loaded.mesh.positions[2], Vec3::new(1.0, 1.0, 0.0));
    assert_eq!(loaded.mesh.colors, Colors::default());
    assert_eq!(loaded.report.summary(), "1 polygon split into triangles");
}

#[test]
fn every_form_of_index_is_understood() {
    let faces = "vt 0 0\nvn 0 0 1\nf 1 2 3\nf 1/1 2/1 3/1\nf 1//1 2//1 3//1\nf 1/1/1 2/1/1 3/1/1\n\
                 f -4 -3 -2\nf -4/-1/-1 2/1/ 3/\n";
    let mesh = read("a.obj", format!("{SQUARE}{faces}")).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]; 6], "texture coordinates and normals make no other vertices");
}

const LOOKS: &str = "vt 0.5 0.25\nvt 1 2 3\nvt 7\nvn 0 0 2\nvn 1 0 0\nvn 0 -3 0\n";

/// What the file's three `vt` and `vn` say, by number; 0 is none.
fn corners(uv: [usize; 3], normals: [usize; 3]) -> Attributes {
    Attributes {
        uv: uv.map(|i| [[0.0, 0.0], [0.5, 0.25], [1.0, 2.0], [7.0, 0.0]][i]),
        normals: normals.map(|i| [Vec3::ZERO, Vec3::Z, Vec3::X, Vec3::NEG_Y].map(Normal::encode)[i]),
    }
}

#[test]
fn texture_coordinates_and_normals_stay_with_their_corners() {
    let faces = "f 1 2 3\no x\nf 1/1/3 2/2/2 3/3/1 4/2/1\ns 1\nf 1 2 2\nusemtl y\nf 1//1 2/2 -2/-1/-2\nf 1 2 4\nf 1/1 2/2\n";
    let loaded = read("a.obj", format!("{SQUARE}{LOOKS}{faces}"));
    assert_eq!(loaded.mesh.triangles.len(), 5, "and one without area, and one of two corners");
    let expected = [
        corners([0; 3], [0; 3]),
        corners([1, 2, 3], [3, 2, 1]),
        corners([1, 3, 2], [3, 1, 1]),
        corners([0, 2, 3], [1, 0, 2]),
        corners([0; 3], [0; 3]),
    ];
    assert_eq!(loaded.mesh.attributes, expected);
    assert!(read("a.obj", format!("{SQUARE}{LOOKS}f 1 2 3\nf 1/ 2// 3\n")).mesh.attributes.is_empty());
}

#[test]
fn attributes_follow_their_triangles_through_any_file() {
    // Faces of all sizes in groups and materials: all corners of a face have its number and size for coordinates.
    let mut file: String = (0..9).map(|x| format!("v {x} 0 0\n")).collect();
    let mut expected = Vec::new();
    for face in 0..200 {
        let size = 1 + (face * 7) % 9;
        file += &format!("vt {face} {size}\n");
        file += ["o a\n", "usemtl x\n", "g\n", "s off\n", "usemtl y\n"][face % 5];
        let corners = (1..=size).map(|corner| format!(" {corner}/-1"));
        file += &format!("f{}\n", corners.collect::<String>());
        let fan = (2..size).map(|last| [0, last - 1, last].map(|x| x as f32));
        expected.extend(fan.map(|xs| (xs, [[face as f32, size as f32]; 3])));
    }
    let mesh = read("a.obj", file).mesh;
    let found = mesh.attributes.iter().enumerate();
    let found = found.map(|(i, attributes)| (mesh.corners(i as u32).map(|p| p.x), attributes.uv));
    assert_eq!(found.collect::<Vec<_>>(), expected);
}

#[test]
fn texture_coordinates_and_normals_that_are_none_are_counted() {
    let looks = "vt nan 1\nvt 1 inf\nvn 0 0 0\nvn nan 0 1\nvn 0 1 0\n";
    let loaded = read("a.obj", format!("{SQUARE}{looks}f 1/1/1 2/2/2 3/1/3\n"));
    assert_eq!(loaded.mesh.attributes[0].uv, [[0.0, 1.0], [1.0, 0.0], [0.0, 1.0]]);
    assert_eq!(loaded.mesh.attributes[0].normals, [Normal::NONE, Normal::NONE, Normal::encode(Vec3::Y)]);
    assert_says(
        &loaded.report.summary(),
        &["2 texture coordinates not finite made 0", "2 normals without a direction ignored"],
    );
}

#[test]
fn vertex_colors_count_unless_materials_do_more() {
    let folder = Folder::new();
    folder.put("a.mtl", "newmtl plain\nKd 1 0 0\nKs 0.5\nillum 2\nnewmtl lamp\nKd 0\nKe 9\n");
    let colored = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\n";
    let of = |material: &str| {
        let file = format!("mtllib a.mtl\n{colored}usemtl {material}\nf 1 2 3\n");
        let path = folder.put("a.obj", file);
        let loaded = mesh::read(&path).unwrap();
        same_in_files(&path, &loaded);
        loaded
    };
    let plain = of("plain");
    assert!(matches!(plain.mesh.colors, Colors::PerVertex(_)));
    assert_eq!(plain.report.summary(), "");
    let lamp = of("lamp");
    assert!(matches!(lamp.mesh.colors, Colors::PerMaterial { .. }));
    assert_says(&lamp.report.summary(), &["3 vertex colours left out for materials that do more"]);
}

#[test]
fn negative_indices_count_from_where_they_stand() {
    let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n";
    let second = read("a.obj", file).mesh.corners(1);
    assert_eq!(second, [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]].map(Vec3::from));
}

#[test]
fn line_ends_continuations_and_tabs_are_forgiven() {
    let file = "\u{feff}# C:\\models\\\r\nv\t0 0 0\r\n  v 1 0 0 \r\nv 0 \\\r\n 1 0\r\n\r\nf 1\t2 \\\r\n3";
    let mesh = read("a.obj", file).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(mesh.positions, [Vec3::ZERO, Vec3::X, Vec3::Y]);
}

#[test]
fn homogeneous_vertices_are_divided() {
    let mesh = read("a.obj", "v 0 0 0 1\nv 4 0 0 2\nv 0 1 0\nf 1 2 3\n").mesh;
    assert_eq!(mesh.positions[1], Vec3::new(2.0, 0.0, 0.0));
    assert_says(&refusal("a.obj", "v 0 0 0 0\n"), &["line 1", "zero"]);
}

#[test]
fn lines_points_and_short_faces_are_counted() {
    let report = read("a.obj", format!("{SQUARE}l 1 2\np 3\np 4\nf 1 2\nf 1 2 3\n")).report;
    assert_eq!((report.lines, report.points, report.short_faces), (1, 2, 1));
    assert_eq!(
        report.summary(),
        "1 face of fewer than three corners dropped; 1 line ignored; 2 points ignored; \
         1 unused vertex dropped"
    );
}

#[test]
fn vertex_colors_are_read() {
    let mesh = read("a.obj", "v 0 0 0 1 0 0\nv 1 0 0 0 1 0 1\nv 0 1 0 0 0 1\nf 3 2 1\n").mesh;
    let colors: Vec<Vec3> = [(0.0, 0.0), (1.0, 0.0), (0.0, 1.0)].map(|(u, v)| mesh.color(0, u, v)).into();
    assert_eq!(colors, [Vec3::Z, Vec3::Y, Vec3::X], "in the order of the face's corners");
}

#[test]
fn vertices_without_the_color_that_others_have_are_grey() {
    let loaded = read("a.obj", "v 0 0 0\nv 1 0 0 0 1 0\nv 0 1 0\nf 1 2 3\n");
    let grey = [mesh::linear_to_srgb(0.7); 3];
    assert_eq!(loaded.mesh.colors, Colors::PerVertex(vec![grey, [0, 255, 0], grey]));
    assert_says(&loaded.report.summary(), &["2 vertices without a colour"]);
}

#[test]
fn foreign_letters_do_no_harm() {
    let file = b"# M\xfcller\no Geh\xe4use\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    assert_eq!(read("a.obj", file).report.triangles, 1);
}

#[test]
fn bad_indices_are_refused_with_their_line() {
    let face = |face: &str| refusal("a.obj", format!("{SQUARE}\nf {face}\n"));
    assert_says(&face("1 2 5"), &["line 6", "vertex 5", "out of range", "4 vertices"]);
    assert_says(&face("1 2 0"), &["line 6", "vertex 0", "count from 1"]);
    assert_says(&face("-5 1 2"), &["line 6", "vertex -5", "out of range"]);
    assert_says(&face("1 2 99999999999999999999"), &["line 6", "no vertex number"]);
    assert_says(&face("1 2 9223372036854775807"), &["line 6", "out of range"]);
    assert_says(&face("1 2 -9223372036854775808"), &["line 6", "out of range"]);
    assert_says(&face("1 2 x\u{1b}[31m"), &["line 6", "no vertex number"]);
    assert_says(&face("/1 /2 /3"), &["line 6", "no vertex number"]);
    assert_says(
        &face("1/1 2 3"),
        &["line 6", "texture coordinate 1", "out of range", "0 texture coordinates"],
    );
    assert_says(&face("1/0 2 3"), &["line 6", "texture coordinate 0", "count from 1"]);
    assert_says(&face("1//-1 2 3"), &["line 6", "normal -1", "out of range", "0 normals"]);
    assert_says(&face("1//x 2 3"), &["line 6", "normal x", "no normal number"]);
    assert_says(&face("1/9999999999999999999999 2 3"), &["line 6", "no texture coordinate number"]);
    assert_says(&face("1///1 2 3"), &["line 6", "more than three"]);
    let looks = "vt 0 0\nvn 0 0 1\n";
    assert_says(
        &refusal("a.obj", format!("{SQUARE}{looks}f 1/2 2 3\n")),
        &["line 7", "texture coordinate 2"],
    );
    assert_says(&refusal("a.obj", format!("{SQUARE}{looks}f 1//-2 2 3\n")), &["line 7", "normal -2"]);
}

#[test]
fn bad_vertices_are_refused_with_their_line() {
    assert_says(&refusal("a.obj", "v 0 0 0\nv 1 x 0\n"), &["line 2", "position"]);
    assert_says(&refusal("a.obj", "v 0 0\n"), &["line 1", "position"]);
    assert_says(&refusal("a.obj", "v 0 0 0 1 0\n"), &["line 1", "colour"]);
    assert_says(&refusal("a.obj", "v 0 0 0 1 0 red\n"), &["line 1", "colour"]);
    assert_says(&refusal("a.obj", b"v 0 0 \xb2\n"), &["line 1"]);
}

#[test]
fn vertices_that_are_not_finite_must_not_be_used() {
    for bad in ["nan", "-inf", "1e999", "Infinity", &"9".repeat(50)] {
        let file = format!("{SQUARE}v 0 {bad} 0\nv 0 0 {bad}\n");
        let used = refusal("a.obj", format!("{file}f 1 2 5\nf 1 2 6\n"));
        assert_says(&used, &["NaN or infinite", "2, the first in line 5"]);
        let report = read("a.obj", format!("{file}f 1 2 3\n")).report;
        assert_eq!((report.unused_non_finite, report.unused_vertices), (2, 3), "{bad}");
    }
    let overflow = refusal("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1e30 0 1e-30\nf 1 2 3\n");
    assert_says(&overflow, &["NaN or infinite", "vertex 2"]);
}

#[test]
fn nothing_to_render_is_refused() {
    assert_says(&refusal("a.obj", ""), &["no triangles"]);
    assert_says(&refusal("a.obj", SQUARE), &["no triangles"]);
    assert_says(&refusal("a.obj", format!("{SQUARE}f 1 2 2\n")), &["no triangles", "twice"]);
    assert_says(&refusal("a.obj", [0_u8; 4096]), &["no triangles"]);
}

#[test]
fn the_tobj_crate_reads_the_same_triangles() {
    // Faces of all sizes in groups and materials, indices of both kinds, texture coordinates and normals.
    let mut file = String::from("vt 0 0\nvt 1 0.5\nvn 0 0 1\n");
    for face in 0..300_usize {
        file += ["o a\n", "usemtl x\n", "g b c\n", "s 1\n", ""][face % 5];
        let size = 3 + face % 4;
        (0..size).for_each(|i| file += &format!("v {face} {} {}.25e-1\n", i * i, face * i));
        let corner = |i: usize| match face % 3 {
            0 => format!(" {}", i as i64 - size as i64),
            1 => format!(" {}/1", i as i64 - size as i64),
            _ => format!(" {}/2/1", i as i64 - size as i64),
        };
        file += &format!("f{}\n", (0..size).map(corner).collect::<String>());
        if face > 10 {
            file += &format!("f {} 1 {}\n", face + 7, 2 * face);
        }
    }
    let options = tobj::LoadOptions { triangulate: true, single_index: true, ..Default::default() };
    let (models, _) = tobj::load_obj_buf(&mut file.as_bytes(), &options, |_| Ok(Default::default())).unwrap();
    let corners_of = |tobj::Model { mesh, .. }: &tobj::Model| {
        let (positions, triangles) = (mesh.positions.as_chunks::<3>().0, mesh.indices.as_chunks::<3>().0);
        triangles.iter().map(|t| t.map(|i| Vec3::from_array(positions[i as usize]))).collect::<Vec<_>>()
    };
    let expected: Vec<[Vec3; 3]> = models.iter().flat_map(corners_of).collect();
    let mesh = read("a.obj", file).mesh;
    assert_eq!(mesh.triangles.len(), expected.len());
    assert!((0..).zip(&expected).all(|(i, corners)| mesh.corners(i) == *corners));
}
