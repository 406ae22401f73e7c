//! Where light goes on from a surface.

use super::meter::Meter;
use super::path::{Path, Use, Way};
use super::point::Point;
use crate::geometry::Ray;
use crate::render::scatter::{
    Basis, Medium, Sequence, cosine_density, cosine_hemisphere, dielectric, ggx, refract, schlick,
};
use crate::scene::effects::{Effect, EffectSet, SMOOTH};
use glam::Vec3;

/// Paths that wait to be traced, by what made them.
#[derive(Debug, Default)]
pub struct Queues([Vec<Path>; Way::ALL.len()]);

impl Queues {
    /// Those that one way made.
    pub fn of(&mut self, way: Way) -> &mut Vec<Path> {
        &mut self.0[way as usize]
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.iter().all(Vec::is_empty)
    }
}

/// The part of the light that a surface itself throws to the eye, as linear RGB weights.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Scattered {
    /// What comes from anywhere.
    pub matt: Vec3,
    /// What comes from near the mirror's direction, of light that no ray will meet there: from points.
    pub points: Vec3,
    /// The same of light that rays may meet, if none was sent.
    pub lights: Vec3,
}

/// What surfaces do with light that is not stopped.
#[derive(Clone, Copy, Debug)]
pub struct Bounce {
    pub set: EffectSet,
    /// Surfaces that a path may meet after the first.
    pub limit: u32,
    /// Below this part of the light, a path goes on by chance, and counts for more if it does.
    pub faint: f32,
}

/// From so many surfaces on, light between matt surfaces goes on by chance, as often as the last of them is bright.
const DEEP: u16 = 3;

impl Bounce {
    /// Sends off what is seen through a surface, in it, and inside of it. What is left for the surface itself to
    /// scatter comes back.
    #[inline]
    pub fn specular(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        weight: Vec3,
        next: &mut Queues,
        meter: &mut impl Meter,
    ) -> Scattered {
        let material = point.material;
        const OF_GLASS: EffectSet = EffectSet::of(&[Effect::Refraction, Effect::Reflection]);
        if material.transmission != Vec3::ZERO && self.set.has_any(OF_GLASS) {
            return self.transparent(path, point, sequence, weight, next, meter);
        }
        let is_smooth = point.roughness < SMOOTH;
        let effect = if is_smooth { Effect::Reflection } else { Effect::Glossy };
        if !material.reflects {
            // The classic model: highlights come on top of the colour, which files give without regard to them.
            let gloss = weight * point.specular;
            return Scattered { matt: weight * point.diffuse, points: gloss, lights: gloss };
        }
        if point.specular == Vec3::ZERO || !self.set.has(effect) {
            return Scattered { matt: weight * point.diffuse, ..Scattered::default() };
        }
        let curved = material.fresnel && self.set.has(Effect::Fresnel);
        let mut shown = |cosine: f32| {
            if curved {
                meter.measure(Effect::Fresnel, || schlick(point.specular, cosine))
            } else {
                point.specular
            }
        };
        let reflectance = shown(point.normal.dot(point.toward));
        if is_smooth {
            self.mirror(path, point, sequence, weight * reflectance, next);
        } else {
            // A microfacet's normal, of those that the eye sees.
            let basis = Basis::of(point.normal);
            let wo = basis.to_local(point.toward);
            let sample = ggx::sample(wo, point.roughness, path.random(sequence, Use::Gloss));
            let toward = sample.map(|sample| (basis.to_world(sample.wi), sample));
            if let Some((toward, sample)) = toward.filter(|(toward, _)| point.face.dot(*toward) > 0.0) {
                let weight = weight * shown(sample.cos_facet) * sample.weight;
                // The lobe's width blurs what pictures show in it.
                let spread = path.cone.spread + 0.25 * point.roughness;
                self.send(path, point, sequence, Way::Glossy, (point.origin(), toward, weight, spread), next);
            }
        }
        Scattered {
            matt: weight * point.diffuse * (1.0 - reflectance.max_element()).max(0.0),
            points: if is_smooth { Vec3::ZERO } else { weight * reflectance },
            lights: Vec3::ZERO,
        }
    }

    /// The same for a surface that light goes through.
    fn transparent(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        weight: Vec3,
        next: &mut Queues,
        meter: &mut impl Meter,
    ) -> Scattered {
        let material = point.material;
        let is_thin = material.ior == 1.0;
        let eta = match (is_thin, point.is_front) {
            (true, _) => 1.0,
            (_, true) => path.media.eta_entering(material.ior),
            (_, false) => path.media.eta_leaving(point.number, material.ior),
        };
        let cosine = point.normal.dot(point.toward);
        let bent = refract(-point.toward, point.normal, eta);
        let curved = material.fresnel && self.set.has(Effect::Fresnel);
        let reflected = match (bent, is_thin) {
            (None, _) => Vec3::ONE,
            (_, true) if material.reflects && curved => {
                meter.measure(Effect::Fresnel, || schlick(point.specular, cosine))
            }
            (_, true) if material.reflects => point.specular,
            (_, true) => Vec3::ZERO,
            (_, false) if curved => Vec3::splat(meter.measure(Effect::Fresnel, || dielectric(cosine, eta))),
            // What Fresnel's equations say of light that comes straight on.
            (_, false) => Vec3::splat(dielectric(1.0, eta)),
        };
        let goes_in = self.set.has(Effect::Refraction);
        if self.set.has(Effect::Reflection) || goes_in && bent.is_none() {
            self.mirror(path, point, sequence, weight * reflected, next);
        }
        let entering = weight * (Vec3::ONE - reflected);
        if let Some(toward) = bent.filter(|_| goes_in) {
            let mut inside = *path;
            if !is_thin {
                if point.is_front {
                    let absorption =
                        if self.set.has(Effect::Absorption) { material.absorption } else { Vec3::ZERO };
                    inside.media.enter(Medium { material: point.number, ior: material.ior, absorption });
                } else {
                    inside.media.leave(point.number);
                }
            }
            let going = (point.origin_behind(), toward, entering * material.transmission, path.cone.spread);
            self.send(&inside, point, sequence, Way::Refraction, going, next);
        }
        let matt = entering * point.diffuse * (1.0 - material.transmission.max_element());
        Scattered { matt, ..Scattered::default() }
    }

    fn mirror(&self, path: &Path, point: &Point<'_>, sequence: &Sequence, weight: Vec3, next: &mut Queues) {
        let toward = (-point.toward).reflect(point.normal);
        // A normal that is not the triangle's may throw light into the surface.
        if point.face.dot(toward) > 0.0 {
            let going = (point.origin(), toward, weight, path.cone.spread);
            self.send(path, point, sequence, Way::Reflection, going, next);
        }
    }

    /// Sends off what goes straight on because the surface is only there in part.
    pub fn through(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        weight: Vec3,
        next: &mut Queues,
    ) {
        let going = (point.origin_behind(), -point.toward, weight, path.cone.spread);
        self.send(path, point, sequence, Way::Through, going, next);
    }

    /// Whether matt surfaces send rays on to look for the light that others throw on them.
    #[inline]
    pub fn looks_around(&self, path: &Path) -> bool {
        self.set.has(Effect::Interreflection) && u32::from(path.depth) < self.limit
    }

    /// Looks for the light that other surfaces throw on this one.
    pub fn diffuse(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        matt: Vec3,
        next: &mut Queues,
    ) {
        let local = cosine_hemisphere(path.random(sequence, Use::Diffuse));
        let toward = Basis::of(point.normal).to_world(local);
        if point.face.dot(toward) <= 0.0 {
            return;
        }
        let mut weight = matt;
        if path.depth >= DEEP && self.faint > 0.0 {
            let stays = point.diffuse.max_element().clamp(0.05, 0.95);
            if path.random(sequence, Use::Roulette)[1] >= stays {
                return;
            }
            weight /= stays;
        }
        // A hemisphere's share of a cone: pictures are seen as plain colours from there on.
        let going = (point.origin(), toward, weight, path.cone.spread.max(0.25));
        self.send(path, point, sequence, Way::Diffuse, going, next);
    }

    /// Sends a path off, unless it is too faint or has met too many surfaces.
    fn send(
        &self,
        path: &Path,
        point: &Point<'_>,
        sequence: &Sequence,
        way: Way,
        (origin, toward, weight, spread): (Vec3, Vec3, Vec3, f32),
        next: &mut Queues,
    ) {
        let strength = weight.max_element();
        if u32::from(path.depth) >= self.limit || strength.is_nan() || strength <= 0.0 {
            return;
        }
        let mut cone = path.cone.propagate(point.distance);
        cone.spread = spread;
        let before = path;
        let mut path = Path {
            ray: Ray::new(origin, toward),
            depth: path.depth + 1,
            way,
            density: 0.0,
            is_indirect: before.is_indirect || before.way == Way::Diffuse,
            from: origin,
            branch: path.branch_of(way),
            weight,
            cone,
            ..*before
        };
        match way {
            // As if there had been nothing.
            Way::Through => (path.density, path.from) = (before.density, before.from),
            Way::Refraction if point.material.ior == 1.0 => {
                (path.density, path.from) = (before.density, before.from);
            }
            Way::Diffuse => path.density = cosine_density(point.normal.dot(toward)),
            _ => {}
        }
        if strength < self.faint {
            let stays = strength / self.faint;
            if path.random(sequence, Use::Roulette)[0] >= stays {
                return;
            }
            path.weight /= stays;
        }
        next.of(way).push(path);
    }
}
