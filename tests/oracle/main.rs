//! Every kernel, width and instruction set against two oracles:
//!
//! - *the same test without a tree*: the watertight test against every triangle. The hit must be
//!   the same to the bit: the tree may save work, it may not change an answer.
//! - *double precision*: a different test (Möller & Trumbore 1997) against every triangle in
//!   `f64`. Answers may differ only where the ray passes an edge within rounding.

mod brute;
mod properties;
mod scenes;

use brute::{Double, Verdict};
use raypack::geometry::{Accuracy, Hit, Ray};
use raypack::kdtree::BuildParams;
use raypack::mesh::Mesh;
use raypack::simd::Isa;
use raypack::traverse::{Accel, Kernel};

/// Rays per scene.
const RAYS: usize = 4000;

/// Runs every kernel on every instruction set and compares its answers with the expected ones.
fn check_kernels(
    name: &str,
    accuracy: Accuracy,
    mesh: &Mesh,
    params: &BuildParams,
    rays: &[Ray],
    expected: &[Hit],
) {
    let mut accel = Accel::build(mesh, params).expect("builds");
    accel.set_accuracy(accuracy);
    accel.tree().validate().unwrap_or_else(|fault| panic!("{name}: {fault}"));
    for isa in Isa::available() {
        accel.set_isa(isa);
        for kernel in Kernel::ALL {
            let mut hits = vec![Hit::MISS; rays.len()];
            accel.intersect_many(kernel, rays, &mut hits);
            let mut occluded = vec![false; rays.len()];
            accel.occluded_many(kernel, rays, &mut occluded);
            for i in 0..rays.len() {
                let (got, want) = (hits[i], expected[i]);
                assert!(
                    bits(&got) == bits(&want) && occluded[i] == want.is_hit(),
                    "{name}, {accuracy} {kernel} on {isa}: {:?} gives {got:?} (occluded: {}), not {want:?}",
                    rays[i],
                    occluded[i]
                );
            }
        }
    }
}

/// A hit as bits, so that equality means identity.
fn bits(hit: &Hit) -> [u32; 7] {
    let n = hit.normal.to_array().map(f32::to_bits);
    [hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits(), hit.primitive, n[0], n[1], n[2]]
}

#[test]
fn every_kernel_gives_what_the_test_gives_without_a_tree() {
    for (name, mesh) in scenes::all() {
        let rays = scenes::rays(&mesh, RAYS, 1);
        for accuracy in Accuracy::ALL {
            let brute = |ray| brute::same_test(&mesh, ray, accuracy);
            let expected: Vec<Hit> = rays.iter().map(brute).collect();
            let hits = expected.iter().filter(|hit| hit.is_hit()).count();
            assert!(hits * 20 > RAYS && hits < RAYS, "{name}: {hits} of {RAYS} rays hit: nothing to compare");
            check_kernels(name, accuracy, &mesh, &BuildParams::default(), &rays, &expected);
            // A tree with the smallest leaves and the most planes has the most ways to lose a hit.
            let deep =
                BuildParams { traversal_cost: 0.1, min_leaf: 1, exact_below: 64, ..Default::default() };
            check_kernels(name, accuracy, &mesh, &deep, &rays, &expected);
        }
    }
}

#[test]
fn hits_agree_with_double_precision() {
    for (name, mesh) in scenes::all() {
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let double = Double::new(&mesh);
        let rays = scenes::rays(&mesh, RAYS, 2);
        let mut unsure = 0;
        for ray in &rays {
            let hit = accel.intersect(ray);
            match double.judge(ray, &hit) {
                Verdict::Right => {}
                Verdict::Unsure => unsure += 1,
                Verdict::Wrong(why) => panic!("{name}: {ray:?} gives {hit:?}: {why}"),
            }
        }
        // Rays aimed at corners and edges are unsure by design: they are a sixth of all.
        assert!(unsure * 4 < RAYS, "{name}: {unsure} of {RAYS} rays are too close to an edge to say");
    }
}
