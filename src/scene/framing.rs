//! A camera for a scene that names none.

use super::{Camera, DEFAULT_FOV};
use crate::geometry::Aabb;
use glam::{DVec3, Vec3};

/// From the middle of the box to the eye: a three-quarter view, some 25 degrees from above.
const DIRECTION: DVec3 = DVec3::new(0.66, 0.5, 0.85);

/// Room left around the box: its farthest corner reaches this part of the half picture.
const FILL: f64 = 0.95;

impl Camera {
    /// A three-quarter view, +Y up, that has the whole box in the picture; `aspect` is the
    /// picture's width divided by its height.
    ///
    /// The eye is as near as it can be: on the line through the box's middle, where the first of
    /// the eight corners touches the picture's margin. A box that is a point gets a camera too. Of a
    /// box that nearly fills the range of floats the eye is infinite, which [`Camera::check`] refuses.
    pub fn framing(bounds: &Aabb, aspect: f32) -> Self {
        let (low, high) = if bounds.is_empty() {
            (DVec3::ZERO, DVec3::ZERO)
        } else {
            (bounds.min.as_dvec3(), bounds.max.as_dvec3())
        };
        let center = (low + high) * 0.5;
        let toward_eye = DIRECTION.normalize();
        let towards = Self::new(Vec3::ZERO, (-toward_eye).as_vec3());
        let [forward, right, up] = towards.axes();
        let slope_y = (f64::from(DEFAULT_FOV).to_radians() * 0.5).tan() * FILL;
        let slope_x = slope_y * f64::from(aspect);

        // A corner is in the picture when |right| <= slope_x * depth, with depth = distance + forward.
        let distance = (0..8)
            .map(|corner: u32| {
                let pick = |axis: usize| if corner >> axis & 1 == 0 { low[axis] } else { high[axis] };
                let from_center = DVec3::new(pick(0), pick(1), pick(2)) - center;
                let sideways =
                    (from_center.dot(right).abs() / slope_x).max(from_center.dot(up).abs() / slope_y);
                sideways - from_center.dot(forward)
            })
            .fold(0.0, f64::max);

        // Of a point there is no best distance; a larger one than its coordinates' rounding will do.
        let distance = distance.max(center.abs().max_element() * 1e-5);
        let distance = if distance > 0.0 { distance } else { 1.0 };
        Self::new((center + toward_eye * distance).as_vec3(), center.as_vec3())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a point appears: -1 to 1 in both directions inside the picture; its depth.
    fn project(camera: &Camera, aspect: f64, point: Vec3) -> (f64, f64, f64) {
        let [forward, right, up] = camera.axes();
        let slope = (f64::from(camera.fov).to_radians() * 0.5).tan();
        let p = point.as_dvec3() - camera.eye.as_dvec3();
        let depth = p.dot(forward);
        (p.dot(right) / (depth * slope * aspect), p.dot(up) / (depth * slope), depth)
    }

    fn corners(b: &Aabb) -> impl Iterator<Item = Vec3> + '_ {
        (0..8).map(|i| {
            let pick = |axis: usize| if i >> axis & 1 == 0 { b.min[axis] } else { b.max[axis] };
            Vec3::new(pick(0), pick(1), pick(2))
        })
    }

    #[test]
    fn the_whole_box_is_in_the_picture_and_fills_it() {
        for size in
            [Vec3::ONE, Vec3::new(100.0, 1.0, 1.0), Vec3::new(1.0, 0.0, 30.0), Vec3::new(0.01, 9.0, 1.0)]
        {
            for scale in [1e-36, 1e-4, 1.0, 1e6, 1e35] {
                for aspect in [0.25, 1.0, 16.0 / 9.0] {
                    let min = Vec3::new(-3.0, 2.0, 7.0) * scale;
                    let bounds = Aabb { min, max: min + size * scale };
                    let camera = Camera::framing(&bounds, aspect as f32);
                    let mut reach = 0.0f64;
                    for corner in corners(&bounds) {
                        let (x, y, depth) = project(&camera, aspect, corner);
                        assert!(depth > 0.0 && x.abs() < 1.0 && y.abs() < 1.0, "{size} {scale} {aspect}");
                        reach = reach.max(x.abs()).max(y.abs());
                    }
                    assert!(reach > 0.9, "the box could be larger in the picture: {reach}");
                }
            }
        }
    }

    #[test]
    fn a_point_and_nothing_have_a_camera_too() {
        for bounds in [Aabb::EMPTY, Aabb { min: Vec3::splat(5e5), max: Vec3::splat(5e5) }] {
            let camera = Camera::framing(&bounds, 1.0);
            camera.check().expect("a camera");
        }
    }

    #[test]
    fn a_box_that_leaves_no_room_for_an_eye_is_refused() {
        let bounds = Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) };
        assert!(Camera::framing(&bounds, 1.0).check().is_err());
    }
}
