//! Axis-aligned boxes.

use glam::Vec3;

/// A closed box; empty when a `min` component exceeds its `max`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Least corner.
    pub min: Vec3,
    /// Greatest corner.
    pub max: Vec3,
}

impl Aabb {
    /// The box that holds nothing and changes nothing when joined.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The least box around `points`; [`Aabb::EMPTY`] for none.
    pub fn of_points(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, Self::grown)
    }

    /// This box and `point`. A NaN component of `point` leaves that side as it was.
    #[inline]
    pub fn grown(self, point: Vec3) -> Self {
        Self { min: point.min(self.min), max: point.max(self.max) }
    }

    /// The least box around both.
    #[inline]
    pub fn union(self, other: Self) -> Self {
        Self { min: self.min.min(other.min), max: self.max.max(other.max) }
    }

    /// Whether it holds no point.
    #[inline]
    pub fn is_empty(&self) -> bool {
        !(self.min.cmple(self.max).all())
    }

    /// Lengths of its edges.
    #[inline]
    pub fn extent(&self) -> Vec3 {
        self.max - self.min
    }

    /// Length of its diagonal, computed in double precision so that it does not overflow.
    pub fn diagonal(&self) -> f32 {
        if self.is_empty() {
            return 0.0;
        }
        (self.max.as_dvec3() - self.min.as_dvec3()).length() as f32
    }

    /// Its middle.
    #[inline]
    pub fn center(&self) -> Vec3 {
        self.min * 0.5 + self.max * 0.5
    }

    /// Area of its six faces in double precision; 0 when empty.
    pub fn area(&self) -> f64 {
        if self.is_empty() {
            return 0.0;
        }
        let e = self.max.as_dvec3() - self.min.as_dvec3();
        2.0 * (e.x * e.y + e.y * e.z + e.z * e.x)
    }

    /// The parts below and above a plane across an axis, which must lie inside or on a face.
    #[inline]
    pub fn halves(&self, axis: usize, position: f32) -> [Self; 2] {
        let (mut below, mut above) = (*self, *self);
        below.max[axis] = position;
        above.min[axis] = position;
        [below, above]
    }

    /// Whether `point` lies inside or on a face.
    #[inline]
    pub fn contains(&self, point: Vec3) -> bool {
        point.cmpge(self.min).all() && point.cmple(self.max).all()
    }
}
