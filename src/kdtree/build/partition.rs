//! Dividing references by a plane, with those that cross it clipped to each side, or cut by it.

use super::reference::Reference;
use crate::geometry::clip::Clipper;
use crate::geometry::cut;
use crate::geometry::triangle::{Corners, Triangle};
use crate::kdtree::sah::Split;
use crate::simd::{Chosen, Simd, Task};

/// Triangles by primitive id.
pub trait Lookup {
    /// The corners of one that is among them.
    fn corners(&self, primitive: u32) -> &Corners;
}

impl Lookup for [Triangle] {
    #[inline(always)]
    fn corners(&self, primitive: u32) -> &Corners {
        &self[primitive as usize].corners
    }
}

/// Memory that dividing reuses.
#[derive(Default)]
pub struct Divider {
    clipper: Clipper,
    /// What goes below the plane.
    below: Vec<Reference>,
}

impl Divider {
    /// Divides the references from `start` on. Those above the plane stay in `references`, moved
    /// together; those below it are returned, to be copied before the next call.
    ///
    /// Every reference goes to each side that its part in the cell reaches into: a triangle that only
    /// touches the plane stays on its own side, one that lies in the plane goes to the side that the
    /// split names. One that crosses is clipped to both sides, and left out of a side that its true
    /// shape does not reach (its bounds had overstated it). Unless `clips`, it is cut by this plane alone,
    /// and left out where even that shows that it does not reach.
    pub fn divide<T: Lookup + ?Sized>(
        &mut self,
        isa: Chosen,
        references: &mut Vec<Reference>,
        start: usize,
        triangles: &T,
        split: &Split,
        clips: bool,
    ) -> &[Reference] {
        let count = references.len() - start;
        if self.below.len() < count {
            self.below.resize(count, Reference::NONE);
        }
        let (list, below) = (&mut references[start..], &mut self.below[..count]);
        let (stay, go) =
            isa.run(Division { list, below, triangles, split, clips, clipper: &mut self.clipper });
        references.truncate(start + stay);
        &self.below[..go]
    }
}

/// A pass over a node's references; what stays moves to the front of `list`, what goes is written to
/// the front of `below`, which is as long.
struct Division<'a, T: ?Sized> {
    list: &'a mut [Reference],
    below: &'a mut [Reference],
    triangles: &'a T,
    split: &'a Split,
    clips: bool,
    clipper: &'a mut Clipper,
}

impl<T: Lookup + ?Sized> Task for Division<'_, T> {
    /// How many stay, and how many go.
    type Output = (usize, usize);

    // Nothing here is a vector by name: the clipper's loops over four coordinates become vectors of the
    // instruction set.
    #[inline(always)]
    fn run<S: Simd>(self) -> (usize, usize) {
        let Self { list, below, triangles, split, clips, clipper } = self;
        let (axis, position) = (split.axis, split.position);
        let (mut stay, mut go) = (0, 0);
        for i in 0..list.len() {
            let reference = list[i];
            let is_below = reference.max(axis) <= position;
            let is_above = reference.min(axis) >= position;
            if is_below | is_above {
                // Written to both lists, and kept in one: no branch to be mispredicted. `stay` is at most
                // `i`, so that nothing is lost.
                let goes = is_below & (!is_above | split.planar_below);
                below[go] = reference;
                list[stay] = reference;
                go += usize::from(goes);
                stay += usize::from(!goes);
            } else {
                let (primitive, bounds) = (reference.primitive(), reference.bounds());
                let corners = triangles.corners(primitive);
                let parts = if clips {
                    clipper.halves(corners, &bounds, axis, position)
                } else {
                    cut::halves(corners, &bounds, axis, position)
                };
                // Rounding outward never loses both; if clipping ever did, keep the triangle whole.
                let lost = parts == [None; 2];
                let whole = lost.then_some(bounds);
                let [part_below, part_above] = parts.map(|part| part.or(whole));
                if let Some(bounds) = part_below {
                    below[go] = Reference::new(primitive, &bounds);
                    go += 1;
                }
                if let Some(bounds) = part_above {
                    list[stay] = Reference::new(primitive, &bounds);
                    stay += 1;
                }
            }
        }
        (stay, go)
    }
}
