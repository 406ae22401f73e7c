//! Light: one key light that casts shadows, and what comes from everywhere.
//!
//! Amounts are linear RGB. A white surface that faces the key light of [`Lighting::for_view`] and
//! the sky comes out at about 1, the brightest value that a PNG holds.

use super::Camera;
use crate::geometry::{Hit, Ray};
use crate::traverse::Accel;
use glam::Vec3;

/// The key light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Parallel light from infinitely far away.
    Sun {
        /// Where it comes from: a unit vector.
        toward: Vec3,
        /// Light on a surface that faces it.
        irradiance: Vec3,
    },
    /// Light from a point, which fades with the distance `d` as `reach² / (reach² + d²)`: like a
    /// lamp of some size, it does not blind what is near to it.
    Point {
        /// Where it is.
        position: Vec3,
        /// Light on a surface that faces it from next to it.
        irradiance: Vec3,
        /// The distance at which half of the light is left. Positive.
        reach: f32,
    },
}

/// The way from a point to a light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ShadowRay {
    /// Unit vector to the light.
    pub toward: Vec3,
    /// The parameter, in lengths of `toward`, at which the light is: infinite for a sun.
    pub distance: f32,
    /// Light that arrives if nothing is in the way, on a surface that faces it.
    pub irradiance: Vec3,
}

impl Light {
    /// The way from `point` to the light.
    #[inline(always)]
    pub fn from(&self, point: Vec3) -> ShadowRay {
        match *self {
            Self::Sun { toward, irradiance } => ShadowRay { toward, distance: f32::INFINITY, irradiance },
            Self::Point { position, irradiance, reach } => {
                let way = position - point;
                let distance = way.length();
                let fade = (reach * reach) / (reach * reach + distance * distance);
                let toward = if distance > 0.0 { way / distance } else { Vec3::ZERO };
                ShadowRay { toward, distance, irradiance: irradiance * fade }
            }
        }
    }
}

/// Light that comes from all directions, more of it from above.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ambient {
    /// Unit vector upward, for the colours of the sky behind the scene.
    pub up: Vec3,
    /// Unit vector to where it is brightest. A little off `up`, so that walls which meet at a
    /// corner differ in the shadow too.
    pub toward: Vec3,
    /// Light on a surface that faces `toward`.
    pub sky: Vec3,
    /// Light on a surface that faces away.
    pub ground: Vec3,
}

impl Ambient {
    /// Light on a surface with the unit normal `normal`.
    #[inline(always)]
    pub fn irradiance(&self, normal: Vec3) -> Vec3 {
        self.ground + (self.sky - self.ground) * (0.5 + 0.5 * normal.dot(self.toward))
    }
}

/// All the light in a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lighting {
    /// The light that casts shadows.
    pub key: Light,
    /// The light that comes from everywhere.
    pub ambient: Ambient,
}

const SUN: Vec3 = Vec3::new(1.02, 0.96, 0.86);
const LAMP: Vec3 = Vec3::new(1.0, 0.95, 0.86);

impl Lighting {
    /// Light from over the camera's shoulder: from above and from the left of the eye, so that
    /// shadows fall to where the camera sees them.
    ///
    /// It is a sun where the eye can see most of the sky around it; where a roof or a wall is in
    /// the way, it is a lamp in the room, which nothing hides from the eye.
    pub fn for_view(camera: &Camera, accel: &Accel) -> Self {
        let [forward, right, up] = camera.axes().map(|axis| axis.as_vec3());
        let upward = camera.up.normalize_or(Vec3::Y);
        // How far the view points up or down must not take the sun below the horizon.
        let ahead = (forward - upward * forward.dot(upward)).normalize_or(up);
        let toward = (upward * 1.25 - right * 0.95 - ahead * 0.55).normalize();
        if sees_sky(accel, camera.eye, toward, [right, upward]) {
            return Self::outdoors(upward, toward);
        }
        let key = lamp(camera, accel, upward * 0.5 - right * 0.35 - ahead * 0.1);
        let (sky, ground) = (Vec3::new(0.33, 0.34, 0.36), Vec3::new(0.13, 0.12, 0.11));
        let toward = (upward + toward * 0.7).normalize();
        Self { key, ambient: Ambient { up: upward, toward, sky, ground } }
    }

    /// A sun in a blue sky. Both are unit vectors: upward, and to the sun.
    pub fn outdoors(up: Vec3, toward: Vec3) -> Self {
        let (sky, ground) = (Vec3::new(0.42, 0.5, 0.62), Vec3::new(0.2, 0.18, 0.16));
        let ambient = Ambient { up, toward: (up + toward * 0.7).normalize_or(up), sky, ground };
        Self { key: Light::Sun { toward, irradiance: SUN }, ambient }
    }
}

/// Whether most of a bundle of rays around `toward` leaves the scene.
fn sees_sky(accel: &Accel, eye: Vec3, toward: Vec3, across: [Vec3; 2]) -> bool {
    const SPREAD: [f32; 3] = [-0.2, 0.0, 0.2];
    let open = SPREAD
        .iter()
        .flat_map(|x| SPREAD.map(|y| toward + across[0] * *x + across[1] * y))
        .filter(|&direction| !accel.occluded(&Ray::new(eye, direction)))
        .count();
    2 * open > SPREAD.len() * SPREAD.len()
}

/// A lamp on the way from the eye along `offset` (in units of half of what is seen), but before
/// whatever is met there.
fn lamp(camera: &Camera, accel: &Accel, offset: Vec3) -> Light {
    let depth = seen_depth(camera, accel);
    let way = offset * depth;
    let hit = accel.intersect(&Ray::new(camera.eye, way));
    let part = if hit.is_hit() { (hit.t * 0.7).min(1.0) } else { 1.0 };
    Light::Point { position: camera.eye + way * part, irradiance: LAMP, reach: depth * 1.5 }
}

/// The median distance of what the camera sees, over a coarse grid.
fn seen_depth(camera: &Camera, accel: &Accel) -> f32 {
    const GRID: u32 = 8;
    let view = camera.view(GRID, GRID);
    let mut depths: Vec<f32> = (0..GRID * GRID)
        .map(|i| view.ray(i % GRID, i / GRID, [0.5, 0.5]))
        .map(|ray| (accel.intersect(&ray), ray))
        .filter(|(hit, _): &(Hit, Ray)| hit.is_hit())
        .map(|(hit, ray)| hit.t * ray.direction.length())
        .collect();
    depths.sort_by(f32::total_cmp);
    depths.get(depths.len() / 2).copied().filter(|&d| d > 0.0).unwrap_or_else(|| camera.distance())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::{Colors, Mesh};

    /// A cube from -1 to 1, without its ceiling if `open`.
    fn room(open: bool) -> Accel {
        let positions = (0..8)
            .map(|i| Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32) * 2.0 - 1.0)
            .collect();
        let mut triangles: Vec<[u32; 3]> =
            [[0, 1, 3, 2], [4, 5, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4]]
                .iter()
                .flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]])
                .collect();
        if !open {
            triangles.extend([[2, 3, 7], [2, 7, 6]]);
        }
        let mesh = Mesh { positions, triangles, colors: Colors::default() };
        Accel::build(&mesh, &BuildParams::default()).expect("builds")
    }

    #[test]
    fn outside_the_sun_shines_from_above_and_behind() {
        let camera = Camera::new(Vec3::new(0.0, 1.0, 9.0), Vec3::ZERO);
        let Light::Sun { toward, .. } = Lighting::for_view(&camera, &room(false)).key else {
            panic!("the eye stands outside")
        };
        assert!(toward.y > 0.5 && toward.z > 0.2 && toward.x < -0.2, "{toward}");
        assert!((toward.length() - 1.0).abs() < 1e-6);
    }

    #[test]
    fn inside_a_lamp_hangs_where_the_eye_sees_it() {
        for aim in [Vec3::NEG_Z, Vec3::new(0.3, 0.9, 0.2), Vec3::new(0.0, -1.0, 0.0)] {
            let camera = Camera::new(Vec3::new(0.2, 0.3, 0.4), aim);
            let accel = room(false);
            let Light::Point { position, .. } = Lighting::for_view(&camera, &accel).key else {
                panic!("the eye stands in a closed room")
            };
            assert!(accel.bounds().contains(position));
            let way = position - camera.eye;
            assert!(!accel.occluded(&Ray::segment(camera.eye, way, 0.0, 1.0)));
        }
    }

    #[test]
    fn under_the_open_sky_it_is_the_sun_again() {
        let camera = Camera::new(Vec3::new(0.0, 0.9, 0.0), Vec3::new(0.0, 0.0, -0.5));
        assert!(matches!(Lighting::for_view(&camera, &room(true)).key, Light::Sun { .. }));
    }

    #[test]
    fn a_lamp_fades_to_half_at_its_reach() {
        let light = Light::Point { position: Vec3::Y * 3.0, irradiance: Vec3::ONE, reach: 3.0 };
        let ray = light.from(Vec3::ZERO);
        assert_eq!((ray.toward, ray.distance, ray.irradiance), (Vec3::Y, 3.0, Vec3::splat(0.5)));
        assert_eq!(light.from(Vec3::Y * 3.0).toward, Vec3::ZERO);
    }
}
