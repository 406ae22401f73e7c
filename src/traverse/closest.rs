//! The closest hits so far, and how they become records.

use super::lanes::HitPacket;
use super::records::Records;
use crate::geometry::NO_PRIMITIVE;
use crate::geometry::triangle::{self, Candidate, Mode, Test};
use crate::kdtree::Tree;
use crate::simd::{Lanes, Mask};
use glam::Vec3;

/// The id of no triangle yet: greater than any, so that equal `t` lets the first hit in.
pub const NONE: i32 = i32::MAX;

/// A hit's id as the library gives it.
const _: () = assert!(NO_PRIMITIVE > NONE as u32);

/// Normals of triangles: neighbouring packets mostly hit the same few, so that `N` of them are remembered.
pub struct Normals<const N: usize> {
    /// Whose they are, each at the place that its id tells.
    primitives: [u32; N],
    normals: [Vec3; N],
}

impl<const N: usize> Normals<N> {
    /// None so far.
    #[inline(always)]
    pub const fn new() -> Self {
        Self { primitives: [NO_PRIMITIVE; N], normals: [Vec3::ZERO; N] }
    }

    /// The normal of a triangle that was entered.
    #[inline(always)]
    fn of<T: Tree>(&mut self, tree: &T, primitive: u32) -> Vec3 {
        let place = primitive as usize % N;
        if primitive != self.primitives[place] {
            (self.primitives[place], self.normals[place]) =
                (primitive, triangle::normal(tree.corners(primitive)));
        }
        self.normals[place]
    }
}

/// The closest hits of `W` rays so far; with any hit, which of them are done.
#[derive(Clone, Copy)]
pub struct Closest<const W: usize, L: Lanes<W>> {
    /// What a hit must not lie beyond: the closest `t`, or `tfar`, which is infinite for nobody.
    pub t: L,
    u: L,
    v: L,
    primitive: L::Ids,
}

impl<const W: usize, L: Lanes<W>> Closest<W, L> {
    /// Nothing found in the intervals that end at `tfar`.
    #[inline(always)]
    pub fn new(tfar: L) -> Self {
        let zero = L::splat(0.0);
        Self { t: L::splat(f32::MAX).min(tfar), u: zero, v: zero, primitive: L::ids(NONE) }
    }

    /// What was found before: the closest `t` or `tfar`, and ids or [`NONE`]; and the weights, if they were kept.
    #[inline(always)]
    pub fn of_found(t: L, primitive: L::Ids, [u, v]: [L; 2]) -> Self {
        Self { t, u, v, primitive }
    }

    /// The ids of what was found, [`NONE`] in the other lanes.
    #[inline(always)]
    pub fn ids(&self) -> L::Ids {
        self.primitive
    }

    /// The weights, if they were kept.
    #[inline(always)]
    pub fn weights(&self) -> [L; 2] {
        [self.u, self.v]
    }

    /// Takes up what a triangle's test found in the lanes `live`: the least `t`, then the lowest id.
    /// With `ANY` a lane is done at its first hit; `weights` says whether those of the candidate are kept.
    /// Says whether anything changed.
    #[inline(always)]
    pub fn take<const ANY: bool>(
        &mut self,
        candidate: &Candidate<W, L>,
        primitive: u32,
        tnear: L,
        live: L::Mask,
        weights: bool,
    ) -> bool {
        let mut hit = candidate.inside & live;
        if !hit.any() {
            return false;
        }
        let id = L::ids(primitive as i32);
        let nearer = candidate.t.lt(self.t) | (candidate.t.eq(self.t) & L::ids_less(id, self.primitive));
        hit = hit & tnear.le(candidate.t) & nearer;
        self.primitive = L::ids_select(hit, id, self.primitive);
        if ANY {
            // A lane that is done has an interval that no later cell can reach.
            self.t = L::select(hit, L::splat(f32::NEG_INFINITY), self.t);
        } else {
            self.t = L::select(hit, candidate.t, self.t);
            if weights {
                self.u = L::select(hit, candidate.u, self.u);
                self.v = L::select(hit, candidate.v, self.v);
            }
        }
        true
    }

    /// The lanes that found something.
    #[inline(always)]
    pub fn found(&self) -> u32 {
        L::ids_less(self.primitive, L::ids(NONE)).bits()
    }

    /// The triangles found, where [`found`](Self::found) says so.
    #[inline(always)]
    pub fn primitives(&self) -> [i32; W] {
        L::ids_store(self.primitive)
    }

    /// Hit records, with what belongs to the triangles filled in. If weights were not kept, `test` finds
    /// them again.
    #[inline(always)]
    pub fn records<T: Records<M>, M: Mode, const N: usize>(
        &self,
        tree: &T,
        test: Option<&M::Test<W, L>>,
        normals: &mut Normals<N>,
    ) -> HitPacket<W> {
        let found = L::ids_less(self.primitive, L::ids(NONE));
        let ids = L::ids_store(L::ids_select(found, self.primitive, L::ids(NO_PRIMITIVE as i32)));
        let zero = L::splat(0.0);
        let (mut u, mut v) = (zero, zero);
        let mut normal = [zero; 3];

        // Triangle by triangle: neighbouring rays mostly hit the same.
        let mut rest = found.bits();
        while rest != 0 {
            let id = ids[rest.trailing_zeros() as usize % W];
            let lanes = !(L::ids_less(self.primitive, L::ids(id)) | L::ids_less(L::ids(id), self.primitive));
            rest &= !lanes.bits();
            tree.enter_triangle(id as u32);
            let record = tree.record_of(id as u32);
            let weights = match test {
                Some(test) => {
                    let [u, v] = test.weigh(record, lanes);
                    M::Test::<W, L>::weights(record, u, v)
                }
                None => M::Test::<W, L>::weights(record, self.u, self.v),
            };
            let along = normals.of(tree, id as u32);
            u = L::select(lanes, weights[0], u);
            v = L::select(lanes, weights[1], v);
            for axis in 0..3 {
                normal[axis] = L::select(lanes, L::splat(along[axis]), normal[axis]);
            }
        }

        // A zero is given out without a sign.
        HitPacket {
            t: (L::select(found, self.t, L::splat(f32::INFINITY)) + zero).store(),
            u: (u + zero).store(),
            v: (v + zero).store(),
            primitive: ids.map(|id| id as u32),
            normal: [normal[0].store(), normal[1].store(), normal[2].store()],
        }
    }
}
