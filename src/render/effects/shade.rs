//! Shading of what a wave's rays hit: by the least of four kernels, counted or timed.

use super::bounce::{Queues, Scattered};
use super::direct::{Gathered, LightRay};
use super::meter::{Counting, Meter, Timing};
use super::path::{Path, Way};
use super::wave::{Seen, Waves, World};
use crate::geometry::Hit;
use crate::render::scatter::Sequence;
use crate::scene::effects::{Effect, EffectSet};
use crate::scene::{Look, Surface};
use glam::Vec3;

/// Effects that need surfaces' pictures, coordinates or normals.
const MAPS: EffectSet = EffectSet::of(&[
    Effect::Textures,
    Effect::Bump,
    Effect::SmoothNormals,
    Effect::CutOuts,
    Effect::Transparency,
]);

/// Effects that concern light wherever it arrives, whatever the material: it goes on, or has lost something on its way.
const EVERYWHERE: EffectSet = EffectSet::of(&[Effect::Interreflection, Effect::Absorption]);

/// Effects of materials that send rays on.
const RAYS: EffectSet = EffectSet::of(&[
    Effect::Transparency,
    Effect::Emission,
    Effect::Highlights,
    Effect::Reflection,
    Effect::Glossy,
    Effect::Refraction,
]);

impl<S: Surface> World<'_, S> {
    /// Shades what the rays hit: by the least kernel that does all that these surfaces call for.
    pub fn shade(
        &self,
        waves: &mut Waves,
        paths: &[Path],
        sequence: &impl Fn(u16) -> Sequence,
        sums: &mut [Vec3],
        next: &mut Queues,
        seen: Option<&mut Seen>,
    ) {
        let surfaces = self.surface.reader();
        let calls = waves.hits.iter().filter(|hit| hit.is_hit()).fold(EffectSet::NONE, |calls, hit| {
            let number = surfaces.material(hit.primitive);
            calls.or(self.resolver.calls.get(number as usize).copied().unwrap_or(EffectSet::NONE))
        });
        let calls = calls.and(self.set).or(self.set.and(EffectSet::of(&[Effect::SmoothNormals])));
        let kernel = (calls.has_any(MAPS), calls.has_any(RAYS) || self.set.has_any(EVERYWHERE));
        let Waves { hits, lights, tallies, clock, pace, counted, counts, .. } = waves;
        lights.clear();
        let mut out = Out { lights, sums, next, seen };
        let mut done = 0;
        while done < paths.len() {
            let (count, is_timed) = pace.next(paths.len() - done);
            let part = done..done + count;
            let job = Job { paths: &paths[part.clone()], hits: &hits[part], sequence, surfaces: &surfaces };
            if is_timed || *counts {
                let list = counts.then_some(&mut *counted);
                self.shade_by(kernel, &job, &mut out, &mut Timing::new(&mut tallies.uses, *clock, list));
            } else {
                self.shade_by(kernel, &job, &mut out, &mut Counting(&mut tallies.uses));
            }
            done += count;
        }
    }

    /// The kernel is named by whether surfaces have maps, and whether rays go on from them.
    fn shade_by(
        &self,
        kernel: (bool, bool),
        job: &Job<'_, impl Look, impl Fn(u16) -> Sequence>,
        out: &mut Out<'_>,
        meter: &mut impl Meter,
    ) {
        match kernel {
            (false, false) => self.shade_with::<false, false>(job, out, meter),
            (true, false) => self.shade_with::<true, false>(job, out, meter),
            (false, true) => self.shade_with::<false, true>(job, out, meter),
            (true, true) => self.shade_with::<true, true>(job, out, meter),
        }
    }

    /// With `MAPS`, surfaces have pictures, coordinates and normals; with `RAYS`, rays go on from them.
    fn shade_with<const MAPS: bool, const RAYS: bool>(
        &self,
        job: &Job<'_, impl Look, impl Fn(u16) -> Sequence>,
        out: &mut Out<'_>,
        meter: &mut impl Meter,
    ) {
        for (path, hit) in job.paths.iter().zip(job.hits) {
            let sum = &mut out.sums[path.pixel as usize];
            if !hit.is_hit() {
                *sum += path.arriving(path.weight * self.behind(path));
                continue;
            }
            meter.begin(path.pixel);
            let sequence = (job.sequence)(path.pixel);
            let point = self.resolver.resolve::<MAPS>(job.surfaces, path, hit, meter);
            if let Some(seen) = &mut out.seen {
                seen[path.pixel as usize] = Some((point.distance, point.face));
            }
            let mut weight = path.weight;
            if RAYS {
                if path.media.absorbs() {
                    weight *= meter.measure(Effect::Absorption, || path.media.attenuation(point.distance));
                }
                if point.opacity < 1.0 {
                    self.bounce.through(path, &point, &sequence, weight * (1.0 - point.opacity), out.next);
                    weight *= point.opacity;
                }
                if point.emission != Vec3::ZERO && self.set.has(Effect::Emission) {
                    *sum += meter.measure(Effect::Emission, || {
                        let share = path.share(|| self.direct.density_of(path, &point));
                        path.arriving(weight * point.emission * share)
                    });
                }
            }
            if point.material.unlit {
                *sum += weight * point.diffuse;
                continue;
            }
            let scattered = if RAYS {
                self.bounce.specular(path, &point, &sequence, weight, out.next, meter)
            } else {
                Scattered { matt: weight * point.diffuse, ..Scattered::default() }
            };
            if scattered != Scattered::default() {
                let looks_around = RAYS && self.bounce.looks_around(path);
                let to = Gathered { sum, rays: out.lights };
                self.direct.gather(path, &point, &sequence, (&scattered, looks_around), to, meter);
            }
            if RAYS && self.bounce.looks_around(path) {
                self.bounce.diffuse(path, &point, &sequence, scattered.matt, out.next);
            }
        }
    }

    /// What a ray sees that hits nothing.
    #[inline]
    fn behind(&self, path: &Path) -> Vec3 {
        let direction = path.ray.direction;
        match (&self.direct.lights.ambient, path.way) {
            // What falls on matt surfaces from everywhere, not what the sky looks like.
            (Some(ambient), Way::Diffuse) => ambient.irradiance(direction.normalize_or_zero()),
            _ => {
                let share = path.share(|| self.direct.density_around(direction));
                self.direct.lights.background(direction) * share
            }
        }
    }
}

/// Where what shading makes goes.
struct Out<'a> {
    /// Rays to lights.
    lights: &'a mut Vec<LightRay>,
    /// Light, by pixel.
    sums: &'a mut [Vec3],
    /// Paths that go on.
    next: &'a mut Queues,
    seen: Option<&'a mut Seen>,
}

/// Paths that are to be shaded, and what they hit.
struct Job<'a, L, F> {
    paths: &'a [Path],
    hits: &'a [Hit],
    sequence: &'a F,
    surfaces: &'a L,
}
