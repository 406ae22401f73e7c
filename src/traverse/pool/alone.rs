//! One ray through the pools, with nobody else in flight.
//!
//! At each node and at each chunk it looks at what it would in a [stream](super), but nobody has other work to do while a step
//! waits for the one before it. So all that it knows of itself stays in registers, and it goes on by branches where a stream
//! goes on by arithmetic: a processor that foresees which way a ray takes has the next node at work before the mask of this one is known.
//! Where one box alone is entered, as at most nodes, there is nothing to be put in order, nor on a stack.
//!
//! Where several are, what is in the nearest one comes next, and what is in the second nearest *at the same time*, if that is a node: neither
//! asks anything of the other. (Hardly any of that is for nothing, as nearly all that is put on a stack is visited in the end.) A
//! chunk is fetched.
//!
//! In the end the mode's own test is asked of the one or two triangles that are left on the ray's list, one by one. Figures are in
//! `docs/incoherent.md`.

use super::answers::OfFlights;
use super::list::{List, Looking};
use super::step::{Met, Spread, cross, in_order, meet, spread, thick};
use super::ways::{Ways, look};
use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::Pooled;
use crate::geometry::{Aabb, Ray};
use crate::kdtree::{Boxes, Chunk, Pools, Tree, Way};
use crate::simd::{Eight, Lanes, Mask, Simd};
use crate::traverse::range::{LEAST, LIMIT};
use crate::traverse::records::Resident;
use crate::traverse::stream::step::{IN_PAIRS, Waiting, eight};
use crate::traverse::walk::{FLATTEST, MARGIN};

/// Traces a ray, and gives an answer for ray 0.
#[inline(always)]
pub fn trace<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    ray: &Ray,
    waiting: &mut Waiting,
    answers: &mut A,
) {
    let Resident { tree, records } = *resident;
    let slabs = if tree.scale().is_none() { ready::<S>(ray, tree.bounds()) } else { None };
    let Some(slabs) = slabs else { return answers.odd::<M>(resident, 0, ray) };
    let [origin, direction] = fours(ray);
    let mut list = List::NONE;
    let mut walk = Walk::<S, M> {
        resident,
        ways: Ways::new(pools),
        ray,
        slabs,
        pooled: Pooled::new(origin, direction),
        tfar: f32::MAX.min(ray.tfar),
        list: &mut list,
        waiting,
        top: 0,
    };
    if walk.all::<A>() {
        answers.hits(0);
    } else if walk.list.is_empty() {
        answers.missed(0);
    } else {
        let test = walk.pooled.test::<M>(ray);
        answers.decide::<M>(resident, 0, walk.list.nearest::<M>(&test, records, ray, walk.tfar));
    }
}

/// A ray's origin and `tnear`, and its direction and `tfar`.
#[inline(always)]
fn fours(ray: &Ray) -> &[[f32; 4]; 2] {
    bytemuck::cast_ref(ray)
}

/// A ray as boxes see it, unless its numbers lie near the ends of the floats' range; a NaN anywhere does. It is what
/// [`Ready`](crate::traverse::ready::Ready) makes of it, with coordinates side by side.
#[inline(always)]
fn ready<S: Simd>(ray: &Ray, bounds: &Aabb) -> Option<Spread<S::F8>> {
    let [from, along] = fours(ray);
    let (origin, direction) = (S::F4::load(from), S::F4::load(along));
    let speed = direction.abs();
    let longest = greater(along[0].abs(), greater(along[1].abs(), along[2].abs()));
    // What is compared with a NaN is not ordinary. (The fourth numbers are the ray's ends.)
    let ordinary = speed.lt(S::F4::splat(LIMIT)) & origin.abs().le(S::F4::splat(f32::MAX));
    if !(ordinary.bits() & 0b111 == 0b111 && LEAST <= longest && ray.tnear <= ray.tfar) {
        return None;
    }
    let inverse = S::F4::splat(1.0) / S::F4::splat(longest * FLATTEST).max(speed).copysign(direction);
    let mut reach = 0.0;
    for axis in 0..3 {
        let to_low = (bounds.min[axis] - from[axis]).abs();
        let to_high = (bounds.max[axis] - from[axis]).abs();
        reach = greater(greater(to_low, to_high), reach);
    }
    let margin = S::F4::splat(reach * MARGIN) * inverse.abs();
    let [near, far] = thick(origin, inverse, margin);
    let octant = inverse.lt(S::F4::splat(0.0)).bits() & 0b111;
    let [inverse, near, far] = [inverse.store(), near.store(), far.store()];
    Some(Spread {
        inverse: spread(&inverse),
        near: spread(&near),
        far: spread(&far),
        octant: octant as usize,
    })
}

/// The greater of two numbers. (The standard library's takes three instructions, to be right of NaNs.)
#[inline(always)]
fn greater(a: f32, b: f32) -> f32 {
    Lanes::<1>::max(a, b)
}

/// A ray on its way.
struct Walk<'a, 'b, S: Simd, M: Mode> {
    resident: &'a Resident<'b, M::Record>,
    ways: Ways<'a>,
    ray: &'a Ray,
    slabs: Spread<S::F8>,
    pooled: Pooled,
    /// What a hit must not lie beyond: where the nearest of those that are certain lies at the latest, or the ray's end.
    tfar: f32,
    /// What it may hit.
    list: &'a mut List,
    waiting: &'a mut Waiting,
    /// The top of its stack, which is empty at 0.
    top: usize,
}

impl<S: Simd, M: Mode> Walk<'_, '_, S, M> {
    /// Goes all the way, and lists what may be hit. Says whether anything is for certain, where that is enough.
    #[inline(always)]
    fn all<A: OfFlights>(&mut self) -> bool {
        // The root is a node.
        let mut next = self.go_through::<A>(Way::ROOT);
        loop {
            let Some(way) = next.or_else(
                #[inline(always)]
                || self.take::<A>(),
            ) else {
                return false;
            };
            if !way.is_pool() {
                next = self.go_through::<A>(way);
                continue;
            }
            let chunk = Chunk::at(self.ways.words, way.word());
            if self.look_at::<A>(chunk) {
                return true;
            }
            next = Some(way.further(chunk.next())).filter(|_| chunk.next() != 0);
        }
    }

    /// Takes what is nearest off the stack.
    #[inline(always)]
    fn take<A: OfFlights>(&mut self) -> Option<Way> {
        while self.top > 0 {
            let top = self.top;
            self.top -= 1;
            if A::ANY || self.waiting.tmin[top] <= self.tfar {
                return Some(Way(self.waiting.exits[top]));
            }
        }
        None
    }

    /// Looks at a chunk. Says whether anything is hit for certain, where that is enough.
    #[inline(always)]
    fn look_at<A: OfFlights>(&mut self, chunk: Chunk<'_>) -> bool {
        let mut looking = Looking::<true>::new(self.list, self.tfar, A::ANY);
        look::<S::F16, M, true>(&self.pooled, chunk, self.ray.tnear, &mut looking);
        let Looking { possible, certain, tfar, .. } = looking;
        if A::ANY && certain {
            return true;
        }
        if possible {
            self.tfar = tfar;
            self.list.fetch_last(self.resident.tree.triangles());
            if self.list.is_full() {
                self.tfar = self.list.settle::<M>(self.resident.records, self.ray, tfar);
            }
        }
        false
    }

    /// Goes through a node, and puts on the stack what is behind the nearest box. The way to what is in that, if any is entered.
    #[inline(always)]
    fn go_through<A: OfFlights>(&mut self, way: Way) -> Option<Way> {
        let node = &self.ways.nodes[way.node()];
        let crossed = self.cross(node);
        let bits = crossed[0].le(crossed[1]).bits() & 0xff;
        if bits == 0 {
            return None;
        }
        let behind = bits & (bits - 1);
        if behind == 0 {
            return Some(Way(node.ways[bits.trailing_zeros() as usize & 7]));
        }
        if A::ANY {
            // Whichever comes first.
            S::F8::ids_compact(S::F8::ids_load(&node.ways), behind, self.free_ways());
            self.top += behind.count_ones() as usize;
            self.second::<A>(Way(node.ways[(behind | 1).ilog2() as usize & 7]));
            return Some(Way(node.ways[bits.trailing_zeros() as usize & 7]));
        }
        let Met { ways, enters, nibbles, bits } = in_order(node, self.slabs.octant, crossed);
        let way_of = |lane: u32| Way(node.ways[(nibbles >> (4 * lane)) as usize & 7]);
        let nearest = (bits | 1).ilog2();
        let behind = bits ^ 1 << nearest;
        S::F8::ids_compact(ways, behind, self.free_ways());
        enters.compact(behind, eight(&mut self.waiting.tmin, self.top + 1));
        self.top += behind.count_ones() as usize;
        self.second::<A>(way_of((behind | 1).ilog2()));
        Some(way_of(nearest))
    }

    /// Goes through the node that is on top of the stack, whose way this is, and puts there what is in it. What is no node, or is there
    /// when much waits already, stays and is fetched.
    #[inline(always)]
    fn second<A: OfFlights>(&mut self, way: Way) {
        if way.is_pool() || self.top > IN_PAIRS {
            self.ways.fetch(way.0);
            return;
        }
        let node = &self.ways.nodes[way.node()];
        let [tnear, tfar] = [S::F8::splat(self.ray.tnear), S::F8::splat(self.tfar)];
        let met = meet(node, &self.slabs, tnear, tfar, A::ANY);
        self.top += met.put(self.waiting, self.top, A::ANY);
        self.top -= 1;
    }

    #[inline(always)]
    fn cross(&self, node: &Boxes) -> [S::F8; 2] {
        cross(node, &self.slabs, S::F8::splat(self.ray.tnear), S::F8::splat(self.tfar))
    }

    /// Room for eight ways on the stack.
    #[inline(always)]
    fn free_ways(&mut self) -> &mut [i32; 8] {
        eight(&mut self.waiting.exits, self.top + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Accuracy, Hit};
    use crate::kdtree::BuildParams;
    use crate::mesh::Mesh;
    use crate::simd::Isa;
    use crate::traverse::Accel;
    use crate::weyl::uniform;
    use glam::Vec3;

    /// Needles from one side of a cube to the other, every way, so that boxes around some of them overlap most others.
    fn needles(count: u32) -> Mesh {
        let mut number = uniform(-1.0, 1.0);
        let mut positions = Vec::new();
        for needle in 0..count {
            let axis = needle as usize % 3;
            let (mut from, mut to) =
                (Vec3::new(number(), number(), number()), Vec3::new(number(), number(), number()));
            (from[axis], to[axis]) = (-1.0, 1.0);
            positions.extend([from, to, to + 0.004 * Vec3::new(number(), number(), number())]);
        }
        let triangles = (0..count).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        Mesh { positions, triangles, ..Mesh::default() }
    }

    #[test]
    fn however_much_waits_for_a_ray_it_hits_what_packets_do() {
        let accel = Accel::build(&needles(3000), &BuildParams::default()).expect("needles have a tree");
        let mut number = uniform(-1.0, 1.0);
        let mut ray = || {
            let origin = 2.0 * Vec3::new(number(), number(), number());
            Ray::new(origin, Vec3::new(number(), number(), number()) - origin)
        };
        let rays: Vec<Ray> = (0..400).map(|_| ray()).collect();
        for (isa, accuracy) in
            Isa::available().into_iter().flat_map(|isa| [(isa, Accuracy::Watertight), (isa, Accuracy::Exact)])
        {
            let accel = accel.clone().with_isa(isa).with_accuracy(accuracy);
            let plain: Vec<(Hit, bool)> =
                rays.iter().map(|ray| (accel.intersect(ray), accel.occluded(ray))).collect();
            assert!((50..350).contains(&plain.iter().filter(|(hit, _)| hit.is_hit()).count()));
            accel.make_pools().expect("all is in memory");
            for (ray, plain) in rays.iter().zip(plain) {
                assert_eq!((accel.intersect(ray), accel.occluded(ray)), plain, "{isa}, {accuracy}, {ray:?}");
            }
        }
    }
}
