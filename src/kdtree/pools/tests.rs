use super::*;
use crate::geometry::Aabb;
use crate::kdtree::{BuildParams, Exit, Tree};
use crate::mesh::Mesh;
use crate::mesh::generate::shapes;
use glam::Vec3;

/// All chunks of a leaf: ids, and the corners that they hold.
fn leaf(pools: &Pools, mut word: usize) -> Vec<(u32, [[f32; 3]; 3])> {
    let mut triangles = Vec::new();
    loop {
        let chunk = Chunk::at(pools.words(), word);
        assert!((1..=MOST).contains(&chunk.count()), "{} triangles", chunk.count());
        let rows = [chunk.row(0), chunk.row(1), chunk.row(2)];
        for lane in 0..chunk.count() {
            let corner = |which: usize| {
                let vertex = (chunk.corners()[lane] >> (4 * which) & 15) as usize;
                rows.map(|row| row[vertex])
            };
            triangles.push((chunk.ids()[lane] as u32, [corner(0), corner(1), corner(2)]));
        }
        match chunk.next() {
            0 => return triangles,
            next => word += next,
        }
    }
}

/// The triangles of the leaf that a point inside the bounds is in; from above if the point is in a plane.
fn leaf_at(pools: &Pools, point: Vec3) -> Vec<(u32, [[f32; 3]; 3])> {
    let mut line = &pools.lines()[0];
    loop {
        let mut exit = 0;
        for level in 0..3 {
            let place = match level {
                0 => 0,
                1 => 4 * exit + 1,
                _ => 4 * (exit >> 1) + 2 + (exit & 1),
            };
            let axis = ((line.exits[place] & 3) as usize).min(2);
            exit = 2 * exit + usize::from(line.planes[place] <= point[axis]);
        }
        let to = Exit(line.exits[exit]);
        if to.is_leaf() {
            return leaf(pools, to.record());
        }
        if to.line() == 0 {
            return Vec::new();
        }
        line = &pools.lines()[to.line()];
    }
}

fn tree_of(mesh: &Mesh) -> KdTree {
    let tree = KdTree::build(mesh, &BuildParams::default(), None).expect("builds");
    assert!(tree.pools().is_none(), "nobody has asked for them");
    assert!(tree.make_pools());
    tree
}

#[test]
fn a_pool_holds_what_the_trees_leaf_names_and_its_corners() {
    for mesh in [shapes::soup(3000, 1), shapes::soup(20, 2), shapes::soup(1, 3)] {
        let tree = tree_of(&mesh);
        let pools = tree.pools().expect("they are made");
        let bounds: &Aabb = tree.bounds();
        let mut part = 0.0f64;
        for _ in 0..2000 {
            let mut next = || {
                part = (part + 0.618_033_988_749_895).fract();
                part as f32
            };
            let point = bounds.min + (bounds.max - bounds.min) * Vec3::new(next(), next(), next());
            let mut node = tree.root();
            while !node.is_leaf() {
                node = tree.children(node)[usize::from(node.split() <= point[node.axis()])];
            }
            let found = leaf_at(pools, point);
            for (id, corners) in &found {
                assert_eq!(tree.triangles()[*id as usize].corners, *corners);
            }
            let ids: Vec<u32> = found.iter().map(|(id, _)| *id).collect();
            assert!(ids.is_sorted_by(|a, b| a < b), "each once: {ids:?}");
            assert!(tree.primitives(node).iter().all(|id| ids.contains(id)), "{point}");
        }
    }
}

#[test]
fn a_leaf_of_many_triangles_is_a_row_of_chunks() {
    // Fans around one vertex share it; triangles apart share nothing, and five fill a chunk.
    let fan = |i: u32| {
        let (sin, cos) = (i as f32 * 0.1).sin_cos();
        Vec3::new(cos, sin, 0.0)
    };
    let fans: Vec<Triangle> = (0..40)
        .map(|i| Triangle::new([Vec3::ZERO, fan(i), fan(i + 1)].map(|corner| corner.to_array())))
        .collect();
    let apart: Vec<Triangle> = (0..40)
        .map(|i| Triangle::new([[i as f32, 0.0, 0.0], [i as f32, 1.0, 0.0], [i as f32, 0.0, 1.0]]))
        .collect();
    for (triangles, most) in [(fans, 14), (apart, 5)] {
        let ids: Vec<u32> = (0..40).rev().collect();
        let mut words = vec![7; 3];
        chunk::write(&ids, &triangles, &mut words);
        let chunks = chunk::count(&ids, &triangles, &mut chunk::Vertices::default());
        assert_eq!(chunks, ids.len().div_ceil(most));
        words.resize(words.len() + chunk::SPAN, 0);
        let pools = Pools { lines: Lines::pack(&[Node::leaf(0, 0)], &Aabb::EMPTY), words };
        let found = leaf(&pools, 3);
        assert_eq!(found.iter().map(|(id, _)| *id).collect::<Vec<_>>(), ids);
        for (id, corners) in found {
            assert_eq!(triangles[id as usize].corners, corners);
        }
    }
}

#[test]
fn zeros_of_both_signs_are_two_vertices() {
    let signs = [Triangle::new([[0.0, 0.0, 1.0], [-0.0, 0.0, 1.0], [1.0, 0.0, 0.0]])];
    let mut vertices = chunk::Vertices::default();
    assert_eq!(vertices.take(&signs[0].corners), Some([0, 1, 2]));
    assert_eq!(vertices.take(&signs[0].corners), Some([0, 1, 2]));
}

#[test]
fn pools_are_the_same_for_any_number_of_threads() {
    let mesh = shapes::soup(5000, 4);
    let words_with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| tree_of(&mesh).pools().expect("they are made").words().to_vec())
    };
    assert_eq!(words_with(1), words_with(3));
}
