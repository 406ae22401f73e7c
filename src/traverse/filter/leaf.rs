//! A list in a leaf: each triangle against as many rays as a register holds.

use super::cut::present;
use super::lists::{Entries, List};
use super::lot::Lot;
use crate::geometry::triangle::{Mode, Test};
use crate::simd::{Dense, Mask, prefetch_both};
use crate::traverse::records::Resident;

/// Triangles that are sifted before some are tested.
pub const SIFTED: usize = 16;

/// Fetches the triangles of a leaf.
#[inline(always)]
pub fn fetch<'a, R>(resident: &Resident<'_, R>, leaf: impl Iterator<Item = &'a [u32]>) {
    for primitives in leaf {
        for &primitive in primitives {
            prefetch_both(resident.records.as_ptr().wrapping_add(primitive as usize));
        }
    }
}

/// Tests a leaf's triangles, up to [`SIFTED`] at a time, against the rays of a list. With `ANY`, a ray is done at its
/// first hit.
#[inline(always)]
pub fn test<'a, const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
    resident: &Resident<'_, M::Record>,
    lot: &mut Lot,
    entries: &Entries,
    list: &List,
    leaf: impl Iterator<Item = &'a [u32]> + Clone,
) {
    let (at, len) = (list.at as usize, list.len as usize);
    let mut done = 0;
    while done < len {
        let ids = entries.words::<W>(at + done);
        let (mut closest, origin) = lot.found::<W, L>(ids);
        let tmin = L::of_tagged(L::ids_of(ids));
        let live = tmin.le(closest.t).bits() & present((len - done).min(W));
        done += W;
        if live == 0 {
            continue;
        }
        let [x, y, z, tnear] = lot.ways::<W, L>(ids);
        let test = M::Test::<W, L>::new(&origin, &[x, y, z], live);
        let lanes = L::mask_from_bits(live);
        let mut changed = false;
        for primitives in leaf.clone() {
            // Which triangles a ray may hit, without a branch on it.
            let mut left = 0;
            for (i, &primitive) in primitives.iter().enumerate() {
                let meets = test.sift(&resident.records[primitive as usize], lanes).any();
                left |= u32::from(meets) << i;
            }

            // Those are tested.
            while left != 0 {
                let primitive = primitives[left.trailing_zeros() as usize % SIFTED];
                left &= left - 1;
                let candidate = test.test(&resident.records[primitive as usize], lanes);
                changed |= closest.take::<ANY>(&candidate, primitive, tnear, lanes, false);
            }
        }
        if changed {
            lot.keep(ids, live, &closest);
        }
    }
}
