//! What every ray-triangle test is to a traversal kernel.

use super::{Accuracy, Placed, Triangle};
use crate::geometry::Ray;
use crate::simd::{Eight, Lanes};

/// Three coordinates, `W` lanes each.
pub type Lanes3<L> = [L; 3];

/// `W` rays prepared for being tested against triangles.
///
/// What a lane answers depends on that lane's ray and the triangle alone, not on the other lanes,
/// the width or the instruction set: kernels that walk differently agree bit for bit.
pub trait Test<const W: usize, L: Lanes<W>>: Copy {
    /// What is kept of each triangle for this test.
    type Record;
    /// What is kept, beside their slopes, of rays that start at one point and whose directions are greatest along one axis, to
    /// be prepared again in no time.
    type Kept: Copy + Default;
    /// What is kept of a hit's weights: they themselves, or nothing if [`test_placed`](Self::test_placed) gives none, for
    /// [`weigh`](Self::weigh) to be asked for them in the end.
    type Weights: Weights<W, L>;

    /// Prepares `W` rays. `active` has a bit for each lane that matters.
    fn new(origin: &Lanes3<L>, direction: &Lanes3<L>, active: u32) -> Self;

    /// What to keep of rays whose directions are greatest along an axis: `along` is what they are there.
    fn keep(along: L) -> Self::Kept;

    /// What [`new`](Self::new) gives for rays that start at `apex`, of which something was kept. `slopes` are the quotients of
    /// the directions' other two coordinates, renamed as `RENAMED` says, and the one along `axis`.
    fn revive(kept: &Self::Kept, slopes: [L; 2], apex: &[f32; 3], direction: &Lanes3<L>, axis: usize)
    -> Self;

    /// One triangle against the lanes in `lanes`; what the others answer means nothing.
    ///
    /// Edges and corners belong to the triangle. A triangle seen exactly edge-on, or with equal
    /// corners, or with a NaN in it, is never hit. Nor is one whose corners lie on a line, but for
    /// the watertight test, which sees corners moved by roundings: there such a triangle fills the
    /// gap that so opens between its neighbours.
    fn test(&self, triangle: &Self::Record, lanes: L::Mask) -> Candidate<W, L>;

    /// The lanes in `lanes` that [`test`](Self::test) may say to be inside: all that are, and few others. No branch
    /// depends on what they do.
    fn sift(&self, triangle: &Self::Record, lanes: L::Mask) -> L::Mask;

    /// What [`test`](Self::test) answers of the triangle `which` of those in `placed`, to the bit, if that can be
    /// told from what was kept of rays from the apex that they were prepared for, and from the rays' slopes and directions,
    /// renamed likewise. `None` if not. What is said of lanes that are not in `lanes` means nothing.
    #[inline(always)]
    fn test_placed(
        _kept: &Self::Kept,
        _slopes: [L; 2],
        _direction: &Lanes3<L>,
        _placed: &Placed,
        _which: usize,
        _lanes: L::Mask,
    ) -> Option<Candidate<W, L>> {
        None
    }

    /// The weights that [`test`](Self::test) gives for the lanes in `lanes`, all of which hit the triangle.
    #[inline(always)]
    fn weigh(&self, triangle: &Self::Record, lanes: L::Mask) -> [L; 2] {
        let candidate = self.test(triangle, lanes);
        [candidate.u, candidate.v]
    }

    /// The barycentric weights `(u, v)` of the triangle's second and third corner, from those that
    /// `test` gave: a record may hold the corners in another order.
    #[inline(always)]
    fn weights(_triangle: &Self::Record, u: L, v: L) -> [L; 2] {
        [u, v]
    }
}

/// What is kept of a hit's weights.
pub trait Weights<const W: usize, L: Lanes<W>>: Copy {
    /// Whether they are kept.
    const ARE_KEPT: bool;

    /// What is kept of them.
    fn of(weights: [L; 2]) -> Self;

    /// The weights, if they are kept; zeros if not.
    fn get(self) -> [L; 2];
}

impl<const W: usize, L: Lanes<W>> Weights<W, L> for [L; 2] {
    const ARE_KEPT: bool = true;

    #[inline(always)]
    fn of(weights: [L; 2]) -> Self {
        weights
    }

    #[inline(always)]
    fn get(self) -> [L; 2] {
        self
    }
}

impl<const W: usize, L: Lanes<W>> Weights<W, L> for () {
    const ARE_KEPT: bool = false;

    #[inline(always)]
    fn of(_: [L; 2]) {}

    #[inline(always)]
    fn get(self) -> [L; 2] {
        [L::splat(0.0); 2]
    }
}

/// One ray prepared for being tested against many triangles at once.
pub trait Alone: Test<1, f32> {
    /// Eight triangles against the ray: which of them it hits with a `t` from `tnear` to `tfar`. What is found
    /// is what [`test`](Test::test) finds, to the bit.
    fn find<L: Eight>(&self, triangles: &[&Self::Record; 8], tnear: f32, tfar: f32) -> Finds<L>;
}

/// What a ray finds of eight triangles, a lane each. (Weights are for [`weigh`](Test::weigh) to say, of the hit that counts
/// in the end.)
pub struct Finds<L: Eight> {
    /// Triangles that are hit.
    pub hits: L::Mask,
    /// The ray's parameter, in the lanes of `hits`.
    pub t: L,
    /// A bit for each triangle of which [`test`](Test::test) has yet to say whether it is hit. None is in `hits`.
    pub open: u32,
}

impl<L: Eight> Finds<L> {
    /// Nothing but triangles to be tested.
    #[inline(always)]
    pub(super) fn open(open: u32) -> Self {
        Self { hits: L::mask_from_bits(0), t: L::splat(0.0), open }
    }
}

/// What rays find of triangles, one of each in a lane.
pub struct Own<const W: usize, L: Lanes<W>> {
    /// A bit for each lane whose triangle is hit between its ray's ends.
    pub hits: u32,
    /// A bit for each lane of which [`test`](Test::test) has yet to say whether it is.
    pub open: u32,
    /// The ray's parameter, as [`test`](Test::test) gives it, in the lanes of `hits`.
    pub t: L,
    /// The barycentric weight of the second corner, likewise.
    pub u: L,
    /// That of the third.
    pub v: L,
}

/// The lanes of a packet that may have hit a triangle.
pub struct Candidate<const W: usize, L: Lanes<W>> {
    /// Lanes in which the line meets the triangle: `t` is not compared with anything yet.
    pub inside: L::Mask,
    /// The ray's parameter.
    pub t: L,
    /// Barycentric weight of the record's second corner.
    pub u: L,
    /// Barycentric weight of the record's third corner.
    pub v: L,
}

impl<const W: usize, L: Lanes<W>> Candidate<W, L> {
    /// None in `inside`, whose lanes are all clear.
    #[inline(always)]
    pub(super) fn none(inside: L::Mask) -> Self {
        let zero = L::splat(0.0);
        Self { inside, t: zero, u: zero, v: zero }
    }
}

/// A test for every width: what a kernel is compiled for.
pub trait Mode {
    /// Its name.
    const ACCURACY: Accuracy;
    /// Whether its test says of every ray that passes the edges by more than the error bounds of
    /// [`Placed`] on which side it does, and finds nothing ahead of one that [leaves](super::leave) a triangle behind.
    const SURE: bool;
    /// Whether signs of edge functions that are not zero decide.
    const SIGNS: bool;
    /// What is kept of each triangle.
    type Record: Send + Sync;
    /// The test for `W` rays in lanes `L`.
    type Test<const W: usize, L: Lanes<W>>: Test<W, L, Record = Self::Record>;
    /// The test for one ray.
    type Alone: Alone<Record = Self::Record>;

    /// Prepares one ray.
    #[inline(always)]
    fn alone(ray: &Ray) -> Self::Alone {
        Self::Alone::new(&ray.origin.to_array(), &ray.direction.to_array(), 1)
    }

    /// Each lane's ray against a triangle of its own, from `tnear` to `tfar`: the numbers of a [`Triangle`] in
    /// lanes, three corners and the plane.
    #[inline(always)]
    fn meet_own<const W: usize, L: Lanes<W>>(
        _test: &Self::Test<W, L>,
        _triangles: &[Lanes3<L>; 4],
        _tnear: L,
        _tfar: L,
    ) -> Own<W, L> {
        let zero = L::splat(0.0);
        Own { hits: 0, open: u32::MAX, t: zero, u: zero, v: zero }
    }
}

/// [`Accuracy::Fast`] as a type.
#[derive(Clone, Copy, Debug)]
pub struct Fast;

/// [`Accuracy::Watertight`] as a type.
#[derive(Clone, Copy, Debug)]
pub struct Watertight;

/// [`Accuracy::Exact`] as a type.
#[derive(Clone, Copy, Debug)]
pub struct Exact;

impl Mode for Fast {
    const ACCURACY: Accuracy = Accuracy::Fast;
    const SURE: bool = false;
    const SIGNS: bool = false;
    type Record = super::fast::Projected;
    type Test<const W: usize, L: Lanes<W>> = super::fast::Lines<W, L>;
    type Alone = super::fast::Lines<1, f32>;
}

impl Mode for Watertight {
    const ACCURACY: Accuracy = Accuracy::Watertight;
    const SURE: bool = true;
    const SIGNS: bool = true;
    type Record = Triangle;
    type Test<const W: usize, L: Lanes<W>> = super::watertight::Shear<W, L>;
    type Alone = super::watertight::Shear<1, f32>;

    #[inline(always)]
    fn meet_own<const W: usize, L: Lanes<W>>(
        test: &Self::Test<W, L>,
        triangles: &[Lanes3<L>; 4],
        tnear: L,
        tfar: L,
    ) -> Own<W, L> {
        test.meet_own(triangles, tnear, tfar)
    }
}

impl Mode for Exact {
    const ACCURACY: Accuracy = Accuracy::Exact;
    const SURE: bool = true;
    const SIGNS: bool = false;
    type Record = Triangle;
    type Test<const W: usize, L: Lanes<W>> = super::exact::Filter<W, L>;
    type Alone = super::exact::Filter<1, f32>;
}
