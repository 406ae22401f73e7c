//! Rays that leave a triangle behind.
//!
//! A shadow ray starts just off the surface that it leaves: nearer to it than what is known of where it runs from the
//! light. So the test would be asked of each packet and the triangle that it starts at. From the ray's own origin it can be told in a
//! third of the time: what matters is not how far away the light is, but how far the corners are.

use super::{Lanes3, Triangle};
use crate::simd::Lanes;

/// A ray's speed along the normal, relative to that along its greatest axis, from which on no test clips `t`: more than `GRAZING` of
/// the watertight test, by more than roundings.
const STEEP: f32 = 0.26;

/// What the height of the plane above the origin may be off by, relative to the sum of its terms' magnitudes: eight roundings.
///
/// With `u = 2^-24`, three products and two sums come to `3 u`, here and in the watertight test, from the same differences and the
/// same normal. Beside the exact height, the differences and the normal have a rounding each: `5 u`.
const HEIGHT: f32 = 8.0 / (1 << 24) as f32;

/// More than what underflows, and the least `-t` that is told.
const TINY: f32 = 1e-30;

/// The lanes whose rays, all of which run fastest along `axis`, leave a triangle behind so clearly that the watertight and the exact
/// test, if they say that the line meets it, give a `t` of less than 0. No lane in which anything is not a number.
///
/// - The plane is passed at a `t` of less than 0: its height above the origin and the speed toward it have signs that no rounding turns.
/// - The speed is such that the watertight test does not clip that `t`.
/// - That test keeps `t` between the corners' depths: one of these is less than 0, too.
#[inline(always)]
pub fn leave<const W: usize, L: Lanes<W>>(
    Triangle { corners, plane }: &Triangle,
    origin: &Lanes3<L>,
    direction: &Lanes3<L>,
    axis: usize,
) -> L::Mask {
    let (zero, tiny) = (L::splat(0.0), L::splat(TINY));
    let (mut height, mut terms, mut speed) = (zero, tiny, zero);
    for axis in 0..3 {
        let normal = L::splat(plane[axis]);
        let term = normal * (L::splat(corners[0][axis]) - origin[axis]);
        height = height + term;
        terms = L::splat(HEIGHT).mul_add(term.abs(), terms);
        speed = normal.mul_add(direction[axis], speed);
    }
    let along = direction[axis];
    let is_behind =
        (height * speed).lt(zero) & terms.lt(height.abs()) & (speed.abs() * tiny).lt(height.abs());
    let is_steep = (L::splat(STEEP) * along.abs()).lt(speed.abs());

    let mut nearest = L::splat(f32::INFINITY);
    for corner in corners {
        nearest = nearest.min((L::splat(corner[axis]) - origin[axis]) * along);
    }
    let begins_behind = nearest.lt(zero - along * along * tiny);
    is_behind & is_steep & begins_behind
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::triangle::{Corners, Exact, Mode, Test, Watertight, normal};
    use crate::render::offset_point;
    use crate::weyl::scattered;
    use glam::Vec3;

    /// Whether the test of a mode finds a `t` that is not less than 0.
    fn is_met<M: Mode<Record = Triangle>>(origin: Vec3, direction: Vec3, triangle: &Triangle) -> bool {
        let test = M::Test::<1, f32>::new(&origin.to_array(), &direction.to_array(), 1);
        let found = test.test(triangle, true);
        found.inside && 0.0 <= found.t
    }

    /// Whether a ray is said to leave a triangle; if so, that no mode's test finds it ahead.
    fn leaves(origin: Vec3, direction: Vec3, corners: &Corners) -> bool {
        let (triangle, magnitude) = (Triangle::new(*corners), direction.abs());
        let axis = magnitude.max_position();
        let leaves = leave::<1, f32>(&triangle, &origin.to_array(), &direction.to_array(), axis);
        if leaves {
            let said = format!("{origin:?} leaves {corners:?} to {direction:?}");
            assert!(!is_met::<Watertight>(origin, direction, &triangle), "watertight: {said}");
            assert!(!is_met::<Exact>(origin, direction, &triangle), "exact: {said}");
        }
        leaves
    }

    fn vector(number: &mut impl FnMut() -> f32) -> Vec3 {
        Vec3::new(number(), number(), number())
    }

    /// A triangle somewhere, of any size and shape.
    fn corners(number: &mut impl FnMut() -> f32) -> Corners {
        let (at, size) = (vector(number) * 10.0, (8.0 * number()).exp2());
        let [p, q, mut r] = [0; 3].map(|_| at + vector(number) * size);
        if number() < -0.5 {
            // A sliver.
            r = q + (r - q) * 1e-5;
        }
        [p, q, r].map(|corner| corner.to_array())
    }

    #[test]
    fn rays_that_start_off_a_surface_leave_it() {
        let mut number = scattered(-1.0, 1.0);
        let (mut steep, mut left) = (0, 0);
        for _ in 0..100_000 {
            let corners = corners(&mut number);
            let (u, v) = (0.5 * number().abs(), 0.5 * number().abs());
            let normal = normal(&corners).normalize_or_zero();
            let direction = vector(&mut number) * (20.0 * number()).exp2();
            let outward = if normal.dot(direction) < 0.0 { -normal } else { normal };
            let origin = offset_point(&corners, u, v, outward);
            let leaves = leaves(origin, direction, &corners);
            if outward.dot(direction) > 0.3 * direction.length() {
                steep += 1;
                left += u32::from(leaves);
            }
            // The other way it is met, or left for the test to say.
            assert!(!self::leaves(origin, -direction, &corners));
        }
        assert!(steep > 50_000 && left == steep, "{left} of {steep}");
    }

    #[test]
    fn no_ray_that_may_meet_a_triangle_is_said_to_leave_it() {
        let mut number = scattered(-1.0, 1.0);
        let mut left = 0;
        for _ in 0..300_000 {
            let corners = corners(&mut number);
            let [p, q, r] = corners.map(Vec3::from_array);
            // In the plane, inside, at an edge or outside, but for some roundings.
            let (u, v) = (1.2 * number(), 1.2 * number());
            let far = (20.0 * number() - 22.0).exp2();
            let origin = p + (q - p) * u + (r - p) * v + vector(&mut number) * far;
            let direction = match number() {
                x if x < 0.0 => vector(&mut number),
                // Grazing.
                _ => (q - p) * number() + (r - p) * number() + vector(&mut number) * 0.01,
            };
            left += u32::from(leaves(origin, direction, &corners));
        }
        assert!(left > 20_000, "{left}");
    }

    #[test]
    fn nothing_leaves_what_has_no_area_or_is_no_number() {
        let flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        assert!(leaves(Vec3::new(0.2, 0.2, 1e-6), Vec3::Z, &flat));
        assert!(!leaves(Vec3::new(0.2, 0.2, 0.0), Vec3::Z, &flat));
        assert!(!leaves(Vec3::new(0.2, 0.2, 1e-6), Vec3::NEG_Z, &flat));
        assert!(!leaves(Vec3::new(0.2, f32::NAN, 1e-6), Vec3::Z, &flat));
        assert!(!leaves(Vec3::new(0.2, 0.2, f32::INFINITY), Vec3::Z, &flat));
        assert!(!leaves(Vec3::new(0.2, 0.2, 1e-6), Vec3::new(0.0, f32::NAN, 1.0), &flat));
        // So near that `t` would be rounded to nothing.
        assert!(!leaves(Vec3::new(0.2, 0.2, 1e-40), Vec3::Z, &flat));
        let line = [[0.0, 0.0, 0.0], [1.0, 1.0, 0.0], [2.0, 2.0, 0.0]];
        assert!(!leaves(Vec3::new(0.2, 0.2, 1e-6), Vec3::Z, &line));
    }
}
