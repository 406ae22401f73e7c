//! The rays that engines are compared on: five kinds, the same for every engine and every run.
//!
//! All come from a camera, a model and a seed, without state: ray `i`'s random numbers are a hash of seed,
//! purpose and `i`. Secondary rays keep the order of the camera rays that they start from, so that
//! neighbours in the list are neighbours in the picture, as in a renderer that works tile by tile.

use crate::error::{Error, Result};
use crate::geometry::{Aabb, Hit, Ray};
use crate::mesh::Mesh;
use crate::morton;
use crate::render::offset_point;
use crate::scene::Camera;
use glam::Vec3;
use serde::Serialize;
use std::f32::consts::TAU;

/// Side of the pixel blocks that camera rays come in: what the widest kernel takes together.
const BLOCK: u32 = 32;

/// Why a ray is traced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum RayKind {
    /// Through pixel centres, closest hit. As the renderer makes them: not normalised.
    ///
    /// Pixels come in blocks of 32 x 32, the blocks row by row, inside a block in Morton order (x first):
    /// 4 rays in a row are 2 x 2 pixels, 8 are 4 x 2, 16 are 4 x 4, 256 are 16 x 16.
    Camera,
    /// From camera hits to the point light, any hit. Surfaces that face away from it send none.
    Shadow,
    /// From camera hits, one cosine-distributed bounce, closest hit.
    Diffuse,
    /// From camera hits, cosine-distributed, any hit within a tenth of the scene's diagonal.
    Ao,
    /// Origins uniform in the scene's box, directions uniform on the sphere, closest hit.
    Random,
}

impl RayKind {
    /// All of them.
    pub const ALL: [Self; 5] = [Self::Camera, Self::Shadow, Self::Diffuse, Self::Ao, Self::Random];

    /// `camera`, `shadow`, `diffuse`, `ao` or `random`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Camera => "camera",
            Self::Shadow => "shadow",
            Self::Diffuse => "diffuse",
            Self::Ao => "ao",
            Self::Random => "random",
        }
    }

    /// Whether any hit will do; else the closest one is asked for.
    pub const fn any_hit(self) -> bool {
        matches!(self, Self::Shadow | Self::Ao)
    }
}

impl std::str::FromStr for RayKind {
    type Err = Error;

    fn from_str(name: &str) -> Result<Self> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| {
            Error::option(
                "--rays",
                format!("\"{name}\" is unknown; known are camera, shadow, diffuse, ao, random"),
            )
        })
    }
}

/// Where the rays come from.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// The camera.
    pub camera: Camera,
    /// Width and height of its image.
    pub size: u32,
    /// The point light of the shadow rays.
    pub light: Vec3,
    /// The scene's box.
    pub bounds: Aabb,
    /// What the random numbers hang on.
    pub seed: u64,
}

impl Setup {
    /// A setup with the light midway between the eye and the middle of the scene: inside rooms, and in
    /// front of objects seen from without.
    pub fn new(camera: Camera, size: u32, bounds: Aabb, seed: u64) -> Self {
        Self { camera, size, light: camera.eye.midpoint(bounds.center()), bounds, seed }
    }
}

/// The rays of one setup. Camera rays are traced once, for the others to start where they end.
#[derive(Debug)]
pub struct RaySets {
    setup: Setup,
    camera: Vec<Ray>,
    surfaces: Vec<Surface>,
}

/// A point that the camera sees.
#[derive(Clone, Copy, Debug)]
struct Surface {
    /// Just off the surface, on the side that is seen.
    point: Vec3,
    /// Of length 1, on that side.
    normal: Vec3,
}

impl RaySets {
    /// Makes the camera rays and has `closest` trace them through the mesh.
    pub fn new(setup: Setup, mesh: &Mesh, closest: impl FnOnce(&[Ray]) -> Vec<Hit>) -> Self {
        let camera = camera_rays(&setup.camera, setup.size);
        let hits = closest(&camera);
        let surfaces =
            camera.iter().zip(&hits).filter_map(|(ray, hit)| Surface::seen(mesh, ray, hit)).collect();
        Self { setup, camera, surfaces }
    }

    /// Where they come from.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// The rays of a kind. Empty when the camera sees nothing to start them from.
    pub fn rays(&self, kind: RayKind) -> Vec<Ray> {
        match kind {
            RayKind::Camera => self.camera.clone(),
            RayKind::Shadow => self.surfaces.iter().filter_map(|s| self.to_light(s)).collect(),
            RayKind::Diffuse => self.bounces(kind, f32::INFINITY),
            RayKind::Ao => self.bounces(kind, self.setup.bounds.diagonal() * 0.1),
            RayKind::Random => self.anywhere(),
        }
    }

    fn to_light(&self, surface: &Surface) -> Option<Ray> {
        let way = self.setup.light - surface.point;
        let distance = way.length();
        // The end stays short of the light, as a light inside a model would have it.
        let ray = Ray::segment(surface.point, way / distance, 0.0, distance * (1.0 - 1e-4));
        (way.dot(surface.normal) > 0.0).then_some(ray)
    }

    fn bounces(&self, kind: RayKind, tfar: f32) -> Vec<Ray> {
        let random = Random { seed: self.setup.seed, purpose: kind as u64 };
        let bounce = |(i, s): (usize, &Surface)| {
            let [a, b] = [0, 1].map(|dimension| random.uniform(i as u64, dimension));
            Ray::segment(s.point, cosine_about(s.normal, a, b), 0.0, tfar)
        };
        self.surfaces.iter().enumerate().map(bounce).collect()
    }

    fn anywhere(&self) -> Vec<Ray> {
        let random = Random { seed: self.setup.seed, purpose: RayKind::Random as u64 };
        let bounds = self.setup.bounds;
        (0..u64::from(self.setup.size) * u64::from(self.setup.size))
            .map(|i| {
                let [x, y, z, a, b] = [0, 1, 2, 3, 4].map(|dimension| random.uniform(i, dimension));
                let cos = 1.0 - 2.0 * a;
                let (sin_phi, cos_phi) = (TAU * b).sin_cos();
                let sin = (1.0 - cos * cos).max(0.0).sqrt();
                let origin = bounds.min + bounds.extent() * Vec3::new(x, y, z);
                Ray::new(origin, Vec3::new(sin * cos_phi, sin * sin_phi, cos))
            })
            .collect()
    }
}

impl Surface {
    /// What a ray sees; nothing if it hits nothing, or a triangle too thin to have a normal.
    fn seen(mesh: &Mesh, ray: &Ray, hit: &Hit) -> Option<Self> {
        let normal = hit.is_hit().then(|| hit.normal.try_normalize()).flatten()?;
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let corners = mesh.corners(hit.primitive).map(|p| p.to_array());
        Some(Self { point: offset_point(&corners, hit.u, hit.v, normal), normal })
    }
}

/// Camera rays in the order that [`RayKind::Camera`] describes; blocks at the edge are cut off.
fn camera_rays(camera: &Camera, size: u32) -> Vec<Ray> {
    let view = camera.view(size, size);
    let blocks = size.div_ceil(BLOCK);
    let mut rays = Vec::with_capacity(size as usize * size as usize);
    for block in 0..blocks * blocks {
        let (left, top) = (block % blocks * BLOCK, block / blocks * BLOCK);
        for i in 0..BLOCK * BLOCK {
            let (right, down) = morton::place(i);
            let (x, y) = (left + right, top + down);
            if x < size && y < size {
                rays.push(view.ray(x, y, [0.5, 0.5]));
            }
        }
    }
    rays
}

/// A direction about `normal`, as likely as its cosine (Malley: a point of the disc, lifted).
fn cosine_about(normal: Vec3, a: f32, b: f32) -> Vec3 {
    let (sin, cos) = (TAU * b).sin_cos();
    let radius = a.sqrt();
    let (tangent, bitangent) = normal.any_orthonormal_pair();
    let lifted = (1.0 - a).max(0.0).sqrt();
    (tangent * (radius * cos) + bitangent * (radius * sin) + normal * lifted).normalize()
}

/// Random numbers by counter: no state, so any ray can be made without the ones before it.
#[derive(Clone, Copy)]
struct Random {
    seed: u64,
    purpose: u64,
}

impl Random {
    /// Uniform in [0, 1), in steps of 2^-24.
    fn uniform(self, index: u64, dimension: u64) -> f32 {
        let key = mix(self.seed ^ mix(self.purpose << 32 | dimension));
        (mix(key.wrapping_add(index)) >> 40) as f32 / (1 << 24) as f32
    }
}

/// The step and finaliser of SplitMix64 (Steele, Lea & Flood 2014).
const fn mix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let x = (x ^ x >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let x = (x ^ x >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    x ^ x >> 31
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    fn setup(size: u32) -> Setup {
        let camera = Camera { fov: 60.0, ..Camera::new(Vec3::new(0.0, 0.0, 4.0), Vec3::ZERO) };
        Setup::new(camera, size, Aabb { min: Vec3::splat(-2.0), max: Vec3::new(2.0, 2.0, 0.0) }, 7)
    }

    /// One triangle at z = 0, |x| < 1 and |y| < 3 within it, its front turned away from the camera.
    fn wall() -> Mesh {
        let positions =
            [(-10.0, -10.0), (0.0, 10.0), (10.0, -10.0)].map(|(x, y)| Vec3::new(x, y, 0.0)).into();
        Mesh { positions, triangles: vec![[0, 1, 2]], ..Mesh::default() }
    }

    /// Hits on the wall wherever |x| < 1.
    fn hits(rays: &[Ray]) -> Vec<Hit> {
        let hit = |r: &Ray| {
            let t = -r.origin.z / r.direction.z;
            let p = r.at(t);
            let u = (p.y + 10.0) / 20.0;
            let v = (p.x + 10.0 - 10.0 * u) / 20.0;
            let normal = Vec3::new(0.0, 0.0, -400.0);
            if p.x.abs() < 1.0 { Hit { t, u, v, primitive: 0, normal } } else { Hit::MISS }
        };
        rays.iter().map(hit).collect()
    }

    fn sets(size: u32, seed: u64) -> RaySets {
        RaySets::new(Setup { seed, ..setup(size) }, &wall(), hits)
    }

    #[test]
    fn every_pixel_has_one_ray_and_packets_are_blocks() {
        let setup = setup(40);
        let rays = camera_rays(&setup.camera, setup.size);
        let distinct: HashSet<_> = rays.iter().map(|r| r.direction.to_array().map(f32::to_bits)).collect();
        assert_eq!((rays.len(), distinct.len()), (1600, 1600));
        let view = setup.camera.view(40, 40);
        let pixel = |x, y| view.ray(x, y, [0.5, 0.5]).direction;
        let first: Vec<Vec3> = rays[..8].iter().map(|r| r.direction).collect();
        let expected = [(0, 0), (1, 0), (0, 1), (1, 1), (2, 0), (3, 0), (2, 1), (3, 1)];
        assert_eq!(first, expected.map(|(x, y)| pixel(x, y)));
        assert!(rays[..16].iter().all(|r| (0..4).any(|x| (0..4).any(|y| r.direction == pixel(x, y)))));
    }

    #[test]
    fn secondary_rays_start_in_front_of_what_is_seen() {
        let sets = sets(64, 7);
        let seen = hits(&sets.rays(RayKind::Camera)).iter().filter(|h| h.is_hit()).count();
        assert!(seen > 500);
        for kind in [RayKind::Shadow, RayKind::Diffuse, RayKind::Ao] {
            let rays = sets.rays(kind);
            assert_eq!(rays.len(), seen, "{kind:?}");
            for ray in &rays {
                assert!(ray.origin.z > 0.0 && ray.origin.z < 1e-3 && ray.direction.z > 0.0, "{ray:?}");
                assert!((ray.direction.length() - 1.0).abs() < 1e-5);
            }
        }
        let light = sets.setup.light;
        assert!(sets.rays(RayKind::Shadow).iter().all(|r| (r.at(r.tfar) - light).length() < 1e-3));
        let reach = sets.setup.bounds.diagonal() * 0.1;
        assert!(sets.rays(RayKind::Ao).iter().all(|r| r.tfar == reach));
        assert!(sets.rays(RayKind::Diffuse).iter().all(|r| r.tfar == f32::INFINITY));
    }

    #[test]
    fn bounces_are_cosine_distributed_and_random_rays_uniform() {
        let sets = sets(128, 7);
        let mean = |kind, f: fn(&Ray) -> f32| {
            let rays = sets.rays(kind);
            rays.iter().map(f).sum::<f32>() / rays.len() as f32
        };
        // Under the cosine density the mean cosine is 2/3; uniform directions have mean 0 and mean square 1/3.
        assert!((mean(RayKind::Diffuse, |r| r.direction.z) - 2.0 / 3.0).abs() < 0.01);
        assert!(mean(RayKind::Diffuse, |r| r.direction.x).abs() < 0.02);
        assert!(mean(RayKind::Random, |r| r.direction.z).abs() < 0.02);
        assert!((mean(RayKind::Random, |r| r.direction.y.powi(2)) - 1.0 / 3.0).abs() < 0.01);
        assert!((mean(RayKind::Random, |r| r.origin.z) + 1.0).abs() < 0.03);
    }

    #[test]
    fn the_seed_decides_and_kinds_differ() {
        let sets = |seed| sets(32, seed);
        assert_eq!(sets(1).rays(RayKind::Random), sets(1).rays(RayKind::Random));
        assert_ne!(sets(1).rays(RayKind::Random), sets(2).rays(RayKind::Random));
        let directions = |kind| sets(1).rays(kind).iter().map(|r| r.direction).collect::<Vec<_>>();
        assert_ne!(directions(RayKind::Diffuse), directions(RayKind::Ao));
    }

    #[test]
    fn names_parse_back() {
        for kind in RayKind::ALL {
            assert_eq!(kind.name().parse::<RayKind>().unwrap(), kind);
        }
        assert!("primary".parse::<RayKind>().unwrap_err().to_string().starts_with("--rays: "));
    }
}
