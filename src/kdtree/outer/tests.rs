use super::*;
use crate::kdtree::{Arrays, KdTree, Tree};
use crate::mesh::Mesh;
use crate::mesh::generate::{plant, shapes};
use std::sync::Mutex;

/// Triangles in memory.
struct Whole<'a>(&'a [Triangle]);

impl Triangles for Whole<'_> {
    fn count(&self) -> usize {
        self.0.len()
    }

    fn read(&self, first: usize, into: &mut [Triangle]) -> Result<()> {
        into.copy_from_slice(&self.0[first..first + into.len()]);
        Ok(())
    }
}

/// A shelf in memory; has so much room.
struct Shelves {
    pieces: Mutex<Vec<Option<Vec<u8>>>>,
    room: usize,
}

impl Shelves {
    fn new(room: usize) -> Self {
        Self { pieces: Mutex::default(), room }
    }

    fn in_use(&self) -> usize {
        self.pieces.lock().expect("no panic").iter().flatten().count()
    }
}

impl Shelf for Shelves {
    fn put(&self, piece: &[u8]) -> Result<usize> {
        assert!(piece.len() <= PIECE);
        let mut pieces = self.pieces.lock().expect("no panic");
        if pieces.iter().flatten().count() == self.room {
            return Err(Error::Mesh("the shelf is full".into()));
        }
        let free = pieces.iter().position(Option::is_none);
        let place = free.unwrap_or_else(|| {
            pieces.push(None);
            pieces.len() - 1
        });
        pieces[place] = Some(piece.to_vec());
        Ok(place)
    }

    fn get(&self, place: usize, into: &mut [u8]) -> Result<()> {
        let pieces = self.pieces.lock().expect("no panic");
        let piece = pieces[place].as_ref().expect("something was put there");
        into.copy_from_slice(&piece[..into.len()]);
        Ok(())
    }

    fn clear(&self, place: usize) {
        self.pieces.lock().expect("no panic")[place].take().expect("something was put there");
    }
}

#[derive(Default)]
struct Arrived([Vec<u8>; Array::ALL.len()]);

impl Output for Arrived {
    fn append(&mut self, array: Array, bytes: &[u8]) -> Result<()> {
        self.0[array as usize].extend_from_slice(bytes);
        Ok(())
    }

    fn patch(&mut self, array: Array, at: usize, bytes: &[u8]) -> Result<()> {
        self.0[array as usize][at..at + bytes.len()].copy_from_slice(bytes);
        Ok(())
    }
}

impl Arrived {
    fn lines(&self, plan: &Plan) -> Vec<Line> {
        let unordered: &[Line] = &bytemuck::pod_collect_to_vec(&self.0[Array::Lines as usize]);
        let mut lines = Vec::new();
        let read = |first: usize, into: &mut [Line]| {
            into.copy_from_slice(&unordered[first..first + into.len()]);
            Ok(())
        };
        let give = |some: &[Line]| {
            lines.extend_from_slice(some);
            Ok::<(), Error>(())
        };
        plan.each(read, give).expect("nothing fails");
        lines
    }
}

/// Builds a mesh's tree in memory and in parts that are sure to fit, and compares them byte for byte; in how many
/// parts.
fn compare(mesh: &Mesh, params: &BuildParams, part: usize) -> usize {
    compare_in(mesh, params, Sizes::new(part, 0)).parts
}

/// The same in parts of any sizes.
fn compare_in(mesh: &Mesh, params: &BuildParams, sizes: Sizes) -> Outline {
    let tree = KdTree::build(mesh, params, None).expect("builds");
    let (triangles, shelf) = (Whole(tree.triangles()), Shelves::new(usize::MAX));
    let progress = BuildProgress::default();
    let job = Job {
        triangles: &triangles,
        bounds: *tree.bounds(),
        params,
        memory: usize::MAX,
        shelf: &shelf,
        progress: Some(&progress),
    };
    let mut arrived = Arrived::default();
    let outline = in_parts(&job, sizes, &mut arrived).expect("builds");

    let Arrays { nodes, references, upper, beneath, pages, lines, .. } = tree.arrays();
    assert!(arrived.lines(&outline.plan) == lines, "lines");
    let arrays: [(Array, &[u8]); 5] = [
        (Array::Nodes, bytemuck::cast_slice(nodes)),
        (Array::References, bytemuck::cast_slice(references)),
        (Array::Upper, bytemuck::cast_slice(upper)),
        (Array::Beneath, bytemuck::cast_slice(beneath)),
        (Array::Pages, bytemuck::cast_slice(pages)),
    ];
    for (array, bytes) in arrays {
        assert!(arrived.0[array as usize] == bytes, "{array:?}");
    }
    let pages = upper.iter().filter(|node| node.is_leaf()).map(|page| page.references().len());
    assert_eq!(Some(outline.largest_page), pages.max());
    assert_eq!(outline.spread, tree.spread());
    // Sums are taken in the same order.
    assert_eq!(outline.stats, tree.stats());
    assert_eq!(shelf.in_use(), 0, "all that was put on the shelf was taken off");
    assert!((0.9..=1.01).contains(&progress.fraction()), "{}", progress.fraction());
    outline
}

#[test]
fn parts_make_the_tree_that_memory_makes() {
    let mesh = shapes::soup(60_000, 5);
    let params = BuildParams::default();
    let parts = [1 << 20, 30_000, 16_384, 8192].map(|part| compare(&mesh, &params, part));
    assert_eq!(parts[0], 1);
    assert!(parts.is_sorted_by(|a, b| a < b) && parts[3] >= 8, "{parts:?}");
}

#[test]
fn so_do_those_of_a_plant_and_of_few_and_large_leaves() {
    let mesh = plant::demo();
    let many = BuildParams { min_leaf: 1, page: 16, ..BuildParams::default() };
    let few = BuildParams { traversal_cost: 1e3, page: 256, ..BuildParams::default() };
    for params in [BuildParams::default(), many, few] {
        assert!(compare(&mesh, &params, 8192) > 1);
    }
}

#[test]
fn what_no_plane_divides_is_one_leaf() {
    let mesh = Mesh {
        positions: vec![glam::Vec3::ZERO, glam::Vec3::X, glam::Vec3::ONE],
        triangles: vec![[0, 1, 2]; 40_000],
        ..Mesh::default()
    };
    assert_eq!(compare(&mesh, &BuildParams::default(), 16_384), 1);
}

#[test]
fn parts_that_may_fit_are_tried_and_given_up_if_they_do_not() {
    let mesh = shapes::soup(120_000, 5);
    let params = BuildParams::default();
    let memory = 8 << 20;
    let [sure, tried] = [0, memory].map(|memory| compare_in(&mesh, &params, Sizes::new(8192, memory)));
    assert!(2 * tried.parts < sure.parts, "{} parts, {} are sure to fit", tried.parts, sure.parts);
    assert!(2 * sure.peak < tried.peak && tried.peak <= memory, "{} bytes, {}", tried.peak, sure.peak);

    // Of a tree that is finer than anybody would guess who believes that next to nothing becomes of references.
    let mesh = shapes::soup(60_000, 5);
    let params = BuildParams { min_leaf: 1, traversal_cost: 0.1, ..BuildParams::default() };
    let memory = 4 << 20;
    let mut rash = Sizes::new(8192, memory);
    rash.learn(1 << 40, 1, 1);
    let rash = compare_in(&mesh, &params, rash);
    assert!(rash.given_up > 0 && rash.parts > 1, "{} given up, {} parts", rash.given_up, rash.parts);
    // What was begun in vain has stopped soon: within what every thread keeps for itself.
    assert!(rash.peak <= memory + (4 << 20), "{} bytes", rash.peak);
}

#[test]
fn faults_are_told() {
    let tree = KdTree::build(&shapes::soup(40_000, 2), &BuildParams::default(), None).expect("builds");
    let triangles = Whole(tree.triangles());
    let built = |room, memory, params: &BuildParams| {
        let shelf = Shelves::new(room);
        let bounds = *tree.bounds();
        let job = Job { triangles: &triangles, bounds, params, memory, shelf: &shelf, progress: None };
        let mut arrived = Arrived::default();
        let built = if memory == 0 {
            build(&job, &mut arrived)
        } else {
            in_parts(&job, Sizes::new(memory, 0), &mut arrived)
        };
        built.map(|_| ()).expect_err("it cannot be built").to_string()
    };
    let params = BuildParams::default();
    assert!(built(2, 8192, &params).contains("the shelf is full"));
    let least = params.least_outer_bytes();
    assert!(built(9, 0, &params).contains(&format!("takes {least} bytes at least, not 0")));
}
