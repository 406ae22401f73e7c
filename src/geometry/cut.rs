//! A triangle cut in two by a plane, in single precision: bounds that are a little wider than those of
//! [`clip`](super::clip) and take a fraction of the time (the reference splitting of Stich, Friedrich &
//! Dietrich, "Spatial splits in bounding volume hierarchies", 2009).
//!
//! The plane meets two edges of the triangle. The corners on one side and the two crossings are the corners of
//! the part on that side, and the box around them, cut to the box that is known to hold the reference, holds
//! what is left of the triangle there. Clipping would take all the planes that made that box into account; here
//! each has narrowed it once.

use super::Aabb;
use super::triangle::Corners;
use glam::{BVec4A, Vec4, Vec4Swizzles};

/// How far a crossing may be off, as a part of the greater of its ends' coordinates. A difference of two floats
/// is off by 2^-24 of itself, so the weight of a crossing is off by 4 · 2^-24 at most, the way between the ends
/// (at most twice the greater) by 2^-24 of itself, their product by one rounding and the sum by one more: no more
/// than 14 · 2^-24 of the greater coordinate in all.
const SLACK: f32 = 1.0 / (1 << 20) as f32;

/// The bounds of the part of a triangle inside `within` on each side of a plane across it: below, and above.
/// Each lies inside its half of the box, the plane included, and may be wider than the part; `None` where the
/// triangle has no point in that half for certain. Corners must be finite.
#[inline(always)]
pub fn halves(corners: &Corners, within: &Aabb, axis: usize, position: f32) -> [Option<Aabb>; 2] {
    let [a, b, c] = [0, 1, 2].map(|i| Vec4::new(corners[i][0], corners[i][1], corners[i][2], 0.0));
    let (mut below, mut above) = (Range::EMPTY, Range::EMPTY);
    for (from, to) in [(a, b), (b, c), (c, a)] {
        let (start, end) = (from[axis], to[axis]);
        below.grow_if(start <= position, from, from);
        above.grow_if(start >= position, from, from);
        let (way, length) = (to - from, end - start);
        let crossing = from + way * ((position - start) / length);
        let slack = from.abs().max(to.abs()) * SLACK + Vec4::splat(f32::MIN_POSITIVE);
        let crosses = (start < position) != (end < position);
        let (low, high) = (crossing - slack, crossing + slack);
        // What overflows, the length among it, says nothing: then the box stays as it is.
        let known = crossing.is_finite_mask() & BVec4A::splat(length.is_finite());
        let low = Vec4::select(known, low, Vec4::NEG_INFINITY);
        let high = Vec4::select(known, high, Vec4::INFINITY);
        below.grow_if(crosses, low, high);
        above.grow_if(crosses, low, high);
    }
    let [half_below, half_above] = within.halves(axis, position);
    [below.within(&half_below), above.within(&half_above)]
}

/// Bounds in the making.
#[derive(Clone, Copy)]
struct Range {
    low: Vec4,
    high: Vec4,
}

impl Range {
    const EMPTY: Self = Self { low: Vec4::INFINITY, high: Vec4::NEG_INFINITY };

    /// Takes in a box if it is to; without a branch, for nobody could foresee it.
    #[inline(always)]
    fn grow_if(&mut self, wanted: bool, low: Vec4, high: Vec4) {
        let wanted = BVec4A::splat(wanted);
        self.low = self.low.min(Vec4::select(wanted, low, Vec4::INFINITY));
        self.high = self.high.max(Vec4::select(wanted, high, Vec4::NEG_INFINITY));
    }

    /// Its part inside a box; `None` where that is empty.
    #[inline(always)]
    fn within(&self, within: &Aabb) -> Option<Aabb> {
        let bounds = Aabb { min: self.low.xyz().max(within.min), max: self.high.xyz().min(within.max) };
        (!bounds.is_empty()).then_some(bounds)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::clip::Clipper;
    use glam::Vec3;
    use proptest::prelude::*;

    /// What clipping leaves on each side must lie in what cutting gives.
    fn check(corners: &Corners, within: &Aabb, axis: usize, position: f32) {
        let clipped = Clipper::default().halves(corners, within, axis, position);
        let cut = halves(corners, within, axis, position);
        let half = within.halves(axis, position);
        for side in 0..2 {
            let Some(least) = clipped[side] else { continue };
            let given = cut[side].unwrap_or_else(|| panic!("{corners:?} has points in {:?}", half[side]));
            assert_eq!(given.union(least), given, "{corners:?} at {position} across {axis}, side {side}");
            assert_eq!(given.union(half[side]), half[side], "it lies in its half");
        }
    }

    #[test]
    fn a_diagonal_takes_a_corner_of_the_box_on_each_side() {
        let corners = [[0.0, 0.0, 0.0], [8.0, 8.0, 0.0], [8.0, 8.0, 1.0]];
        let within = Aabb { min: Vec3::ZERO, max: Vec3::new(8.0, 8.0, 1.0) };
        let [below, above] = halves(&corners, &within, 0, 4.0).map(|half| half.expect("both have some"));
        assert!(below.max.y >= 4.0 && below.max.y < 4.001, "{below:?}");
        assert!(above.min.y <= 4.0 && above.min.y > 3.999, "{above:?}");
        assert_eq!((below.max.x, above.min.x), (4.0, 4.0));
        // A box away from the diagonal holds none of it, which one plane is enough to see.
        let beside = Aabb { min: Vec3::new(2.0, 5.0, 0.0), max: Vec3::new(6.0, 8.0, 1.0) };
        let [below, above] = halves(&corners, &beside, 0, 4.0);
        assert_eq!(below, None);
        assert!(above.is_some());
    }

    #[test]
    fn numbers_at_the_end_of_the_range_cut_nothing_off() {
        let corners = [[-3e38, -3e38, 0.0], [3e38, 3e38, 0.0], [3e38, 3e38, 1.0]];
        let within = Aabb { min: Vec3::new(-3e38, -3e38, 0.0), max: Vec3::new(3e38, 3e38, 1.0) };
        assert_eq!(halves(&corners, &within, 0, 1e38), within.halves(0, 1e38).map(Some));
        // The length alone overflows.
        let corners = [[-3e38, -1.0, 0.0], [3e38, 1.0, 0.0], [3e38, -1.0, 1.0]];
        let within = Aabb::of_points(corners.map(Vec3::from));
        check(&corners, &within, 0, 0.0);
    }

    proptest! {
        #[test]
        fn nothing_is_lost(
            numbers in proptest::array::uniform9(-1.0f32..1.0),
            box_at in proptest::array::uniform6(0.0f32..=1.0),
            part in 0.0f32..=1.0,
            axis in 0usize..3,
            round in 0usize..4,
        ) {
            // Coarse coordinates put corners into planes; tiny ones are subnormal where they differ.
            let (grid, unit) = [(1e6, 1.0), (4.0, 1.0), (1e6, 1e-38), (1e6, 1e30)][round];
            let at = |i: usize| (numbers[i] * grid).round() / grid * unit;
            let corners: Corners = std::array::from_fn(|i| std::array::from_fn(|j| at(3 * i + j)));
            let whole = Aabb::of_points(corners.map(Vec3::from));
            let inside = |i: usize| {
                Vec3::from_slice(&box_at[i..i + 3]) * whole.extent() + whole.min
            };
            let (a, b) = (inside(0), inside(3));
            let within = Aabb { min: a.min(b).max(whole.min), max: a.max(b).min(whole.max) };
            let position = within.min[axis] + part * (within.max[axis] - within.min[axis]);
            if within.min[axis] < position && position < within.max[axis] {
                check(&corners, &within, axis, position);
            }
        }
    }
}
