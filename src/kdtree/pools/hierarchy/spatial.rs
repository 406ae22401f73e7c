//! Parting triangles across a plane: what reaches over it is on both sides then, a part of it each (Stich, Friedrich &
//! Dietrich, "Spatial splits in bounding volume hierarchies", 2009).

use super::Split;
use super::reference::Reference;
use crate::geometry::Aabb;
use crate::geometry::clip::Clipper;
use crate::geometry::triangle::Triangle;
use rayon::prelude::*;

/// Bins along each axis.
const BINS: usize = 16;

/// References for which it pays to look at each axis by another worker.
const PARALLEL: usize = 1 << 12;

/// The cheapest plane between bins of a box around some references, of those that leave no more than `most` of them; `None` if
/// none parts them.
pub fn best(references: &[Reference], bounds: &Aabb, triangles: &[Triangle], most: usize) -> Option<Split> {
    let along = |axis| binned(references, bounds, axis, triangles, most);
    if references.len() >= PARALLEL {
        let each: Vec<_> = (0..3).into_par_iter().map(along).collect();
        return each.into_iter().fold(None, Split::cheaper);
    }
    (0..3).map(along).fold(None, Split::cheaper)
}

/// Parts references across a plane. One that reaches over it stays whole, on one side, where that is cheaper.
pub fn part(
    references: &[Reference],
    bounds: &Aabb,
    split: &Split,
    triangles: &[Triangle],
) -> [Vec<Reference>; 2] {
    let Split { axis, at, counts: [mut below, mut above], boxes: [mut low, mut high] } = *split;
    let plane = Bins::of_box(bounds, axis).expect("it was parted by them").plane(at);
    let mut sides = split.counts.map(Vec::with_capacity);
    let mut clipper = Clipper::default();
    for reference in references {
        let Reference { bounds, id } = *reference;
        if bounds.max[axis] <= plane {
            sides[0].push(*reference);
            continue;
        }
        if plane <= bounds.min[axis] {
            sides[1].push(*reference);
            continue;
        }
        let [lower, upper] = clipper.halves(&triangles[id as usize].corners, &bounds, axis, plane);
        let (Some(lower), Some(upper)) = (lower, upper) else {
            sides[usize::from(lower.is_none())].push(*reference);
            continue;
        };
        // On both sides, all of it on the lower one, or on the upper one.
        let (wider_low, wider_high) = (low.union(bounds), high.union(bounds));
        let cost = |counts, boxes| Split { axis, at, counts, boxes }.cost();
        let parted = cost([below, above], [low, high]);
        let lower_only = cost([below, above.saturating_sub(1)], [wider_low, high]);
        let upper_only = cost([below.saturating_sub(1), above], [low, wider_high]);
        if lower_only < parted && lower_only <= upper_only {
            (low, above) = (wider_low, above.saturating_sub(1));
            sides[0].push(*reference);
        } else if upper_only < parted {
            (high, below) = (wider_high, below.saturating_sub(1));
            sides[1].push(*reference);
        } else {
            sides[0].push(Reference { bounds: lower, id });
            sides[1].push(Reference { bounds: upper, id });
        }
    }
    sides
}

/// Where bins lie.
struct Bins {
    first: f32,
    last: f32,
    scale: f32,
}

impl Bins {
    /// Those along an axis of a box; `None` if it is flat there.
    fn of_box(bounds: &Aabb, axis: usize) -> Option<Self> {
        let (first, last) = (bounds.min[axis], bounds.max[axis]);
        let scale = BINS as f32 / (last - first);
        (first < last && 0.0 < scale && scale <= f32::MAX).then_some(Self { first, last, scale })
    }

    /// The one that a coordinate is in: it grows with the coordinate.
    #[inline(always)]
    fn of(&self, at: f32) -> usize {
        (((at - self.first) * self.scale) as usize).min(BINS - 1)
    }

    /// Where a bin begins.
    #[inline(always)]
    fn plane(&self, bin: usize) -> f32 {
        let part = bin as f32 / BINS as f32;
        self.first * (1.0 - part) + self.last * part
    }
}

/// The cheapest plane across an axis.
fn binned(
    references: &[Reference],
    bounds: &Aabb,
    axis: usize,
    triangles: &[Triangle],
    most: usize,
) -> Option<Split> {
    let bins = Bins::of_box(bounds, axis)?;
    let mut clipper = Clipper::default();
    let [mut begins, mut ends] = [[0; BINS]; 2];
    let mut boxes = [Aabb::EMPTY; BINS];
    for Reference { bounds, id } in references {
        let (first, last) = (bins.of(bounds.min[axis]), bins.of(bounds.max[axis]));
        begins[first] += 1;
        ends[last] += 1;
        if first == last {
            boxes[first] = boxes[first].union(*bounds);
            continue;
        }
        for bin in first..=last {
            let mut slab = *bounds;
            slab.min[axis] = if bin == first { bounds.min[axis] } else { bins.plane(bin) };
            slab.max[axis] = if bin == last { bounds.max[axis] } else { bins.plane(bin + 1) };
            if let Some(part) = clipper.part(&triangles[*id as usize].corners, &slab) {
                boxes[bin] = boxes[bin].union(part);
            }
        }
    }
    Split::between(axis, &begins, &ends, &boxes, most)
}
