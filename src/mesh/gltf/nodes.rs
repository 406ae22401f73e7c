//! The scene: which meshes stand where.

use glam::{DMat4, DQuat, DVec3};
use gltf::Document;
use gltf::json::scene::Node;

/// A mesh in the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Instance {
    /// Its number in the document.
    pub mesh: usize,
    /// From its coordinates to the scene's.
    pub transform: DMat4,
}

/// The meshes of the scene that a document shows: the one that it names, else its first, else all nodes that are
/// nobody's children. In the order of a walk that visits parents first.
///
/// # Errors
/// A node can be reached in two ways, as in a cycle: then nodes form no tree, as they have to.
pub(super) fn instances(document: &Document) -> Result<Vec<Instance>, String> {
    let root = document.as_json();
    let scene = root.scene.map(|scene| scene.value()).and_then(|scene| root.scenes.get(scene));
    let first: Vec<usize> = match scene.or(root.scenes.first()) {
        Some(scene) => scene.nodes.iter().map(|node| node.value()).collect(),
        None => {
            let mut is_child = vec![false; root.nodes.len()];
            let children = root.nodes.iter().filter_map(|node| node.children.as_ref()).flatten();
            children.for_each(|child| is_child[child.value()] = true);
            (0..root.nodes.len()).filter(|&node| !is_child[node]).collect()
        }
    };
    let mut instances = Vec::new();
    let mut reached = vec![false; root.nodes.len()];
    // A list, not recursion: a chain of nodes may be as long as the file.
    let mut open: Vec<(usize, DMat4)> = first.into_iter().rev().map(|node| (node, DMat4::IDENTITY)).collect();
    while let Some((number, above)) = open.pop() {
        if std::mem::replace(&mut reached[number], true) {
            return Err(format!(
                "node {number} is reached twice: nodes form a cycle or share a child, and must form trees"
            ));
        }
        let node = &root.nodes[number];
        let transform = above * local(node);
        instances.extend(node.mesh.map(|mesh| Instance { mesh: mesh.value(), transform }));
        let children = node.children.iter().flatten().rev();
        open.extend(children.map(|child| (child.value(), transform)));
    }
    Ok(instances)
}

/// From a node's coordinates to its parent's.
fn local(node: &Node) -> DMat4 {
    if let Some(matrix) = node.matrix {
        return DMat4::from_cols_array(&matrix.map(f64::from));
    }
    let vector = |v: Option<[f32; 3]>| v.map(|v| DVec3::from_array(v.map(f64::from)));
    let rotation = node.rotation.map_or(DQuat::IDENTITY, |q| DQuat::from_array(q.0.map(f64::from)));
    // Rounded to single precision, it is not quite of length 1; of length 0 it says nothing.
    let rotation = if rotation.length_squared() > 0.0 { rotation.normalize() } else { DQuat::IDENTITY };
    DMat4::from_scale_rotation_translation(
        vector(node.scale).unwrap_or(DVec3::ONE),
        rotation,
        vector(node.translation).unwrap_or_default(),
    )
}
