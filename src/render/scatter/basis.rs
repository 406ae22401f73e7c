//! A surface's own coordinates.

use glam::Vec3;

/// Three unit vectors at right angles to each other, right-handed: the axes X, Y and Z of local coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    /// The axis X: some direction along the surface.
    pub tangent: Vec3,
    /// The axis Y.
    pub bitangent: Vec3,
    /// The axis Z.
    pub normal: Vec3,
}

impl Basis {
    /// Some basis around a unit normal: the same one each time, but not one that changes smoothly with the normal
    /// where its Z changes sign (Duff et al., "Building an orthonormal basis, revisited", 2017).
    #[inline]
    pub fn of(normal: Vec3) -> Self {
        let (tangent, bitangent) = normal.any_orthonormal_pair();
        Self { tangent, bitangent, normal }
    }

    /// A vector of the scene, in local coordinates.
    #[inline]
    pub fn to_local(&self, v: Vec3) -> Vec3 {
        Vec3::new(v.dot(self.tangent), v.dot(self.bitangent), v.dot(self.normal))
    }

    /// A vector in local coordinates, in those of the scene.
    #[inline]
    pub fn to_world(&self, v: Vec3) -> Vec3 {
        self.tangent * v.x + self.bitangent * v.y + self.normal * v.z
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn check(normal: Vec3) -> Result<(), TestCaseError> {
        let basis = Basis::of(normal);
        let Basis { tangent, bitangent, .. } = basis;
        prop_assert!(tangent.cross(bitangent).distance(normal) < 1e-6, "right-handed: {basis:?}");
        prop_assert!(tangent.dot(bitangent).abs() < 1e-6 && tangent.dot(normal).abs() < 1e-6, "{basis:?}");
        prop_assert!((tangent.length() - 1.0).abs() < 1e-6, "{basis:?}");
        let v = Vec3::new(0.3, -1.7, 2.1);
        prop_assert!(basis.to_world(basis.to_local(v)).distance(v) < 2e-6);
        prop_assert_eq!(basis.to_world(Vec3::Z), normal);
        Ok(())
    }

    proptest! {
        #[test]
        fn it_is_orthonormal(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..1.0) {
            let v = Vec3::new(x, y, z);
            prop_assume!(v.length() > 1e-3);
            check(v.normalize())?;
        }
    }

    #[test]
    fn it_is_orthonormal_where_other_methods_are_not() {
        for z in [1.0, -1.0, 0.0, -0.0, 1e-20, -1e-20, -0.999_999_9] {
            let normal = Vec3::new((1.0f32 - z * z).max(0.0).sqrt(), 0.0, z);
            check(normal).unwrap_or_else(|error| panic!("{normal}: {error}"));
        }
    }
}
