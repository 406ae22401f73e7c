//! Places on surfaces that rays have met, with all that light does there.

use super::holes::opacity;
use super::meter::Meter;
use super::path::Path;
use crate::geometry::Hit;
use crate::mesh::{Attributes, Material, Normal};
use crate::render::offset::offset_point;
use crate::render::scatter::{consistent_normal, terminator_offset};
use crate::render::shade::unit_normal;
use crate::scene::effects::{Effect, EffectSet};
use crate::scene::texture::{Textures, footprint};
use crate::scene::{Detail, Look};
use glam::{Vec2, Vec3};
use std::sync::LazyLock;

/// What surfaces without a material are.
static MATT: LazyLock<Material> = LazyLock::new(Material::default);

/// A place on a surface.
#[derive(Clone, Copy, Debug)]
pub struct Point<'a> {
    /// What the surface is.
    pub material: &'a Material,
    /// The material's number.
    pub number: u32,
    /// The triangle.
    pub primitive: u32,
    corners: [Vec3; 3],
    normals: [Normal; 3],
    u: f32,
    v: f32,
    /// Unit normal of the triangle, on the side that the ray came from.
    pub face: Vec3,
    /// Unit normal that light is computed with, on the same side.
    pub normal: Vec3,
    /// Whether the ray came from the triangle's front.
    pub is_front: bool,
    /// Unit vector to where the ray came from.
    pub toward: Vec3,
    /// How far the ray went, in the scene's units.
    pub distance: f32,
    /// The material's values here, maps included.
    pub diffuse: Vec3,
    pub specular: Vec3,
    pub roughness: f32,
    pub opacity: f32,
    pub emission: Vec3,
}

/// What turns hits into points.
pub struct Resolver<'a> {
    pub materials: &'a [Material],
    /// What each of them calls for.
    pub calls: Vec<EffectSet>,
    pub textures: &'a Textures,
    pub set: EffectSet,
}

impl<'a> Resolver<'a> {
    /// The place that a path's ray has hit. With `MAPS` surfaces may have pictures and normals.
    #[inline]
    pub fn resolve<const MAPS: bool>(
        &self,
        surfaces: &impl Look,
        path: &Path,
        hit: &Hit,
        meter: &mut impl Meter,
    ) -> Point<'a> {
        let Detail { corners, color, material: number, attributes } =
            surfaces.detail(hit.primitive, hit.u, hit.v);
        let material = self.materials.get(number as usize).unwrap_or(&MATT);
        let length = path.ray.direction.length();
        let toward = -path.ray.direction / length;
        let front = unit_normal(hit.normal, corners);
        let is_front = front.dot(path.ray.direction) <= 0.0;
        let face = if is_front { front } else { -front };
        let mut point = Point {
            material,
            number,
            primitive: hit.primitive,
            corners,
            normals: attributes.normals,
            u: hit.u,
            v: hit.v,
            face,
            normal: face,
            is_front,
            toward,
            distance: hit.t * length,
            diffuse: color,
            specular: material.specular,
            roughness: material.roughness,
            opacity: if material.cutoff.is_some() { 1.0 } else { material.opacity },
            emission: material.emission,
        };
        if MAPS {
            self.map(&mut point, &attributes, path, meter);
        }
        if !self.set.has(Effect::Transparency) {
            point.opacity = 1.0;
        }
        point
    }

    /// What a surface is that a ray has hit, and the share of it that is there, at its finest.
    pub fn opacity(&self, surfaces: &impl Look, hit: &Hit) -> (&'a Material, f32) {
        let Detail { material, attributes, .. } = surfaces.detail(hit.primitive, hit.u, hit.v);
        let material = self.materials.get(material as usize).unwrap_or(&MATT);
        if material.cutoff.is_some() || !self.set.has(Effect::Transparency) {
            return (material, 1.0);
        }
        (material, opacity(material, self.textures, attributes.uv_at(hit.u, hit.v), 0.0))
    }

    /// Looks up what normals and pictures say.
    fn map(&self, point: &mut Point<'a>, attributes: &Attributes, path: &Path, meter: &mut impl Meter) {
        if self.set.has(Effect::SmoothNormals) {
            let normal = meter.time(Effect::SmoothNormals, || attributes.normal_at(point.u, point.v));
            match normal {
                Some(normal) => {
                    meter.note(Effect::SmoothNormals, 1);
                    point.normal = if normal.dot(point.face) < 0.0 { -normal } else { normal };
                }
                None => point.normals = [Normal::NONE; 3],
            }
        } else {
            point.normals = [Normal::NONE; 3];
        }
        let maps = &point.material.maps;
        if maps.all().next().is_some() {
            let uv = attributes.uv_at(point.u, point.v);
            let cosine = point.face.dot(point.toward);
            let width = path.cone.width_at(point.distance);
            let print = footprint(&point.corners, &attributes.uv, width, cosine);
            if self.set.has(Effect::Textures) {
                let uses = meter.time(Effect::Textures, || self.color(point, uv, print));
                meter.note(Effect::Textures, uses);
            }
            if self.set.has(Effect::Transparency) && point.material.cutoff.is_none() {
                point.opacity = opacity(point.material, self.textures, uv, print);
            }
            if self.set.has(Effect::Bump) {
                let uses = meter.time(Effect::Bump, || self.bump(point, attributes, uv, print));
                meter.note(Effect::Bump, uses);
            }
        }
        point.normal = consistent_normal(point.toward, point.face, point.normal);
    }

    /// Looks pictures up, and says how many.
    fn color(&self, point: &mut Point<'a>, uv: Vec2, print: f32) -> u32 {
        let maps = &point.material.maps;
        let mut uses = 0;
        if let Some(map) = &maps.diffuse {
            point.diffuse *= self.textures.color(map, uv, print);
            uses += 1;
        }
        if let Some(map) = &maps.specular {
            point.specular *= self.textures.color(map, uv, print);
            uses += 1;
        }
        if let Some(map) = &maps.roughness {
            point.roughness *= self.textures.value(map, uv, print);
            uses += 1;
        }
        if let Some(map) = &maps.emission {
            point.emission *= self.textures.color(map, uv, print);
            uses += 1;
        }
        uses
    }

    /// Tilts the normal as height and normal maps say, and says how many were looked up.
    fn bump(&self, point: &mut Point<'a>, attributes: &Attributes, uv: Vec2, print: f32) -> u32 {
        let maps = &point.material.maps;
        if maps.normal.is_none() && maps.bump.is_none() {
            return 0;
        }
        let Some([along_u, along_v]) = tangents(&point.corners, &attributes.uv) else { return 0 };
        let mut uses = 0;
        // The maps are made for the front.
        let side = if point.is_front { 1.0 } else { -1.0 };
        let up = point.normal * side;
        if let Some(map) = &maps.normal {
            let n = self.textures.normal(map, uv, print);
            let tilted = along_u.normalize_or_zero() * n.x + along_v.normalize_or_zero() * n.y + up * n.z;
            point.normal = tilted.normalize_or(up) * side;
            uses += 1;
        }
        if let Some(map) = &maps.bump {
            // The surface rises by the slope along each tangent; heights are in units of the coordinates, so that a
            // slope of 1 is 45 degrees whatever the scale of the scene.
            let slope = self.textures.gradient(map, uv, print);
            let tilted = up - along_u.normalize_or_zero() * slope.x - along_v.normalize_or_zero() * slope.y;
            point.normal = tilted.normalize_or(up) * side;
            uses += 1;
        }
        uses
    }
}

/// Where the texture coordinates grow on a triangle: vectors for a step of 1 in each; `None` if they do not.
fn tangents([a, b, c]: &[Vec3; 3], uv: &[[f32; 2]; 3]) -> Option<[Vec3; 2]> {
    let [p, q, r] = uv.map(Vec2::from_array);
    let (e1, e2, d1, d2) = (*b - *a, *c - *a, q - p, r - p);
    let area = d1.perp_dot(d2);
    if area == 0.0 || !area.is_finite() {
        return None;
    }
    Some([(e1 * d2.y - e2 * d1.y) / area, (e2 * d1.x - e1 * d2.x) / area])
}

impl Point<'_> {
    /// Where a ray starts that leaves on the side that the path came from.
    #[inline]
    pub fn origin(&self) -> Vec3 {
        offset_point(&self.corners.map(|p| p.to_array()), self.u, self.v, self.face)
    }

    /// The same for one to a light: moved off the flat triangle to where the smooth surface would be.
    #[inline]
    pub fn origin_to_light(&self, meter: &mut impl Meter) -> Vec3 {
        let off = self.origin();
        if self.normals.contains(&Normal::NONE) {
            return off;
        }
        off + meter.time(Effect::SmoothNormals, || {
            let normals = self.normals.map(Normal::decode);
            terminator_offset(self.corners, normals, self.u, self.v, self.face)
        })
    }

    /// Where a ray starts that goes through the surface.
    #[inline]
    pub fn origin_behind(&self) -> Vec3 {
        offset_point(&self.corners.map(|p| p.to_array()), self.u, self.v, -self.face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tangents_follow_the_coordinates() {
        let corners = [Vec3::ZERO, Vec3::X * 4.0, Vec3::Z * 2.0];
        let [u, v] = tangents(&corners, &[[0.0, 0.0], [0.0, 1.0], [2.0, 0.0]]).expect("they grow");
        assert_eq!((u, v), (Vec3::Z, Vec3::X * 4.0));
        assert_eq!(tangents(&corners, &[[1.0, 1.0]; 3]), None);
    }
}
