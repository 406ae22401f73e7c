//! The SAH kd-tree.

use serde::{Deserialize, Serialize};

/// What the builder is free to choose.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct BuildParams {
    /// Cost of a step through an inner node.
    pub traversal_cost: f32,
    /// Cost of testing one triangle.
    pub intersection_cost: f32,
}

impl Default for BuildParams {
    fn default() -> Self {
        Self { traversal_cost: 1.0, intersection_cost: 1.0 }
    }
}

/// Figures about a tree.
#[derive(Clone, Debug, Default, Serialize)]
pub struct TreeStats {
    /// Triangles that the tree holds.
    pub triangles: u64,
}
