//! Planes that keep clear of what they part.
//!
//! The cheapest planes are those at the ends of triangles: a floor, the side of a box. But a ray that hits what lies in a plane, or
//! ends or starts there, is in the plane's wall (`traverse/walk.rs`), and so in both of its cells: it has to look at what is
//! beyond, too. So a plane is moved off the end that it was found at, by more than a wall is thick for rays that start inside of
//! the scene, as far as nothing comes in its way on the other side. Rays then mostly end in one cell.

use super::reference::Reference;
use crate::geometry::Aabb;
use crate::kdtree::sah::{CellCost, Split};

/// How far planes keep away, relative to the scene's greatest extent: four times the half-thickness of walls, of which two would do for
/// hits themselves, and one is what pools do not know of them (`geometry/triangle/watertight/pooled.rs`).
const CLEARANCE: f32 = 1.0 / (1 << 17) as f32;

/// How far planes keep away in a scene.
pub fn clearance(bounds: &Aabb) -> f32 {
    CLEARANCE * (bounds.max - bounds.min).max_element()
}

/// Where what lies below a plane ends, and what lies above it begins, all that crosses it left aside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gap {
    end: f32,
    begin: f32,
}

impl Gap {
    /// Nothing lies anywhere.
    pub const ALL: Self = Self { end: f32::NEG_INFINITY, begin: f32::INFINITY };

    /// What some more references leave of it.
    #[inline]
    pub fn beside(mut self, split: &Split, references: &[Reference]) -> Self {
        let (axis, position) = (split.axis, split.position);
        for reference in references {
            let (low, high) = (reference.min(axis), reference.max(axis));
            let (touches_below, touches_above) = (high <= position, low >= position);
            let is_below = touches_below & (!touches_above | split.planar_below);
            let is_above = touches_above & !is_below;
            self.end = if is_below { self.end.max(high) } else { self.end };
            self.begin = if is_above { self.begin.min(low) } else { self.begin };
        }
        self
    }

    /// What is in both.
    pub fn and(self, other: Self) -> Self {
        Self { end: self.end.max(other.end), begin: self.begin.min(other.begin) }
    }

    /// A plane in the gap, moved away from its ends. In a face of the cell, or where nothing is between the ends, it stays.
    pub fn clear(self, split: Split, costs: &CellCost) -> Split {
        let (low, high) = costs.range(split.axis);
        let (end, begin) = (self.end.max(low), self.begin.min(high));
        let step = costs.clearance().min((begin - end) / 2.0);
        if split.position <= low || split.position >= high || step <= 0.0 {
            return split;
        }
        let position = split.position.max(end + step).min(begin - step);
        // Rounding may have brought it where it divides something else.
        if end <= position && position <= begin && low < position && position < high {
            Split { position, ..split }
        } else {
            split
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use glam::Vec3;

    /// References from one place along x to another.
    fn references(parts: &[[f32; 2]]) -> Vec<Reference> {
        let part =
            |&[low, high]: &[f32; 2]| Aabb { min: Vec3::new(low, 0.0, 0.0), max: Vec3::new(high, 1.0, 1.0) };
        parts.iter().map(|ends| Reference::new(0, &part(ends))).collect()
    }

    fn moved(position: f32, planar_below: bool, clearance: f32, parts: &[[f32; 2]]) -> f32 {
        let cell = Aabb { min: Vec3::ZERO, max: Vec3::ONE };
        let params = BuildParams::default();
        let costs = CellCost::new(&params, cell, clearance).expect("it has an area");
        let split = Split { axis: 0, position, planar_below, cost: 1.0 };
        Gap::ALL.beside(&split, &references(parts)).clear(split, &costs).position
    }

    #[test]
    fn a_plane_is_moved_off_the_end_that_it_was_found_at() {
        let apart = [[0.0, 0.25], [0.75, 1.0]];
        assert_eq!(moved(0.25, true, 0.125, &apart), 0.375);
        assert_eq!(moved(0.75, true, 0.125, &apart), 0.625);
        // As far as there is room, and not at all where there is none.
        assert_eq!(moved(0.25, true, 0.5, &apart), 0.5);
        assert_eq!(moved(0.5, true, 0.125, &[[0.0, 0.5], [0.5, 1.0]]), 0.5);
        // What crosses it is in nobody's way.
        assert_eq!(moved(0.25, true, 0.125, &[[0.0, 0.25], [0.0, 0.3], [0.2, 1.0], [0.75, 1.0]]), 0.375);
        // Flat parts are on the side that is named.
        assert_eq!(moved(0.25, true, 0.125, &[[0.25, 0.25], [0.75, 1.0]]), 0.375);
        assert_eq!(moved(0.25, false, 0.125, &[[0.25, 0.25], [0.75, 1.0]]), 0.125);
    }

    #[test]
    fn a_plane_that_cuts_off_nothing_but_space_stays_inside_of_the_cell() {
        assert_eq!(moved(0.25, true, 0.125, &[[0.25, 1.0]]), 0.125);
        assert_eq!(moved(0.25, true, 0.5, &[[0.25, 1.0]]), 0.125);
        assert_eq!(moved(0.75, true, 0.125, &[[0.0, 0.75]]), 0.875);
        // In a face it stays.
        assert_eq!(moved(0.0, true, 0.125, &[[0.0, 0.0], [0.5, 1.0]]), 0.0);
        assert_eq!(moved(1.0, false, 0.125, &[[1.0, 1.0], [0.0, 0.5]]), 1.0);
    }

    #[test]
    fn gaps_of_parts_make_that_of_all() {
        let split = Split { axis: 0, position: 0.5, planar_below: true, cost: 1.0 };
        let all = references(&[[0.0, 0.25], [0.1, 0.4], [0.5, 0.5], [0.6, 1.0], [0.55, 0.9], [0.4, 0.6]]);
        let whole = Gap::ALL.beside(&split, &all);
        assert_eq!(whole, Gap { end: 0.5, begin: 0.55 });
        let (first, second) = all.split_at(2);
        assert_eq!(Gap::ALL.beside(&split, first).and(Gap::ALL.beside(&split, second)), whole);
    }
}
