//! Whatever triangles and rays chance brings, every kernel answers as the test does without a
//! tree. In the grid mode coordinates are small integers, so planes, corners, edges and
//! distances coincide all the time.

use crate::{brute, check_kernels};
use proptest::prelude::*;
use raypack::Vec3;
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::{Colors, Mesh};

fn point(grid: bool) -> impl Strategy<Value = Vec3> {
    prop::array::uniform3(-4.0f32..4.0).prop_map(move |p| {
        let p = Vec3::from_array(p);
        if grid { p.round() } else { p }
    })
}

fn mesh(grid: bool) -> impl Strategy<Value = Mesh> {
    prop::collection::vec([point(grid), point(grid), point(grid)], 1..60).prop_map(|triangles| {
        let positions: Vec<Vec3> = triangles.into_iter().flatten().collect();
        let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
    })
}

fn rays(grid: bool) -> impl Strategy<Value = Vec<Ray>> {
    let ray = (point(grid), point(grid), 0.0f32..2.0, 0.0f32..4.0);
    let ray = ray.prop_map(move |(origin, direction, a, b)| {
        let (tnear, tfar) = if grid { (a.round(), b.round()) } else { (a, b) };
        Ray::segment(origin, direction, tnear, tfar)
    });
    prop::collection::vec(ray, 1..40)
}

fn same_everywhere(mesh: &Mesh, rays: &[Ray]) {
    let params = BuildParams { traversal_cost: 0.3, min_leaf: 1, ..Default::default() };
    for accuracy in Accuracy::ALL {
        let brute = |ray| brute::same_test(mesh, ray, accuracy);
        let expected: Vec<Hit> = rays.iter().map(brute).collect();
        check_kernels("chance", accuracy, mesh, &params, rays, &expected);
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..Default::default() })]

    #[test]
    fn chance_meshes(mesh in mesh(false), rays in rays(false)) {
        same_everywhere(&mesh, &rays);
    }

    #[test]
    fn chance_meshes_on_a_grid(mesh in mesh(true), rays in rays(true)) {
        same_everywhere(&mesh, &rays);
    }
}
