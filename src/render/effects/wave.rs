//! All paths of a sample, wave after wave.
//!
//! What a wave's rays hit is shaded before the next wave is traced, so that kernels get rays by the hundred, each
//! kind by itself: those from a camera or off a mirror have much in common, those off a matt surface nothing. A
//! pixel's light is added up in the order of its own paths, whoever its neighbours are: pictures are the same for
//! every size of a tile.

use super::bounce::{Bounce, Queues};
use super::cost::Tallies;
use super::direct::{Direct, LightRay};
use super::holes::Holes;
use super::meter::{Clock, Pace};
use super::path::{Path, Way};
use super::point::Resolver;
use super::trace::Tracer;
use crate::geometry::{Hit, Ray};
use crate::render::scatter::Sequence;
use crate::render::stats::Tally;
use crate::scene::effects::{Effect, EffectSet};
use crate::scene::{Look, Surface};
use crate::traverse::{Accel, Dispatch, Kernel};
use glam::Vec3;
use std::time::Instant;

/// All that paths meet.
pub struct World<'a, S> {
    pub accel: &'a Accel,
    /// What traces: a kernel of beams for whatever is quickest.
    pub kernel: Kernel,
    pub surface: &'a S,
    pub resolver: Resolver<'a>,
    pub direct: Direct<'a>,
    pub bounce: Bounce,
    pub holes: Option<Holes<'a, S>>,
    pub set: EffectSet,
    /// Whether anything lets light through, other than by holes.
    pub lets_pass: LetsPass,
}

/// What kinds of light some surface lets through on the straight way to where it was looked for from.
#[derive(Clone, Copy, Debug, Default)]
pub struct LetsPass {
    /// That of points, which bends nowhere: see [`World`]'s `passing`.
    pub points: bool,
    /// All other light.
    pub wide: bool,
}

/// What a wave's work is kept in.
#[derive(Debug, Default)]
pub struct Waves {
    pub tracer: Tracer,
    pub tallies: Tallies,
    /// Camera rays.
    pub camera: Tally,
    queues: [Queues; 2],
    rays: Vec<Ray>,
    pub hits: Vec<Hit>,
    pub lights: Vec<LightRay>,
    light_rays: Vec<Ray>,
    occluded: Vec<bool>,
    asked: Vec<usize>,
    pub clock: Clock,
    /// Which hits are timed.
    pub pace: Pace,
    /// The pixels and effects of all rays and uses, if they are to be counted.
    pub counted: Vec<(u16, Effect)>,
    /// Whether they are.
    pub counts: bool,
}

impl Waves {
    /// Empty, with what has been learnt before about kernels. With `counts`, rays and uses are counted pixel by pixel.
    pub fn new(learnt: Dispatch, counts: bool) -> Self {
        Self { tracer: Tracer::new(learnt), clock: Clock::calibrated(), counts, ..Self::default() }
    }
}

/// The layers that a ray to a light goes through at most: what is behind more is dark.
const LAYERS: usize = 32;

/// The first hits of a pixel's first sample: how far away, and the unit normal on the eye's side.
pub type Seen = Vec<Option<(f32, Vec3)>>;

impl<S: Surface> World<'_, S> {
    /// Traces paths from the camera and all that follows from them, and adds each pixel's light to `sums`. `seen`
    /// is filled in for those pixels if it is given.
    pub fn run(
        &self,
        waves: &mut Waves,
        camera: &mut Vec<Path>,
        sequence: impl Fn(u16) -> Sequence,
        sums: &mut [Vec3],
        mut seen: Option<&mut Seen>,
    ) {
        std::mem::swap(waves.queues[0].of(Way::Camera), camera);
        let mut now = 0;
        while !waves.queues[now].is_empty() {
            for way in Way::ALL {
                let mut paths = std::mem::take(waves.queues[now].of(way));
                if !paths.is_empty() {
                    self.trace(waves, way, &paths);
                    let mut next = std::mem::take(&mut waves.queues[1 - now]);
                    let start = Instant::now();
                    self.shade(waves, &paths, &sequence, sums, &mut next, seen.as_deref_mut());
                    waves.tallies.shading += start.elapsed();
                    waves.queues[1 - now] = next;
                    self.light(waves, sums);
                }
                paths.clear();
                *waves.queues[now].of(way) = paths;
                seen = None;
            }
            now = 1 - now;
        }
        std::mem::swap(waves.queues[0].of(Way::Camera), camera);
    }

    /// Finds what the paths' rays hit.
    fn trace(&self, waves: &mut Waves, way: Way, paths: &[Path]) {
        let start = Instant::now();
        waves.rays.clear();
        waves.rays.extend(paths.iter().map(|path| path.ray));
        waves.hits.clear();
        waves.hits.resize(paths.len(), Hit::MISS);
        waves.tracer.intersect(self.accel, self.kernel, way, &waves.rays, &mut waves.hits);
        let (rays, time) = (paths.len() as u64, start.elapsed());
        if let (true, Some(effect)) = (waves.counts, way.effect()) {
            waves.counted.extend(paths.iter().map(|path| (path.pixel, effect)));
        }
        match way.effect() {
            Some(effect) => waves.tallies.add(effect, rays, time),
            None => waves.camera += Tally { rays, time },
        }
        if let Some(holes) = &self.holes {
            let start = Instant::now();
            let surfaces = self.surface.reader();
            waves.asked.clear();
            waves.asked.extend((0..paths.len()).filter(|&i| {
                let Hit { u, v, primitive, .. } = waves.hits[i];
                waves.hits[i].is_hit() && !holes.is_there_for(&surfaces, primitive, u, v)
            }));
            drop(surfaces);
            if waves.counts {
                waves.counted.extend(waves.asked.iter().map(|&i| (paths[i].pixel, Effect::CutOuts)));
            }
            let Waves { tracer, rays, hits, asked, .. } = waves;
            tracer.intersect_sifted(self.accel, holes, rays, hits, asked);
            waves.tallies.add(Effect::CutOuts, waves.asked.len() as u64, start.elapsed());
        }
    }

    /// Adds the light that nothing is in the way of.
    fn light(&self, waves: &mut Waves, sums: &mut [Vec3]) {
        if waves.lights.is_empty() {
            return;
        }
        if waves.counts {
            waves.counted.extend(waves.lights.iter().map(|light| (light.pixel, light.effect)));
        }
        waves.occluded.clear();
        waves.occluded.resize(waves.lights.len(), false);
        const KINDS: [Effect; 4] =
            [Effect::Shadows, Effect::SoftShadows, Effect::Environment, Effect::AmbientOcclusion];
        for effect in KINDS {
            waves.asked.clear();
            waves.asked.extend((0..waves.lights.len()).filter(|&i| waves.lights[i].effect == effect));
            if waves.asked.is_empty() {
                continue;
            }
            let start = Instant::now();
            waves.light_rays.clear();
            waves.light_rays.extend(waves.asked.iter().map(|&i| waves.lights[i].ray));
            waves.tracer.occluded(
                self.accel,
                self.kernel,
                effect,
                &waves.light_rays,
                &waves.asked,
                &mut waves.occluded,
            );
            waves.tallies.add(effect, waves.asked.len() as u64, start.elapsed());
        }
        self.see_through(waves);
        for (light, occluded) in waves.lights.iter().zip(&waves.occluded) {
            if !occluded {
                sums[light.pixel as usize] += light.light;
            }
        }
    }

    /// Looks again at the light that something is in the way of: it may have holes, or let light through.
    fn see_through(&self, waves: &mut Waves) {
        let LetsPass { points, wide } = self.lets_pass;
        let effect = match &self.holes {
            Some(_) if !points => Effect::CutOuts,
            None if !points => return,
            _ if self.set.has(Effect::Transparency) => Effect::Transparency,
            _ => Effect::Refraction,
        };
        let start = Instant::now();
        let Waves { tracer, lights, occluded, rays, hits, asked, tallies, counted, counts, .. } = waves;
        let may_pass = |light: &LightRay| match light.effect {
            _ if self.holes.is_some() => true,
            Effect::Shadows | Effect::AmbientOcclusion => points,
            _ => wide,
        };
        asked.clear();
        asked.extend((0..lights.len()).filter(|&i| occluded[i] && may_pass(&lights[i])));
        let mut cast = 0;
        if let (Some(holes), Effect::CutOuts) = (&self.holes, effect) {
            cast += asked.len() as u64;
            if *counts {
                counted.extend(asked.iter().map(|&i| (lights[i].pixel, effect)));
            }
            tracer.occluded_sifted(self.accel, holes, lights, asked, occluded);
        } else {
            // Layer by layer, each taking its part of the light.
            for _ in 0..LAYERS {
                if asked.is_empty() {
                    break;
                }
                rays.clear();
                rays.extend(asked.iter().map(|&i| lights[i].ray));
                hits.clear();
                hits.resize(rays.len(), Hit::MISS);
                tracer.intersect(self.accel, self.kernel, Way::Through, rays, hits);
                cast += rays.len() as u64;
                if *counts {
                    counted.extend(asked.iter().map(|&i| (lights[i].pixel, effect)));
                }
                let surfaces = self.surface.reader();
                let mut place = 0;
                asked.retain(|&i| {
                    let hit = hits[place];
                    place += 1;
                    let light = &mut lights[i];
                    if !hit.is_hit() {
                        occluded[i] = false;
                        return false;
                    }
                    light.light *= self.passing(&surfaces, light, &hit);
                    light.ray.tnear = hit.t.next_up();
                    light.light.max_element() > 0.0
                });
            }
        }
        tallies.add(effect, cast, start.elapsed());
    }

    /// The part of the light that goes straight through a surface. What bends light is taken to let that of points
    /// pass unbent, which no path would ever find behind it; other light is found by the paths that are bent.
    fn passing(&self, surfaces: &impl Look, light: &LightRay, hit: &Hit) -> Vec3 {
        if let Some(holes) = &self.holes
            && !holes.is_there_for(surfaces, hit.primitive, hit.u, hit.v)
        {
            return Vec3::ONE;
        }
        let (material, opacity) = self.resolver.opacity(surfaces, hit);
        let passes =
            material.ior == 1.0 || matches!(light.effect, Effect::Shadows | Effect::AmbientOcclusion);
        let gone_through =
            if passes && self.set.has(Effect::Refraction) { material.transmission } else { Vec3::ZERO };
        Vec3::splat(1.0 - opacity) + gone_through * opacity
    }
}
