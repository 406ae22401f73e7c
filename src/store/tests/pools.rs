//! Pools in scene files: they come back, and what is wrong with them is noticed.

use super::super::{Kind, PoolsMeta};
use super::damage::{liar, reseal};
use super::*;
use crate::geometry::Ray;
use crate::traverse::Accel;

/// A scene with pools, in a file.
fn with_pools(mesh: &Mesh) -> (KdTree, Place) {
    let tree = build(mesh);
    assert!(tree.make_pools(16));
    let place = Place::new();
    place.write(mesh, &tree).expect("written");
    (tree, place)
}

#[test]
fn pools_come_back_to_the_bit_and_rays_go_through_them() {
    for mesh in meshes() {
        let (tree, place) = with_pools(&mesh);
        let file = place.open().expect("opens");
        file.verify(&|_| ()).expect("is whole");
        assert_eq!(file.mesh().expect("a mesh"), mesh);
        let again = file.tree().expect("a tree");
        again.validate().expect("is whole");
        let [ours, theirs] = [&tree, &again].map(|tree| tree.pools().expect("they were made"));
        assert_eq!(
            (ours.nodes(), ours.words(), ours.most()),
            (theirs.nodes(), theirs.words(), theirs.most())
        );
        let counts =
            PoolsMeta { nodes: ours.nodes().len() as u64, words: ours.words().len() as u64, most: 16 };
        assert_eq!(file.meta().pools, Some(counts));

        let (with, without) = (Accel::of_tree(again), Accel::of_tree(build(&mesh)));
        assert!(with.pool_bytes() > 0 && without.pool_bytes() == 0);
        let center = with.bounds().center();
        let (mut hits, mut number) = (0, crate::weyl::uniform(-1.0, 1.0));
        for _ in 0..3000 {
            let ray = Ray::new(center, Vec3::new(number(), number(), number()));
            let hit = with.intersect(&ray);
            assert_eq!(hit, without.intersect(&ray));
            hits += u32::from(hit.is_hit());
        }
        assert!(hits > 100, "{hits} hits");
    }
}

#[test]
fn a_scene_without_pools_has_no_sections_for_them() {
    let place = Place::with(&meshes()[0]);
    let file = place.open().expect("opens");
    assert_eq!(file.meta().pools, None);
    assert!(file.section(Kind::PoolNodes).is_none() && file.section(Kind::PoolWords).is_none());
    assert!(file.tree().expect("a tree").pools().is_none());
}

#[test]
fn damaged_pools_are_not_handed_out() {
    let (_, place) = with_pools(&meshes()[1]);
    let (mut bytes, sections) = (place.bytes(), place.open().expect("opens").sections().to_vec());
    for kind in [Kind::PoolNodes, Kind::PoolWords] {
        let range = sections.iter().find(|section| section.kind == kind).expect("there").range();
        for at in [range.start, range.end - 1] {
            bytes[at] ^= 4;
            place.set(&bytes);
            let message = place.open().expect("opens").tree().expect_err("a bit was flipped").to_string();
            assert!(message.contains(&format!("its section {kind} is damaged")), "{message}");
            bytes[at] ^= 4;
        }
    }
}

#[test]
fn what_checksums_cannot_know_of_pools_is_looked_at() {
    let (tree, place) = with_pools(&meshes()[0]);
    let lie = liar(&place);
    let pools = tree.pools().expect("they were made");
    let counts = |nodes: usize, words: usize| format!("\"nodes\":{nodes},\"words\":{words}");
    let (nodes, words) = (pools.nodes().len(), pools.words().len());
    // Members of an object come in the order of their names.
    let [truth, more, less] =
        [(nodes, words), (nodes + 1, words), (nodes, words - 1)].map(|(n, w)| counts(n, w));
    lie(&truth, &more, "elements of pool-nodes");
    lie(&truth, &less, "elements of pool-words");
    lie("\"pools\":{", "\"pools\":{\"a\":1,", "its meta section makes no sense");

    // One of no triangles that there are, with checksums made right for it.
    place.write(&meshes()[0], &tree).expect("written");
    let (mut bytes, file) = (place.bytes(), place.open().expect("opens"));
    let word = file.section(Kind::PoolNodes).expect("there").range().start + 192;
    bytes[word..word + 4].copy_from_slice(&i32::MAX.to_le_bytes());
    reseal(&mut bytes);
    place.set(&bytes);
    let forged = place.open().expect("opens").tree().expect("nothing that costs no walk is wrong");
    let message = forged.validate().expect_err("it leads nowhere");
    assert!(message.contains("there is no node of boxes"), "{message}");
}
