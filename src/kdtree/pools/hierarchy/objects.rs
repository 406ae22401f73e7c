//! Parting references into groups: each goes where its middle is.
//!
//! Many of them are counted in bins (Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007); few are
//! put in order, and all ways to part them are tried.

use super::Split;
use super::reference::Reference;
use crate::geometry::Aabb;
use rayon::prelude::*;

/// Bins along each axis.
const BINS: usize = 64;

/// So many are put in order.
const FEW: usize = 24;

/// References for which it pays to look at each axis by another worker.
const PARALLEL: usize = 1 << 14;

/// The cheapest way to part some references; `None` if all have the same middle.
pub fn best(references: &[Reference]) -> Option<Split> {
    if references.len() <= FEW {
        return (0..3).map(|axis| swept(references, axis)).fold(None, Split::cheaper);
    }
    if references.len() >= PARALLEL {
        let each: Vec<_> = (0..3).into_par_iter().map(|axis| binned(references, axis)).collect();
        return each.into_iter().fold(None, Split::cheaper);
    }
    (0..3).map(|axis| binned(references, axis)).fold(None, Split::cheaper)
}

/// Parts references as was found best.
pub fn part(mut references: Vec<Reference>, split: &Split) -> [Vec<Reference>; 2] {
    let Split { axis, at, .. } = *split;
    if references.len() <= FEW {
        put_in_order(&mut references, axis);
        let high = references.split_off(at);
        return [references, high];
    }
    let bins = Bins::along(&references, axis).expect("they were parted by them");
    let (low, high) = references.into_iter().partition(|reference| bins.of(reference.middle(axis)) < at);
    [low, high]
}

/// Half of the references and the other half, along the longest axis.
pub fn halves(mut references: Vec<Reference>, bounds: &Aabb) -> [Vec<Reference>; 2] {
    let axis = bounds.extent().max_position();
    put_in_order(&mut references, axis);
    let high = references.split_off(references.len().div_ceil(2));
    [references, high]
}

/// Sorts references by their middles, and by their ids where those are the same.
fn put_in_order(references: &mut [Reference], axis: usize) {
    references
        .sort_unstable_by(|a, b| a.middle(axis).total_cmp(&b.middle(axis)).then_with(|| a.id.cmp(&b.id)));
}

/// The cheapest way along an axis, of all.
fn swept(references: &[Reference], axis: usize) -> Option<Split> {
    let count = references.len();
    let mut room = [Reference { bounds: Aabb::EMPTY, id: 0 }; FEW];
    let ordered = &mut room[..count];
    ordered.copy_from_slice(references);
    put_in_order(ordered, axis);
    if ordered[0].middle(axis) == ordered[count - 1].middle(axis) {
        return None;
    }
    let mut above = [Aabb::EMPTY; FEW];
    let mut all = Aabb::EMPTY;
    for (reference, above) in ordered.iter().zip(&mut above).rev() {
        all = all.union(reference.bounds);
        *above = all;
    }
    let (mut below, mut best) = (Aabb::EMPTY, None);
    for at in 1..count {
        below = below.union(ordered[at - 1].bounds);
        let split = Split { axis, at, counts: [at, count - at], boxes: [below, above[at]] };
        best = Split::cheaper(best, Some(split));
    }
    best
}

/// Where bins lie.
struct Bins {
    first: f32,
    scale: f32,
}

impl Bins {
    /// Those for some references; `None` if all have the same middle.
    fn along(references: &[Reference], axis: usize) -> Option<Self> {
        let (mut first, mut last) = (f32::INFINITY, f32::NEG_INFINITY);
        for reference in references {
            let middle = reference.middle(axis);
            (first, last) = (first.min(middle), last.max(middle));
        }
        let scale = BINS as f32 / (last - first);
        // (Where the middles are that near, the scale may be infinite, and one is as good as the others.)
        (first < last && scale <= f32::MAX).then_some(Self { first, scale })
    }

    /// The one that a middle is in: it grows with the middle.
    #[inline(always)]
    fn of(&self, middle: f32) -> usize {
        (((middle - self.first) * self.scale) as usize).min(BINS - 1)
    }
}

/// The cheapest way along an axis, of those between bins.
fn binned(references: &[Reference], axis: usize) -> Option<Split> {
    let bins = Bins::along(references, axis)?;
    let mut counts = [0; BINS];
    let mut boxes = [Aabb::EMPTY; BINS];
    for reference in references {
        let bin = bins.of(reference.middle(axis));
        counts[bin] += 1;
        boxes[bin] = boxes[bin].union(reference.bounds);
    }
    Split::between(axis, &counts, &counts, &boxes, references.len())
}

#[cfg(test)]
mod tests {
    use super::super::reference::around;
    use super::*;
    use crate::weyl::uniform;
    use glam::Vec3;

    fn cube(id: u32, center: Vec3, half: f32) -> Reference {
        let half = Vec3::splat(half);
        Reference { bounds: Aabb { min: center - half, max: center + half }, id }
    }

    #[test]
    fn two_heaps_are_parted_between_them() {
        let mut number = uniform(0.0, 1.0);
        for count in [4, FEW as u32, 200] {
            for axis in 0..3 {
                let all: Vec<Reference> = (0..count)
                    .map(|id| {
                        let mut center = Vec3::new(number(), number(), number());
                        center[axis] += if id % 2 == 0 { 10.0 } else { 0.0 };
                        cube(id, center, 0.1)
                    })
                    .collect();
                let split = best(&all).expect("they have two sides");
                assert_eq!((split.axis, split.counts), (axis, [count as usize / 2; 2]));
                let sides = part(all, &split);
                for (i, side) in sides.iter().enumerate() {
                    assert!(side.iter().all(|reference| (reference.id % 2 == 0) == (i == 1)));
                    assert_eq!((side.len(), around(side)), (split.counts[i], split.boxes[i]));
                }
            }
        }
    }

    #[test]
    fn what_has_one_middle_is_not_parted_but_by_halves() {
        for count in [2, 100u32] {
            let all: Vec<Reference> = (0..count).map(|id| cube(id, Vec3::ONE, 1.0 + id as f32)).collect();
            assert_eq!(best(&all), None);
            let bounds = around(&all);
            let [low, high] = halves(all, &bounds);
            assert_eq!((low.len(), high.len()), (count as usize / 2, count as usize / 2));
        }
    }
}
