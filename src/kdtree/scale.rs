//! Coordinates near the ends of the floats' range, brought where products neither overflow nor
//! vanish.
//!
//! A triangle test multiplies coordinates with one another, so it needs about half of the exponents'
//! range for itself. A mesh whose greatest coordinate lies outside of `2^-30 ..= 2^40` is therefore
//! kept multiplied by a power of two, which changes nothing but exponents.

use crate::geometry::Aabb;
use crate::geometry::triangle::Corners;
use glam::Vec3;

/// Meshes whose greatest coordinate has an exponent in this range are kept as they are.
const ORDINARY: std::ops::RangeInclusive<i32> = -30..=40;

/// A power of two that multiplies coordinates.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Coordinates in the tree are the mesh's times `2^exponent`.
    exponent: i32,
}

impl Scale {
    /// The one that brings the greatest of all coordinates into the range, and no farther.
    pub fn of_bounds(bounds: &Aabb) -> Self {
        let greatest = bounds.min.abs().max(bounds.max.abs()).max_element();
        if greatest == 0.0 {
            return Self { exponent: 0 };
        }
        let exponent = exponent(greatest);
        Self { exponent: exponent.clamp(*ORDINARY.start(), *ORDINARY.end()) - exponent }
    }

    /// The one that multiplies by `2^exponent`; `None` if no finite coordinates call for it.
    pub fn of_exponent(exponent: i32) -> Option<Self> {
        let called_for = ORDINARY.end() - 127..=ORDINARY.start() + 149;
        called_for.contains(&exponent).then_some(Self { exponent })
    }

    /// The exponent of the power of two that it multiplies by.
    pub fn exponent(self) -> i32 {
        self.exponent
    }

    /// Whether it leaves everything as it is.
    #[inline(always)]
    pub fn is_none(self) -> bool {
        self.exponent == 0
    }

    /// The factor in double precision, where it never overflows.
    #[inline]
    pub fn factor(self) -> f64 {
        f64::powi(2.0, self.exponent)
    }

    /// Corners as the tree keeps them.
    pub fn apply(self, corners: &Corners) -> Corners {
        if self.is_none() {
            *corners
        } else {
            corners.map(|c| c.map(|x| (f64::from(x) * self.factor()) as f32))
        }
    }

    /// Corners as the mesh has them (but for denormal ones that were made smaller).
    pub fn undo(self, corners: &Corners) -> Corners {
        corners.map(|c| c.map(|x| (f64::from(x) / self.factor()) as f32))
    }

    /// A box in the mesh's coordinates.
    pub fn undo_bounds(self, bounds: &Aabb) -> Aabb {
        let [min, max, _] = self.undo(&[bounds.min, bounds.max, Vec3::ZERO].map(Vec3::into));
        Aabb { min: min.into(), max: max.into() }
    }
}

/// Of a positive float, denormal ones included: in double precision they are normal.
pub fn exponent(x: f32) -> i32 {
    ((f64::from(x).to_bits() >> 52) as i32) - 1023
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn only_the_ends_of_the_range_are_moved() {
        for (greatest, exponent) in [
            (0.0, 0),
            (1.0, 0),
            (1e-6, 0),
            (1e12, 0),
            (f32::MAX, 40 - 127),
            (f32::from_bits(1), 149 - 30),
            (1e-38, 127 - 30),
        ] {
            let bounds = Aabb { min: Vec3::new(0.0, -greatest, 0.0), max: Vec3::splat(greatest * 0.5) };
            let scale = Scale::of_bounds(&bounds);
            assert_eq!(scale.exponent, exponent, "{greatest:e}");
            assert_eq!(Scale::of_exponent(exponent), Some(scale));
            let scaled = scale.apply(&[[greatest; 3]; 3])[0][0];
            assert!(scaled == greatest || (0.9e-9..2.2e12).contains(&scaled), "{scaled:e}");
            assert_eq!(scale.undo(&[[scaled; 3]; 3]), [[greatest; 3]; 3]);
        }
        assert_eq!([-88, 120].map(Scale::of_exponent), [None, None]);
    }
}
