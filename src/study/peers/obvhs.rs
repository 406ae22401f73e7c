//! obvhs 0.4: a BVH library in Rust, traced ray by ray.
//!
//! Its SIMD is chosen when raypack is compiled, not when it runs: [`COMPILED_FOR`] says for what.

use crate::geometry::{Hit, Ray};
use crate::mesh::Mesh;
use glam::Vec3;
use obvhs::BvhBuildParams;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh_from_tris};
use obvhs::ray::{Ray as PeerRay, RayHit};
use obvhs::rt_triangle::RtTriangle;
use obvhs::triangle::Triangle;
use std::time::{Duration, Instant};

/// The version that Cargo.toml pins.
pub const VERSION: &str = "0.4.0";

/// The instruction set that its code was compiled for.
pub const COMPILED_FOR: &str = if cfg!(target_feature = "avx512f") {
    "avx512"
} else if cfg!(target_feature = "avx2") {
    "avx2"
} else if cfg!(target_feature = "avx") {
    "avx"
} else if cfg!(target_feature = "sse2") {
    "sse2"
} else {
    std::env::consts::ARCH
};

/// Which of its trees.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Layout {
    /// Compressed eight-wide nodes (Ylitie 2017), four children a SIMD test.
    CwBvh,
    /// Binary nodes.
    Bvh2,
}

/// Which of its build presets.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Preset {
    /// The one that its documentation starts with.
    Medium,
    /// The most thorough one.
    VerySlow,
}

/// Every combination.
pub const ALL: [(Layout, Preset); 4] = [
    (Layout::CwBvh, Preset::Medium),
    (Layout::CwBvh, Preset::VerySlow),
    (Layout::Bvh2, Preset::Medium),
    (Layout::Bvh2, Preset::VerySlow),
];

impl Layout {
    /// `cwbvh` or `bvh2`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::CwBvh => "cwbvh",
            Self::Bvh2 => "bvh2",
        }
    }
}

impl Preset {
    /// `medium` or `very-slow`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Medium => "medium",
            Self::VerySlow => "very-slow",
        }
    }

    const fn params(self) -> BvhBuildParams {
        match self {
            Self::Medium => BvhBuildParams::medium_build(),
            Self::VerySlow => BvhBuildParams::very_slow_build(),
        }
    }
}

enum Tree {
    CwBvh(CwBvh),
    Bvh2(Bvh2),
}

/// A built tree with its triangles in the tree's order, as its examples have it for speed.
pub struct Scene {
    tree: Tree,
    triangles: Vec<RtTriangle>,
    build_seconds: f64,
}

/// Rays in its form, which carries the inverse direction; made before the clock starts.
#[derive(Clone, Debug)]
pub struct Prepared(Vec<PeerRay>);

impl Prepared {
    /// Converts rays.
    pub fn new(rays: &[Ray]) -> Self {
        let convert = |r: &Ray| PeerRay::new(r.origin.into(), r.direction.into(), r.tnear, r.tfar);
        Self(rays.iter().map(convert).collect())
    }

    /// Where they are.
    pub fn as_slice(&self) -> &[impl Sized + use<>] {
        &self.0
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl Scene {
    /// Builds a tree; the clock also runs over putting the triangles in order.
    pub fn new(mesh: &Mesh, layout: Layout, preset: Preset) -> Self {
        let triangles: Vec<Triangle> = (0..mesh.triangles.len() as u32)
            .map(|i| {
                let [v0, v1, v2] = mesh.corners(i).map(Into::into);
                Triangle { v0, v1, v2 }
            })
            .collect();
        let start = Instant::now();
        let mut core = Duration::ZERO;
        let tree = match layout {
            Layout::CwBvh => Tree::CwBvh(build_cwbvh_from_tris(&triangles, preset.params(), &mut core)),
            Layout::Bvh2 => Tree::Bvh2(build_bvh2_from_tris(&triangles, preset.params(), &mut core)),
        };
        let order = match &tree {
            Tree::CwBvh(t) => &t.primitive_indices,
            Tree::Bvh2(t) => &t.primitive_indices,
        };
        let triangles = order.iter().map(|&i| RtTriangle::from(&triangles[i as usize])).collect();
        Self { tree, triangles, build_seconds: start.elapsed().as_secs_f64() }
    }

    /// Seconds that the build took.
    pub fn build_seconds(&self) -> f64 {
        self.build_seconds
    }

    /// Bytes of nodes, indices and ordered triangles.
    pub fn bytes(&self) -> u64 {
        let tree = match &self.tree {
            Tree::CwBvh(t) => size_of_val(&t.nodes[..]) + size_of_val(&t.primitive_indices[..]),
            Tree::Bvh2(t) => size_of_val(&t.nodes[..]) + size_of_val(&t.primitive_indices[..]),
        };
        (tree + size_of_val(&self.triangles[..])) as u64
    }

    /// The closest hits, in full. Panics if the lengths differ.
    pub fn closest(&self, rays: &Prepared, hits: &mut [Hit]) {
        assert_eq!(rays.0.len(), hits.len());
        // The tree is chosen outside of the loop so that each is compiled for itself.
        match &self.tree {
            Tree::CwBvh(tree) => {
                for (ray, out) in rays.0.iter().zip(hits) {
                    let mut hit = RayHit::none();
                    tree.ray_traverse(*ray, &mut hit, |ray, i| self.triangles[i].intersect(ray));
                    *out = self.record(ray, &hit, &tree.primitive_indices);
                }
            }
            Tree::Bvh2(tree) => {
                for (ray, out) in rays.0.iter().zip(hits) {
                    let mut hit = RayHit::none();
                    tree.ray_traverse(*ray, &mut hit, |ray, i| self.triangles[i].intersect(ray));
                    *out = self.record(ray, &hit, &tree.primitive_indices);
                }
            }
        }
    }

    /// Whether each ray hits anything. Panics if the lengths differ.
    pub fn any(&self, rays: &Prepared, occluded: &mut [bool]) {
        assert_eq!(rays.0.len(), occluded.len());
        match &self.tree {
            Tree::CwBvh(tree) => {
                for (ray, out) in rays.0.iter().zip(occluded) {
                    *out = !tree.ray_traverse_miss(*ray, |ray, i| self.triangles[i].intersect(ray));
                }
            }
            Tree::Bvh2(tree) => {
                for (ray, out) in rays.0.iter().zip(occluded) {
                    *out = !tree.ray_traverse_miss(*ray, |ray, i| self.triangles[i].intersect(ray));
                }
            }
        }
    }

    #[inline(always)]
    fn record(&self, ray: &PeerRay, hit: &RayHit, primitives: &[u32]) -> Hit {
        // Its binary traversal counts a ray that meets no leaf as "hit" at tmax; the id tells.
        if hit.primitive_id == u32::MAX {
            return Hit::MISS;
        }
        let triangle = &self.triangles[hit.primitive_id as usize];
        let uv = triangle.compute_barycentric(ray);
        // Its stored normal is the negative of (p1 - p0) x (p2 - p0).
        let normal = -Vec3::from(triangle.ng);
        Hit { t: hit.t, u: uv.x, v: uv.y, primitive: primitives[hit.primitive_id as usize], normal }
    }
}
