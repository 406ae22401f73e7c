//! The last step of every reader: what a file held becomes a mesh that keeps its promises.
//!
//! The policy, in the order in which it applies:
//!
//! | what | becomes |
//! |---|---|
//! | a triangle that names one vertex twice | dropped, counted |
//! | more triangles than [`MAX_TRIANGLES`], or none | an error |
//! | a NaN or infinite vertex that a triangle uses | an error: dropping the triangle would leave a hole |
//! | a triangle without area, with three different vertices | kept, counted |
//! | a vertex that no triangle uses | dropped, counted |
//!
//! Triangles keep their order; primitive ids are places among those that were kept.

use super::{Colors, Mesh, ReadReport};
use glam::Vec3;

/// The most triangles that a mesh may have: a tree spends two of an index's bits otherwise.
pub const MAX_TRIANGLES: usize = (u32::MAX >> 2) as usize;

/// A vertex that cannot be used, and how many there are like it.
#[derive(Debug, PartialEq)]
pub(super) struct NonFinite {
    /// Index of the first.
    pub first: u32,
    /// How many.
    pub count: u64,
}

/// Why what was read is no mesh.
#[derive(Debug, PartialEq)]
pub(super) enum Unusable {
    /// No triangles, or none after the degenerate ones were dropped.
    NoTriangles,
    /// Too many; this many.
    TooManyTriangles(usize),
    /// Triangles use vertices that are nowhere.
    NonFinite(NonFinite),
}

/// Applies the policy of this module to `mesh`, whose indices, colours and attributes are in range, and adds
/// what it did to `report`.
pub(super) fn check(mut mesh: Mesh, report: &mut ReadReport) -> Result<Mesh, Unusable> {
    drop_degenerate(&mut mesh, report);
    match mesh.triangles.len() {
        0 => return Err(Unusable::NoTriangles),
        n if n > MAX_TRIANGLES => return Err(Unusable::TooManyTriangles(n)),
        _ => {}
    }
    let used = used_vertices(&mesh);
    refuse_non_finite(&mesh, &used)?;
    report.zero_area_triangles = count_zero_area(&mesh);
    drop_unused(&mut mesh, &used, report);
    report.triangles = mesh.triangles.len() as u64;
    report.vertices = mesh.positions.len() as u64;
    Ok(mesh)
}

fn drop_degenerate(mesh: &mut Mesh, report: &mut ReadReport) {
    let sound = |t: &[u32; 3]| t[0] != t[1] && t[1] != t[2] && t[2] != t[0];
    let kept = mesh.triangles.iter().filter(|t| sound(t)).count();
    report.degenerate_triangles = (mesh.triangles.len() - kept) as u64;
    if report.degenerate_triangles == 0 {
        return;
    }
    let triangles = &mesh.triangles;
    match &mut mesh.colors {
        Colors::PerTriangle(colors) => retain_where(colors, |i| sound(&triangles[i])),
        Colors::PerMaterial { of_triangle, .. } => retain_where(of_triangle, |i| sound(&triangles[i])),
        Colors::Uniform(_) | Colors::PerVertex(_) => {}
    }
    if !mesh.attributes.is_empty() {
        retain_where(&mut mesh.attributes, |i| sound(&triangles[i]));
    }
    mesh.triangles.retain(sound);
}

fn used_vertices(mesh: &Mesh) -> Vec<bool> {
    let mut used = vec![false; mesh.positions.len()];
    for &i in mesh.triangles.iter().flatten() {
        used[i as usize] = true;
    }
    used
}

fn refuse_non_finite(mesh: &Mesh, used: &[bool]) -> Result<(), Unusable> {
    let mut bad = (0..).zip(&mesh.positions).zip(used).filter(|((_, p), used)| **used && !p.is_finite());
    match bad.next() {
        None => Ok(()),
        Some(((first, _), _)) => Err(Unusable::NonFinite(NonFinite { first, count: 1 + bad.count() as u64 })),
    }
}

/// Counts triangles whose corners lie on one line (in double precision, in which products of
/// coordinate differences do not underflow).
fn count_zero_area(mesh: &Mesh) -> u64 {
    mesh.triangles.iter().filter(|t| is_flat(t.map(|i| mesh.positions[i as usize]))).count() as u64
}

/// Whether corners lie on one line.
pub(super) fn is_flat(corners: [Vec3; 3]) -> bool {
    let [a, b, c] = corners.map(|corner| corner.as_dvec3());
    (b - a).cross(c - a) == glam::DVec3::ZERO
}

fn drop_unused(mesh: &mut Mesh, used: &[bool], report: &mut ReadReport) {
    let unused = used.iter().filter(|u| !**u).count() as u64;
    if unused == 0 {
        return;
    }
    report.unused_vertices += unused;
    let non_finite = |(p, used): &(&Vec3, &bool)| !**used && !p.is_finite();
    report.unused_non_finite += mesh.positions.iter().zip(used).filter(non_finite).count() as u64;
    let mut next = 0;
    let new_index: Vec<u32> = used
        .iter()
        .map(|&used| {
            let index = next;
            next += u32::from(used);
            index
        })
        .collect();
    for i in mesh.triangles.iter_mut().flatten() {
        *i = new_index[*i as usize];
    }
    retain_where(&mut mesh.positions, |i| used[i]);
    if let Colors::PerVertex(colors) = &mut mesh.colors {
        retain_where(colors, |i| used[i]);
    }
}

/// Keeps the items at the indices that `keep` accepts.
fn retain_where<T>(items: &mut Vec<T>, keep: impl Fn(usize) -> bool) {
    let mut index = 0;
    items.retain(|_| {
        index += 1;
        keep(index - 1)
    });
    items.shrink_to_fit();
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Attributes;

    fn points(xs: &[f32]) -> Vec<Vec3> {
        xs.iter().map(|&x| Vec3::new(x, x * x, 0.0)).collect()
    }

    fn checked(mesh: Mesh) -> Result<(Mesh, ReadReport), Unusable> {
        let mut report = ReadReport::default();
        check(mesh, &mut report).map(|mesh| (mesh, report))
    }

    #[test]
    fn degenerate_triangles_go_with_what_they_have() {
        let uv = |x: f32| Attributes { uv: [[x; 2]; 3], ..Attributes::NONE };
        let mesh = Mesh {
            positions: points(&[0.0, 1.0, 2.0, 3.0]),
            triangles: vec![[0, 0, 1], [0, 1, 2], [1, 2, 1], [1, 2, 3]],
            colors: Colors::PerTriangle(vec![[1; 3], [2; 3], [3; 3], [4; 3]]),
            attributes: [1.0, 2.0, 3.0, 4.0].map(uv).to_vec(),
            ..Mesh::default()
        };
        let (mesh, report) = checked(mesh).unwrap();
        assert_eq!(mesh.triangles, [[0, 1, 2], [1, 2, 3]]);
        assert_eq!(mesh.attributes, [2.0, 4.0].map(uv));
        assert_eq!(mesh.colors, Colors::PerTriangle(vec![[2; 3], [4; 3]]));
        assert_eq!((report.degenerate_triangles, report.triangles), (2, 2));
    }

    #[test]
    fn unused_vertices_go_with_their_colors() {
        let mesh = Mesh {
            positions: points(&[f32::NAN, 0.0, 9.0, 1.0, 2.0]),
            triangles: vec![[1, 3, 4]],
            colors: Colors::PerVertex(vec![[0; 3], [1; 3], [2; 3], [3; 3], [4; 3]]),
            ..Mesh::default()
        };
        let (mesh, report) = checked(mesh).unwrap();
        assert_eq!(mesh.positions, points(&[0.0, 1.0, 2.0]));
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.colors, Colors::PerVertex(vec![[1; 3], [3; 3], [4; 3]]));
        assert_eq!((report.unused_vertices, report.unused_non_finite, report.vertices), (2, 1, 3));
    }

    #[test]
    fn used_vertices_must_be_finite() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::new(0.0, f32::INFINITY, 0.0), Vec3::NAN],
            triangles: vec![[0, 1, 2], [0, 1, 3]],
            colors: Colors::default(),
            ..Mesh::default()
        };
        assert_eq!(checked(mesh).unwrap_err(), Unusable::NonFinite(NonFinite { first: 2, count: 2 }));
    }

    #[test]
    fn collinear_triangles_are_kept_and_counted() {
        let mesh = Mesh {
            positions: vec![Vec3::ZERO, Vec3::X, Vec3::X * 2.0, Vec3::Y * 1e-30],
            triangles: vec![[0, 1, 2], [0, 1, 3]],
            colors: Colors::default(),
            ..Mesh::default()
        };
        let (mesh, report) = checked(mesh).unwrap();
        assert_eq!((mesh.triangles.len(), report.zero_area_triangles), (2, 1));
    }

    #[test]
    fn nothing_left_is_an_error() {
        let mesh = Mesh {
            positions: points(&[0.0, 1.0]),
            triangles: vec![[0, 1, 1]],
            colors: Colors::default(),
            ..Mesh::default()
        };
        assert_eq!(checked(mesh).unwrap_err(), Unusable::NoTriangles);
    }
}
