//! Light: one key light that casts shadows, and what comes from everywhere.
//!
//! Amounts are linear RGB. A white surface that faces the key light of [`Lighting::for_view`] and
//! the sky comes out at about 1, the brightest value that a PNG holds.

use super::{Camera, Emitters};
use crate::geometry::{Hit, Ray};
use crate::traverse::Accel;
use glam::Vec3;
use std::f32::consts::PI;

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
                // Squares of floats fit into double precision, whatever the scale of the scene.
                let way = position.as_dvec3() - point.as_dvec3();
                let (distance, reach) = (way.length(), f64::from(reach));
                let fade = (reach * reach) / (reach * reach + distance * distance);
                let toward = if distance > 0.0 { (way / distance).as_vec3() } else { Vec3::ZERO };
                ShadowRay { toward, distance: distance as f32, irradiance: irradiance * fade as f32 }
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

    /// What the sky looks like in a direction of any length: pale at the horizon, darker toward the zenith, grey
    /// below.
    #[inline]
    pub fn sky(&self, direction: Vec3) -> Vec3 {
        const ZENITH: Vec3 = Vec3::new(0.18, 0.36, 0.68);
        const HORIZON: Vec3 = Vec3::new(0.72, 0.8, 0.88);
        const BELOW: Vec3 = Vec3::new(0.36, 0.35, 0.34);
        let height = direction.dot(self.up) / direction.length();
        if height >= 0.0 {
            // The square root lets the colour change fast near the horizon.
            HORIZON + (ZENITH - HORIZON) * height.sqrt()
        } else {
            HORIZON + (BELOW - HORIZON) * (-height * 8.0).min(1.0)
        }
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
    /// It is a sun if enough of what the camera sees lies in it. Where a roof or a wall is in the
    /// way it is a lamp, the nearer to the eye the narrower the room is.
    pub fn for_view(camera: &Camera, accel: &Accel) -> Self {
        let [forward, right, up] = camera.axes().map(|axis| axis.as_vec3());
        let upward = camera.up.normalize_or(Vec3::Y);
        // How far the view points up or down must not take the sun below the horizon.
        let ahead = (forward - upward * forward.dot(upward)).normalize_or(up);
        let from = |[over, left, behind]: [f32; 3]| upward * over - right * left - ahead * behind;
        let sun = Self::outdoors(upward, from([1.25, 0.95, 0.55]).normalize());

        let seen = Seen::new(camera, accel, &|_| false);
        if seen.share_in(&sun.key, accel) >= ENOUGH {
            return sun;
        }
        let lamps = LAMP_DISTANCES.map(|distance| {
            Self::indoors(upward, lamp(camera, accel, from([0.5, 0.35, 0.1]) * distance, seen.depth))
        });
        let share = |lighting: &Self| seen.share_in(&lighting.key, accel);
        let best = |a: Self, b: Self| if share(&b) > share(&a) { b } else { a };
        let [first, others @ ..] = lamps;
        lamps
            .into_iter()
            .find(|lamp| share(lamp) >= ENOUGH)
            .unwrap_or_else(|| others.into_iter().fold(first, best))
    }

    /// A sun in a blue sky. Both are unit vectors: upward, and to the sun.
    pub fn outdoors(up: Vec3, toward: Vec3) -> Self {
        let (sky, ground) = (Vec3::new(0.42, 0.5, 0.62), Vec3::new(0.2, 0.18, 0.16));
        let ambient = Ambient { up, toward: (up + toward * 0.7).normalize_or(up), sky, ground };
        Self { key: Light::Sun { toward, irradiance: SUN }, ambient }
    }

    /// A lamp in a room.
    fn indoors(up: Vec3, lamp: Light) -> Self {
        let (sky, ground) = (Vec3::new(0.33, 0.34, 0.36), Vec3::new(0.13, 0.12, 0.11));
        Self { key: lamp, ambient: Ambient { up, toward: up, sky, ground } }
    }
}

/// The part of what is seen that is to lie in the key light.
pub(super) const ENOUGH: f32 = 0.3;

/// What a ray hits behind at most so many surfaces that let light pass.
fn first_opaque(accel: &Accel, mut ray: Ray, lets_pass: &impl Fn(u32) -> bool) -> Hit {
    const LAYERS: usize = 16;
    for _ in 0..LAYERS {
        let hit = accel.intersect(&ray);
        if !hit.is_hit() || !lets_pass(hit.primitive) {
            return hit;
        }
        ray.tnear = hit.t.next_up();
    }
    Hit::MISS
}

/// Rays to lights from each point.
const PROBES: u32 = 8;

/// Light that can be seen on a white surface: about an eighth of a display's brightness.
const BRIGHT: f32 = 0.015;

/// How far from the eye a lamp is tried, in units of the depth of what is seen.
const LAMP_DISTANCES: [f32; 4] = [1.0, 0.5, 0.25, 0.1];

/// A coarse grid of what a camera sees.
pub(super) struct Seen {
    /// Points just before the surfaces, and the normals on the eye's side.
    points: Vec<(Vec3, Vec3)>,
    /// The median distance from the eye.
    depth: f32,
}

impl Seen {
    /// Looks through the camera, and through what lets light pass.
    pub fn new(camera: &Camera, accel: &Accel, lets_pass: &impl Fn(u32) -> bool) -> Self {
        const GRID: u32 = 16;
        let view = camera.view(GRID, GRID);
        let (mut points, mut depths) = (Vec::new(), Vec::new());
        for i in 0..GRID * GRID {
            let ray = view.ray(i % GRID, i / GRID, [0.5, 0.5]);
            let hit = first_opaque(accel, ray, lets_pass);
            if hit.is_hit() {
                let side = -hit.normal.dot(ray.direction).signum();
                points.push((ray.at(hit.t * 0.9995), hit.normal * side));
                depths.push(hit.t * ray.direction.length());
            }
        }
        depths.sort_by(f32::total_cmp);
        let median = depths.get(depths.len() / 2).copied().filter(|&depth| depth > 0.0);
        Self { points, depth: median.unwrap_or_else(|| camera.distance()) }
    }

    /// The part of the points that some surfaces throw light on which can be seen; all of them if there are none.
    pub fn share_lit_by(&self, emitters: &Emitters, accel: &Accel, lets_pass: &impl Fn(u32) -> bool) -> f32 {
        let sees = |&&(point, normal): &&(Vec3, Vec3)| {
            let light: f32 = (0..PROBES)
                .map(|probe| {
                    // Each quarter of the lights, and of a light, once.
                    let along = (probe as f32 + 0.5) / PROBES as f32;
                    let light = emitters.sample([along, 0.5], [(along * 2.6) % 1.0, (along * 7.3) % 1.0]);
                    let way = light.position - point;
                    let squared = way.length_squared();
                    let cosines = normal.normalize_or_zero().dot(way).max(0.0) * light.normal.dot(way).abs();
                    let ray = Ray::segment(point, way, 0.0, 0.999);
                    if cosines <= 0.0 || first_opaque(accel, ray, lets_pass).is_hit() {
                        return 0.0;
                    }
                    light.radiance.max_element() * cosines / (squared * squared * light.pdf_area * PI)
                })
                .sum();
            light / PROBES as f32 > BRIGHT
        };
        let lit = self.points.iter().filter(sees).count();
        if self.points.is_empty() { 1.0 } else { lit as f32 / self.points.len() as f32 }
    }

    /// The part of the points that a light reaches; all of them if there are none.
    fn share_in(&self, light: &Light, accel: &Accel) -> f32 {
        let lit = self.points.iter().filter(|&&(point, normal)| {
            let way = light.from(point);
            normal.dot(way.toward) > 0.0
                && !accel.occluded(&Ray::segment(point, way.toward, 0.0, way.distance))
        });
        if self.points.is_empty() { 1.0 } else { lit.count() as f32 / self.points.len() as f32 }
    }
}

/// A lamp on the way from the eye along `offset` (in units of `depth`), but before whatever is
/// met there.
fn lamp(camera: &Camera, accel: &Accel, offset: Vec3, depth: f32) -> Light {
    let way = offset * depth;
    let hit = accel.intersect(&Ray::new(camera.eye, way));
    let part = if hit.is_hit() { (hit.t * 0.7).min(1.0) } else { 1.0 };
    Light::Point { position: camera.eye + way * part, irradiance: LAMP, reach: depth * 1.5 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::{Colors, Mesh};

    /// The corners of a box that stands on y = -1 and reaches from -1 to 1 in x and z.
    fn room_corners(height: f32) -> Vec<Vec3> {
        let corner =
            |i: u32| Vec3::new((i & 1) as f32 * 2.0, (i >> 1 & 1) as f32 * height, (i >> 2) as f32 * 2.0);
        (0..8).map(|i| corner(i) - 1.0).collect()
    }

    fn quads(faces: &[[u32; 4]]) -> Vec<[u32; 3]> {
        faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
    }

    /// A closed room, or low walls without a ceiling if `open`.
    fn room(open: bool) -> Accel {
        let mut triangles = quads(&[[0, 1, 3, 2], [4, 5, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4]]);
        if !open {
            triangles.extend(quads(&[[2, 3, 7, 6]]));
        }
        let positions = room_corners(if open { 0.2 } else { 2.0 });
        let mesh = Mesh { positions, triangles, colors: Colors::default(), ..Mesh::default() };
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
        let camera = Camera::new(Vec3::new(0.0, -0.5, 0.9), Vec3::new(0.0, -1.0, -0.5));
        assert!(matches!(Lighting::for_view(&camera, &room(true)).key, Light::Sun { .. }));
    }

    #[test]
    fn a_look_into_a_box_lights_its_inside() {
        // The front wall is left out; the eye stands before it, under the open sky.
        let mesh = Mesh {
            positions: room_corners(2.0),
            triangles: quads(&[[0, 1, 3, 2], [0, 2, 6, 4], [1, 3, 7, 5], [0, 1, 5, 4], [2, 3, 7, 6]]),
            colors: Colors::default(),
            ..Mesh::default()
        };
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let camera = Camera { fov: 35.0, ..Camera::new(Vec3::Z * 4.0, Vec3::ZERO) };
        let lighting = Lighting::for_view(&camera, &accel);
        assert!(Seen::new(&camera, &accel, &|_| false).share_in(&lighting.key, &accel) >= ENOUGH);
    }

    #[test]
    fn a_lamp_fades_to_half_at_its_reach() {
        let light = Light::Point { position: Vec3::Y * 3.0, irradiance: Vec3::ONE, reach: 3.0 };
        let ray = light.from(Vec3::ZERO);
        assert_eq!((ray.toward, ray.distance, ray.irradiance), (Vec3::Y, 3.0, Vec3::splat(0.5)));
        assert_eq!(light.from(Vec3::Y * 3.0).toward, Vec3::ZERO);
    }
}
