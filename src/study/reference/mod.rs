//! What rays really hit: answers in exact arithmetic, to judge engines by.
//!
//! Nothing here is shared with what is judged: no kd-tree, no SIMD, none of the library's own
//! triangle tests. A ray goes through three steps:
//!
//! 1. a bounding volume hierarchy in double precision finds the triangles that it may meet
//!    (`hierarchy`; its boxes are widened by proven error bounds, so none is lost);
//! 2. double precision with a proven error bound decides nearly all of them (`filter`);
//! 3. whole numbers of any size decide the rest, and give the record of the hit (`exact`).
//!
//! # What a hit is
//!
//! Ray and triangle are taken for the real numbers that their floats name:
//!
//! - The triangle is closed: edges and corners belong to it. A triangle without area is never hit,
//!   nor is one whose plane the ray's line lies in or runs along (edge-on).
//! - The interval is closed: a hit counts if its exact `t` satisfies `tnear <= t <= tfar`. Where `tfar` is
//!   infinite, a `t` that rounds to an infinite float does not count: no hit record could name it.
//! - A ray with a NaN, with an infinite origin or direction, with a zero direction or an empty
//!   interval hits nothing.
//! - The closest hit is the one of the least exact `t`, and among several at exactly that `t` the
//!   one of the lowest primitive id. Other triangles whose `t` *rounds to the same float* are
//!   [ties](Truth::ties): an engine that answers in floats cannot tell them apart.

mod exact;
mod filter;
mod hierarchy;

pub use exact::Meeting;

use crate::geometry::{Aabb, NO_PRIMITIVE, Ray};
use crate::mesh::Mesh;
use filter::{Probe, Verdict};
use glam::Vec3;
use hierarchy::{Hierarchy, Item};
use rayon::prelude::*;

/// The closest hit in truth; see the [module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct Truth {
    /// The ray's parameter, rounded to the nearest float, ties to even; infinite for a miss.
    pub t: f32,
    /// The same, rounded to the nearest double.
    pub t_f64: f64,
    /// Barycentric weight of the second corner of `primitive`, rounded to the nearest double.
    pub u: f64,
    /// Barycentric weight of its third corner.
    pub v: f64,
    /// The lowest id of the triangles with the least exact `t`; [`NO_PRIMITIVE`] for a miss.
    pub primitive: u32,
    /// The other triangles whose `t` rounds to the same float, in ascending order.
    pub ties: Vec<u32>,
}

impl Truth {
    /// No hit.
    pub const MISS: Self = Self {
        t: f32::INFINITY,
        t_f64: f64::INFINITY,
        u: 0.0,
        v: 0.0,
        primitive: NO_PRIMITIVE,
        ties: Vec::new(),
    };

    /// Whether anything is hit.
    pub fn is_hit(&self) -> bool {
        self.primitive != NO_PRIMITIVE
    }

    /// The lowest id among the nearest and its ties.
    pub fn lowest(&self) -> u32 {
        self.ties.first().map_or(self.primitive, |&tie| tie.min(self.primitive))
    }

    /// Whether an engine that names this primitive is right: it is the nearest, or ties with it.
    pub fn names(&self, primitive: u32) -> bool {
        self.is_hit() && (primitive == self.primitive || self.ties.binary_search(&primitive).is_ok())
    }
}

/// Exact answers for the rays of one scene.
pub struct Reference<'a> {
    mesh: &'a Mesh,
    hierarchy: Hierarchy,
}

impl<'a> Reference<'a> {
    /// Prepares a mesh, with all threads. Triangles with a corner that is not finite are never hit.
    ///
    /// # Panics
    /// If an index of the mesh is out of range.
    pub fn new(mesh: &'a Mesh) -> Self {
        let item = |id: u32| Item { id, bounds: Aabb::of_points(mesh.corners(id)) };
        let finite = |id: &u32| mesh.corners(*id).iter().all(|corner| corner.is_finite());
        let items = (0..mesh.triangles.len() as u32).into_par_iter().filter(finite).map(item).collect();
        Self { mesh, hierarchy: Hierarchy::new(items) }
    }

    /// The closest hit.
    pub fn closest(&self, ray: &Ray) -> Truth {
        let Some(probe) = Probe::new(ray) else { return Truth::MISS };
        let mut candidates: Vec<(u32, f64)> = Vec::new();
        let mut reach = probe.tfar;
        self.hierarchy.walk(&probe, &mut reach, &mut |id, reach| {
            if let Some((low, high)) = self.between(&probe, ray, id)
                && low <= *reach
            {
                candidates.push((id, low));
                *reach = reach.min(tie_limit(high));
            }
        });
        candidates.retain(|&(_, low)| low <= reach);
        self.nearest(ray, candidates.into_iter().map(|(id, _)| id))
    }

    /// Whether anything lies in the ray's interval.
    pub fn any(&self, ray: &Ray) -> bool {
        let Some(probe) = Probe::new(ray) else { return false };
        let (mut found, mut reach) = (false, probe.tfar);
        self.hierarchy.walk(&probe, &mut reach, &mut |id, reach| {
            if !found && self.between(&probe, ray, id).is_some() {
                (found, *reach) = (true, f64::NEG_INFINITY);
            }
        });
        found
    }

    /// Where the ray meets one triangle, whatever else it meets.
    ///
    /// # Panics
    /// If there is no such primitive.
    pub fn meets(&self, ray: &Ray, primitive: u32) -> Option<Meeting> {
        let corners = self.mesh.corners(primitive);
        Probe::new(ray)?;
        corners.iter().all(|corner| corner.is_finite()).then(|| exact::meet(ray, &corners)).flatten()
    }

    /// [`Reference::closest`] for many rays, with all threads.
    pub fn closest_of(&self, rays: &[Ray]) -> Vec<Truth> {
        rays.par_iter().map(|ray| self.closest(ray)).collect()
    }

    /// [`Reference::any`] for many rays, with all threads.
    pub fn any_of(&self, rays: &[Ray]) -> Vec<bool> {
        rays.par_iter().map(|ray| self.any(ray)).collect()
    }

    /// Between which doubles the `t` of a hit lies, if there is one.
    fn between(&self, probe: &Probe, ray: &Ray, primitive: u32) -> Option<(f64, f64)> {
        let corners = self.mesh.corners(primitive);
        match probe.meets(&corners) {
            Verdict::Miss => None,
            Verdict::Hit(low, high) => Some((low, high)),
            Verdict::Unsure => exact::meet(ray, &corners).map(|found| {
                let t = found.t_f64();
                (t.next_down(), t.next_up())
            }),
        }
    }

    /// The truth, of those that are met.
    fn nearest(&self, ray: &Ray, candidates: impl Iterator<Item = u32>) -> Truth {
        let corners = |id: u32| -> [Vec3; 3] { self.mesh.corners(id) };
        let mut met: Vec<(Meeting, u32)> =
            candidates.filter_map(|id| exact::meet(ray, &corners(id)).map(|found| (found, id))).collect();
        met.sort_unstable();
        let Some((found, primitive)) = met.first() else { return Truth::MISS };
        let t = found.t();
        let mut ties: Vec<u32> =
            met[1..].iter().take_while(|(other, _)| other.t() == t).map(|&(_, id)| id).collect();
        ties.sort_unstable();
        Truth { t, t_f64: found.t_f64(), u: found.u(), v: found.v(), primitive: *primitive, ties }
    }
}

/// What rounds to the same float as any `t` up to `high` lies below this.
fn tie_limit(high: f64) -> f64 {
    f64::from((high as f32).next_up())
}

#[cfg(test)]
mod tests;
