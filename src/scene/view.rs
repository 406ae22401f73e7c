//! A camera made ready for one image size: pixels to rays.

use super::Camera;
use crate::geometry::Ray;
use glam::Vec3;
use std::f32::consts::FRAC_PI_4;

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
    /// From the middle of the lens to its border, to the right and upward in the picture; zero for a pinhole.
    lens: [Vec3; 2],
    /// By how much a ray from there is turned, on the plane one unit ahead: [`lens`](Self::lens) divided by the
    /// distance in focus.
    turn: [Vec3; 2],
    pixel_spread: f32,
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
            lens: [right, up].map(|axis| (axis * (f64::from(camera.aperture) * 0.5)).as_vec3()),
            turn: [right, up].map(|axis| (axis * camera.lens_slope()).as_vec3()),
            pixel_spread: libm::atan(pixel) as f32,
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

    /// The ray from a point of the lens through what [`ray`](Self::ray) meets on the plane in focus; `lens` is
    /// uniform in the unit square and chooses the point, (0.5, 0.5) the middle. A pinhole's is `ray`'s, to the bit.
    ///
    /// The direction's component along the view is 1 here too.
    #[inline(always)]
    pub fn lens_ray(&self, x: u32, y: u32, offset: [f32; 2], lens: [f32; 2]) -> Ray {
        let ray = self.ray(x, y, offset);
        if self.is_pinhole() {
            return ray;
        }
        let [right, up] = disk(lens);
        Ray::new(
            ray.origin + (self.lens[0] * right + self.lens[1] * up),
            ray.direction - (self.turn[0] * right + self.turn[1] * up),
        )
    }

    /// Whether all rays start at the eye.
    #[inline]
    pub fn is_pinhole(&self) -> bool {
        self.lens == [Vec3::ZERO; 2]
    }

    /// The angle, in radians, that a pixel in the middle of the picture is high: what a ray's
    /// [`Cone`](super::texture::Cone) opens by.
    #[inline]
    pub fn pixel_spread(&self) -> f32 {
        self.pixel_spread
    }
}

/// A point of the unit disk for one of the unit square, area for area, squares around the middle to circles around
/// it (Shirley & Chiu, "A low distortion map between disk and square", 1997).
fn disk(square: [f32; 2]) -> [f32; 2] {
    let [x, y] = square.map(|s| 2.0 * s - 1.0);
    let (radius, other, x_is_longer) = if x.abs() > y.abs() { (x, y, true) } else { (y, x, false) };
    if radius == 0.0 {
        return [0.0; 2];
    }
    let (sine, cosine) = libm::sincosf(FRAC_PI_4 * (other / radius));
    if x_is_longer { [radius * cosine, radius * sine] } else { [radius * sine, radius * cosine] }
}

#[cfg(test)]
mod tests {
    use super::*;

    const CAMERA: Camera = Camera { fov: 90.0, ..Camera::new(Vec3::ZERO, Vec3::NEG_Z) };
    const LENS: Camera = Camera { aperture: 0.5, focus: Some(8.0), ..CAMERA };

    /// Points that cover the unit square evenly.
    fn grid(side: u32) -> impl Iterator<Item = [f32; 2]> {
        (0..side * side).map(move |i| [i % side, i / side].map(|i| (i as f32 + 0.5) / side as f32))
    }

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

    #[test]
    fn a_pinhole_has_the_same_rays_to_the_bit() {
        let camera = Camera { eye: Vec3::new(-0.0, 0.1, 3.0), focus: Some(2.0), ..CAMERA };
        let view = camera.view(31, 17);
        assert!(view.is_pinhole());
        for lens in [[0.0, 0.0], [0.3, 0.9], [1.0, 0.5]] {
            let (ray, same) = (view.ray(7, 5, [0.2, 0.8]), view.lens_ray(7, 5, [0.2, 0.8], lens));
            let bits = |ray: Ray| [ray.origin, ray.direction].map(|v| v.to_array().map(f32::to_bits));
            assert_eq!(bits(ray), bits(same));
        }
    }

    #[test]
    fn rays_of_a_lens_meet_in_the_plane_in_focus() {
        let view = LENS.view(64, 48);
        for offset in grid(3) {
            let ray = view.ray(50, 7, offset);
            let sharp = ray.origin + 8.0 * ray.direction;
            for lens in grid(9) {
                let ray = view.lens_ray(50, 7, offset, lens);
                assert!((ray.origin + 8.0 * ray.direction).distance(sharp) < 1e-5);
                assert!(ray.origin.length() < 0.25 && ray.origin.z == 0.0, "within the lens");
                assert_eq!(ray.direction.z, -1.0, "t is the depth");
            }
        }
        assert_eq!(view.lens_ray(3, 4, [0.5; 2], [0.5; 2]), view.ray(3, 4, [0.5; 2]));
    }

    #[test]
    fn without_a_distance_the_point_looked_at_is_sharp() {
        let camera = Camera { aperture: 1.0, ..Camera::new(Vec3::new(3.0, 4.0, 12.0), Vec3::ZERO) };
        let view = camera.view(2, 2);
        for lens in grid(5) {
            let ray = view.lens_ray(1, 1, [0.0; 2], lens);
            assert!((ray.origin + 13.0 * ray.direction).length() < 1e-5);
        }
    }

    #[test]
    fn the_disk_is_covered_evenly() {
        let side = 256;
        let within = |radius: f32| {
            let near = grid(side).map(disk).filter(|[x, y]| x * x + y * y <= radius * radius).count();
            near as f32 / (side * side) as f32
        };
        for radius in [0.25f32, 0.5, 0.75, 1.0] {
            assert!((within(radius) - radius * radius).abs() < 0.01, "{radius}");
        }
        let quadrant = grid(side).map(disk).filter(|[x, y]| *x > 0.0 && *y > *x).count();
        assert!((quadrant as f32 / (side * side) as f32 - 0.125).abs() < 0.01);
        assert_eq!(disk([0.5, 0.5]), [0.0, 0.0]);
        assert_eq!(disk([0.0, 0.5]), [-1.0, 0.0]);
        assert_eq!(disk([0.5, 1.0]), [0.0, 1.0]);
    }

    #[test]
    fn a_pixel_is_as_wide_as_its_neighbours_are_apart() {
        let view = CAMERA.view(1001, 1001);
        let [a, b] = [500, 501].map(|y| view.ray(500, y, [0.5; 2]).direction.as_dvec3());
        assert!((f64::from(view.pixel_spread()) - a.angle_between(b)).abs() < 1e-7);
    }
}
