//! Shading of a packet's hits: matt surfaces in key and ambient light, or the sky.
//!
//! The formulas are those for one point ([`unit_normal`], [`offset_point`], [`Light::from`],
//! [`irradiance`](crate::scene::Ambient::irradiance)), in loops over lanes that have no branches: compilers make vectors
//! of the task's instruction set of them. Most of the time would otherwise go into one division and one square root
//! after the other. Nothing in them fuses, so that every instruction set and every packet width gives the same bits.

use super::offset::offset_point;
use super::shade::{has_unit, unit_normal, unit_of};
use super::tile::lanes;
use crate::geometry::Ray;
use crate::scene::{Face, Light, Lighting, Look, ShadowRay};
use crate::simd::{Simd, Task};
use crate::traverse::{HitPacket, RayPacket};
use glam::Vec3;

/// Vectors component by component: `vectors[axis][lane]`.
type Vectors<const W: usize> = [[f32; W]; 3];

/// The vector in a lane.
#[inline(always)]
fn get<const W: usize>(vectors: &Vectors<W>, lane: usize) -> Vec3 {
    Vec3::new(vectors[0][lane], vectors[1][lane], vectors[2][lane])
}

/// Puts a vector into a lane.
#[inline(always)]
fn set<const W: usize>(vectors: &mut Vectors<W>, lane: usize, vector: Vec3) {
    for axis in 0..3 {
        vectors[axis][lane] = vector[axis];
    }
}

/// What surfaces say of the triangles that a packet hit; anything in the other lanes.
#[derive(Clone, Debug)]
pub(super) struct Found<const W: usize> {
    /// The lanes that hit something.
    hit: u32,
    corners: [Vectors<W>; 3],
    color: Vectors<W>,
}

impl<const W: usize> Found<W> {
    /// Nothing.
    pub const fn nothing() -> Self {
        Self { hit: 0, corners: [[[0.0; W]; 3]; 3], color: [[0.0; W]; 3] }
    }

    /// Looks up what the lanes in `active` hit.
    #[inline(always)]
    pub fn look_up(&mut self, surfaces: &impl Look, hits: &HitPacket<W>, active: u32) {
        self.hit = 0;
        // Where triangles are larger than pixels, lanes that follow one another hit the same.
        let mut last: Option<(u32, Face)> = None;
        for lane in lanes(active) {
            let hit = hits.get(lane);
            if hit.is_hit() {
                self.hit |= 1 << lane;
                let (_, face) = match &mut last {
                    Some(seen) if seen.0 == hit.primitive => seen,
                    last => last.insert((hit.primitive, surfaces.face(hit.primitive))),
                };
                for (all, corner) in self.corners.iter_mut().zip(face.corners) {
                    set(all, lane, corner);
                }
                set(&mut self.color, lane, face.color.at(hit.u, hit.v));
            }
        }
    }

    #[inline(always)]
    fn corners(&self, lane: usize) -> [Vec3; 3] {
        self.corners.each_ref().map(|corner| get(corner, lane))
    }
}

/// What a packet's samples see. Lanes that do not count have anything in them.
#[derive(Clone, Debug)]
pub(super) struct Shades<const W: usize> {
    /// Light that arrives in any case.
    pub base: Vectors<W>,
    /// Light that is added where the shadow ray is free.
    pub key: Vectors<W>,
    /// The lanes in which something depends on the shadow ray.
    pub lit: u32,
    /// Unit normals on the side of the eye, zero for the sky.
    pub normal: Vectors<W>,
    /// Light of all samples so far.
    pub sum: Vectors<W>,
}

impl<const W: usize> Shades<W> {
    /// Black.
    pub const fn black() -> Self {
        let zero = [[0.0; W]; 3];
        Self { base: zero, key: zero, lit: 0, normal: zero, sum: zero }
    }
}

/// Shades a packet. Both sides of a surface look alike.
pub(super) struct Shading<'a, const W: usize> {
    pub lighting: &'a Lighting,
    /// Whether anything casts shadows.
    pub shadows: bool,
    pub rays: &'a RayPacket<W>,
    pub hits: &'a HitPacket<W>,
    pub found: &'a Found<W>,
    /// What they see.
    pub shades: &'a mut Shades<W>,
    /// The rays to the key light, where `lit` says so; empty ones elsewhere.
    pub to_light: &'a mut RayPacket<W>,
}

impl<const W: usize> Task for Shading<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self) {
        self.normals();
        let origin = self.origins();
        match self.lighting.key {
            // Which light there is, is asked once, not lane by lane.
            sun @ Light::Sun { .. } => self.light(&origin, |point| sun.from(point)),
            Light::Point { position, irradiance, reach } => {
                let lamp = Light::Point { position, irradiance, reach };
                self.light(&origin, |point| lamp.from(point));
            }
        }
        if self.found.hit != u32::MAX >> (32 - W) {
            self.sky();
        }
        let Shades { base, sum, .. } = self.shades;
        for (sum, base) in sum.iter_mut().zip(base) {
            for lane in 0..W {
                sum[lane] += base[lane];
            }
        }
    }
}

impl<const W: usize> Shading<'_, W> {
    /// Unit normals, turned to where the rays come from.
    #[inline(always)]
    fn normals(&mut self) {
        let Self { hits, rays, found, shades, .. } = self;
        let mut plain = [false; W];
        for lane in 0..W {
            let normal = get(&hits.normal, lane);
            plain[lane] = has_unit(normal);
            set(&mut shades.normal, lane, unit_of(normal));
        }
        for lane in lanes(found.hit) {
            if !plain[lane] {
                set(&mut shades.normal, lane, unit_normal(get(&hits.normal, lane), found.corners(lane)));
            }
        }
        for lane in 0..W {
            let normal = get(&shades.normal, lane);
            let away = normal.dot(get(&rays.direction, lane)) > 0.0;
            set(&mut shades.normal, lane, if away { -normal } else { normal });
        }
    }

    /// Where the rays to the light start.
    #[inline(always)]
    fn origins(&self) -> Vectors<W> {
        let Self { hits, found, shades, .. } = self;
        let mut origins = [[0.0; W]; 3];
        for lane in 0..W {
            let corners = found.corners(lane).map(|corner| corner.to_array());
            let normal = get(&shades.normal, lane);
            set(&mut origins, lane, offset_point(&corners, hits.u[lane], hits.v[lane], normal));
        }
        origins
    }

    /// Light on the surfaces, and the rays that it depends on.
    #[inline(always)]
    fn light(&mut self, origins: &Vectors<W>, from: impl Fn(Vec3) -> ShadowRay) {
        let Self { lighting, found, shades, to_light, .. } = self;
        let ambient = lighting.ambient;
        // A surface that is turned away from the light needs no ray to know that it is dark.
        let mut faces = [false; W];
        for lane in 0..W {
            let origin = get(origins, lane);
            let way = from(origin);
            let (normal, color) = (get(&shades.normal, lane), get(&found.color, lane));
            let cosine = normal.dot(way.toward);
            faces[lane] = cosine > 0.0;
            set(&mut shades.base, lane, color * ambient.irradiance(normal));
            set(&mut shades.key, lane, color * way.irradiance * cosine);
            to_light.set(lane, &Ray::segment(origin, way.toward, 0.0, way.distance));
        }
        let facing = faces.iter().enumerate().fold(0, |bits, (lane, &faces)| bits | u32::from(faces) << lane);
        shades.lit = facing & found.hit;
        if !self.shadows {
            for lane in 0..W {
                let light = get(&shades.base, lane) + get(&shades.key, lane);
                let base = if faces[lane] { light } else { get(&shades.base, lane) };
                set(&mut shades.base, lane, base);
            }
            shades.lit = 0;
        }
        for lane in lanes(!shades.lit & u32::MAX >> (32 - W)) {
            to_light.set(lane, &RayPacket::<1>::empty().get(0));
        }
    }

    /// What rays see that hit nothing.
    #[inline(always)]
    fn sky(&mut self) {
        let Self { lighting, rays, found, shades, .. } = self;
        let ambient = lighting.ambient;
        for lane in 0..W {
            let hits = found.hit >> lane & 1 == 1;
            let (base, normal) = (get(&shades.base, lane), get(&shades.normal, lane));
            let sky = ambient.sky(get(&rays.direction, lane));
            set(&mut shades.base, lane, if hits { base } else { sky });
            set(&mut shades.normal, lane, if hits { normal } else { Vec3::ZERO });
        }
    }
}

/// Adds the light of shadow rays that nothing is in the way of, packet by packet.
pub(super) struct AddKey<'a, const W: usize> {
    pub shades: &'a mut [Shades<W>],
    /// The lanes whose shadow rays matter, and those of them that are in the dark.
    pub lit: &'a [u32],
    pub occluded: &'a [u32],
}

impl<const W: usize> Task for AddKey<'_, W> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        for ((shades, lit), occluded) in self.shades.iter_mut().zip(self.lit).zip(self.occluded) {
            let free = lit & !occluded;
            if free == 0 {
                continue;
            }
            // Bit by bit once, not once for each channel.
            let is_free: [bool; W] = std::array::from_fn(|lane| free >> lane & 1 == 1);
            for (sum, key) in shades.sum.iter_mut().zip(&shades.key) {
                for lane in 0..W {
                    let more = sum[lane] + key[lane];
                    sum[lane] = if is_free[lane] { more } else { sum[lane] };
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Hit;
    use crate::render::shade::Shader;
    use crate::render::shade::tests::floor;
    use crate::scene::Ambient;
    use crate::simd::{Chosen, Isa};
    use glam::Vec3Swizzles;
    use proptest::prelude::*;

    const AMBIENT: Ambient =
        Ambient { up: Vec3::Y, toward: Vec3::Y, sky: Vec3::splat(0.5), ground: Vec3::ZERO };
    const SUN: Lighting =
        Lighting { key: Light::Sun { toward: Vec3::Y, irradiance: Vec3::ONE }, ambient: AMBIENT };
    const LAMP: Lighting = Lighting {
        key: Light::Point { position: Vec3::new(0.5, 2.0, 0.25), irradiance: Vec3::ONE, reach: 3.0 },
        ambient: AMBIENT,
    };

    fn hit(size: f32) -> Hit {
        Hit { t: 2.0, u: 0.25, v: 0.25, primitive: 0, normal: Vec3::Y * size * size }
    }

    /// What the lanes of packets of `W` see, and the rays to the light of those that are lit.
    fn seen<const W: usize>(
        isa: Isa,
        lighting: &Lighting,
        shadows: bool,
        samples: &[(Ray, Hit)],
    ) -> Vec<([Vec3; 4], Option<Ray>)> {
        let mesh = floor(1.0);
        let shader = Shader::new(&mesh, lighting, shadows);
        let chosen = Chosen::new(isa).expect("it is available");
        let mut all = Vec::new();
        for samples in samples.chunks(W) {
            let (mut rays, mut hits) = (RayPacket::<W>::empty(), HitPacket::<W>::miss());
            for (lane, (ray, hit)) in samples.iter().enumerate() {
                rays.set(lane, ray);
                (hits.t[lane], hits.u[lane], hits.v[lane]) = (hit.t, hit.u, hit.v);
                hits.primitive[lane] = hit.primitive;
                set(&mut hits.normal, lane, hit.normal);
            }
            let (mut found, mut shades, mut to_light) =
                (Found::nothing(), Shades::black(), RayPacket::empty());
            let out = (&mut found, &mut shades, &mut to_light);
            let active = u32::MAX >> (32 - samples.len());
            shader.shade(chosen, &&mesh, (&rays, &hits, active), out);
            let one_sample = shades.sum;
            let (lit, occluded) = (&[active], &[!shades.lit]);
            chosen.run(AddKey { shades: std::slice::from_mut(&mut shades), lit, occluded });
            for lane in 0..samples.len() {
                let lit = shades.lit >> lane & 1 == 1;
                assert_eq!(get(&shades.base, lane), get(&one_sample, lane));
                let sums = [&shades.base, &shades.normal, &shades.sum].map(|row| get(row, lane));
                let key = if lit { get(&shades.key, lane) } else { Vec3::ZERO };
                let ray = to_light.get(lane);
                assert_eq!(lit, ray.tfar >= ray.tnear, "rays that nothing depends on are empty");
                all.push(([sums[0], sums[1], sums[2], key], lit.then_some(ray)));
            }
        }
        all
    }

    /// The same from every instruction set and every width, to the bit.
    fn see(lighting: &Lighting, shadows: bool, samples: &[(Ray, Hit)]) -> Vec<([Vec3; 4], Option<Ray>)> {
        let expected = seen::<1>(Isa::Portable, lighting, shadows, samples);
        let bits = |seen: &[([Vec3; 4], Option<Ray>)]| format!("{seen:?}");
        for isa in Isa::available() {
            assert_eq!(bits(&seen::<1>(isa, lighting, shadows, samples)), bits(&expected), "{isa}");
            assert_eq!(bits(&seen::<4>(isa, lighting, shadows, samples)), bits(&expected), "{isa}");
            assert_eq!(bits(&seen::<8>(isa, lighting, shadows, samples)), bits(&expected), "{isa}");
            assert_eq!(bits(&seen::<16>(isa, lighting, shadows, samples)), bits(&expected), "{isa}");
        }
        expected
    }

    #[test]
    fn a_floor_under_the_sun_gets_its_light_and_the_skys() {
        let down = Ray::new(Vec3::new(0.25, 4.0, 0.25), Vec3::NEG_Y * 2.0);
        let ([base, normal, sum, key], shadow) = see(&SUN, true, &[(down, hit(1.0))])[0];
        assert_eq!((base, key, normal), (Vec3::splat(0.35), Vec3::splat(0.7), Vec3::Y));
        assert_eq!(sum, base + key);
        let shadow = shadow.expect("it faces the light");
        assert_eq!((shadow.direction, shadow.tfar), (Vec3::Y, f32::INFINITY));
        assert!(shadow.origin.y > 0.0);

        let ([base, ..], shadow) = see(&SUN, false, &[(down, hit(1.0))])[0];
        assert!(shadow.is_none());
        assert_eq!(base, Vec3::splat(0.35) + Vec3::splat(0.7));
    }

    #[test]
    fn from_below_it_is_its_other_side_that_is_seen() {
        let up = Ray::new(Vec3::new(0.25, -2.0, 0.25), Vec3::Y);
        for shadows in [false, true] {
            let ([base, normal, sum, _], shadow) = see(&SUN, shadows, &[(up, hit(1.0))])[0];
            assert_eq!((base, normal, sum), (Vec3::ZERO, Vec3::NEG_Y, Vec3::ZERO));
            assert!(shadow.is_none(), "turned away from the light");
        }
    }

    #[test]
    fn a_lamp_is_as_far_away_as_it_is() {
        let down = Ray::new(Vec3::new(0.5, 4.0, 0.25), Vec3::NEG_Y);
        let ([_, _, _, key], shadow) = see(&LAMP, true, &[(down, Hit { u: 0.25, v: 0.5, ..hit(1.0) })])[0];
        let shadow = shadow.expect("it faces the light");
        assert!((shadow.tfar - 2.0).abs() < 1e-5 && shadow.direction.distance(Vec3::Y) < 1e-5, "{shadow:?}");
        assert!((key - Vec3::splat(0.7 * 9.0 / 13.0)).length() < 1e-5, "{key}");
    }

    #[test]
    fn normals_beyond_the_range_are_made_anew() {
        let down = Ray::new(Vec3::new(0.25, 4.0, 0.25), Vec3::NEG_Y);
        for normal in [Vec3::ZERO, Vec3::splat(f32::INFINITY), Vec3::splat(f32::NAN), Vec3::Y * 1e-39] {
            let samples = [(down, hit(1.0)), (down, Hit { normal, ..hit(1.0) })];
            let seen = see(&SUN, true, &samples);
            assert_eq!(format!("{:?}", seen[0]), format!("{:?}", seen[1]), "{normal}");
        }
    }

    proptest! {
        #[test]
        fn every_width_and_instruction_set_sees_the_same(
            samples in prop::collection::vec(
                (prop::array::uniform3(-9f32..9.0), prop::array::uniform3(-1f32..1.0), 0f32..0.5, 0u32..3),
                1..40,
            ),
            shadows in any::<bool>(),
        ) {
            let samples: Vec<(Ray, Hit)> = samples
                .into_iter()
                .filter(|(_, way, ..)| Vec3::from(*way).length() > 1e-3)
                .map(|(origin, way, at, kind)| {
                    let normal = Vec3::from(way).yzx() * 1e3;
                    let hit = if kind == 0 { Hit::MISS } else { Hit { t: at, u: at, v: 0.4, primitive: 0, normal } };
                    (Ray::new(origin.into(), way.into()), hit)
                })
                .collect();
            for ((ray, hit), ([base, normal, ..], _)) in samples.iter().zip(see(&LAMP, shadows, &samples)) {
                if hit.is_hit() {
                    prop_assert!((normal.length() - 1.0).abs() < 1e-6 && normal.dot(ray.direction) <= 0.0);
                } else {
                    prop_assert_eq!((base, normal), (AMBIENT.sky(ray.direction), Vec3::ZERO));
                }
            }
            see(&SUN, shadows, &samples);
        }
    }
}
