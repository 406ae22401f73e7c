//! What a triangle's corners have beside their places: texture coordinates and normals.

use bytemuck::{Pod, Zeroable};
use glam::{Vec2, Vec3};

/// Texture coordinates and normals of a triangle's three corners: 36 bytes.
///
/// By triangle, not by vertex: in models the same vertex has other ones in its other triangles, and shading, which
/// reads one triangle here and one there, fetches one record instead of following three indices twice.
#[derive(Clone, Copy, Debug, PartialEq, Pod, Zeroable)]
#[repr(C)]
pub struct Attributes {
    /// Texture coordinates: u to the right and v **upward** in the picture, 0 to 1 for the whole of it. Zeros if the
    /// model gives none. Finite.
    pub uv: [[f32; 2]; 3],
    /// Normals; [`Normal::NONE`] at each corner if the model gives none.
    pub normals: [Normal; 3],
}

impl Attributes {
    /// Of a triangle of which the model says nothing.
    pub const NONE: Self = Self { uv: [[0.0; 2]; 3], normals: [Normal::NONE; 3] };

    /// Whether all corners have a normal.
    #[inline]
    pub fn has_normals(&self) -> bool {
        !self.normals.contains(&Normal::NONE)
    }

    /// The texture coordinates where a hit's barycentrics are `u` and `v`.
    #[inline]
    pub fn uv_at(&self, u: f32, v: f32) -> Vec2 {
        let [a, b, c] = self.uv.map(Vec2::from_array);
        (1.0 - u - v) * a + u * b + v * c
    }

    /// The unit normal between those of the corners, if all of them have one and they do not cancel.
    #[inline]
    pub fn normal_at(&self, u: f32, v: f32) -> Option<Vec3> {
        if !self.has_normals() {
            return None;
        }
        let [a, b, c] = self.normals.map(Normal::decode);
        ((1.0 - u - v) * a + u * b + v * c).try_normalize()
    }
}

/// A unit vector in four bytes: its place on an unfolded octahedron, 16 bits each way (Cigolle et al., "A survey
/// of efficient representations for independent unit vectors", 2014). Off by 7e-5 at most.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Pod, Zeroable)]
#[repr(transparent)]
pub struct Normal([i16; 2]);

/// The greatest step to either side of the middle.
const STEPS: f32 = 32767.0;

impl Normal {
    /// No normal: a value that no vector has.
    pub const NONE: Self = Self([i16::MIN; 2]);

    /// The nearest to a vector of any length; [`NONE`](Self::NONE) of what has no direction.
    pub fn encode(vector: Vec3) -> Self {
        let size = vector.abs().element_sum();
        if !(size > 0.0 && size < f32::INFINITY) {
            return Self::NONE;
        }
        let v = vector / size;
        // The lower half is folded outward over the square's corners.
        let (x, y) = if v.z >= 0.0 {
            (v.x, v.y)
        } else {
            ((1.0 - v.y.abs()) * 1.0_f32.copysign(v.x), (1.0 - v.x.abs()) * 1.0_f32.copysign(v.y))
        };
        Self([x, y].map(|x| (x * STEPS).round() as i16))
    }

    /// The unit vector; +Z of [`NONE`](Self::NONE), or close to it.
    #[inline]
    pub fn decode(self) -> Vec3 {
        let [x, y] = self.0.map(|x| f32::from(x) / STEPS);
        let z = 1.0 - x.abs() - y.abs();
        // What lies beyond the upper half's edge is folded back.
        let fold = (-z).max(0.0);
        Vec3::new(x - fold.copysign(x), y - fold.copysign(y), z).normalize_or(Vec3::Z)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn vectors_come_back(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0, size in -30i32..30) {
            let vector = Vec3::new(x, y, z);
            prop_assume!(vector.length() > 1e-3);
            let back = Normal::encode(vector * (size as f32).exp2()).decode();
            prop_assert!(back.distance(vector.normalize()) < 7e-5, "{vector} {back}");
        }
    }

    #[test]
    fn axes_are_exact_and_nothing_is_none() {
        for axis in [Vec3::X, Vec3::Y, Vec3::Z, Vec3::NEG_X, Vec3::NEG_Y, Vec3::NEG_Z] {
            assert_eq!(Normal::encode(axis * 7.0).decode(), axis);
        }
        for nothing in [Vec3::ZERO, Vec3::NAN, Vec3::INFINITY, Vec3::new(f32::MAX, f32::MAX, 0.0)] {
            assert_eq!(Normal::encode(nothing), Normal::NONE, "{nothing}");
        }
        assert!(Normal::NONE.decode().is_normalized());
    }

    #[test]
    fn corners_blend() {
        let normals = [Vec3::X, Vec3::Y, Vec3::Z].map(Normal::encode);
        let attributes = Attributes { uv: [[0.0, 0.0], [1.0, 0.0], [0.0, 2.0]], normals };
        assert_eq!(attributes.uv_at(0.5, 0.25), Vec2::new(0.5, 0.5));
        assert_eq!(attributes.normal_at(1.0, 0.0), Some(Vec3::Y));
        assert_eq!(Attributes::NONE.normal_at(0.3, 0.3), None);
        let opposed =
            Attributes { normals: [Vec3::X, Vec3::NEG_X, Vec3::X].map(Normal::encode), ..attributes };
        assert_eq!(opposed.normal_at(0.5, 0.0), None);
    }
}
