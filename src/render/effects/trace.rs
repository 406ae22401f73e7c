//! Rays to kernels: each kind to where it is quick.

use super::direct::LightRay;
use super::holes::Holes;
use super::path::Way;
use crate::geometry::{Hit, Ray};
use crate::scene::Surface;
use crate::scene::effects::Effect;
use crate::traverse::{
    Accel, Dispatch, HitPacket, Kernel, Place, RayPacket, ScatteredDispatch, SliceDispatch, give_lanes,
};

/// Rays that go to a kernel at once: as many as a wide beam holds.
const LOT: usize = Kernel::WideTile.width();

/// Traces a worker's rays, and learns which kernel is quickest for which kind of them.
#[derive(Debug, Default)]
pub struct Tracer {
    /// What was learnt about camera rays.
    camera: Dispatch,
    /// The same of rays to lights that are points or suns.
    lights: Dispatch,
    /// The same of what has much in common or nothing, as the scene has it: a flat mirror's rays do, those of a crumpled one do not.
    ways: [SliceDispatch; Way::ALL.len()],
    /// And of rays to lights that have an extent.
    wide_lights: SliceDispatch,
    /// What was learnt about rays that go everywhere: from surfaces, and to all that surrounds the scene.
    scattered: ScatteredDispatch,
    /// The same of rays that look no farther than for what dims a surface.
    near: ScatteredDispatch,
    packets: Packets,
    found: Vec<bool>,
    sifted: Vec<Ray>,
    sifted_hits: Vec<Hit>,
}

/// A lot as packets.
#[derive(Debug)]
struct Packets {
    rays: Vec<RayPacket<16>>,
    active: Vec<u32>,
    hits: Vec<HitPacket<16>>,
    occluded: Vec<u32>,
}

impl Default for Packets {
    fn default() -> Self {
        let count = LOT / 16;
        Self {
            rays: vec![RayPacket::empty(); count],
            active: vec![0; count],
            hits: vec![HitPacket::miss(); count],
            occluded: vec![0; count],
        }
    }
}

impl Packets {
    /// Takes up at most a lot of rays, and says how many packets they fill.
    fn fill(&mut self, accel: &Accel, rays: &[Ray]) -> usize {
        accel.pack(rays, &mut self.rays, &mut self.active)
    }
}

impl Tracer {
    /// With what was learnt in earlier frames about camera rays and shadow rays.
    pub fn new(learnt: Dispatch) -> Self {
        Self { camera: learnt, lights: learnt, ..Self::default() }
    }

    /// What was learnt about camera rays.
    pub fn learnt(&self) -> Dispatch {
        self.camera
    }

    /// The closest hits of rays of one kind, by the kernel named or, for beams, by whichever is quickest.
    pub fn intersect(&mut self, accel: &Accel, kernel: Kernel, way: Way, rays: &[Ray], hits: &mut [Hit]) {
        match (kernel, way) {
            (Kernel::Tile | Kernel::WideTile, Way::Diffuse) => {
                self.scattered.intersect(accel, rays, hits);
            }
            (Kernel::Tile | Kernel::WideTile, Way::Camera) => {
                for (rays, hits) in rays.chunks(LOT).zip(hits.chunks_mut(LOT)) {
                    let packets = &mut self.packets;
                    let count = packets.fill(accel, rays);
                    let found = &mut packets.hits[..count];
                    self.camera.intersect(
                        accel,
                        &[Place::NONE],
                        &packets.rays[..count],
                        &packets.active[..count],
                        found,
                    );
                    accel.unpack(found, hits);
                }
            }
            (Kernel::Tile | Kernel::WideTile, _) => {
                self.ways[way as usize].intersect(accel, rays, hits);
            }
            (kernel, _) => accel.intersect_many(kernel, rays, hits),
        }
    }

    /// Whether anything is in the way of rays that cast the shadows of `effect`; answers go to the places `to`.
    pub fn occluded(
        &mut self,
        accel: &Accel,
        kernel: Kernel,
        effect: Effect,
        rays: &[Ray],
        to: &[usize],
        occluded: &mut [bool],
    ) {
        self.found.clear();
        self.found.resize(rays.len(), false);
        if !matches!(kernel, Kernel::Tile | Kernel::WideTile) {
            accel.occluded_many(kernel, rays, &mut self.found);
        } else if effect == Effect::Environment {
            self.scattered.occluded(accel, rays, &mut self.found);
        } else if effect == Effect::AmbientOcclusion {
            self.near.occluded(accel, rays, &mut self.found);
        } else if effect == Effect::SoftShadows {
            self.wide_lights.occluded(accel, rays, &mut self.found);
        } else {
            for (rays, found) in rays.chunks(LOT).zip(self.found.chunks_mut(LOT)) {
                let packets = &mut self.packets;
                let count = packets.fill(accel, rays);
                let lanes = &mut packets.occluded[..count];
                self.lights.occluded(
                    accel,
                    &[Place::NONE],
                    &packets.rays[..count],
                    &packets.active[..count],
                    lanes,
                );
                give_lanes::<16>(lanes, found);
            }
        }
        for (&to, &found) in to.iter().zip(&self.found) {
            occluded[to] = found;
        }
    }

    /// Lets the rays at the places `asked` go on through holes, from the hits that they have on.
    pub fn intersect_sifted<S: Surface>(
        &mut self,
        accel: &Accel,
        holes: &Holes<'_, S>,
        rays: &[Ray],
        hits: &mut [Hit],
        asked: &[usize],
    ) {
        self.sifted.clear();
        self.sifted.extend(asked.iter().map(|&i| Ray { tnear: hits[i].t, ..rays[i] }));
        self.sifted_hits.clear();
        self.sifted_hits.resize(asked.len(), Hit::MISS);
        if accel.cached().is_none() {
            accel.intersect_sifted(holes, &self.sifted, &mut self.sifted_hits);
        } else {
            // Who looks at surfaces that are not all in memory traces nothing meanwhile: hit by hit, then.
            for (ray, hit) in self.sifted.iter_mut().zip(&mut self.sifted_hits) {
                *hit = first_there(accel, holes, ray);
            }
        }
        for (&i, hit) in asked.iter().zip(&self.sifted_hits) {
            hits[i] = *hit;
        }
    }

    /// Finds out of the rays to lights at the places `asked`, which something is in the way of, whether that is all
    /// holes.
    pub fn occluded_sifted<S: Surface>(
        &mut self,
        accel: &Accel,
        holes: &Holes<'_, S>,
        lights: &[LightRay],
        asked: &[usize],
        occluded: &mut [bool],
    ) {
        self.sifted.clear();
        self.sifted.extend(asked.iter().map(|&i| lights[i].ray));
        self.found.clear();
        self.found.resize(asked.len(), false);
        if accel.cached().is_none() {
            accel.occluded_sifted(holes, &self.sifted, &mut self.found);
        } else {
            for (ray, found) in self.sifted.iter_mut().zip(&mut self.found) {
                *found = first_there(accel, holes, ray).is_hit();
            }
        }
        for (&i, &found) in asked.iter().zip(&self.found) {
            occluded[i] = found;
        }
    }
}

/// The first hit that is no hole, ray by ray.
fn first_there<S: Surface>(accel: &Accel, holes: &Holes<'_, S>, ray: &mut Ray) -> Hit {
    loop {
        let hit = accel.intersect(ray);
        if !hit.is_hit() || holes.is_there_for(&holes.surface().reader(), hit.primitive, hit.u, hit.v) {
            return hit;
        }
        // The same triangle, and what coincides with it, is behind the ray from here on.
        ray.tnear = hit.t.next_up();
    }
}
