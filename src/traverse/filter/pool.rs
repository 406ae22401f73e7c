//! A ray of a list in a pool, by itself: a chunk's triangles at once, as in a [stream](crate::traverse::pool).

use super::ground::Chunks;
use super::lists::Entries;
use super::lot::Lot;
use crate::geometry::triangle::pooled::Prospects;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Mask, Sixteen};
use crate::traverse::pool::ways::prospects;
use crate::traverse::records::Resident;

/// Tests a pool's triangles against the ray of an entry. With `ANY`, it is done at its first hit.
#[inline(always)]
pub fn test_one<L: Sixteen, M: Mode, const ANY: bool>(
    resident: &Resident<'_, M::Record>,
    lot: &mut Lot,
    entries: &Entries,
    at: usize,
    chunks: Chunks<'_>,
) {
    let (id, tmin, _) = entries.one(at);
    let (ray, mut primitive) = lot.ray(id);
    let mut closest = ray.tfar;
    // (What is done ends before anything.)
    if closest < tmin {
        return;
    }
    let pooled = lot.pooled(&ray);
    for chunk in chunks {
        let Prospects { possible, certain, .. } = prospects::<L, M>(&pooled, chunk, ray.tnear, closest);
        let certain = certain.bits();
        if ANY && certain != 0 {
            lot.keep_one(id, f32::NEG_INFINITY, chunk.ids()[certain.trailing_zeros() as usize % 16]);
            return;
        }
        let mut possible = possible.bits();
        if possible == 0 {
            continue;
        }
        let test = M::Alone::new(&ray.origin.to_array(), &ray.direction.to_array(), 1);
        while possible != 0 {
            let other = chunk.ids()[possible.trailing_zeros() as usize % 16];
            possible &= possible - 1;
            let candidate = test.test(&resident.records[other as usize], true);
            let t = candidate.t;
            let nearer = t < closest || t == closest && other < primitive;
            if candidate.inside && ray.tnear <= t && nearer {
                (closest, primitive) = (if ANY { f32::NEG_INFINITY } else { t }, other);
            }
        }
        lot.keep_one(id, closest, primitive);
    }
}
