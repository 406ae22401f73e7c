//! Dividing references by a plane, with those that cross it clipped to each side.

use super::Reference;
use crate::geometry::clip::clipped_bounds;
use crate::geometry::triangle::Corners;
use crate::kdtree::sah::Split;

/// References on the two sides of a plane.
pub(super) struct Parts {
    pub below: Vec<Reference>,
    pub above: Vec<Reference>,
}

/// Every reference goes to each side that its part in the cell reaches into.
///
/// A triangle that only touches the plane stays on its own side; one that lies in the plane goes
/// to the side that the split names. One that crosses is clipped to both sides, and left out of
/// a side that its true shape does not reach (its bounds had overstated it).
pub(super) fn partition(references: &[Reference], triangles: &[Corners], split: &Split) -> Parts {
    let (axis, position) = (split.axis, split.position);
    let mut below = Vec::with_capacity(references.len() / 2 + 8);
    let mut above = Vec::with_capacity(references.len() / 2 + 8);
    for reference in references {
        let (low, high) = (reference.min[axis], reference.max[axis]);
        if low == position && high == position {
            if split.planar_below { &mut below } else { &mut above }.push(*reference);
        } else if high <= position {
            below.push(*reference);
        } else if low >= position {
            above.push(*reference);
        } else {
            let corners = &triangles[reference.primitive as usize];
            let [part_below, part_above] = reference.bounds().halves(axis, position);
            let clipped_below = clipped_bounds(corners, &part_below);
            let clipped_above = clipped_bounds(corners, &part_above);
            // Rounding outward never loses both; if clipping ever did, keep the triangle whole.
            if clipped_below.is_none() && clipped_above.is_none() {
                below.push(*reference);
                above.push(*reference);
            }
            below.extend(clipped_below.map(|b| Reference::with_bounds(reference.primitive, b)));
            above.extend(clipped_above.map(|b| Reference::with_bounds(reference.primitive, b)));
        }
    }
    Parts { below, above }
}
