//! Cameras that move.

use super::Camera;
use glam::{DQuat, DVec3};

/// A turn about the point that a camera looks at, around its up direction: the path of the seed
/// paper's experiments is 15 frames of 2 degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orbit {
    /// How many frames.
    pub frames: u32,
    /// Degrees from one frame to the next; positive turns the eye counter-clockwise as seen from
    /// above (up pointing at the onlooker), so to its right.
    pub step: f64,
}

impl Orbit {
    /// The cameras, frame by frame; the first is `start` itself.
    pub fn cameras(self, start: Camera) -> impl ExactSizeIterator<Item = Camera> {
        (0..self.frames).map(move |frame| self.camera(start, frame))
    }

    /// The camera of one frame.
    ///
    /// Each is turned from the first one in double precision, so that errors do not add up.
    pub fn camera(self, start: Camera, frame: u32) -> Camera {
        if frame == 0 {
            return start;
        }
        let axis = start.up.as_dvec3().normalize_or(DVec3::Y);
        let turn = DQuat::from_axis_angle(axis, (self.step * f64::from(frame)).to_radians());
        let at = start.at.as_dvec3();
        let eye = at + turn * (start.eye.as_dvec3() - at);
        Camera { eye: eye.as_vec3(), ..start }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn the_eye_goes_round_at_one_height_and_distance() {
        let start = Camera::new(Vec3::new(4.0, 3.0, 2.0), Vec3::new(1.0, 1.0, 1.0));
        let cameras: Vec<Camera> = Orbit { frames: 15, step: 2.0 }.cameras(start).collect();
        assert_eq!(cameras.len(), 15);
        assert_eq!(cameras[0], start);
        for camera in &cameras {
            assert!((camera.distance() - start.distance()).abs() < 1e-5);
            assert!((camera.eye.y - 3.0).abs() < 1e-6);
            assert_eq!((camera.at, camera.up, camera.fov), (start.at, start.up, start.fov));
        }
    }

    #[test]
    fn a_quarter_turn_goes_counter_clockwise_seen_from_above() {
        let start = Camera::new(Vec3::new(0.0, 0.0, 5.0), Vec3::ZERO);
        let eye = Orbit { frames: 2, step: 90.0 }.camera(start, 1).eye;
        assert!(eye.distance(Vec3::new(5.0, 0.0, 0.0)) < 1e-5, "{eye}");
    }

    #[test]
    fn a_full_turn_ends_where_it_began() {
        let start =
            Camera { up: Vec3::new(0.3, 0.9, -0.1), ..Camera::new(Vec3::new(7.0, 1.0, 0.0), Vec3::X) };
        let end = Orbit { frames: 181, step: 2.0 }.camera(start, 180);
        assert!(end.eye.distance(start.eye) < 1e-5);
    }
}
