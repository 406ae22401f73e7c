//! A file's arrays as tree and mesh.

use super::meta::{ColorMeta, PoolsMeta};
use super::reader::File;
use super::section::Kind;
use crate::column::Column;
use crate::error::{Error, Result};
use crate::kdtree::{KdTree, Node, Parts, Pools};
use crate::mesh::{Colors, Mesh};
use glam::Vec3;
use rayon::prelude::*;

/// The sections that the tree lies in.
const TREE: [Kind; 7] =
    [Kind::Nodes, Kind::References, Kind::Upper, Kind::Beneath, Kind::Pages, Kind::Lines, Kind::Triangles];

/// The sections that the mesh lies in.
const MESH: [Kind; 4] = [Kind::Positions, Kind::Indices, Kind::TriangleColors, Kind::VertexColors];

impl File {
    /// The tree, and its pools if the file has any, mapped: nothing is copied. Checks the checksums of their sections first, unless
    /// that was done.
    ///
    /// # Errors
    /// A section is damaged, or lacks something.
    pub fn tree(&self) -> Result<KdTree> {
        self.verify_sections(&TREE)?;
        let meta = self.meta();
        KdTree::of_parts(Parts {
            nodes: self.column(Kind::Nodes),
            references: self.column(Kind::References),
            upper: self.column(Kind::Upper),
            beneath: self.column(Kind::Beneath),
            pages: self.column(Kind::Pages),
            lines: self.column(Kind::Lines),
            triangles: self.column(Kind::Triangles),
            pools: self.pools()?,
            bounds: meta.tree_bounds(),
            scale: meta.scale(),
            params: meta.params.clone(),
            build_peak: meta.build_peak,
            stats: meta.stats.clone(),
        })
        .map_err(|what| Error::malformed(self.path(), format!("its tree is none: {what}")))
    }

    /// The tree's pools, likewise, if the file has any.
    fn pools(&self) -> Result<Option<Pools>> {
        let Some(PoolsMeta { most, .. }) = self.meta().pools else { return Ok(None) };
        self.verify_sections(&[Kind::PoolNodes, Kind::PoolWords])?;
        let pools = Pools::of_parts(self.column(Kind::PoolNodes), self.column(Kind::PoolWords), most);
        pools.map(Some).map_err(|what| Error::malformed(self.path(), format!("its pools are none: {what}")))
    }

    /// The upper tree, the places of its nodes in the full tree, and the full tree's root: what has to be known
    /// to fetch all else piece by piece. Checks the checksums of no more than that.
    ///
    /// # Errors
    /// A section is damaged or empty.
    pub fn upper_tree(&self) -> Result<(Column<Node>, Column<u32>, Node)> {
        self.verify_sections(&[Kind::Upper, Kind::Beneath])?;
        self.verify_first_block(Kind::Nodes)?;
        let (upper, beneath) = (self.column(Kind::Upper), self.column::<u32>(Kind::Beneath));
        match self.column::<Node>(Kind::Nodes).first() {
            Some(&root) if !upper.is_empty() && upper.len() == beneath.len() => Ok((upper, beneath, root)),
            _ => Err(Error::malformed(self.path(), "its tree is none: it has no root, or no upper nodes")),
        }
    }

    /// A copy of the mesh, its pictures' files included. Checks the checksums of its sections first, unless that was done, and that it is a
    /// mesh.
    ///
    /// # Errors
    /// A section is damaged, an index is out of range, or a vertex or a texture coordinate is not finite.
    pub fn mesh(&self) -> Result<Mesh> {
        self.verify_sections(&MESH)?;
        let positions: Column<Vec3> = self.column(Kind::Positions);
        let triangles: Column<[u32; 3]> = self.column(Kind::Indices);
        if positions.par_iter().any(|position| !position.is_finite()) {
            return Err(Error::malformed(self.path(), "a vertex of its mesh is not finite"));
        }
        let is_there = |&vertex: &u32| (vertex as usize) < positions.len();
        if !triangles.par_iter().all(|corners| corners.iter().all(is_there)) {
            return Err(Error::malformed(
                self.path(),
                "a triangle of its mesh names a vertex that is not there",
            ));
        }
        let colors = match &self.meta().colors {
            ColorMeta::Uniform { color } => Colors::Uniform((*color).into()),
            ColorMeta::PerTriangle => Colors::PerTriangle(self.column(Kind::TriangleColors).to_vec()),
            ColorMeta::PerVertex => Colors::PerVertex(self.column(Kind::VertexColors).to_vec()),
            ColorMeta::PerMaterial { materials } => {
                Colors::PerMaterial { materials: materials.clone(), of_triangle: self.substances()?.to_vec() }
            }
        };
        Ok(Mesh {
            positions: positions.to_vec(),
            triangles: triangles.to_vec(),
            colors,
            attributes: self.records()?.par_iter().map(|record| record.attributes).collect(),
            images: self.copied_images()?,
        })
    }
}
