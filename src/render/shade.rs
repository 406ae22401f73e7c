//! What a ray from the eye sees: a Lambertian surface in key and ambient light, or the sky.

use super::offset::offset_point;
use crate::geometry::{Hit, Ray};
use crate::scene::{Lighting, Look, Surface};
use crate::traverse::Entry;
use glam::{DVec3, Vec3};

/// Shades hits. The arithmetic is plain `f32` lane by lane: the same for every packet width and
/// instruction set.
pub(super) struct Shader<'a, S> {
    surface: &'a S,
    lighting: Lighting,
    shadows: bool,
}

/// What one sample sees.
pub(super) struct Shade {
    /// Light that arrives in any case.
    pub base: Vec3,
    /// Light that is added if the shadow ray is free.
    pub key: Vec3,
    /// The ray to the key light; `None` if nothing depends on it.
    pub shadow: Option<Ray>,
    /// Distance from the eye, infinite for the sky.
    pub depth: f32,
    /// Unit normal on the side of the eye, zero for the sky.
    pub normal: Vec3,
}

/// The reflectance of what stands for something else: that of many things on average.
const STAND_IN: Vec3 = Vec3::splat(0.4);

impl<'a, S: Surface> Shader<'a, S> {
    pub fn new(surface: &'a S, lighting: &Lighting, shadows: bool) -> Self {
        Self { surface, lighting: *lighting, shadows }
    }

    /// What the surfaces are looked at with. The thread traces nothing while it has this.
    #[inline(always)]
    pub fn reader(&self) -> S::Reader<'a> {
        self.surface.reader()
    }

    /// Shades what `ray` hit. Both sides of a surface look alike.
    #[inline(always)]
    pub fn shade(&self, surfaces: &impl Look, ray: &Ray, hit: &Hit) -> Shade {
        if !hit.is_hit() {
            return self.nothing(ray);
        }
        let (corners, color) = surfaces.look(hit.primitive, hit.u, hit.v);
        let normal = unit_normal(hit.normal, corners);
        let normal = if normal.dot(ray.direction) > 0.0 { -normal } else { normal };
        let mut shade = Shade {
            base: color * self.lighting.ambient.irradiance(normal),
            key: Vec3::ZERO,
            shadow: None,
            depth: hit.t * ray.direction.length(),
            normal,
        };

        // A surface that is turned away from the light needs no ray to know that it is dark.
        let origin = offset_point(&corners.map(|p| p.to_array()), hit.u, hit.v, normal);
        let way = self.lighting.key.from(origin);
        let cosine = normal.dot(way.toward);
        if cosine > 0.0 {
            let key = color * way.irradiance * cosine;
            if self.shadows {
                shade.key = key;
                shade.shadow = Some(Ray::segment(origin, way.toward, 0.0, way.distance));
            } else {
                shade.base += key;
            }
        }
        shade
    }

    /// Shades the face of a box that stands for what is in it: grey, in the light and without a shadow.
    pub fn stand_in(&self, ray: &Ray, entry: Option<Entry>) -> Shade {
        let Some(Entry { t, axis }) = entry else { return self.nothing(ray) };
        let mut normal = Vec3::ZERO;
        normal[axis] = -ray.direction[axis].signum();
        let way = self.lighting.key.from(ray.origin + ray.direction * t);
        let cosine = normal.dot(way.toward).max(0.0);
        let light = self.lighting.ambient.irradiance(normal) + way.irradiance * cosine;
        let depth = t * ray.direction.length();
        Shade { base: STAND_IN * light, key: Vec3::ZERO, shadow: None, depth, normal }
    }

    /// What a ray sees that hits nothing.
    #[inline]
    fn nothing(&self, ray: &Ray) -> Shade {
        let (base, depth) = (self.lighting.ambient.sky(ray.direction), f32::INFINITY);
        Shade { base, key: Vec3::ZERO, shadow: None, depth, normal: Vec3::ZERO }
    }
}

/// The unit vector along a triangle's normal. Squares of very small and very large normals
/// underflow and overflow, so it is brought to the size of 1 first.
#[inline(always)]
pub(super) fn unit_normal(normal: Vec3, corners: [Vec3; 3]) -> Vec3 {
    let greatest = normal.abs().max_element();
    if greatest > f32::MIN_POSITIVE && greatest < f32::MAX {
        (normal / greatest).normalize()
    } else {
        let [p0, p1, p2] = corners.map(|p| p.as_dvec3());
        (p1 - p0).cross(p2 - p0).normalize_or(DVec3::Y).as_vec3()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::scene::{Ambient, Light};

    fn floor(size: f32) -> Mesh {
        Mesh {
            positions: vec![Vec3::ZERO, Vec3::Z * size, Vec3::X * size],
            triangles: vec![[0, 1, 2]],
            ..Mesh::default()
        }
    }

    const LIGHTING: Lighting = Lighting {
        key: Light::Sun { toward: Vec3::Y, irradiance: Vec3::ONE },
        ambient: Ambient { up: Vec3::Y, toward: Vec3::Y, sky: Vec3::splat(0.5), ground: Vec3::ZERO },
    };

    fn hit(size: f32) -> Hit {
        Hit { t: 2.0, u: 0.25, v: 0.25, primitive: 0, normal: Vec3::Y * size * size }
    }

    #[test]
    fn a_floor_under_the_sun_gets_its_light_and_the_skys() {
        let mesh = floor(1.0);
        let down = Ray::new(Vec3::new(0.25, 4.0, 0.25), Vec3::NEG_Y * 2.0);
        let shade = Shader::new(&mesh, &LIGHTING, true).shade(&&mesh, &down, &hit(1.0));
        assert_eq!((shade.base, shade.key), (Vec3::splat(0.35), Vec3::splat(0.7)));
        assert_eq!((shade.depth, shade.normal), (4.0, Vec3::Y));
        let shadow = shade.shadow.expect("it faces the light");
        assert_eq!((shadow.direction, shadow.tfar), (Vec3::Y, f32::INFINITY));
        assert!(shadow.origin.y > 0.0);

        let shade = Shader::new(&mesh, &LIGHTING, false).shade(&&mesh, &down, &hit(1.0));
        assert!(shade.shadow.is_none());
        assert_eq!(shade.base, Vec3::splat(0.35) + Vec3::splat(0.7));
    }

    #[test]
    fn from_below_it_is_its_other_side_that_is_seen() {
        let mesh = floor(1.0);
        let up = Ray::new(Vec3::new(0.25, -2.0, 0.25), Vec3::Y);
        let shade = Shader::new(&mesh, &LIGHTING, true).shade(&&mesh, &up, &hit(1.0));
        assert_eq!(shade.normal, Vec3::NEG_Y);
        assert!(shade.shadow.is_none(), "turned away from the light");
        assert_eq!(shade.base, Vec3::ZERO);
    }

    #[test]
    fn a_box_stands_in_the_light_where_its_face_is_turned_to_it() {
        let mesh = floor(1.0);
        let shader = Shader::new(&mesh, &LIGHTING, true);
        let down = Ray::new(Vec3::new(0.25, 4.0, 0.25), Vec3::NEG_Y * 2.0);
        let shade = shader.stand_in(&down, Some(Entry { t: 1.5, axis: 1 }));
        assert_eq!((shade.normal, shade.depth), (Vec3::Y, 3.0));
        assert_eq!(shade.base, STAND_IN * 1.5);
        assert!(shade.shadow.is_none(), "it casts no ray");
        let side = shader.stand_in(&Ray::new(Vec3::ZERO, Vec3::X), Some(Entry { t: 2.0, axis: 0 }));
        assert_eq!((side.normal, side.base), (Vec3::NEG_X, STAND_IN * 0.25));
        let sky = shader.stand_in(&down, None);
        assert_eq!((sky.depth, sky.normal), (f32::INFINITY, Vec3::ZERO));
    }

    #[test]
    fn normals_of_any_length_become_unit_vectors() {
        for size in [1e-30f32, 1e-18, 1e-6, 1.0, 1e6, 1e18, 1e30] {
            let corners = floor(size).corners(0);
            let normal = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            assert_eq!(unit_normal(normal, corners), Vec3::Y, "{size}");
        }
    }
}
