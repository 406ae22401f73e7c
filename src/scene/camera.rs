//! The camera: where the eye is, what it sees, and what of that is sharp.

use super::View;
use crate::error::{Error, Result};
use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt;

/// The vertical field of view of a camera that names none, in degrees.
pub const DEFAULT_FOV: f32 = 45.0;

/// A camera: a pinhole, or a thin lens if it has an aperture.
///
/// It is written `eye=x,y,z;at=x,y,z;up=x,y,z;fov=DEG` on the command line, followed by
/// `;aperture=D;focus=D` if it has a lens ([`Camera::parse`] reads that form, `Display` writes it so
/// that it comes back bit for bit) or as the same keys in a TOML file.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Camera {
    /// Where the eye is.
    pub eye: Vec3,
    /// The point that appears in the middle of the picture.
    pub at: Vec3,
    /// The direction that appears upward in the picture; any length. Where it is parallel to the
    /// view, the coordinate axis farthest from the view takes its place.
    #[serde(default = "default_up")]
    pub up: Vec3,
    /// Vertical field of view in degrees, between 0 and 180.
    #[serde(default = "default_fov")]
    pub fov: f32,
    /// Diameter of the lens, in the scene's units. 0 is a pinhole, which sees everything sharp.
    #[serde(default, skip_serializing_if = "is_pinhole")]
    pub aperture: f32,
    /// How far ahead of the eye the plane is that a lens sees sharp; `None`: it goes through `at`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub focus: Option<f32>,
}

/// Whether an aperture is none.
fn is_pinhole(aperture: &f32) -> bool {
    *aperture == 0.0
}

/// Of the widest lens, half a million times as wide as the plane that is sharp is far: beyond it directions have no
/// digits left for the picture.
const MAX_LENS_SLOPE: f64 = 2.5e5;

fn default_up() -> Vec3 {
    Vec3::Y
}

fn default_fov() -> f32 {
    DEFAULT_FOV
}

impl Camera {
    /// A pinhole with +Y up and [`DEFAULT_FOV`].
    pub const fn new(eye: Vec3, at: Vec3) -> Self {
        Self { eye, at, up: Vec3::Y, fov: DEFAULT_FOV, aperture: 0.0, focus: None }
    }

    /// Makes rays for a picture of `width` x `height` pixels.
    pub fn view(&self, width: u32, height: u32) -> View {
        View::new(self, width, height)
    }

    /// The direction of view, the direction to the right and the one upward in the picture: unit
    /// vectors at right angles.
    ///
    /// In double precision, because an eye far from the origin leaves few bits of `at - eye`.
    pub fn axes(&self) -> [DVec3; 3] {
        let forward = (self.at.as_dvec3() - self.eye.as_dvec3()).normalize_or(DVec3::NEG_Z);
        let up = self.up.as_dvec3().normalize_or(DVec3::Y);
        let mut right = forward.cross(up);
        if right.length_squared() < 1e-12 {
            right = forward.cross(least_axis(forward));
        }
        let right = right.normalize();
        [forward, right, right.cross(forward)]
    }

    /// How far the eye is from the point that it looks at.
    pub fn distance(&self) -> f32 {
        (self.at.as_dvec3() - self.eye.as_dvec3()).length() as f32
    }

    /// The radius of the lens, divided by the distance of the plane that is sharp.
    pub(super) fn lens_slope(&self) -> f64 {
        let to_at = || (self.at.as_dvec3() - self.eye.as_dvec3()).length();
        f64::from(self.aperture) * 0.5 / self.focus.map_or_else(to_at, f64::from)
    }

    /// Whether rays can be made of it.
    ///
    /// # Errors
    /// [`Error::Option`] for `--camera`: a number is not finite, or there is no direction of view.
    pub fn check(&self) -> Result<()> {
        self.fault().map_or(Ok(()), |fault| Err(Error::option("--camera", fault)))
    }

    /// What is wrong with it, if anything: a sentence.
    pub(super) fn fault(&self) -> Option<String> {
        let vectors = [("eye", self.eye), ("at", self.at), ("up", self.up)];
        if let Some((name, _)) = vectors.iter().find(|(_, v)| !v.is_finite()) {
            Some(format!("{name} must be three finite numbers"))
        } else if self.eye == self.at {
            Some("eye and at are the same point; move one of them".into())
        } else if self.up == Vec3::ZERO {
            Some("up is zero; give a direction, such as up=0,1,0".into())
        } else if !(self.fov > 0.0 && self.fov < 180.0) {
            Some(format!("fov={} is not an angle between 0 and 180 degrees", self.fov))
        } else if !(self.aperture >= 0.0 && self.aperture.is_finite()) {
            Some(format!("aperture={} is not a diameter; 0 is a pinhole", self.aperture))
        } else if let Some(focus) = self.focus.filter(|focus| !(*focus > 0.0 && focus.is_finite())) {
            Some(format!("focus={focus} is not a distance ahead of the eye; it must be above 0"))
        } else if self.lens_slope() > MAX_LENS_SLOPE {
            Some(
                "the aperture is too wide for a plane in focus that near; make it smaller, or focus larger"
                    .into(),
            )
        } else {
            None
        }
    }
}

/// The coordinate axis that is nearest to a right angle with `direction`; of equals, z before x
/// before y, so that a view straight down the y axis has -z (the far side) upward.
fn least_axis(direction: DVec3) -> DVec3 {
    let [x, y, z] = direction.abs().to_array();
    if z <= x && z <= y {
        DVec3::NEG_Z
    } else if x <= y {
        DVec3::X
    } else {
        DVec3::Y
    }
}

impl fmt::Display for Camera {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { eye, at, up, fov, aperture, focus } = self;
        write!(f, "eye={},{},{};at={},{},{}", eye.x, eye.y, eye.z, at.x, at.y, at.z)?;
        write!(f, ";up={},{},{};fov={fov}", up.x, up.y, up.z)?;
        if !is_pinhole(aperture) {
            write!(f, ";aperture={aperture}")?;
        }
        focus.map_or(Ok(()), |focus| write!(f, ";focus={focus}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn axes_are_right_handed_and_at_right_angles() {
        let camera = Camera::new(Vec3::new(3.0, 4.0, 5.0), Vec3::new(-1.0, 0.5, 2.0));
        let [forward, right, up] = camera.axes();
        for (a, b) in [(forward, right), (right, up), (up, forward)] {
            assert!(a.dot(b).abs() < 1e-12);
        }
        assert!(right.cross(forward).distance(up) < 1e-12);
        assert!(up.y > 0.0);
    }

    #[test]
    fn a_view_along_up_still_has_axes() {
        for (at, expected_up) in
            [(Vec3::NEG_Y, DVec3::NEG_Z), (Vec3::Y, DVec3::NEG_Z), (Vec3::NEG_Y * 1e-6, DVec3::NEG_Z)]
        {
            let [_, right, up] = Camera::new(Vec3::ZERO, at).axes();
            assert!((right.length() - 1.0).abs() < 1e-12);
            assert!(up.distance(expected_up) < 1e-12, "{at}: {up}");
        }
    }

    #[test]
    fn up_need_not_be_normalised() {
        let camera = Camera::new(Vec3::new(0.0, 1.0, 5.0), Vec3::ZERO);
        let long = Camera { up: Vec3::Y * 1e-20, ..camera };
        assert!(camera.axes()[2].distance(long.axes()[2]) < 1e-6);
    }
}
