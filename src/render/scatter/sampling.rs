//! From pairs of numbers to places and directions, and how two ways to choose them are weighed.
//!
//! Pairs are in [0, 1), evenly spread; so are the results over what they are on. A density is by area or by solid
//! angle, as said.

use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, FRAC_PI_2, FRAC_PI_4};

/// A point of the unit disk. What is near in the square is near in the disk (Shirley & Chiu, "A low distortion map
/// between disk and square", 1997). Density by area: `1 / pi`.
#[inline]
pub fn disk([u, v]: [f32; 2]) -> [f32; 2] {
    let (a, b) = (2.0 * u - 1.0, 2.0 * v - 1.0);
    if a == 0.0 && b == 0.0 {
        return [0.0; 2];
    }
    // The square's four quarters between its diagonals become those of the disk.
    let (radius, angle) =
        if a.abs() > b.abs() { (a, FRAC_PI_4 * (b / a)) } else { (b, FRAC_PI_2 - FRAC_PI_4 * (a / b)) };
    let (sin, cos) = libm::sincosf(angle);
    [radius * cos, radius * sin]
}

/// A direction above the surface, in local coordinates, as often as light from there counts on a matt surface:
/// density by solid angle [`cosine_density`] of its Z, which is positive. The disk, lifted onto the sphere (Malley).
#[inline]
pub fn cosine_hemisphere(uv: [f32; 2]) -> Vec3 {
    // Never along the surface itself, where the density is zero.
    const LEAST: f32 = 1e-10;
    let [x, y] = disk(uv);
    Vec3::new(x, y, (1.0 - x * x - y * y).max(LEAST).sqrt())
}

/// The density by solid angle with which [`cosine_hemisphere`] gives directions at a cosine to the normal.
#[inline]
pub fn cosine_density(cos: f32) -> f32 {
    cos.max(0.0) * FRAC_1_PI
}

/// A density by area, of points on a surface with the unit normal `normal`, as one by solid angle, of directions
/// from a point from which `way` leads to the surface. Infinite if the surface is seen edge-on, or `way` is zero.
#[inline]
pub fn by_solid_angle(by_area: f32, way: Vec3, normal: Vec3) -> f32 {
    let distance = way.length();
    let cos = (way.dot(normal) / distance).abs();
    // Not so for a NaN either.
    if cos > 0.0 { by_area * (distance * distance) / cos } else { f32::INFINITY }
}

/// The weight of a sample that was taken with the density `taken`, and could have been taken with the density
/// `other` in another way that is also tried once: between 0 and 1; over both ways the weights of a direction add up
/// to 1 (Veach & Guibas, "Optimally combining sampling techniques for Monte Carlo rendering", 1995: the power
/// heuristic, exponent 2).
///
/// Densities are not negative; `taken` may be infinite, as for a mirror.
#[inline]
pub fn power_heuristic(taken: f32, other: f32) -> f32 {
    if taken == f32::INFINITY {
        return 1.0;
    }
    if taken <= 0.0 {
        return 0.0;
    }
    // The quotient first: squares of densities overflow.
    let ratio = other / taken;
    1.0 / (1.0 + ratio * ratio)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The middles of the cells of an `n` by `n` grid.
    fn grid(n: u32) -> impl Iterator<Item = [f32; 2]> {
        (0..n * n).map(move |i| [i % n, i / n].map(|k| (k as f32 + 0.5) / n as f32))
    }

    fn mean(n: u32, of: impl Fn([f32; 2]) -> f32) -> f64 {
        grid(n).map(|uv| f64::from(of(uv))).sum::<f64>() / f64::from(n * n)
    }

    #[test]
    fn the_disk_is_filled_evenly() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        close(mean(200, |uv| disk(uv)[0]), 0.0);
        close(mean(200, |uv| disk(uv)[1]), 0.0);
        close(mean(200, |uv| disk(uv)[0].powi(2)), 0.25);
        close(mean(200, |uv| disk(uv)[1].powi(2)), 0.25);
        close(mean(200, |uv| disk(uv)[0] * disk(uv)[1]), 0.0);
        // The share of each of twelve sectors, of the half of its area that is farther out.
        for sector in 0..12 {
            let inside = |[x, y]: [f32; 2]| {
                let turn = (y.atan2(x) / std::f32::consts::TAU).rem_euclid(1.0);
                (turn * 12.0) as u32 == sector && x * x + y * y > 0.5
            };
            close(mean(400, |uv| f32::from(u8::from(inside(disk(uv))))), 1.0 / 24.0);
        }
        for corner in [[0.0, 0.0], [0.0, 0.5], [0.5, 0.0], [0.999_999_94, 0.0]] {
            let [x, y] = disk(corner);
            assert!((x.hypot(y) - 1.0).abs() < 1e-6, "edges stay edges: {corner:?}");
        }
        assert_eq!(disk([0.5, 0.5]), [0.0, 0.0]);
    }

    #[test]
    fn moments_of_the_cosine_hemisphere() {
        let close = |a: f64, b: f64| assert!((a - b).abs() < 1e-3, "{a} {b}");
        // The density is cos / pi: the mean of cos^k is 2 / (k + 2).
        close(mean(300, |uv| cosine_hemisphere(uv).z), 2.0 / 3.0);
        close(mean(300, |uv| cosine_hemisphere(uv).z.powi(2)), 0.5);
        close(mean(300, |uv| cosine_hemisphere(uv).x), 0.0);
        close(mean(300, |uv| cosine_hemisphere(uv).y.powi(2)), 0.25);
        // Each direction's weight by its density: the hemisphere's cosine integral over the hemisphere's.
        close(
            mean(300, |uv| cosine_hemisphere(uv).z / cosine_density(cosine_hemisphere(uv).z)),
            std::f64::consts::PI,
        );
        for uv in grid(64).chain([[0.0, 0.0], [0.0, 0.999_999_94], [0.5, 0.0]]) {
            let w = cosine_hemisphere(uv);
            assert!(w.z > 0.0 && w.is_normalized(), "{w}");
        }
    }

    #[test]
    fn an_area_seen_from_afar() {
        // A square of side 2, facing the point from a distance of 10: some 4 / 100 sr.
        let sr = 1.0 / by_solid_angle(0.25, Vec3::Z * 10.0, Vec3::NEG_Z);
        assert!((sr - 0.04).abs() < 1e-6);
        // Turned by 60 degrees it is half of that.
        let turned = Vec3::new(0.75f32.sqrt(), 0.0, 0.5);
        assert!((1.0 / by_solid_angle(0.25, Vec3::Z * 10.0, turned) - 0.02).abs() < 1e-6);
        assert_eq!(by_solid_angle(0.25, Vec3::Z, Vec3::X), f32::INFINITY);
        assert_eq!(by_solid_angle(0.25, Vec3::ZERO, Vec3::X), f32::INFINITY);
    }

    #[test]
    fn weights_add_up_to_one() {
        for (a, b) in [(1.0, 1.0), (0.3, 17.0), (1e30, 1e25), (1e-30, 1e-25), (2.0, 0.0)] {
            let sum = power_heuristic(a, b) + power_heuristic(b, a);
            assert!((sum - 1.0).abs() < 1e-6, "{a} {b}: {sum}");
        }
        assert_eq!(power_heuristic(3.0, 1.0), 0.9);
        assert_eq!(power_heuristic(f32::INFINITY, 7.0), 1.0);
        assert_eq!(power_heuristic(7.0, f32::INFINITY), 0.0);
        assert_eq!(power_heuristic(0.0, 0.0), 0.0);
    }
}
