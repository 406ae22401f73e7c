//! Trees of small meshes: whole, tight, bounded, and the same for any number of threads.

use super::*;
use crate::geometry::clip::Polygon;
use crate::mesh::Colors;
use glam::Vec3;

/// A generator of numbers for tests (SplitMix64).
struct Numbers(pub u64);

impl Numbers {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Uniform in 0..1.
    fn unit(&mut self) -> f32 {
        (self.next() >> 40) as f32 / (1 << 24) as f32
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}

fn mesh_of(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Mesh {
    let positions: Vec<Vec3> = triangles.into_iter().flatten().collect();
    let triangles = (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() }
}

fn soup(count: usize, size: f32, seed: u64) -> Mesh {
    let mut numbers = Numbers(seed);
    mesh_of((0..count).map(|_| {
        let at = numbers.point() * 10.0;
        [0; 3].map(|_| at + (numbers.point() - 0.5) * size)
    }))
}

/// Soup with its coordinates rounded to integers: flat, axis-aligned and coincident triangles.
fn lattice(count: usize, seed: u64) -> Mesh {
    let mut mesh = soup(count, 4.0, seed);
    for position in &mut mesh.positions {
        *position = position.round();
    }
    mesh
}

fn checked(mesh: &Mesh, params: &BuildParams) -> TreeStats {
    let tree = KdTree::build(mesh, params, None).expect("builds");
    tree.validate().expect("is whole");
    tree.stats()
}

#[test]
fn trees_are_whole() {
    let params = [
        BuildParams::default(),
        BuildParams { exact_below: 0, bins: 8, min_leaf: 1, ..Default::default() },
        BuildParams { exact_below: usize::MAX, empty_bonus: 0.0, traversal_cost: 0.2, ..Default::default() },
        BuildParams { perfect: false, exact_below: 0, bins: 16, min_leaf: 1, ..Default::default() },
        BuildParams::preset(Preset::Preview),
    ];
    for params in &params {
        for seed in 0..4 {
            checked(&soup(500, 0.5, seed), params);
            checked(&soup(200, 8.0, seed), params);
            checked(&lattice(500, seed), params);
        }
    }
}

#[test]
fn a_large_soup_pays_off() {
    // At a cost ratio that has leaves of few triangles.
    let params = BuildParams { traversal_cost: 3.0, ..BuildParams::default() };
    let stats = checked(&soup(20_000, 0.2, 1), &params);
    assert!(stats.expected_tests < 90.0, "{stats:?}");
    assert!(stats.references_per_triangle < 6.0, "{stats:?}");
    assert!(stats.depth <= 36);
    assert_eq!(stats.leaf_histogram.iter().sum::<usize>(), stats.leaves);
}

/// The references to triangles of which nothing reaches into the leaf's cell.
fn strays(tree: &KdTree) -> usize {
    let mut strays = 0;
    let mut stack = vec![(tree.root(), *tree.bounds())];
    while let Some((node, cell)) = stack.pop() {
        if !node.is_leaf() {
            let halves = cell.halves(node.axis(), node.split());
            stack.extend(tree.children(node).into_iter().zip(halves));
            continue;
        }
        for &primitive in tree.primitives(node) {
            let mut piece = Polygon::new(tree.corners(primitive));
            for axis in 0..3 {
                piece.clip(axis, cell.min[axis], false);
                piece.clip(axis, cell.max[axis], true);
            }
            strays += usize::from(piece.is_empty());
        }
    }
    strays
}

#[test]
fn perfect_splits_leave_no_strays_and_quick_ones_few() {
    let params =
        |perfect| BuildParams { perfect, exact_below: 0, max_duplication: 100.0, ..Default::default() };
    let [quick, perfect] = [false, true].map(|perfect| {
        let tree = KdTree::build(&soup(5_000, 1.0, 1), &params(perfect), None).expect("builds");
        tree.validate().expect("is whole");
        (strays(&tree), tree.stats().references)
    });
    assert_eq!(perfect.0, 0, "of {}", perfect.1);
    assert!(0 < quick.0 && quick.0 < quick.1 / 20, "{} of {}", quick.0, quick.1);
}

#[test]
fn every_reference_is_a_triangle_in_a_leaf() {
    let tree = KdTree::build(&soup(2_000, 0.5, 3), &BuildParams::default(), None).expect("builds");
    let histogram = tree.duplication();
    assert_eq!(histogram.iter().sum::<usize>(), 2_000, "each is in some leaf");
    assert_eq!(histogram.last(), Some(&0), "none is in so many that they are not told apart");
    let references: usize = histogram.iter().zip(1..).map(|(triangles, leaves)| triangles * leaves).sum();
    assert_eq!(references, tree.stats().references);
    assert!(histogram[0] < 2_000, "some are cut");
}

#[test]
fn coincident_triangles_end_in_one_leaf() {
    let one = soup(1, 1.0, 7).positions;
    let mesh = mesh_of(std::iter::repeat_n([one[0], one[1], one[2]], 1000));
    let stats = checked(&mesh, &BuildParams::default());
    assert_eq!(stats.largest_leaf, 1000);
    assert!(stats.references <= 12_000 + 1024);
}

#[test]
fn degenerate_meshes_build() {
    let point = Vec3::new(1.0, 2.0, 3.0);
    checked(&mesh_of([[point; 3]]), &BuildParams::default());
    checked(&mesh_of(vec![[point; 3]; 100]), &BuildParams::default());
    // All on one line, and all in one plane.
    checked(
        &mesh_of((0..100).map(|i| [0.0, 1.0, 2.0].map(|x| Vec3::X * (x + i as f32)))),
        &BuildParams::default(),
    );
    let mut flat = soup(300, 1.0, 3);
    flat.positions.iter_mut().for_each(|p| p.y = 0.25);
    checked(&flat, &BuildParams { min_leaf: 1, ..Default::default() });
}

#[test]
fn a_bundle_of_slivers_stays_within_its_budget() {
    let mut numbers = Numbers(11);
    let mesh = mesh_of((0..2000).map(|_| {
        let jitter = numbers.point() * 0.05;
        [Vec3::ZERO + jitter, Vec3::ONE * 10.0 + jitter, Vec3::ONE * 10.0 + jitter + Vec3::X * 1e-4]
    }));
    let params = BuildParams { traversal_cost: 0.05, max_duplication: 4.0, ..Default::default() };
    let stats = checked(&mesh, &params);
    assert!(stats.references <= 4 * 2000 + 1024, "{stats:?}");
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let mesh = soup(30_000, 0.3, 5);
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| KdTree::build(&mesh, &BuildParams::default(), None).expect("builds"))
    };
    let (one, four) = (build(1), build(4));
    assert_eq!(one.nodes, four.nodes);
    assert_eq!(one.references, four.references);
}

#[test]
fn bad_meshes_are_refused() {
    let good = soup(1, 1.0, 0);
    let build = |mesh: &Mesh| KdTree::build(mesh, &BuildParams::default(), None).map(drop);
    let mut mesh = good.clone();
    mesh.triangles.clear();
    assert!(build(&mesh).unwrap_err().to_string().contains("no triangles"));
    mesh = good.clone();
    mesh.triangles[0][1] = 3;
    assert!(build(&mesh).unwrap_err().to_string().contains("names vertex 3"));
    for bad in [f32::NAN, f32::INFINITY] {
        mesh = good.clone();
        mesh.positions[2].y = bad;
        assert!(build(&mesh).unwrap_err().to_string().contains("not finite"));
    }
    let params = BuildParams { bins: 1, ..Default::default() };
    assert!(KdTree::build(&good, &params, None).unwrap_err().to_string().contains("build.bins"));
}

#[test]
fn validate_sees_what_is_broken() {
    let mesh = soup(300, 1.0, 2);
    let build = || KdTree::build(&mesh, &BuildParams::default(), None).expect("builds");
    let references = |change: fn(&mut Vec<u32>)| {
        let mut tree = build();
        let mut references = tree.references.to_vec();
        change(&mut references);
        tree.references = references.into();
        tree.validate().expect_err("something is broken")
    };
    let nodes = |change: fn(&mut Vec<Node>)| {
        let mut tree = build();
        let mut nodes = tree.nodes.to_vec();
        change(&mut nodes);
        tree.nodes = nodes.into();
        tree.validate().expect_err("something is broken")
    };
    assert!(references(|r| r[1] ^= 1).contains("missing from a leaf"));
    assert!(references(|r| r[1] = 300).contains("names triangle"));
    assert!(references(|r| r[0] += 1).contains("no number before"));
    assert!(nodes(|n| n[0] = Node::inner(0, 5.0, n.len() - 1)).contains("children would be at"));
    assert!(nodes(|n| n[0] = Node::inner(n[0].axis(), 1e9, 2)).contains("outside of its cell"));
    assert!(nodes(|n| n[3] = Node::inner(n[3].axis(), n[3].split(), 2)).contains("two parents"));
    assert!(references(|r| r.push(0)).contains("belongs to no leaf"));
}

/// Meshes that strain a builder: coincident triangles, one under everything, slivers, far outliers.
fn strained() -> Vec<Mesh> {
    let mut numbers = Numbers(5);
    let one = soup(1, 1.0, 7).positions;
    let coincident = mesh_of(std::iter::repeat_n([one[0], one[1], one[2]], 20_000));
    let mut carpet = soup(20_000, 0.1, 3);
    let first = carpet.positions.len() as u32;
    carpet.positions.extend([
        Vec3::new(-9.0, 0.0, -9.0),
        Vec3::new(40.0, 0.1, -9.0),
        Vec3::new(-9.0, 0.0, 40.0),
    ]);
    carpet.triangles.push([first, first + 1, first + 2]);
    let slivers = mesh_of((0..20_000).map(|_| {
        let from = numbers.point() * 10.0;
        let to = numbers.point() * 10.0;
        [from, to, to + Vec3::X * 1e-4]
    }));
    let mut outlier = soup(20_000, 0.1, 4);
    outlier.positions[0] *= 1e6;
    vec![coincident, carpet, slivers, outlier, lattice(20_000, 2)]
}

#[test]
fn the_tree_does_not_depend_on_threads_however_the_mesh_strains() {
    for (number, mesh) in strained().iter().enumerate() {
        for preset in Preset::ALL {
            let build = |threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
                pool.install(|| KdTree::build(mesh, &BuildParams::preset(preset), None).expect("builds"))
            };
            let (one, three) = (build(1), build(3));
            assert!(one.nodes == three.nodes && one.references == three.references, "{number}, {preset}");
        }
    }
}

#[test]
fn memory_and_depth_are_bounded_as_announced() {
    for (number, mesh) in strained().iter().enumerate() {
        for (traversal_cost, perfect) in [(3.0, true), (0.01, true), (3.0, false), (0.01, false)] {
            let params = BuildParams { traversal_cost, perfect, max_duplication: 4.0, ..Default::default() };
            let announced = params.peak_bytes(mesh.triangles.len());
            let tree = KdTree::build(mesh, &params, None).expect("builds");
            assert!(tree.build_peak() <= announced, "{number}: {} of {announced}", tree.build_peak());
            let stats = tree.stats();
            assert!(tree.build_peak() >= stats.bytes(), "{number}: {} bytes", stats.bytes());
            assert!(stats.references + stats.nodes <= 4 * mesh.triangles.len() + 1024, "{number}: {stats:?}");
            assert!(stats.depth <= MAX_DEPTH);
        }
    }
}
