//! How much light a smooth surface throws back, and where it bends the rest to.
//!
//! Where the reflection itself goes is [`Vec3::reflect`].

use glam::Vec3;

/// The share of unpolarised light that the boundary between two clear materials throws back: Fresnel's equations.
///
/// `cos_incident` is the cosine between the incoming light and the normal on its side, `eta` the index of refraction
/// beyond the boundary divided by that before it. The result is 1 where all is thrown back, 0 where `eta` is 1.
#[inline]
pub fn dielectric(cos_incident: f32, eta: f32) -> f32 {
    if eta == 1.0 {
        return 0.0;
    }
    let cos_i = cos_incident.clamp(0.0, 1.0);
    let Some(cos_t) = cos_transmitted(cos_i, eta) else { return 1.0 };
    let eta = eta.min(f32::MAX);
    let parallel = (eta * cos_i - cos_t) / (eta * cos_i + cos_t);
    let perpendicular = (cos_i - eta * cos_t) / (cos_i + eta * cos_t);
    0.5 * (parallel * parallel + perpendicular * perpendicular)
}

/// The share that a metal, or anything of which but the share `f0` at normal incidence is known, throws back
/// (Schlick, "An inexpensive BRDF model for physically-based rendering", 1994).
#[inline]
pub fn schlick(f0: Vec3, cos_incident: f32) -> Vec3 {
    let grazing = 1.0 - cos_incident.clamp(0.0, 1.0);
    let square = grazing * grazing;
    f0 + (Vec3::ONE - f0) * (square * square * grazing)
}

/// The direction in which light goes on that travels along `direction` and goes through a boundary: Snell's law.
/// `None` exactly where [`dielectric`] gives 1 because there is no such direction.
///
/// `normal` is on the side where the light comes from, so its product with `direction` is not positive; `eta` is as
/// for [`dielectric`], and 1 lets light go straight on.
#[inline]
pub fn refract(direction: Vec3, normal: Vec3, eta: f32) -> Option<Vec3> {
    if eta == 1.0 {
        return Some(direction);
    }
    let cos_i = (-direction.dot(normal)).clamp(0.0, 1.0);
    let cos_t = cos_transmitted(cos_i, eta)?;
    // Normalised, so that many boundaries in a row do not add up what each one rounds.
    Some((direction / eta + normal * (cos_i / eta - cos_t)).normalize())
}

/// The cosine of the angle beyond a boundary; `None` if all light is thrown back.
#[inline]
fn cos_transmitted(cos_i: f32, eta: f32) -> Option<f32> {
    // `1 - c^2`, without the loss of digits for `c` near 1.
    let sin2_t = (1.0 - cos_i) * (1.0 + cos_i) / (eta * eta);
    (sin2_t < 1.0).then(|| (1.0 - sin2_t).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn head_on_and_grazing() {
        for n in [1.31f32, 1.5, 2.42, 1.0 / 1.5] {
            let expected = ((n - 1.0) / (n + 1.0)).powi(2);
            assert!((dielectric(1.0, n) - expected).abs() < 1e-6, "{n}");
            assert_eq!(dielectric(0.0, n), 1.0, "{n}");
            assert_eq!(dielectric(-0.25, n), 1.0, "{n}: as if grazing");
        }
        assert_eq!(schlick(Vec3::new(0.04, 0.5, 0.9), 1.0), Vec3::new(0.04, 0.5, 0.9));
        assert_eq!(schlick(Vec3::new(0.04, 0.5, 0.9), 0.0), Vec3::ONE);
    }

    #[test]
    fn at_brewsters_angle_one_polarisation_is_not_thrown_back() {
        // There the mean is half of the other one, which is ((n² - 1) / (n² + 1))² (Born & Wolf, 1.5.3).
        for n in [1.33f32, 1.5, 2.0] {
            let cos = 1.0 / (1.0 + n * n).sqrt();
            let expected = 0.5 * ((n * n - 1.0) / (n * n + 1.0)).powi(2);
            assert!((dielectric(cos, n) - expected).abs() < 1e-6, "{n}");
        }
    }

    #[test]
    fn beyond_the_critical_angle_all_is_thrown_back() {
        let n = 1.5f32;
        let critical = (1.0 / n).asin();
        for (angle, all) in [(critical - 1e-3, false), (critical + 1e-3, true), (1.5, true)] {
            let direction = Vec3::new(angle.sin(), 0.0, -angle.cos());
            assert_eq!(dielectric(angle.cos(), 1.0 / n) == 1.0, all, "{angle}");
            assert_eq!(refract(direction, Vec3::Z, 1.0 / n).is_none(), all, "{angle}");
        }
    }

    #[test]
    fn an_index_of_one_does_nothing() {
        for cos in [0.0f32, 1e-6, 0.5, 1.0] {
            let direction = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, -cos);
            assert_eq!(dielectric(cos, 1.0), 0.0);
            assert_eq!(refract(direction, Vec3::Z, 1.0), Some(direction));
        }
    }

    #[test]
    fn extreme_indices_give_numbers() {
        for eta in [f32::INFINITY, f32::MAX, 1e20, 1.000_000_1, 0.999_999_9, 1e-3, 1e-30] {
            for cos in [0.0, 1e-30, 1e-4, 0.5, 1.0] {
                let share = dielectric(cos, eta);
                assert!((0.0..=1.0).contains(&share), "{eta} {cos}: {share}");
                let direction = Vec3::new((1.0 - cos * cos).sqrt(), 0.0, -cos);
                let beyond = refract(direction, Vec3::Z, eta);
                assert!(beyond.is_none_or(|d| d.is_normalized() && d.z <= 0.0), "{eta} {cos}: {beyond:?}");
            }
        }
    }

    proptest! {
        #[test]
        fn there_and_back(x in -1.0f32..1.0, y in -1.0f32..1.0, z in -1.0f32..-0.05, eta in 1.0f32..3.0) {
            let direction = Vec3::new(x, y, z).normalize();
            let Some(beyond) = refract(direction, Vec3::Z, eta) else {
                return Err(TestCaseError::fail("light always enters what is denser"));
            };
            // Snell: the part along the surface shrinks by eta; the plane is the same.
            prop_assert!((beyond * eta).truncate().distance(direction.truncate()) < 1e-6, "{direction} {beyond}");
            let back = refract(beyond, Vec3::Z, 1.0 / eta);
            prop_assert!(back.is_some_and(|back| back.distance(direction) < 1e-4), "{direction} {back:?}");
            // And as much is thrown back either way.
            let shares = [dielectric(-direction.z, eta), dielectric(-beyond.z, 1.0 / eta)];
            prop_assert!((shares[0] - shares[1]).abs() < 1e-4, "{shares:?}");
        }
    }
}
