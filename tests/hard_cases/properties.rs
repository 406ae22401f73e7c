//! Whatever triangles and rays chance brings: all ways to trace agree, and exact is what exact
//! arithmetic says. On the lattice, corners, edges, planes and distances coincide all the time.

use crate::meshes::of_triangles;
use crate::scene::Scene;
use proptest::prelude::*;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Ray};
use raypack::study::reference::Reference;

/// A point; on a lattice of whole numbers, or anywhere.
fn point(lattice: bool) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-3.0f32..3.0).prop_map(move |p| {
        let p = Vec3::from_array(p);
        if lattice { p.round() } else { p }
    })
}

fn triangles(lattice: bool) -> impl Strategy<Value = Vec<[Vec3; 3]>> {
    prop::collection::vec([point(lattice), point(lattice), point(lattice)], 1..30)
}

/// Where a ray starts and what it is aimed at.
#[derive(Clone, Debug)]
enum Aim {
    Anywhere(Vec3, Vec3),
    /// From a point through a corner of a triangle.
    Corner(Vec3, prop::sample::Index, usize),
    /// From a corner of one triangle to a corner of another.
    Between(prop::sample::Index, usize, prop::sample::Index, usize),
    /// Along an axis from the plane of a corner.
    Axis(Vec3, prop::sample::Index, usize, usize),
}

fn aims(lattice: bool) -> impl Strategy<Value = Vec<Aim>> {
    let index = any::<prop::sample::Index>;
    let aim = prop_oneof![
        (point(lattice), point(lattice)).prop_map(|(from, to)| Aim::Anywhere(from, to)),
        (point(lattice), index(), 0..3usize).prop_map(|(from, t, c)| Aim::Corner(from, t, c)),
        (index(), 0..3usize, index(), 0..3usize).prop_map(|(t, c, u, d)| Aim::Between(t, c, u, d)),
        (point(lattice), index(), 0..3usize, 0..6usize).prop_map(|(p, t, c, way)| Aim::Axis(p, t, c, way)),
    ];
    prop::collection::vec(aim, 1..30)
}

fn ray(aim: &Aim, triangles: &[[Vec3; 3]]) -> Ray {
    match aim {
        Aim::Anywhere(from, to) => Ray::new(*from, *to - *from),
        Aim::Corner(from, t, c) => Ray::new(*from, t.get(triangles)[*c] - *from),
        Aim::Between(t, c, u, d) => {
            let from = t.get(triangles)[*c];
            Ray::new(from, u.get(triangles)[*d] - from)
        }
        Aim::Axis(p, t, c, way) => {
            let (axis, sign) = (way % 3, if way / 3 == 0 { 1.0 } else { -1.0 });
            let mut origin = t.get(triangles)[*c];
            origin[axis] = p[axis];
            let mut direction = Vec3::ZERO;
            direction[axis] = sign;
            Ray::new(origin, direction)
        }
    }
}

fn trial(triangles: &[[Vec3; 3]], aims: &[Aim]) {
    let mesh = of_triangles(triangles.iter().copied());
    let rays: Vec<Ray> = aims.iter().map(|aim| ray(aim, triangles)).collect();
    let reference = Reference::new(&mesh);
    let truth = reference.closest_of(&rays);
    Scene::new("chance", 0, mesh).check(&rays, |accuracy, i, hit| {
        let truth = &truth[i];
        let wrong = accuracy == Accuracy::Exact
            && (hit.is_hit() != truth.is_hit()
                || (hit.is_hit() && (hit.t.to_bits().abs_diff(truth.t.to_bits()) > 1)));
        wrong.then(|| format!("instead of {truth:?}"))
    });
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 120, failure_persistence: None, ..Default::default() })]

    #[test]
    fn chance(triangles in triangles(false), aims in aims(false)) {
        trial(&triangles, &aims);
    }

    #[test]
    fn chance_on_a_lattice(triangles in triangles(true), aims in aims(true)) {
        trial(&triangles, &aims);
    }
}
