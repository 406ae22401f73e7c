//! Wavefront OBJ and MTL.

use super::{Folder, SQUARE, assert_says, read, refusal};
use raypack::Vec3;
use raypack::mesh::{self, Colors};

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
                 f -4 -3 -2\nf 1/9999999999/-7 2/0 3/x\n";
    let mesh = read("a.obj", format!("{SQUARE}{faces}")).mesh;
    assert_eq!(mesh.triangles, [[0, 1, 2]; 6], "normals and texture coordinates do not matter");
}

#[test]
fn negative_indices_count_from_where_they_stand() {
    let file = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 5 0 0\nv 6 0 0\nv 5 1 0\nf -3 -2 -1\n";
    let second = read("a.obj", file).mesh.corners(1);
    assert_eq!(second, [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0]].map(Vec3::from));
}

#[test]
fn line_ends_continuations_and_tabs_are_forgiven() {
    let file = "# C:\\models\\\r\nv\t0 0 0\r\n  v 1 0 0 \r\nv 0 \\\r\n 1 0\r\n\r\nf 1\t2 \\\r\n3";
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
fn materials_color_what_follows_them() {
    let folder = Folder::new();
    let materials = "newmtl red one\r\nKd 1 0 0\r\nnewmtl grey\nKd 0.5\nillum 99999\nd\n";
    folder.put("two words.mtl", materials);
    let faces = "f 1 2 3\nusemtl\tred one\nf 1 3 4\no x\nf 1 2 4\nusemtl grey\nf 2 3 4\n";
    let path = folder.put("a.obj", format!("mtllib two words.mtl\n{SQUARE}{faces}"));
    let loaded = mesh::read(path).unwrap();
    let colors: Vec<Vec3> = (0..4).map(|i| loaded.mesh.color(i, 0.2, 0.3)).collect();
    assert_eq!(colors, [Vec3::splat(0.7), Vec3::X, Vec3::X, Vec3::splat(0.5)]);
    let Colors::PerMaterial { materials, .. } = &loaded.mesh.colors else { panic!() };
    assert_eq!(materials[0].name, "red one");
    assert_eq!(loaded.report.summary(), "");
}

#[test]
fn material_files_are_found_behind_backslashes_and_in_lists() {
    let folder = Folder::new();
    folder.put("sub/a.mtl", "newmtl a\nKd 1 0 0\n");
    folder.put("b.mtl", "newmtl b\nKd 0 1 0");
    let libraries = "mtllib sub\\a.mtl\nmtllib none.mtl b.mtl\n";
    let faces = "usemtl a\nf 1 2 3\nusemtl b\nf 1 3 4\n";
    let loaded = mesh::read(folder.put("a.obj", format!("{libraries}{SQUARE}{faces}"))).unwrap();
    assert_eq!((loaded.mesh.color(0, 0.0, 0.0), loaded.mesh.color(1, 0.0, 0.0)), (Vec3::X, Vec3::Y));
    assert_eq!(loaded.report.missing_material_files, ["none.mtl"]);
}

#[test]
fn missing_and_broken_materials_are_said_and_not_fatal() {
    let folder = Folder::new();
    folder.put("bad.mtl", b"newmtl \xe4\nKd 0.1 zwei 0.3\nKd\nnewmtl\nmap_Kd\n");
    let faces = "usemtl wood\nf 1 2 3\nusemtl wood\nf 1 3 4\n";
    let file = format!("mtllib gone.mtl\nmtllib bad.mtl\n{SQUARE}{faces}");
    let loaded = mesh::read(folder.put("a.obj", file)).unwrap();
    assert_eq!(
        loaded.report.summary(),
        "3 MTL lines not understood; material file not found: gone.mtl; material not defined: wood"
    );
    assert_eq!(loaded.mesh.color(0, 0.0, 0.0), Vec3::splat(0.7));
}

#[test]
#[cfg(unix)]
fn a_material_file_without_an_end_is_missing() {
    let loaded = read("a.obj", format!("mtllib /dev/zero\n{SQUARE}f 1 2 3\n"));
    assert_eq!(loaded.report.missing_material_files, ["/dev/zero"]);
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
}

#[test]
fn bad_vertices_are_refused_with_their_line() {
    assert_says(&refusal("a.obj", "v 0 0 0\nv 1 x 0\n"), &["line 2", "position"]);
    assert_says(&refusal("a.obj", "v 0 0\n"), &["line 1", "position"]);
    assert_says(&refusal("a.obj", "v 0 0 0 1 0\n"), &["line 1", "color"]);
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
