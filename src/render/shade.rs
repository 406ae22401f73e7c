//! What a ray from the eye sees: a Lambertian surface in key and ambient light, or the sky.

use super::matt::{Found, Shades, Shading};
use crate::geometry::Ray;
use crate::scene::{Lighting, Look, Surface};
use crate::simd::Chosen;
use crate::traverse::{Entry, HitPacket, RayPacket};
use glam::{DVec3, Vec3};

/// Shades hits, and what stands for them.
pub(super) struct Shader<'a, S> {
    surface: &'a S,
    lighting: Lighting,
    shadows: bool,
}

/// What stands for something else where a ray meets it.
pub(super) struct Shade {
    /// Light that arrives.
    pub base: Vec3,
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

    /// Shades what the lanes in `active` hit, and makes the rays to the light that it depends on.
    #[inline(always)]
    pub fn shade<const W: usize>(
        &self,
        chosen: Chosen,
        surfaces: &impl Look,
        (rays, hits, active): (&RayPacket<W>, &HitPacket<W>, u32),
        (found, shades, to_light): (&mut Found<W>, &mut Shades<W>, &mut RayPacket<W>),
    ) {
        found.look_up(surfaces, hits, active);
        let Self { ref lighting, shadows, .. } = *self;
        chosen.run(Shading { lighting, shadows, rays, hits, found, shades, to_light });
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
        Shade { base: STAND_IN * light, depth, normal }
    }

    /// What a ray sees that hits nothing.
    #[inline]
    fn nothing(&self, ray: &Ray) -> Shade {
        let (base, depth) = (self.lighting.ambient.sky(ray.direction), f32::INFINITY);
        Shade { base, depth, normal: Vec3::ZERO }
    }
}

/// The unit vector along a triangle's normal. Squares of very small and very large normals
/// underflow and overflow, so it is brought to the size of 1 first.
#[inline(always)]
pub(super) fn unit_normal(normal: Vec3, corners: [Vec3; 3]) -> Vec3 {
    if has_unit(normal) {
        unit_of(normal)
    } else {
        let [p0, p1, p2] = corners.map(|p| p.as_dvec3());
        (p1 - p0).cross(p2 - p0).normalize_or(DVec3::Y).as_vec3()
    }
}

/// Whether a normal is neither zero nor beyond what floats hold.
#[inline(always)]
pub(super) fn has_unit(normal: Vec3) -> bool {
    let greatest = normal.abs().max_element();
    greatest > f32::MIN_POSITIVE && greatest < f32::MAX
}

/// The unit vector along such a normal; of others, anything.
#[inline(always)]
pub(super) fn unit_of(normal: Vec3) -> Vec3 {
    (normal / normal.abs().max_element()).normalize()
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::mesh::Mesh;
    use crate::scene::{Ambient, Light};

    /// A triangle in the plane of x and z.
    pub fn floor(size: f32) -> Mesh {
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

    #[test]
    fn a_box_stands_in_the_light_where_its_face_is_turned_to_it() {
        let mesh = floor(1.0);
        let shader = Shader::new(&mesh, &LIGHTING, true);
        let down = Ray::new(Vec3::new(0.25, 4.0, 0.25), Vec3::NEG_Y * 2.0);
        let shade = shader.stand_in(&down, Some(Entry { t: 1.5, axis: 1 }));
        assert_eq!((shade.normal, shade.depth), (Vec3::Y, 3.0));
        assert_eq!(shade.base, STAND_IN * 1.5);
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
