//! The proof that a tree is whole.

use super::{KdTree, MAX_DEPTH, Node, Tree, lines};
use crate::geometry::Aabb;
use crate::geometry::clip::Polygon;

impl KdTree {
    /// Proves that the tree can be walked and loses no triangle:
    ///
    /// 1. from the root, every index stays inside the arrays, every pair of siblings and every
    ///    reference is owned exactly once, no way is longer than the kernels' stacks, and every
    ///    split plane lies in its cell (so every cell lies in its parent's);
    /// 2. every triangle is found in every leaf that it overlaps: its polygon is cut by the planes
    ///    on the way down, independently of the builder's boxes, and wherever a piece that
    ///    reaches into the inside of a leaf's cell arrives, the leaf must list the triangle. A piece
    ///    that lies in a plane must be found on one side of it at least.
    ///
    /// Takes about as long as the build.
    ///
    /// # Errors
    /// A sentence that names the first node or triangle at fault.
    pub fn validate(&self) -> Result<(), String> {
        self.validate_shape()?;
        for primitive in 0..self.triangles.len() as u32 {
            let corners = self.corners(primitive);
            let extended =
                [0, 1, 2].map(|axis| corners.iter().any(|corner| corner[axis] != corners[0][axis]));
            if !self.covers(primitive, extended, self.root(), &self.bounds, &Polygon::new(corners)) {
                return Err(format!("triangle {primitive} is missing from a leaf that it overlaps"));
            }
        }
        self.pools().map_or(Ok(()), |pools| pools.validate(&self.triangles))
    }

    fn validate_shape(&self) -> Result<(), String> {
        let mut pairs = vec![false; self.nodes.len() / 2 + 1];
        let mut owned = vec![false; self.references.len()];
        let after = owned.len().saturating_sub(lines::AFTER);
        owned[after..].fill(true);
        let mut stack = vec![(*self.nodes.first().ok_or("there is no root")?, self.bounds, 0)];
        while let Some((node, cell, depth)) = stack.pop() {
            if depth > MAX_DEPTH {
                return Err(format!("a leaf lies {depth} levels deep"));
            }
            if node.is_leaf() {
                let range = node.references();
                if range.is_empty() {
                    continue;
                }
                // The word in front of a leaf's references is their number.
                let record = range.start.wrapping_sub(1);
                if self.references.get(record).is_none_or(|&count| count as usize != range.len()) {
                    return Err(format!("there is no number before references {range:?}"));
                }
                owned[record] = true;
                let list = owned
                    .get_mut(range.clone())
                    .ok_or_else(|| format!("a leaf names references {range:?}"))?;
                for (owned, index) in list.iter_mut().zip(range) {
                    if std::mem::replace(owned, true) {
                        return Err(format!("reference {index} belongs to two leaves"));
                    }
                    let primitive = self.references[index];
                    if primitive as usize >= self.triangles.len() {
                        return Err(format!("reference {index} names triangle {primitive}"));
                    }
                }
                continue;
            }
            let (axis, split, below) = (node.axis(), node.split(), node.below() as usize);
            if below < 2 || below % 2 != 0 || below + 1 >= self.nodes.len() {
                return Err(format!("a node's children would be at {below}"));
            }
            if std::mem::replace(&mut pairs[below / 2], true) {
                return Err(format!("the nodes at {below} have two parents"));
            }
            if !(cell.min[axis] <= split && split <= cell.max[axis]) {
                return Err(format!("the plane {split} of the parent of {below} lies outside of its cell"));
            }
            let [low, high] = cell.halves(axis, split);
            stack.push((self.nodes[below], low, depth + 1));
            stack.push((self.nodes[below + 1], high, depth + 1));
        }
        match owned.iter().position(|owned| !owned) {
            Some(index) => Err(format!("reference {index} belongs to no leaf")),
            None => Ok(()),
        }
    }

    /// Whether the part of a triangle that lies in a node's cell is found in all of its leaves.
    /// `extended` says along which axes the whole triangle has an extent.
    fn covers(&self, primitive: u32, extended: [bool; 3], node: Node, cell: &Aabb, piece: &Polygon) -> bool {
        if node.is_leaf() {
            return self.primitives(node).contains(&primitive) || only_touches(piece, extended, cell);
        }
        let (axis, split) = (node.axis(), f64::from(node.split()));
        let (low, high) = piece.certain_range(axis);
        let [below, above] = self.children(node);
        let [cell_below, cell_above] = cell.halves(axis, node.split());
        let go = |child: Node, cell: &Aabb, is_below: bool| {
            let mut part = piece.clone();
            part.clip(axis, node.split(), is_below);
            part.is_empty() || self.covers(primitive, extended, child, cell, &part)
        };
        match (low < split, high > split) {
            (true, true) => go(below, &cell_below, true) && go(above, &cell_above, false),
            (true, false) => go(below, &cell_below, true),
            (false, true) => go(above, &cell_above, false),
            // It lies in the plane, or too near to say.
            (false, false) => go(below, &cell_below, true) || go(above, &cell_above, false),
        }
    }
}

/// Whether a piece of a triangle lies in a face of a cell, as far as can be said, while the
/// triangle goes on beyond: then the neighbour has it, and nothing of it is inside. A triangle
/// that is flat along the axis has no such excuse.
fn only_touches(piece: &Polygon, extended: [bool; 3], cell: &Aabb) -> bool {
    (0..3).any(|axis| {
        let (low, high) = piece.certain_range(axis);
        extended[axis] && (low >= f64::from(cell.max[axis]) || high <= f64::from(cell.min[axis]))
    })
}
