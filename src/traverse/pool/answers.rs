//! What becomes of rays that have ended.
//!
//! The triangles that they may hit wait until there are sixteen and some more, so that their records are here by then. Then each lane
//! asks the mode's test of a triangle and of the ray that may hit it, and hits are written by whole registers, where they are nearer
//! than what the same ray had before.

use super::flight::Flight;
use super::list::Nearest;
use crate::geometry::triangle::{self, Candidate, Mode, Own, Test, Triangle};
use crate::geometry::{Hit, Ray};
use crate::kdtree::{MOST, Tree};
use crate::simd::{Lanes, Simd, Sixteen, Task, prefetch_both};
use crate::traverse::records::Resident;
use crate::traverse::source::Source;
use crate::traverse::stream::{Answers, Any, Closest, OneByOne};
use std::marker::PhantomData;

/// Triangles that wait, and the ray of each.
pub struct Pairs {
    rays: [i32; ROOM + 2 * MOST],
    primitives: [i32; ROOM + 2 * MOST],
    count: usize,
}

/// How many wait before some are answered.
const ROOM: usize = 24;

impl Pairs {
    pub const NONE: Self = Self { rays: [0; ROOM + 2 * MOST], primitives: [0; ROOM + 2 * MOST], count: 0 };

    /// Puts the triangles there that a ray may hit, and fetches the records of the first two.
    #[inline(always)]
    fn put_all<L: Sixteen>(&mut self, flight: &Flight, records: &[Triangle]) {
        let place = self.count.min(ROOM);
        self.rays[place..][..2 * MOST].fill(flight.ray as i32);
        let primitives = self.primitives[place..].first_chunk_mut().expect("room for a list");
        self.count = place + flight.list.write::<L>(flight.tfar, primitives);
        for primitive in &self.primitives[place..][..2] {
            prefetch_both(records.as_ptr().wrapping_add(*primitive as usize));
        }
    }

    /// Puts those of some rays and triangles there whose bits are set, and fetches their records.
    #[inline(always)]
    pub fn put<L: Sixteen>(
        &mut self,
        rays: &[i32; MOST],
        primitives: &[i32; MOST],
        bits: u32,
        records: &[Triangle],
    ) {
        let place = self.count.min(ROOM);
        let room = "room for a list";
        L::ids_compact(L::ids_load(rays), bits, self.rays[place..].first_chunk_mut().expect(room));
        let to = self.primitives[place..].first_chunk_mut().expect(room);
        L::ids_compact(L::ids_load(primitives), bits, to);
        self.count = place + bits.count_ones() as usize;
        for primitive in &self.primitives[place..self.count] {
            prefetch_both(records.as_ptr().wrapping_add(*primitive as usize));
        }
    }

    /// Takes out the first sixteen.
    #[inline(always)]
    fn shift(&mut self) {
        self.rays.copy_within(16.., 0);
        self.primitives.copy_within(16.., 0);
        self.count = self.count.saturating_sub(16);
    }
}

/// What sixteen rays find of a triangle each, and its corners.
pub struct Met16<L: Sixteen> {
    own: Own<16, L>,
    corners: [[L; 3]; 3],
}

impl<L: Sixteen> Met16<L> {
    /// The rays that hit their triangles, of the first `count` that wait.
    #[inline(always)]
    fn rays<M: Mode>(
        &self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        pairs: &Pairs,
        count: usize,
    ) -> impl Iterator<Item = usize> {
        let Own { mut hits, open, .. } = self.own;
        let mut open = open & ((1 << count) - 1);
        while open != 0 {
            let lane = open.trailing_zeros() as usize % 16;
            open &= open - 1;
            let (ray, primitive) = (rays.ray(pairs.rays[lane] as usize), pairs.primitives[lane] as u32);
            hits |= u32::from(hit_of_one::<M>(tree, &ray, primitive).is_hit()) << lane;
        }
        (0..count).filter(move |lane| hits >> lane & 1 == 1).map(|lane| pairs.rays[lane] as usize)
    }
}

/// Where the answers of rays go that may hit some triangles.
pub trait Told: Answers {
    /// A ray hits something. Where the closest hits are wanted, nobody says so.
    #[inline(always)]
    fn hits(&mut self, _ray: usize) {}

    /// Takes a hit for a ray, if it is [nearer](is_nearer) than what that had. Where any hit will do, none is offered.
    #[inline(always)]
    fn offer(&mut self, _ray: usize, _hit: &Hit) {}

    /// Takes up what rays found of a triangle each, of the first `count` that wait.
    #[inline(always)]
    fn tell<S: Simd, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        pairs: &Pairs,
        count: usize,
        found: &Met16<S::F16>,
    ) {
        if Self::ANY {
            for ray in found.rays::<M>(tree, rays, pairs, count) {
                self.hits(ray);
            }
            return;
        }
        let Met16 { own, corners: [a, b, c] } = found;
        let corners = [
            [a[0].store(), a[1].store(), a[2].store()],
            [b[0].store(), b[1].store(), b[2].store()],
            [c[0].store(), c[1].store(), c[2].store()],
        ];
        let [x, y, z] = triangle::normals(&corners);
        let zero = S::F16::splat(0.0);
        // A zero is given out without a sign.
        let numbers = S::F16::fours(&[own.t + zero, own.u + zero, own.v + zero, zero]);
        let present = (1 << count) - 1;
        let mut hits = own.hits & present;
        while hits != 0 {
            let lane = hits.trailing_zeros() as usize % 16;
            hits &= hits - 1;
            let [t, u, v, _] = numbers[lane];
            let (primitive, normal) = (pairs.primitives[lane] as u32, [x[lane], y[lane], z[lane]].into());
            self.offer(pairs.rays[lane] as usize, &Hit { t, u, v, primitive, normal });
        }
        let mut open = own.open & present;
        while open != 0 {
            let lane = open.trailing_zeros() as usize % 16;
            open &= open - 1;
            let ray = pairs.rays[lane] as usize;
            self.offer(ray, &hit_of_one::<M>(tree, &rays.ray(ray), pairs.primitives[lane] as u32));
        }
    }

    /// Answers the first sixteen that wait.
    #[inline(always)]
    fn answer<S: Simd, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        pairs: &mut Pairs,
    ) {
        let triangles = tree.tree.triangles();
        let nowhere = &[0.0; 4];
        let mut fours = [[nowhere; 16]; 3];
        for lane in 0..16 {
            let [a, b, c] = triangles[pairs.primitives[lane] as usize].fours();
            (fours[0][lane], fours[1][lane], fours[2][lane]) = (a, b, c);
        }
        let first = pairs.rays.first_chunk().expect("room for more than sixteen");
        let [[ox, oy, oz, tnear], [dx, dy, dz, tfar]] = rays.in_places::<S::F16>(first);
        let [ax, ay, az, bx] = S::F16::of_fours(&fours[0]);
        let [by, bz, cx, cy] = S::F16::of_fours(&fours[1]);
        let [cz, nx, ny, nz] = S::F16::of_fours(&fours[2]);
        let [a, b, c] = [[ax, ay, az], [bx, by, bz], [cx, cy, cz]];
        let test = M::Test::<16, S::F16>::new(&[ox, oy, oz], &[dx, dy, dz], 0xffff);
        let tfar = S::F16::splat(f32::MAX).min(tfar);
        let own = M::meet_own::<16, S::F16>(&test, &[a, b, c, [nx, ny, nz]], tnear, tfar);
        let found = Met16 { own, corners: [a, b, c] };
        self.tell::<S, M>(tree, rays, pairs, pairs.count.min(16), &found);
        pairs.shift();
    }

    /// Answers some, unless those that wait are few.
    #[inline(always)]
    fn answer_if_many<S: Simd, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        pairs: &mut Pairs,
    ) {
        if pairs.count > ROOM {
            S::apart(Answering::<M, Self>::until(ROOM, self, tree, rays, pairs));
        }
    }

    /// Answers all that wait.
    #[inline(always)]
    fn finish<S: Simd, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        pairs: &mut Pairs,
    ) {
        if pairs.count > 0 {
            S::apart(Answering::<M, Self>::until(0, self, tree, rays, pairs));
        }
    }
}

/// Answers until no more than `most` wait.
struct Answering<'a, M: Mode, A: ?Sized> {
    most: usize,
    answers: &'a mut A,
    tree: Resident<'a, M::Record>,
    rays: Source<'a>,
    pairs: &'a mut Pairs,
    mode: PhantomData<M>,
}

impl<'a, M: Mode, A: ?Sized> Answering<'a, M, A> {
    #[inline(always)]
    fn until(
        most: usize,
        answers: &'a mut A,
        tree: &Resident<'a, M::Record>,
        rays: Source<'a>,
        pairs: &'a mut Pairs,
    ) -> Self {
        // The tree by value: a kernel keeps it in registers.
        let tree = Resident { tree: tree.tree, records: tree.records };
        Self { most, answers, tree, rays, pairs, mode: PhantomData }
    }
}

impl<M: Mode, A: Told + ?Sized> Task for Answering<'_, M, A> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self) {
        let Self { answers, tree, rays, pairs, most, .. } = self;
        while pairs.count > most {
            // Lanes that are too many ask what the first one does.
            for place in pairs.count..16 {
                (pairs.rays[place], pairs.primitives[place]) = (pairs.rays[0], pairs.primitives[0]);
            }
            answers.answer::<S, M>(&tree, rays, pairs);
        }
    }
}

/// Where the answers of rays in flight go.
pub trait OfFlights: Told + OneByOne {
    /// A ray has ended.
    #[inline(always)]
    fn end<S: Simd, M: Mode>(
        &mut self,
        tree: &Resident<'_, M::Record>,
        rays: Source<'_>,
        flight: &Flight,
        pairs: &mut Pairs,
    ) {
        self.missed(flight.ray as usize);
        if flight.list.is_empty() {
            return;
        }
        pairs.put_all::<S::F16>(flight, tree.tree.triangles());
        self.answer_if_many::<S, M>(tree, rays, pairs);
    }

    /// Answers a ray that hits that, the nearest of what it may hit, or nothing.
    fn decide<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, ray: usize, nearest: Option<Nearest>);
}

/// Whether a hit counts in place of what was had, given by `t` and id: it is nearer, or as near and of a lower id.
#[inline(always)]
pub fn is_nearer(hit: &Hit, t: f32, primitive: u32) -> bool {
    hit.t < t || hit.t == t && hit.primitive < primitive
}

impl Told for Closest<'_> {
    #[inline(always)]
    fn offer(&mut self, ray: usize, hit: &Hit) {
        let had = &mut self.0[ray];
        if is_nearer(hit, had.t, had.primitive) {
            *had = *hit;
        }
    }
}

impl OfFlights for Closest<'_> {
    #[inline(always)]
    fn decide<M: Mode>(&mut self, tree: &Resident<'_, M::Record>, ray: usize, nearest: Option<Nearest>) {
        self.0[ray] = nearest.map_or(Hit::MISS, |(id, candidate)| hit_of::<M>(tree, id, &candidate));
    }
}

/// The hit of a ray that may hit one triangle.
#[inline(never)]
fn hit_of_one<M: Mode>(tree: &Resident<'_, M::Record>, ray: &Ray, primitive: u32) -> Hit {
    let record = &tree.records[primitive as usize];
    let test = M::alone(ray);
    let candidate = test.test(record, true);
    if !(candidate.inside && ray.tnear <= candidate.t && candidate.t <= f32::MAX.min(ray.tfar)) {
        return Hit::MISS;
    }
    hit_of::<M>(tree, primitive, &candidate)
}

/// The record of a hit that was found.
#[inline(always)]
fn hit_of<M: Mode>(tree: &Resident<'_, M::Record>, primitive: u32, candidate: &Candidate<1, f32>) -> Hit {
    let [u, v] = M::Alone::weights(&tree.records[primitive as usize], candidate.u, candidate.v);
    // A zero is given out without a sign.
    Hit {
        t: candidate.t + 0.0,
        u: u + 0.0,
        v: v + 0.0,
        primitive,
        normal: triangle::normal(tree.corners(primitive)),
    }
}

impl Told for Any<'_> {
    #[inline(always)]
    fn hits(&mut self, ray: usize) {
        self.0[ray] = true;
    }
}

impl OfFlights for Any<'_> {
    #[inline(always)]
    fn decide<M: Mode>(&mut self, _: &Resident<'_, M::Record>, ray: usize, nearest: Option<Nearest>) {
        self.0[ray] = nearest.is_some();
    }
}
