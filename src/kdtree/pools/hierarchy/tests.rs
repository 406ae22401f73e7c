use super::*;
use crate::mesh::generate::shapes;
use glam::Vec3;

fn soup(count: usize, seed: u64) -> Vec<Triangle> {
    let mesh = shapes::soup(count, seed);
    (0..count as u32).map(|id| Triangle::new(mesh.corners(id).map(|corner| corner.to_array()))).collect()
}

/// Checks that boxes hold boxes, that each triangle is named, each once a leaf; how deep the deepest leaf lies.
fn check(hierarchy: &Hierarchy, triangles: &[Triangle]) -> usize {
    let Hierarchy { nodes, boxes, ids } = hierarchy;
    assert!(ids.len() <= triangles.len() + (triangles.len() as f64 * PARTS) as usize);
    let (mut named, mut deepest) = (vec![false; triangles.len()], 0);
    let mut stack = vec![(0, 0)];
    while let Some((index, depth)) = stack.pop() {
        let (node, outer) = (nodes[index], boxes[index]);
        if node.is_leaf() {
            let ids = &ids[node.references()];
            assert!(!ids.is_empty() && ids.is_sorted_by(|a, b| a < b), "{ids:?}");
            ids.iter().for_each(|&id| named[id as usize] = true);
            deepest = deepest.max(depth);
            continue;
        }
        for below in [node.below() as usize, node.below() as usize + 1] {
            assert_eq!(outer.union(boxes[below]), outer, "a box lies in the one above");
            stack.push((below, depth + 1));
        }
    }
    assert!(named.iter().all(|&is_named| is_named));
    deepest
}

/// What it costs, as builders count.
fn cost(hierarchy: &Hierarchy, triangles: &[Triangle]) -> f64 {
    let Hierarchy { nodes, boxes, ids } = hierarchy;
    let mut cost = 0.0;
    let mut stack = vec![0];
    while let Some(index) = stack.pop() {
        let node = nodes[index];
        if node.is_leaf() {
            cost += boxes[index].area() * chunk::count(&ids[node.references()], triangles) as f64;
        } else {
            cost += boxes[index].area() * CUT;
            stack.extend([node.below() as usize, node.below() as usize + 1]);
        }
    }
    cost / boxes[0].area()
}

#[test]
fn boxes_hold_boxes_and_leaves_name_all() {
    for triangles in [soup(3000, 1), soup(17, 2), soup(2, 3), soup(1, 4)] {
        check(&Hierarchy::new(&triangles), &triangles);
    }
}

#[test]
fn it_is_the_same_for_any_number_of_threads() {
    let triangles = soup(40_000, 5);
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| Hierarchy::new(&triangles))
    };
    let (one, three) = (with(1), with(3));
    assert!(one.nodes == three.nodes && one.boxes == three.boxes && one.ids == three.ids);
}

#[test]
fn long_triangles_are_parted_where_boxes_around_them_overlap() {
    // Slivers one beside the other, along an axis or across all of them.
    let sliver = |i: u32, along: Vec3| {
        let from = Vec3::X * i as f32;
        Triangle::new([from, from + along, from + Vec3::X].map(|corner| corner.to_array()))
    };
    let [straight, slanting] = [Vec3::Y, Vec3::ONE].map(|along| {
        let triangles: Vec<Triangle> = (0..200).map(|i| sliver(i, 100.0 * along)).collect();
        let hierarchy = Hierarchy::new(&triangles);
        check(&hierarchy, &triangles);

        let whole = Builder { triangles: &triangles, overlap: f64::INFINITY };
        let references = (0..200).map(|id| Reference::new(id, &triangles[id as usize])).collect();
        let whole = Hierarchy::of_loose(Loose::of_part(whole.build(references, 0, 0).part));
        assert_eq!(whole.ids.len(), 200);
        (hierarchy.ids.len(), cost(&hierarchy, &triangles) / cost(&whole, &triangles))
    });
    assert_eq!(straight, (200, 1.0));
    assert!(slanting.0 > 250 && slanting.1 < 0.8, "{slanting:?}");
}

#[test]
fn triangles_with_one_middle_are_parted_by_planes_or_not_at_all() {
    // A bundle across all axes.
    let blades: Vec<Triangle> = (0..300)
        .map(|i| {
            let (sin, cos) = (i as f32 * 0.02).sin_cos();
            let tip = Vec3::ONE + Vec3::new(cos, sin, cos * sin) * 0.1;
            Triangle::new([tip, -tip, tip * 0.5].map(|corner| corner.to_array()))
        })
        .collect();
    let hierarchy = Hierarchy::new(&blades);
    check(&hierarchy, &blades);
    assert!(!hierarchy.nodes[0].is_leaf());

    // Where no box becomes smaller, nothing is gained.
    let lines = vec![Triangle::new([[0.0; 3], [1.0, 0.0, 0.0], [0.5, 0.0, 0.0]]); 100];
    let hierarchy = Hierarchy::new(&lines);
    check(&hierarchy, &lines);
    assert!(hierarchy.nodes[0].is_leaf());
}

#[test]
fn it_is_not_deeper_than_stacks_are() {
    // Each triangle is a little larger than the one before, over sixty powers of two: a split takes few of them off, and leaves
    // all others.
    let nested: Vec<Triangle> = (0..3000)
        .map(|i| {
            let size = 2f32.powf(i as f32 * 0.02 - 30.0);
            Triangle::new([[size, 0.0, 0.0], [size * 1.01, 0.0, 0.0], [size, size * 0.01, 0.0]])
        })
        .collect();
    let deepest = check(&Hierarchy::new(&nested), &nested);
    assert!((20..=MAX_DEPTH).contains(&deepest), "{deepest}");
    // The same with so little room that halves are all there is.
    let builder = Builder { triangles: &nested, overlap: 0.0 };
    let references = (0..3000).map(|id| Reference::new(id, &nested[id as usize])).collect();
    let built = Hierarchy::of_loose(Loose::of_part(builder.build(references, MAX_DEPTH - 12, 0).part));
    assert!(check(&built, &nested) <= 12);
}
