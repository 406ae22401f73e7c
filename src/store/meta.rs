//! What is known about a scene, as JSON.

use crate::geometry::Aabb;
use crate::kdtree::{BuildParams, KdTree, SPREAD_BLOCKS, Scale, Tree, TreeStats};
use crate::mesh::{Colors, Material, Mesh};
use serde::{Deserialize, Serialize};

/// What writes files.
pub(super) const ENGINE: &str = concat!("raypack ", env!("CARGO_PKG_VERSION"));

/// What a scene file says about itself, beside its arrays.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Meta {
    /// What wrote it: `raypack 0.1.0`.
    pub engine: String,
    /// What it was made of, in words: models' names.
    pub source: String,
    /// Triangles of mesh and tree.
    pub triangles: u64,
    /// Vertices of the mesh.
    pub vertices: u64,
    /// Least and greatest corner of the box around all triangles, in the tree's coordinates.
    pub bounds: [[f32; 3]; 2],
    /// The tree's coordinates are the mesh's times two to this power: hardly ever anything but 0.
    pub scale_exponent: i32,
    /// The settings that the tree was built with.
    pub params: BuildParams,
    /// What [`KdTree::stats`] says of the tree.
    pub stats: TreeStats,
    /// The most bytes that the build's arrays held.
    pub build_peak: usize,
    /// The most triangles in a leaf.
    pub largest_leaf: usize,
    /// The most triangles in a page.
    pub largest_page: usize,
    /// What [`KdTree::spread`] says of the tree.
    pub spread: [usize; SPREAD_BLOCKS.len()],
    /// Where colours come from.
    pub colors: ColorMeta,
}

/// Where a scene's colours come from: see [`Colors`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ColorMeta {
    /// One for everything.
    Uniform {
        /// Linear RGB.
        color: [f32; 3],
    },
    /// The section `triangle-colors`.
    PerTriangle,
    /// The sections `vertex-colors` and `corner-colors`.
    PerVertex,
    /// These, and the section `material-of-triangle`.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
    },
}

impl Meta {
    /// What there is to say about a mesh and its tree.
    pub(super) fn new(mesh: &Mesh, tree: &KdTree, source: &str) -> Self {
        let stats = tree.stats();
        let Aabb { min, max } = tree.bounds();
        let pages = tree.arrays().upper.iter().filter(|node| node.is_leaf());
        Self {
            engine: ENGINE.into(),
            source: source.into(),
            triangles: mesh.triangles.len() as u64,
            vertices: mesh.positions.len() as u64,
            bounds: [min.to_array(), max.to_array()],
            scale_exponent: tree.scale().exponent(),
            params: tree.params().clone(),
            build_peak: tree.build_peak(),
            largest_leaf: stats.largest_leaf,
            largest_page: pages.map(|page| page.references().len()).max().unwrap_or(0),
            spread: tree.spread(),
            stats,
            colors: ColorMeta::of(&mesh.colors),
        }
    }

    /// Reads it.
    ///
    /// # Errors
    /// What in it makes no sense.
    pub(super) fn parse(json: &[u8]) -> Result<Self, String> {
        let meta: Self = serde_json::from_slice(json).map_err(|error| error.to_string())?;
        meta.params.check().map_err(|error| error.to_string())?;
        let reflects = |color: &[f32; 3]| color.iter().all(|c| c.is_finite());
        let has_colors = match &meta.colors {
            ColorMeta::Uniform { color } => reflects(color),
            ColorMeta::PerTriangle | ColorMeta::PerVertex => true,
            ColorMeta::PerMaterial { materials } => {
                !materials.is_empty() && materials.iter().all(|material| material.fault().is_none())
            }
        };
        if !has_colors {
            return Err("its colours are none".into());
        }
        if Scale::of_exponent(meta.scale_exponent).is_none() {
            return Err(format!("its coordinates cannot be scaled by 2^{}", meta.scale_exponent));
        }
        Ok(meta)
    }

    /// The box around all triangles, in the tree's coordinates.
    pub fn tree_bounds(&self) -> Aabb {
        let [min, max] = self.bounds.map(Into::into);
        Aabb { min, max }
    }

    /// What the mesh's coordinates were multiplied by.
    pub fn scale(&self) -> Scale {
        Scale::of_exponent(self.scale_exponent).expect("no file is opened with another one")
    }
}

impl ColorMeta {
    fn of(colors: &Colors) -> Self {
        match colors {
            Colors::Uniform(color) => Self::Uniform { color: color.to_array() },
            Colors::PerTriangle(_) => Self::PerTriangle,
            Colors::PerVertex(_) => Self::PerVertex,
            Colors::PerMaterial { materials, .. } => Self::PerMaterial { materials: materials.clone() },
        }
    }
}
