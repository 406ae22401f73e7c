//! One ray through the pools, with nobody else in flight.
//!
//! At each node and at each chunk it looks at what it would in a [stream](super), but nobody has other work to do while a step
//! waits for the one before it. So all that it knows of itself stays in registers, and it goes on by branches where a stream
//! goes on by arithmetic: a processor that foresees which way a ray takes has the next node at work before the mask of this one is known.
//! Where one box alone is entered, as at a quarter to seven tenths of the nodes, there is nothing to be put in order, nor on a stack.
//!
//! Where several are, what is in the nearest one comes next, and what is in the second nearest *at the same time*, if that is a node: neither
//! asks anything of the other. (Hardly any of that is for nothing, as nearly all that is put on a stack is visited in the end.) A
//! chunk is fetched.
//!
//! In the end the mode's own test is asked of the one or two triangles that are left on the ray's list, one by one. Figures are in
//! `docs/incoherent.md`.

use super::answers::OfFlights;
use super::list::{List, Looking};
use super::prepared::Prepared;
use super::step::{Met, Spread, cross, meet};
use super::ways::{Ways, look};
use crate::geometry::Ray;
use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::Pooled;
use crate::kdtree::{Chunk, Pools, Tree, Way};
use crate::simd::{Lanes, Mask, Simd};
use crate::traverse::records::Resident;
use crate::traverse::stream::step::{IN_PAIRS, Waiting};
use std::hint::black_box;

/// Traces a ray, and gives an answer for ray 0.
#[inline(always)]
pub fn trace<S: Simd, M: Mode, A: OfFlights>(
    resident: &Resident<'_, M::Record>,
    pools: &Pools,
    ray: &Ray,
    waiting: &mut Waiting,
    list: &mut List,
    answers: &mut A,
) {
    let prepared = if resident.tree.scale().is_none() { Prepared::new(ray, pools.corners()) } else { None };
    let Some(Prepared { slabs, pooled, tfar }) = prepared else { return answers.odd::<M>(resident, 0, ray) };
    list.clear();
    let mut walk = Walk::<S, M> {
        resident,
        ways: Ways::new(pools),
        ray,
        slabs,
        pooled: &pooled,
        tfar,
        list,
        waiting,
        top: 0,
    };
    if walk.all::<A>() {
        answers.hits(0);
    } else if walk.list.is_empty() {
        answers.missed(0);
    } else {
        let test = pooled.test::<M>(ray);
        let nearest = walk.list.nearest::<M>(&test, resident.records, ray, walk.tfar);
        answers.decide::<M>(resident, 0, nearest);
    }
}

/// A ray on its way.
struct Walk<'a, 'b, S: Simd, M: Mode> {
    resident: &'a Resident<'b, M::Record>,
    ways: Ways<'a>,
    ray: &'a Ray,
    slabs: Spread<S::F8>,
    /// (In a place of its own: see [`look_at`](Self::look_at).)
    pooled: &'a Pooled,
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
        // What is the same for all chunks would be spread over registers before the first node. Where those are few, it is only spilled
        // there, and rays that any hit will do for come to few chunks.
        let pooled = if A::ANY && S::NATIVE == 8 { black_box(self.pooled) } else { self.pooled };
        let mut looking = Looking::<true>::new(self.list, self.tfar, A::ANY);
        look::<S::F16, M, true>(pooled, chunk, self.ray.tnear, &mut looking);
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

    /// Goes through a node, and puts on the stack what is behind the nearest box, or behind any, if any hit will do. The way to what is in
    /// that, if any is entered.
    #[inline(always)]
    fn go_through<A: OfFlights>(&mut self, way: Way) -> Option<Way> {
        let node = &self.ways.nodes[way.node()];
        let [tnear, tfar] = self.ends();
        let crossed = cross(node, &self.slabs, tnear, tfar);
        let entered = crossed[0].le(crossed[1]).bits() & 0xff;
        if entered == 0 {
            return None;
        }
        if entered.is_power_of_two() {
            return Some(Way(node.ways[entered.trailing_zeros() as usize & 7]));
        }
        let mut met = Met::new(node, self.slabs.octant, crossed, A::ANY);
        // (Of those that are in no order, the first is as good as any.)
        let nearest = if A::ANY { met.bits.trailing_zeros() } else { met.last() };
        met.bits ^= 1 << nearest;
        self.top += met.put(self.waiting, self.top + 1, A::ANY);
        self.second::<A>(met.way(node, met.last(), A::ANY));
        Some(met.way(node, nearest, A::ANY))
    }

    /// Goes through the node that is on top of the stack, whose way this is, and puts there what is in it. What is no node, or is there
    /// when much waits already, stays and is fetched.
    #[inline(always)]
    fn second<A: OfFlights>(&mut self, way: Way) {
        if way.is_pool() || self.top > IN_PAIRS {
            self.ways.fetch(way.0);
            return;
        }
        let [tnear, tfar] = self.ends();
        let met = meet(&self.ways.nodes[way.node()], &self.slabs, tnear, tfar, A::ANY);
        self.top += met.put(self.waiting, self.top, A::ANY);
        self.top -= 1;
    }

    /// Its ends, in all lanes.
    #[inline(always)]
    fn ends(&self) -> [S::F8; 2] {
        [S::F8::splat(self.ray.tnear), S::F8::splat(self.tfar)]
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
