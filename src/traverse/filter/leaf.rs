//! A list in a leaf: each triangle against as many rays as a register holds.

use super::cut::present;
use super::lists::{Entries, List};
use super::lot::Lot;
use crate::geometry::triangle::{Mode, Test};
use crate::kdtree::Exit;
use crate::simd::{Dense, Mask, prefetch_both};
use crate::traverse::records::Resident;

/// Triangles that are sifted before some are tested.
const SIFTED: usize = 16;

/// The triangles of the leaf that a list is in.
#[inline(always)]
fn primitives<'a, R>(resident: &Resident<'a, R>, list: &List) -> &'a [u32] {
    let words = &resident.tree.references()[Exit(list.exit).record()..];
    &words[1..][..words[0] as usize]
}

/// Fetches them.
#[inline(always)]
pub fn fetch<R>(resident: &Resident<'_, R>, list: &List) {
    for &primitive in primitives(resident, list) {
        prefetch_both(resident.records.as_ptr().wrapping_add(primitive as usize));
    }
}

/// Tests a leaf's triangles against the rays of a list. With `ANY`, a ray is done at its first hit.
#[inline(always)]
pub fn test<const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
    resident: &Resident<'_, M::Record>,
    lot: &mut Lot,
    entries: &Entries,
    list: &List,
) {
    let primitives = primitives(resident, list);
    let (at, len) = (list.at as usize, list.len as usize);
    let mut done = 0;
    while done < len {
        let (ids, tmin, tmax) = entries.load::<W, L>(at + done);
        let (mut closest, origin) = lot.found::<W, L>(&ids);
        let live = tmin.le(closest.t.min(tmax)).bits() & present((len - done).min(W));
        done += W;
        if live == 0 {
            continue;
        }
        let [x, y, z, tnear] = lot.ways::<W, L>(&ids);
        let test = M::Test::<W, L>::new(&origin, &[x, y, z], live);
        let lanes = L::mask_from_bits(live);
        let mut changed = false;
        for primitives in primitives.chunks(SIFTED) {
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
            lot.keep(&ids, live, &closest);
        }
    }
}
