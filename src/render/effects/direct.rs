//! Light that comes to a matt surface straight from where it is made.

use super::bounce::Scattered;
use super::meter::Meter;
use super::path::{Path, Use};
use super::point::Point;
use crate::geometry::Ray;
use crate::render::scatter::{
    Basis, Sequence, by_solid_angle, cosine_density, cosine_hemisphere, ggx, power_heuristic,
};
use crate::scene::effects::{Effect, EffectSet};
use crate::scene::{Lights, ShadowRay};
use glam::Vec3;
use std::f32::consts::{FRAC_1_PI, PI};

/// A ray to a light, and what arrives along it if nothing is in the way.
#[derive(Clone, Copy, Debug)]
pub struct LightRay {
    pub ray: Ray,
    pub pixel: u16,
    /// The effect whose shadow it casts.
    pub effect: Effect,
    pub light: Vec3,
}

/// Where the light of a surface goes.
pub struct Gathered<'a> {
    /// What arrives whatever is in the way.
    pub sum: &'a mut Vec3,
    /// What depends on that.
    pub rays: &'a mut Vec<LightRay>,
}

/// The smoothest surface on which lights make highlights: that of a light without extent is invisible on a mirror.
const SHARPEST: f32 = 0.03;

/// The same for lights that have one, of which one point is looked at a time: a sharper highlight would be a few bright
/// dots.
const SHARPEST_OF_WIDE: f32 = 0.2;

/// What lights a frame.
pub struct Direct<'a> {
    pub lights: &'a Lights,
    pub set: EffectSet,
    /// How far a surface may be that takes light from everywhere away.
    pub reach: f32,
    /// Rays to lights that have an extent.
    pub samples: u32,
}

impl Direct<'_> {
    /// Gathers the light that arrives at a matt surface. `scattered` is the part that the eye gets of what arrives; `looks_around` says whether the path goes on
    /// to look for light by chance, which may be the same light.
    #[inline]
    pub fn gather(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        (scattered, looks_around): (&Scattered, bool),
        Gathered { sum, rays }: Gathered<'_>,
        meter: &mut impl Meter,
    ) {
        let matt = scattered.matt;
        let mut add = |effect: Effect, ray: Ray, light: Vec3| {
            let light = path.arriving_from_there(light);
            if light.max_element() <= 0.0 {
            } else if self.set.has(effect) {
                rays.push(LightRay { ray, pixel: path.pixel, effect, light });
            } else {
                *sum += light;
            }
        };
        let origin = point.origin_to_light(meter);
        if let Some(light) = &self.lights.key {
            let way = light.from(origin);
            let light = self.key(point, &way, scattered, meter);
            add(Effect::Shadows, Ray::segment(origin, way.toward, 0.0, way.distance), light);
        }
        for time in 0..self.samples {
            let random = |what| path.random_of(sequence, what, time);
            let scattered = (scattered, looks_around);
            if let Some(found) = self.light_of_surfaces(point, origin, scattered, random, meter) {
                add(Effect::SoftShadows, found.0, found.1);
            }
            if let Some(found) = self.light_from_afar(point, origin, scattered, random, meter) {
                add(Effect::Environment, found.0, found.1);
            }
        }
        if self.set.has(Effect::Interreflection) {
            return;
        }
        let Some(ambient) = &self.lights.ambient else { return };
        if self.set.has(Effect::AmbientOcclusion) {
            let local = cosine_hemisphere(path.random(sequence, Use::Occlusion));
            let toward = Basis::of(point.normal).to_world(local);
            if point.face.dot(toward) > 0.0 {
                let ray = Ray::segment(origin, toward, 0.0, self.reach);
                add(Effect::AmbientOcclusion, ray, matt * ambient.irradiance(point.normal));
            }
        } else {
            *sum += matt * ambient.irradiance(point.normal);
        }
    }

    /// A point on a light: the ray to it, and the light that arrives.
    fn light_of_surfaces(
        &self,
        point: &Point<'_>,
        origin: Vec3,
        (scattered, looks_around): (&Scattered, bool),
        random: impl Fn(Use) -> [f32; 2],
        meter: &mut impl Meter,
    ) -> Option<(Ray, Vec3)> {
        let emitters = self.lights.emitters.as_ref()?;
        let light = emitters.sample_for(origin, random(Use::Light), random(Use::LightPlace));
        let way = light.position - origin;
        let distance = way.length();
        let toward = way / distance;
        let cosines = point.normal.dot(toward).max(0.0) * light.normal.dot(toward).abs();
        // A point on the light itself, or on its back's edge, gets nothing from here.
        if cosines.is_nan() || cosines <= 0.0 || point.face.dot(toward) <= 0.0 || light.pdf_area <= 0.0 {
            return None;
        }
        let count = self.samples as f32;
        let by_angle = by_solid_angle(light.pdf_area, way, light.normal);
        let thrown = self.thrown(point, toward, (scattered, looks_around), by_angle * count, meter);
        let part = cosines / (distance * distance * light.pdf_area * count);
        // Short of the light, which would hide itself.
        Some((Ray::segment(origin, way, 0.0, 1.0 - 1e-4), thrown * light.radiance * part))
    }

    /// The same from infinitely far away.
    fn light_from_afar(
        &self,
        point: &Point<'_>,
        origin: Vec3,
        (scattered, looks_around): (&Scattered, bool),
        random: impl Fn(Use) -> [f32; 2],
        meter: &mut impl Meter,
    ) -> Option<(Ray, Vec3)> {
        let sample = self.lights.environment.as_ref()?.sample(random(Use::Environment));
        let toward = sample.direction;
        let cosine = point.normal.dot(toward);
        if cosine <= 0.0 || point.face.dot(toward) <= 0.0 || sample.pdf <= 0.0 {
            return None;
        }
        let count = self.samples as f32;
        let thrown = self.thrown(point, toward, (scattered, looks_around), sample.pdf * count, meter);
        Some((Ray::new(origin, toward), thrown * sample.radiance * (cosine / (sample.pdf * count))))
    }

    /// The part of the light from `toward` that the eye gets, by solid angle, where that direction was looked at on
    /// purpose, with that density.
    fn thrown(
        &self,
        point: &Point<'_>,
        toward: Vec3,
        (scattered, looks_around): (&Scattered, bool),
        on_purpose: f32,
        meter: &mut impl Meter,
    ) -> Vec3 {
        let share = share(looks_around, on_purpose, point.normal.dot(toward));
        let gloss = if scattered.lights == Vec3::ZERO {
            0.0
        } else {
            self.lobe(point, toward, SHARPEST_OF_WIDE, meter)
        };
        scattered.matt * (FRAC_1_PI * share) + scattered.lights * gloss
    }

    /// The density by solid angle with which a light would have been looked for that a path has met, all tries together.
    pub fn density_of(&self, path: &Path, point: &Point<'_>) -> f32 {
        let Some(emitters) = &self.lights.emitters else { return 0.0 };
        let by_area = emitters.pdf_area_for(path.from, point.primitive);
        let place = path.ray.origin - point.toward * point.distance;
        by_solid_angle(by_area, place - path.from, point.face) * self.samples as f32
    }

    /// The same for the light from around.
    pub fn density_around(&self, direction: Vec3) -> f32 {
        self.lights
            .environment
            .as_ref()
            .map_or(0.0, |environment| environment.pdf(direction) * self.samples as f32)
    }

    /// Light of the key light. Its irradiance is what a white surface that faces it throws back: that divided by
    /// pi.
    #[inline]
    fn key(&self, point: &Point<'_>, way: &ShadowRay, scattered: &Scattered, meter: &mut impl Meter) -> Vec3 {
        let cosine = point.normal.dot(way.toward);
        if cosine <= 0.0 || point.face.dot(way.toward) <= 0.0 {
            return Vec3::ZERO;
        }
        let gloss =
            if scattered.points == Vec3::ZERO { 0.0 } else { self.lobe(point, way.toward, SHARPEST, meter) };
        (scattered.matt + scattered.points * (PI * gloss)) * way.irradiance * cosine
    }

    /// How much of the light from `toward` a surface throws to the eye near the mirror's direction, for each unit of
    /// its specular reflectance.
    #[inline]
    fn lobe(&self, point: &Point<'_>, toward: Vec3, sharpest: f32, meter: &mut impl Meter) -> f32 {
        let effect = if point.material.reflects { Effect::Glossy } else { Effect::Highlights };
        if !self.set.has(effect) || point.specular == Vec3::ZERO {
            return 0.0;
        }
        let evaluate = || {
            let basis = Basis::of(point.normal);
            let [wo, wi] = [point.toward, toward].map(|v| basis.to_local(v));
            ggx::evaluate(wo, wi, point.roughness.max(sharpest), |_| Vec3::ONE).x
        };
        match effect {
            Effect::Highlights => meter.measure(effect, evaluate),
            // Counted by its rays.
            _ => evaluate(),
        }
    }
}

/// How much light counts that was looked for on purpose, where a path may meet it by chance as well: see
/// [`Path::share`].
#[inline]
fn share(looks_around: bool, on_purpose: f32, cosine: f32) -> f32 {
    if looks_around { power_heuristic(on_purpose, cosine_density(cosine)) } else { 1.0 }
}
