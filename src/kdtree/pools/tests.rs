use super::*;
use crate::kdtree::{BuildParams, KdTree, Tree};
use crate::mesh::Mesh;
use crate::mesh::generate::shapes;
use crate::weyl::uniform;
use glam::Vec3;

/// A triangle's id, and its corners.
type Held = (u32, [[f32; 3]; 3]);

/// All chunks of a leaf: ids, and the corners that they hold.
fn leaf(pools: &Pools, mut word: usize) -> Vec<Held> {
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

/// What lies in the pools of all boxes that a point lies in, or beside by `slack`; and how many boxes those are.
fn pools_at(pools: &Pools, point: Vec3, slack: f32) -> (Vec<Held>, usize) {
    let (mut found, mut count) = (Vec::new(), 0);
    let mut stack = vec![Way::ROOT];
    while let Some(way) = stack.pop() {
        if way.is_pool() {
            found.extend(leaf(pools, way.word()));
            count += 1;
            continue;
        }
        let Boxes { faces, ways, .. } = &pools.nodes()[way.node()];
        let holds = |lane: &usize| {
            (0..3).all(|axis| {
                let [least, greatest] = faces[axis].map(|row| row[*lane]);
                least - slack <= point[axis] && point[axis] <= greatest + slack
            })
        };
        stack.extend((0..8).filter(holds).map(|lane| Way(ways[lane])));
    }
    (found, count)
}

fn tree_of(mesh: &Mesh) -> KdTree {
    let tree = KdTree::build(mesh, &BuildParams::default(), None).expect("builds");
    assert!(tree.pools().is_none(), "nobody has asked for them");
    assert!(tree.make_pools(MOST));
    tree
}

#[test]
fn every_point_of_a_triangle_lies_in_a_box_around_a_pool_that_holds_it() {
    for mesh in [shapes::soup(3000, 1), shapes::soup(20, 2), shapes::soup(1, 3)] {
        let tree = tree_of(&mesh);
        let pools = tree.pools().expect("they are made");
        let slack = tree.bounds().extent().max_element() / (1 << 22) as f32;
        let mut number = uniform(0.0, 1.0);
        for (id, triangle) in tree.triangles().iter().enumerate() {
            let [a, b, c] = triangle.corners.map(Vec3::from_array);
            for _ in 0..8 {
                let (u, v) = (number(), number());
                let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
                let point = a + (b - a) * u + (c - a) * v;
                let (found, _) = pools_at(pools, point, slack);
                assert!(found.contains(&(id as u32, triangle.corners)), "{id} is not found in {point}");
            }
        }
    }
}

#[test]
fn orders_are_those_in_which_rays_come_to_boxes() {
    let tree = tree_of(&shapes::soup(3000, 1));
    let pools = tree.pools().expect("they are made");
    let (mut all, mut apart, mut wrong) = (0, 0, 0);
    for Boxes { faces, ways, orders } in pools.nodes() {
        let boxes = ways.iter().filter(|&&way| way != Way::NOTHING.0).count();
        all += boxes;
        let order_of = |octant: usize| -> Vec<usize> {
            (0..8).map(|place| (orders[octant] >> (4 * place) & 15) as usize).collect()
        };
        for octant in 0..8 {
            let order = order_of(octant);
            assert_eq!((0..8).filter(|lane| order.contains(lane)).count(), 8, "each has one place");
            assert!(order[boxes..].iter().all(|&lane| ways[lane] == Way::NOTHING.0), "there are {boxes}");
            assert!(order[..boxes].iter().eq(order_of(7 - octant)[..boxes].iter().rev()), "there and back");
            for (place, &later) in order[..boxes].iter().enumerate() {
                for &earlier in &order[place + 1..boxes] {
                    // Where they do not overlap, there is a plane between them.
                    let lies_before = |a: usize, b: usize| {
                        (0..3).any(|axis| match octant >> axis & 1 {
                            0 => faces[axis][1][a] <= faces[axis][0][b],
                            _ => faces[axis][1][b] <= faces[axis][0][a],
                        })
                    };
                    let is_right = lies_before(earlier, later);
                    let is_wrong = lies_before(later, earlier) && !is_right;
                    apart += usize::from(is_right || is_wrong);
                    wrong += usize::from(is_wrong);
                }
            }
        }
    }
    assert!(all > 4 * pools.nodes().len(), "{all} boxes of {} nodes", pools.nodes().len());
    assert!(apart > 1000 && 20 * wrong < apart, "{wrong} of {apart} are in the wrong order");
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
        let chunks = chunk::count(&ids, &triangles);
        assert_eq!(chunks, ids.len().div_ceil(most));
        words.resize(words.len() + chunk::SPAN, 0);
        let pools =
            Pools { nodes: Vec::new().into(), words: words.into(), most: MOST, corners: [[0.0; 4]; 2] };
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

/// Pools of which something is changed.
fn changed(pools: &Pools, change: impl FnOnce(&mut Vec<Boxes>, &mut Vec<u32>)) -> Pools {
    let (mut nodes, mut words) = (pools.nodes().to_vec(), pools.words().to_vec());
    change(&mut nodes, &mut words);
    Pools::of_parts(nodes.into(), words.into(), pools.most()).expect("of possible sizes")
}

#[test]
fn pools_that_were_made_are_whole() {
    let sliver = Mesh { triangles: vec![[0, 1, 2]; 3], ..shapes::soup(1, 5) };
    for mesh in [shapes::soup(2000, 1), shapes::soup(9, 2), shapes::soup(1, 3), sliver] {
        for most in [8, MOST] {
            let tree = KdTree::build(&mesh, &BuildParams::default(), None).expect("builds");
            assert!(tree.make_pools(most));
            tree.pools().expect("they are made").validate(tree.triangles()).expect("whole");
        }
    }
}

#[test]
fn pools_that_are_not_whole_are_found_out() {
    let tree = tree_of(&shapes::soup(2000, 1));
    let pools = tree.pools().expect("they are made");
    let (nodes, words) = (pools.nodes(), pools.words());
    let is_pool = |way: &i32| Way(*way).is_pool() && Way(*way) != Way::NOTHING;
    let lane_of = |node: &Boxes, wanted: bool| node.ways.iter().position(|way| is_pool(way) == wanted);
    let (with_pool, pool) = (0..nodes.len())
        .find_map(|node| lane_of(&nodes[node], true).map(|lane| (node, lane)))
        .expect("there are pools");
    let inner = lane_of(&nodes[0], false).expect("the root leads to nodes");
    let word = Way(nodes[with_pool].ways[pool]).word();
    let found_out = |change: &dyn Fn(&mut Vec<Boxes>, &mut Vec<u32>), expected: &str| {
        let message = changed(pools, change).validate(tree.triangles()).expect_err(expected);
        assert!(message.contains(expected), "\"{message}\" is not about {expected}");
    };
    found_out(&|nodes, _| nodes[0].ways[inner] = i32::MAX, "there is no node of boxes");
    found_out(&|nodes, _| nodes[0].ways[inner] = 0, "two boxes lead to node of boxes 0");
    found_out(&|nodes, _| nodes.push(nodes[0]), &format!("no box leads to node of boxes {}", nodes.len()));
    found_out(&|nodes, _| nodes[0].orders[3] = 0, "the order for octant 3 of node of boxes 0");
    found_out(&|nodes, _| nodes[with_pool].ways[pool] = Way::to_pool(MAX_WORD).0, "beyond the last");
    let below = nodes[0].ways[inner] as usize;
    found_out(
        &|nodes, _| nodes[below].faces[1][1][0] = 1e30,
        &format!("a box of node of boxes {below} is larger"),
    );
    found_out(&|nodes, _| nodes[with_pool].faces[0][1][pool] = -1e30, "is empty, and leads to something");
    // Without a pool, some triangle is in none, or not all of it.
    found_out(
        &|nodes, _| {
            nodes[with_pool].ways[pool] = Way::NOTHING.0;
            for side in 0..2 {
                nodes[with_pool].faces[0][side][pool] = [1.0, -1.0][side];
            }
        },
        "no box around a corner of triangle",
    );
    let ids = word + (words[word] >> 15 & 0x7f) as usize;
    found_out(&|_, words| words[ids] = 2000, "names triangle 2000");
    found_out(&|_, words| words[ids] ^= 1, "holds another corner 0 of triangle");
    found_out(&|_, words| words[word] &= !31, "a chunk of 0 triangles");
}

#[test]
fn parts_of_impossible_sizes_are_refused() {
    let node = Boxes { faces: [[[0.0; 8]; 2]; 3], ways: [Way::NOTHING.0; 8], orders: [0; 8] };
    let refused = |nodes: usize, words: usize, most: usize, expected: &str| {
        let pools = Pools::of_parts(vec![node; nodes].into(), vec![0; words].into(), most);
        let message = pools.expect_err(expected);
        assert!(message.contains(expected), "\"{message}\" is not about {expected}");
    };
    refused(0, 2 + chunk::SPAN, 16, "0 is no number of nodes");
    refused(1, 1 + chunk::SPAN, 16, "words are no pools");
    refused(1, 2 + chunk::SPAN, 0, "not 0");
    refused(1, 2 + chunk::SPAN, 17, "not 17");
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
