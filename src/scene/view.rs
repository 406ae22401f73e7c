//! A camera made ready for one image size: pixels to rays.

use super::Camera;
use crate::geometry::Ray;
use glam::Vec3;

/// Makes the rays of a picture.
///
/// Pixel (0, 0) is the top left one; x grows to the right, y downward. The arithmetic is plain
/// `f32` without fused operations, so that every instruction set gives the same bits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    eye: Vec3,
    /// Unit vector to the middle of the picture.
    forward: Vec3,
    /// From a pixel to its right and lower neighbour, on the plane one unit ahead of the eye.
    step_x: Vec3,
    step_y: Vec3,
    /// The middle of the picture in pixels.
    center: [f32; 2],
}

impl View {
    pub(super) fn new(camera: &Camera, width: u32, height: u32) -> Self {
        let [forward, right, up] = camera.axes();
        let pixel = 2.0 * (f64::from(camera.fov).to_radians() * 0.5).tan() / f64::from(height.max(1));
        Self {
            eye: camera.eye,
            forward: forward.as_vec3(),
            step_x: (right * pixel).as_vec3(),
            step_y: (up * -pixel).as_vec3(),
            center: [width as f32 * 0.5, height as f32 * 0.5],
        }
    }

    /// The ray through a point of pixel (`x`, `y`): `offset` runs from (0, 0), its top left
    /// corner, to (1, 1); its middle is (0.5, 0.5).
    ///
    /// The direction is **not** normalised: its component along the view is 1, so that the hit's
    /// `t` is the distance from the eye's plane, and `t` times the direction's length the
    /// distance from the eye.
    #[inline(always)]
    pub fn ray(&self, x: u32, y: u32, offset: [f32; 2]) -> Ray {
        let right = (x as f32 + offset[0]) - self.center[0];
        let down = (y as f32 + offset[1]) - self.center[1];
        Ray::new(self.eye, self.forward + self.step_x * right + self.step_y * down)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera { eye: Vec3::ZERO, at: Vec3::NEG_Z, up: Vec3::Y, fov: 90.0 };

    #[test]
    fn the_first_pixel_is_at_the_top_left() {
        let view = CAMERA.view(4, 2);
        let direction = view.ray(0, 0, [0.0, 0.0]).direction;
        // 90 degrees upright: the upper edge is as far up as the plane is ahead.
        assert!(direction.distance(Vec3::new(-2.0, 1.0, -1.0)) < 1e-6, "{direction}");
        let direction = view.ray(3, 1, [1.0, 1.0]).direction;
        assert!(direction.distance(Vec3::new(2.0, -1.0, -1.0)) < 1e-6, "{direction}");
    }

    #[test]
    fn the_middle_looks_at_the_point() {
        for (width, height) in [(5, 3), (1, 1), (32767, 1), (4, 4)] {
            let ray = CAMERA.view(width, height).ray(
                width / 2,
                height / 2,
                [(width % 2) as f32 * 0.5, (height % 2) as f32 * 0.5],
            );
            assert_eq!(ray.direction, Vec3::NEG_Z, "{width} x {height}");
            assert_eq!((ray.origin, ray.tnear, ray.tfar), (Vec3::ZERO, 0.0, f32::INFINITY));
        }
    }

    #[test]
    fn neighbouring_pixels_meet_at_their_edge() {
        let view = CAMERA.view(640, 480);
        assert_eq!(view.ray(17, 31, [1.0, 0.5]), view.ray(18, 31, [0.0, 0.5]));
        assert_eq!(view.ray(17, 31, [0.5, 1.0]), view.ray(17, 32, [0.5, 0.0]));
    }
}
