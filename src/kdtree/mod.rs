//! The SAH kd-tree over a mesh's triangles.
//!
//! Everything above this room sees a tree through [`Tree`] alone: a root, nodes that are inner or
//! leaves, and the triangles of a leaf. How nodes lie in memory is this room's own business.

mod build;
mod lines;
mod memory;
mod node;
pub mod outer;
mod pages;
mod params;
mod parts;
mod pools;
mod preset;
mod sah;
mod scale;
mod spread;
mod stats;
mod validate;

pub use build::BuildProgress;
pub use lines::{Exit, Line};
pub use node::Node;
pub use params::{BuildParams, MAX_DEPTH};
pub(crate) use parts::Walked;
pub use parts::{Arrays, Parts};
pub use pools::{Boxes, Chunk, MOST, Pools, Way};
pub use preset::Preset;
pub use scale::{Scale, exponent};
pub use spread::SPREAD_BLOCKS;
pub use stats::TreeStats;

use crate::column::Column;
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::geometry::triangle::{Corners, Triangle};
use crate::huge;
use crate::mesh::Mesh;
use crate::simd::prefetch;
use memory::{Ledger, bytes_of};
use rayon::prelude::*;
use std::sync::OnceLock;

/// What a traversal kernel asks of a tree.
///
/// Its coordinates are the mesh's times the scale, which hardly ever is anything but 1.
pub trait Tree {
    /// What multiplies the mesh's coordinates.
    fn scale(&self) -> Scale;
    /// The box around all triangles.
    fn bounds(&self) -> &Aabb;
    /// Where every walk begins.
    fn root(&self) -> Node;
    /// The children of an inner node: below its plane, and above. A tree that is not all in memory gets them now;
    /// what it has given out before may be gone then.
    fn children(&self, inner: Node) -> [Node; 2];
    /// The primitive ids of a leaf's triangles, in no order that means anything. The leaf has been
    /// [entered](Self::enter_leaf).
    fn primitives(&self, leaf: Node) -> &[u32];
    /// The node at a place of the upper tree, whose root is at 0: an inner node, whose children's places
    /// are `below()` and the next, or a leaf, which is a page.
    fn upper(&self, place: usize) -> Node;
    /// The node of the full tree at a place of the upper tree.
    fn beneath(&self, place: usize) -> Node;
    /// The primitives that a page of the upper tree holds, each once.
    fn page(&self, leaf: Node) -> &[u32];
    /// A triangle's record.
    fn triangle(&self, primitive: u32) -> &Triangle;
    /// A triangle's corners.
    #[inline(always)]
    fn corners(&self, primitive: u32) -> &Corners {
        &self.triangle(primitive).corners
    }

    /// Said before a walk looks at a leaf's triangles. A tree that is not all in memory gets them now; what it has
    /// given out before may be gone then.
    #[inline(always)]
    fn enter_leaf(&self, _leaf: Node) {}
    /// The same, before a walk looks at a page's triangles.
    #[inline(always)]
    fn enter_page(&self, _leaf: Node) {}
    /// The same, before one triangle is looked at by itself.
    #[inline(always)]
    fn enter_triangle(&self, _primitive: u32) {}
}

/// A kd-tree in memory: nodes, the leaves' references, and the triangles' corners.
#[derive(Debug)]
pub struct KdTree {
    /// The root, an unused place, and then pairs of siblings.
    nodes: Column<Node>,
    /// Primitive ids, leaf after leaf, each leaf's behind their number.
    references: Column<u32>,
    /// The same tree for kernels that trace one ray at a time.
    lines: lines::Lines,
    /// The same tree for kernels that look at many triangles at once.
    pages: pages::Pages,
    /// Records by primitive id.
    triangles: Column<Triangle>,
    bounds: Aabb,
    scale: Scale,
    params: BuildParams,
    /// The most memory that the build took, in bytes.
    build_peak: usize,
    /// What a walk of the whole tree counts, once someone has asked.
    stats: OnceLock<TreeStats>,
    /// Leaves that hold their corners, once someone has asked for them.
    pools: OnceLock<Option<Pools>>,
}

impl KdTree {
    /// Builds the tree of a mesh; `progress`, if given, can be read meanwhile.
    ///
    /// The tree is the same for any number of threads.
    ///
    /// # Errors
    /// The mesh has no triangles or too many, an index is out of range, a vertex that a triangle
    /// uses is not finite, or a parameter makes no sense.
    pub fn build(mesh: &Mesh, params: &BuildParams, progress: Option<&BuildProgress>) -> Result<Self> {
        params.check()?;
        let ledger = Ledger::default();
        let (triangles, bounds, scale) = gather(mesh)?;
        ledger.add(bytes_of(&triangles));
        let build::Built { mut nodes, references } =
            build::build(&triangles, bounds, params, &ledger, progress)?;
        let pages = pages::Pages::cut(&nodes, &references, params.page);
        ledger.add(pages.bytes());
        let mut counted = lines::counted(&mut nodes, &references);
        counted.extend([0; lines::AFTER]);
        ledger.add(bytes_of(&counted));
        ledger.sub(bytes_of(&references));
        drop(references);
        let lines = lines::Lines::pack(&nodes, &bounds);
        ledger.add(lines.bytes());
        if counted.len() > lines::MAX_RECORD || lines.all().len() > lines::MAX_LINE {
            let message = "its tree has more references than a tree can hold: lower max_duplication or raise \
                           traversal_cost in a profile";
            return Err(Error::Mesh(message.into()));
        }
        Ok(Self {
            nodes: nodes.into(),
            references: counted.into(),
            lines,
            pages,
            triangles: triangles.into(),
            bounds,
            scale,
            params: params.clone(),
            build_peak: ledger.peak(),
            stats: OnceLock::new(),
            pools: OnceLock::new(),
        })
    }

    /// The box around all triangles, in the mesh's coordinates.
    pub fn mesh_bounds(&self) -> Aabb {
        self.scale.undo_bounds(&self.bounds)
    }

    /// The tree in cache lines; the root is the first.
    #[inline(always)]
    pub fn lines(&self) -> &[Line] {
        self.lines.all()
    }

    /// Makes leaves that hold their corners, if they have not been made, with up to so many triangles (8, or [`MOST`]: what kernels meet
    /// at once). Whether there are any now: a tree may be too large for them.
    pub fn make_pools(&self, most: usize) -> bool {
        self.pools.get_or_init(|| Pools::new(&self.triangles, most)).is_some()
    }

    /// Leaves that hold their corners, if they have been made.
    #[inline(always)]
    pub fn pools(&self) -> Option<&Pools> {
        self.pools.get()?.as_ref()
    }

    /// Has a node's children fetched into the caches. A leaf has none; then something else is asked for.
    #[inline(always)]
    pub fn fetch_children(&self, node: Node) {
        prefetch(self.nodes.as_ptr().wrapping_add(node.below() as usize));
    }

    /// The words of all leaves' records.
    #[inline(always)]
    pub fn references(&self) -> &[u32] {
        &self.references
    }

    /// The primitive ids of the leaf whose record begins at a word.
    #[inline(always)]
    pub fn record(&self, word: usize) -> &[u32] {
        let first = word + 1;
        &self.references[first..first + self.references[word] as usize]
    }

    /// All triangles, by primitive id, in the tree's coordinates.
    #[inline(always)]
    pub fn triangles(&self) -> &[Triangle] {
        &self.triangles
    }

    /// The most bytes that the build's arrays held, the tree's own among them.
    pub fn build_peak(&self) -> usize {
        self.build_peak
    }

    /// The settings that it was built with.
    pub fn params(&self) -> &BuildParams {
        &self.params
    }
}

/// Every triangle's record, checked; the box around them; and what their coordinates were multiplied by.
fn gather(mesh: &Mesh) -> Result<(Vec<Triangle>, Aabb, Scale)> {
    if mesh.triangles.is_empty() {
        return Err(Error::Mesh("it has no triangles".into()));
    }
    if mesh.triangles.len() > node::MAX_INDEX {
        return Err(Error::Mesh(format!(
            "{} triangles are more than one tree can hold",
            mesh.triangles.len()
        )));
    }
    let corners = |(primitive, indices): (usize, &[u32; 3])| -> Result<Corners> {
        let mut corners: Corners = [[0.0; 3]; 3];
        for (corner, &index) in corners.iter_mut().zip(indices) {
            let Some(position) = mesh.positions.get(index as usize) else {
                let count = mesh.positions.len();
                return Err(Error::Mesh(format!(
                    "triangle {primitive} names vertex {index}, but there are only {count} vertices"
                )));
            };
            if !position.is_finite() {
                return Err(Error::Mesh(format!("vertex {index} of triangle {primitive} is not finite")));
            }
            *corner = position.to_array();
        }
        Ok(corners)
    };
    let all = || mesh.triangles.par_iter().enumerate().map(corners);
    let bounds_of = |corners: &Corners| Aabb::of_points(corners.map(Into::into));
    let grown = |bounds: Aabb, corners: Result<Corners>| Ok(bounds.union(bounds_of(&corners?)));
    let bounds = all().try_fold(|| Aabb::EMPTY, grown).try_reduce(|| Aabb::EMPTY, |a, b| Ok(a.union(b)));
    // Whichever fault is met first, the first one is named.
    let bounds = bounds.map_err(|error| all().find_map_first(Result::err).unwrap_or(error))?;
    let scale = Scale::of_bounds(&bounds);
    let record = |indices: &[u32; 3]| {
        let corners = indices.map(|index| mesh.positions[index as usize].to_array());
        Triangle::new(if scale.is_none() { corners } else { scale.apply(&corners) })
    };
    let mut triangles: Vec<Triangle> = huge::room_for(mesh.triangles.len());
    mesh.triangles.par_iter().map(record).collect_into_vec(&mut triangles);
    let bounds = if scale.is_none() {
        bounds
    } else {
        triangles.par_iter().map(|triangle| bounds_of(&triangle.corners)).reduce(|| Aabb::EMPTY, Aabb::union)
    };
    Ok((triangles, bounds, scale))
}

impl Tree for KdTree {
    #[inline(always)]
    fn scale(&self) -> Scale {
        self.scale
    }

    #[inline(always)]
    fn bounds(&self) -> &Aabb {
        &self.bounds
    }

    #[inline(always)]
    fn root(&self) -> Node {
        self.nodes[0]
    }

    #[inline(always)]
    fn children(&self, inner: Node) -> [Node; 2] {
        let below = inner.below() as usize;
        [self.nodes[below], self.nodes[below + 1]]
    }

    #[inline(always)]
    fn primitives(&self, leaf: Node) -> &[u32] {
        &self.references[leaf.references()]
    }

    #[inline(always)]
    fn upper(&self, place: usize) -> Node {
        self.pages.upper[place]
    }

    #[inline(always)]
    fn beneath(&self, place: usize) -> Node {
        self.nodes[self.pages.beneath[place] as usize]
    }

    #[inline(always)]
    fn page(&self, leaf: Node) -> &[u32] {
        &self.pages.primitives[leaf.references()]
    }

    #[inline(always)]
    fn triangle(&self, primitive: u32) -> &Triangle {
        &self.triangles[primitive as usize]
    }
}

#[cfg(test)]
mod tests;
