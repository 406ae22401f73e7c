//! What is known about a scene, as JSON.

use crate::geometry::Aabb;
use crate::kdtree::{BuildParams, KdTree, Pools, SPREAD_BLOCKS, Scale, Tree, TreeStats};
use crate::mesh::{Attributes, Colors, MAX_IMAGE_BYTES, Material, Mesh};
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
    /// What there is of leaves that hold their corners: in the sections `pool-nodes` and `pool-words`.
    pub pools: Option<PoolsMeta>,
    /// Where colours come from.
    pub colors: ColorMeta,
    /// How many triangles each of the materials has; empty if there are none.
    pub uses: Vec<u64>,
    /// Whether triangles have texture coordinates or normals: in the section `surface-records`.
    pub attributes: bool,
    /// Whether any of them has normals.
    pub normals: bool,
    /// The pictures that materials name, in the order of their numbers.
    pub images: Vec<ImageMeta>,
}

/// Leaves that hold their corners, and the nodes that lead to them: see [`Pools`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoolsMeta {
    /// Nodes of eight boxes.
    pub nodes: u64,
    /// Words of pools.
    pub words: u64,
    /// Up to how many triangles leaves mostly have.
    pub most: usize,
}

impl PoolsMeta {
    /// What there is to say of some.
    fn of(pools: &Pools) -> Self {
        let [nodes, words] = [pools.nodes().len(), pools.words().len()].map(|count| count as u64);
        Self { nodes, words, most: pools.most() }
    }
}

/// A picture that materials name.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case", deny_unknown_fields)]
pub enum ImageMeta {
    /// Its file is in the section `images`.
    Stored {
        /// What messages call it.
        name: String,
        /// Where in the section it begins: where the one before ends.
        offset: u64,
        /// Its length.
        bytes: u64,
    },
    /// It could not be had when the scene file was written.
    Missing {
        /// What messages call it.
        name: String,
        /// What was wrong, in words that follow the name.
        reason: String,
    },
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
    /// These, and the section `material-of-triangle`, or `surface-records` in its place.
    PerMaterial {
        /// The materials.
        materials: Vec<Material>,
    },
}

impl Meta {
    /// What there is to say about a mesh and its tree, but for the pictures, which have still to be read.
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
            pools: tree.pools().map(PoolsMeta::of),
            colors: ColorMeta::of(&mesh.colors),
            uses: mesh.colors.uses(),
            attributes: !mesh.attributes.is_empty(),
            normals: mesh.attributes.iter().any(Attributes::has_normals),
            images: Vec::new(),
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
        meta.check_materials()?;
        meta.check_images()?;
        Ok(meta)
    }

    /// Whether all triangles have a material, where there are any, and all pictures that are named are there.
    fn check_materials(&self) -> Result<(), String> {
        let materials = self.colors.materials();
        let of_all = self.uses.iter().try_fold(0u64, |sum, &uses| sum.checked_add(uses));
        let expected = if materials.is_empty() { 0 } else { self.triangles };
        if self.uses.len() != materials.len() || of_all != Some(expected) {
            return Err("its uses of materials are not those of its triangles".into());
        }
        let there = |image: u32| (image as usize) < self.images.len();
        match materials.iter().find(|material| !material.maps.all().all(|map| there(map.image))) {
            Some(material) => Err(format!("material {} names a picture that is not there", material.name)),
            None => Ok(()),
        }
    }

    /// Whether pictures lie one behind the other.
    fn check_images(&self) -> Result<(), String> {
        let mut end = 0;
        for image in &self.images {
            if let ImageMeta::Stored { name, offset, bytes } = image {
                if *offset != end || *bytes > MAX_IMAGE_BYTES {
                    return Err(format!("picture {name} has no place of its own"));
                }
                end += bytes;
            }
        }
        Ok(())
    }

    /// How many triangles give off light.
    pub(super) fn emitters(&self) -> u64 {
        let materials = self.colors.materials().iter().zip(&self.uses);
        materials.filter(|(material, _)| material.emits()).map(|(_, uses)| uses).sum()
    }

    /// Bytes of the section `images`.
    pub(super) fn image_bytes(&self) -> u64 {
        self.images.iter().map(ImageMeta::bytes).sum()
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

impl ImageMeta {
    /// What messages call it.
    pub fn name(&self) -> &str {
        match self {
            Self::Stored { name, .. } | Self::Missing { name, .. } => name,
        }
    }

    /// The length of its file; 0 if it is missing.
    pub fn bytes(&self) -> u64 {
        match *self {
            Self::Stored { bytes, .. } => bytes,
            Self::Missing { .. } => 0,
        }
    }
}

impl ColorMeta {
    /// The materials; none if colours are of another kind.
    pub fn materials(&self) -> &[Material] {
        match self {
            Self::PerMaterial { materials } => materials,
            _ => &[],
        }
    }

    fn of(colors: &Colors) -> Self {
        match colors {
            Colors::Uniform(color) => Self::Uniform { color: color.to_array() },
            Colors::PerTriangle(_) => Self::PerTriangle,
            Colors::PerVertex(_) => Self::PerVertex,
            Colors::PerMaterial { materials, .. } => Self::PerMaterial { materials: materials.clone() },
        }
    }
}
