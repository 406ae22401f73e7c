//! One ray against the sixteen triangles of a pool at once, or sixteen rays against one of them.
//!
//! What is asked here is not yet whether the ray hits, and where, to the bit: that is the mode's own test to say, of the one
//! or two triangles that are left in the end. It is which triangles the ray may hit, which of them it hits for certain, and
//! between which bounds `t` lies.
//!
//! **Whether it hits.** Vertices are translated and sheared as the watertight test does it, operation by operation, each of
//! them once; corners are taken from them, and the edge functions have the same bits as that test's. A triangle with edge functions
//! of both signs is missed. One whose edge functions are of one sign, none of them zero, is hit for certain.
//!
//! **Where.** With `u = 2^-24`, `S` the sum of the magnitudes of a triangle's sheared coordinates, and `R` no less than the
//! greatest coordinate distance from the origin to a corner, sheared coordinates are off by at most `6u R` (see `likely`),
//! so each edge function is off by at most `10u R (S + 8u R)`. As no coordinate is sheared by more than the third one, `S` and
//! the greatest of the corners' third coordinates make an `R`: that is their depth times `|dz|`. (Something the scene as a whole reaches
//! farther than is of no account: in a power plant, seen from inside, most of what may be hit lies in the next few metres.)
//! `t` is the mean of the corners' depths weighted by
//! edge functions: it is off by `48u R (S + 8u R) span / |sum|` because of them, where `span` is the distance between the nearest
//! depth and the farthest, and by some `10u R / |dz|` because depths are rounded, and it is. What a test answers is off likewise:
//! by up to `30u R / (s |dz|)` for a plane that the ray meets at a speed `s` relative to the greatest component of the
//! normal (see `distance`). That component is at most `|sum| + 4 S span |dz|`, of which `s` is `|sum|`, so this is
//! `30u R / |dz| + 120u R S span / |sum|`. The bounds here allow for half as much again as both together. Where `sum` is
//! so small that this means nothing, the depths themselves are bounds: `t` is kept between them.
//!
//! All of that is in proportion to the triangle. What products lose where they underflow is not, near an origin that lies on it
//! all but for the smallest floats: each by itself that is less than `2^-149`, and the bounds allow for `TINY` more.

use super::{Shear, edges, one_sign};
use crate::geometry::Ray;
use crate::geometry::triangle::{Lanes3, Mode, RENAMED, Test};
use crate::simd::{Eight, Lanes, Mask, Sixteen};

/// `64u`, for what does not depend on the triangle.
const SLACK: f32 = 1.0 / (1 << 18) as f32;
/// `256u`, for what grows with the triangle as the ray sees it.
const BLUR: f32 = 1.0 / (1 << 16) as f32;
/// `16u`, for edge functions.
const DOUBT: f32 = 1.0 / (1 << 20) as f32;
/// What is more than any sum of products loses that underflow, times 2^29 and more.
const TINY: f32 = f32::MIN_POSITIVE * 256.0;

/// A ray as pools see it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Pooled {
    /// The origin and the shear, in renamed coordinates.
    origin: [f32; 3],
    shear: [f32; 3],
    /// What the coordinates are renamed by: `RENAMED` of the greatest axis.
    axes: [u8; 4],
    /// How fast the ray runs along its greatest axis.
    speed: f32,
}

/// What rays may find in triangles: one ray of each lane in one triangle.
pub struct Prospects<const W: usize, L: Lanes<W>> {
    /// Where the ray may hit the triangle between its ends.
    pub possible: L::Mask,
    /// Where it does for certain.
    pub certain: L::Mask,
    /// `t` lies between this, where it may hit,
    pub first: L,
    /// and this.
    pub last: L,
}

/// How fast rays run along their greatest axes, the reciprocals of that, and where they look for hits.
struct Sight<L> {
    speed: L,
    scale: L,
    tnear: L,
    tfar: L,
}

/// Vertices as a ray sees them: two coordinates, the depth, and the sum of the coordinates' magnitudes.
pub struct Vertices<L> {
    x: L,
    y: L,
    depth: L,
    size: L,
}

/// Sixteen triangles, by their vertices.
pub struct Sixteens<'a> {
    /// The vertices' coordinates, in the order of [`Pooled::renamed`].
    pub rows: [&'a [f32; 16]; 3],
    /// Each triangle's vertices, in bits 0 to 3, 4 to 7 and 8 to 11.
    pub corners: &'a [u16; 16],
    /// How many there are.
    pub count: usize,
}

/// How numbers of vertices come to the corners of eight triangles. (A trait, as a closure would be compiled without the
/// instruction set.)
pub trait Picks<V> {
    /// Numbers of eight corners.
    type Corners: Eight;

    /// Lane `i` becomes that of the vertex which lane `i` of `numbers` names in its last four bits.
    fn pick(vertices: V, numbers: <Self::Corners as Lanes<8>>::Ids) -> Self::Corners;
}

/// Out of one register, which has up to eight vertices: by one shuffle.
pub struct FromEight;

/// Out of sixteen lanes: where those are two registers, by two shuffles and a choice.
pub struct FromSixteen;

impl<L: Eight> Picks<L> for FromEight {
    type Corners = L;

    #[inline(always)]
    fn pick(vertices: L, numbers: L::Ids) -> L {
        vertices.pick(numbers)
    }
}

impl<L: Sixteen> Picks<L> for FromSixteen {
    type Corners = L::Half;

    #[inline(always)]
    fn pick(vertices: L, numbers: <L::Half as Lanes<8>>::Ids) -> L::Half {
        vertices.pick_half(numbers)
    }
}

impl Pooled {
    /// That of no ray.
    pub const NONE: Self = Self { origin: [0.0; 3], shear: [0.0; 3], axes: [0; 4], speed: 0.0 };

    /// Prepares a ray whose greatest axis is known, the first of several, from its origin and its direction, of which a fourth
    /// number says nothing.
    #[inline(always)]
    pub fn of_one<L: Eight>(origin: &[f32; 4], direction: &[f32; 4], axis: usize) -> Self {
        // As in `Shear::new`, to the bit.
        let [i, j, k] = RENAMED[axis.min(2)];
        let along = direction[k];
        let slopes = (L::of_fours([direction, direction]) / L::splat(along)).store();
        let shear = [slopes[i], slopes[j], 1.0 / along];
        let origin = [origin[i], origin[j], origin[k]];
        Self { origin, shear, axes: [i as u8, j as u8, k as u8, 0], speed: along.abs() }
    }

    /// The ray prepared for the test of a mode that is told ahead here.
    #[inline(always)]
    pub fn test<M: Mode>(&self, ray: &Ray) -> M::Alone {
        let axis = usize::from(self.axes[2]) % 3;
        let direction = ray.direction.to_array();
        let [x, y, _] = self.shear;
        let kept = M::Alone::keep(direction[axis]);
        M::Alone::revive(&kept, [x, y], &ray.origin.to_array(), &direction, axis)
    }

    /// Which of the coordinates `x`, `y` and `z` take the places of those.
    #[inline(always)]
    pub fn renamed(&self) -> [usize; 3] {
        let [i, j, k, _] = self.axes.map(usize::from);
        [i, j, k]
    }

    /// The ray with an origin, of which a [`shear`](shears) was kept, and its greatest axis.
    #[inline(always)]
    pub fn of_shear(origin: &[f32; 3], shear: [f32; 3], axis: usize) -> Self {
        Self::of_speed(origin, shear, speed(shear[2]), axis)
    }

    /// The same if its [`speed`] along that axis was kept as well.
    #[inline(always)]
    pub fn of_speed(origin: &[f32; 3], shear: [f32; 3], speed: f32, axis: usize) -> Self {
        let [i, j, k] = RENAMED[axis % 3];
        let origin = [origin[i], origin[j], origin[k]];
        Self { origin, shear, axes: [i as u8, j as u8, k as u8, 0], speed }
    }

    /// Each vertex translated and sheared, as the ray sees it.
    #[inline(always)]
    pub fn see<L: Sixteen>(&self, triangles: &Sixteens<'_>) -> Vertices<L> {
        let [i, j, k] = triangles.rows;
        self.seen::<16, L>([L::load(i), L::load(j), L::load(k)])
    }

    /// The same of the first eight.
    #[inline(always)]
    pub fn see_eight<L: Eight>(&self, triangles: &Sixteens<'_>) -> Vertices<L> {
        let ([i, j, k], few) = (triangles.rows, "eight of sixteen");
        let load = [i.first_chunk().expect(few), j.first_chunk().expect(few), k.first_chunk().expect(few)];
        self.seen::<8, L>([L::load(load[0]), L::load(load[1]), L::load(load[2])])
    }

    /// Vertices of which the coordinates are given, as the ray sees them.
    #[inline(always)]
    fn seen<const W: usize, L: Lanes<W>>(&self, [i, j, k]: Lanes3<L>) -> Vertices<L> {
        let [ox, oy, oz] = self.origin;
        let [sx, sy, scale] = self.shear;
        let z = k - L::splat(oz);
        let x = (i - L::splat(ox)) - L::splat(sx) * z;
        let y = (j - L::splat(oy)) - L::splat(sy) * z;
        Vertices { x, y, depth: L::splat(scale) * z, size: x.abs() + y.abs() }
    }

    /// What the ray may find between `tnear` and `tfar`. With `SIGNS`, signs of edge functions are right if they are not
    /// zero; otherwise they are if those are beyond their error bounds. With `EARLY`, and if those are enough,
    /// nobody asks for bounds where they say that nothing is hit.
    #[inline(always)]
    pub fn prospects<L: Sixteen, const SIGNS: bool, const EARLY: bool>(
        &self,
        Vertices { x, y, depth, size }: &Vertices<L>,
        triangles: &Sixteens<'_>,
        tnear: f32,
        tfar: f32,
    ) -> Prospects<16, L> {
        let a = L::ids_widen(triangles.corners);
        let (b, c) = (L::ids_shift::<4>(a), L::ids_shift::<8>(a));
        let corners = [
            [x.pick(a), y.pick(a), depth.pick(a)],
            [x.pick(b), y.pick(b), depth.pick(b)],
            [x.pick(c), y.pick(c), depth.pick(c)],
        ];
        let size = size.pick(a) + size.pick(b) + size.pick(c);
        self.between::<16, L, SIGNS, EARLY>(&corners, size, triangles.count, tnear, tfar)
    }

    /// The same of the first eight triangles, or of the last eight.
    #[inline(always)]
    pub fn prospects_of_half<P: Picks<V>, V: Copy, const SIGNS: bool, const EARLY: bool>(
        &self,
        &Vertices { x, y, depth, size }: &Vertices<V>,
        triangles: &Sixteens<'_>,
        half: usize,
        tnear: f32,
        tfar: f32,
    ) -> Prospects<8, P::Corners> {
        let first = half * 8;
        let corners = triangles.corners[first..].first_chunk().expect("there are two halves");
        let a = P::Corners::ids_widen(corners);
        let (b, c) = (P::Corners::ids_shift::<4>(a), P::Corners::ids_shift::<8>(a));
        let corners = [
            [P::pick(x, a), P::pick(y, a), P::pick(depth, a)],
            [P::pick(x, b), P::pick(y, b), P::pick(depth, b)],
            [P::pick(x, c), P::pick(y, c), P::pick(depth, c)],
        ];
        let size = P::pick(size, a) + P::pick(size, b) + P::pick(size, c);
        self.between::<8, P::Corners, SIGNS, EARLY>(
            &corners,
            size,
            triangles.count.saturating_sub(first),
            tnear,
            tfar,
        )
    }

    /// What the ray may find in so many triangles of such corners and sizes.
    #[inline(always)]
    fn between<const W: usize, L: Lanes<W>, const SIGNS: bool, const EARLY: bool>(
        &self,
        corners: &[Lanes3<L>; 3],
        size: L,
        count: usize,
        tnear: f32,
        tfar: f32,
    ) -> Prospects<W, L> {
        let sight = Sight {
            speed: L::splat(self.speed),
            scale: L::splat(self.shear[2].abs()),
            tnear: L::splat(tnear),
            tfar: L::splat(tfar),
        };
        let present = L::mask_of_first(count);
        if EARLY && SIGNS && !(present & one_sign(&edges(corners))).any() {
            let (none, zero) = (L::mask_from_bits(0), L::splat(0.0));
            return Prospects { possible: none, certain: none, first: zero, last: zero };
        }
        let found = prospects::<W, L, SIGNS>(corners, size, &sight);
        Prospects { possible: present & found.possible, certain: present & found.certain, ..found }
    }
}

/// What is kept of rays for [`Pooled`] and [`Listed`]: their shears, and which rays have x for the greatest axis, and which y.
#[inline(always)]
pub fn shears<const W: usize, L: Lanes<W>>(
    origin: &Lanes3<L>,
    direction: &Lanes3<L>,
) -> (Lanes3<L>, [L::Mask; 2]) {
    // (As if no lane mattered: so nobody asks whether all have the same.)
    let Shear { shear, major_x, major_y, .. } = Shear::<W, L>::new(origin, direction, 0);
    (shear, [major_x, major_y])
}

/// How fast rays run along their greatest axes, of which their shears hold the reciprocals.
#[inline(always)]
pub fn speed<const W: usize, L: Lanes<W>>(reciprocal: L) -> L {
    L::splat(1.0) / reciprocal.abs()
}

/// Rays as pools see them that meet triangles together.
pub struct Listed<const W: usize, L: Lanes<W>> {
    frame: Shear<W, L>,
    speed: L,
}

impl<const W: usize, L: Lanes<W>> Listed<W, L> {
    /// Rays of which [`shears`] were kept. Where the greatest axis is neither x nor, among the others, y, it is z.
    #[inline(always)]
    pub fn new(origin: &Lanes3<L>, shear: Lanes3<L>, [is_x, is_y]: [L::Mask; 2]) -> Self {
        // Nobody asks for directions.
        let mut frame =
            Shear { major: None, major_x: is_x, major_y: is_y, origin: *origin, direction: *origin, shear };
        frame.origin = frame.renamed(origin);
        Self { frame, speed: speed(shear[2]) }
    }

    /// A vertex translated and sheared, and its depth, as the rays see it.
    #[inline(always)]
    pub fn see(&self, vertex: &[f32; 3]) -> Lanes3<L> {
        let [x, y, z] = self.frame.sheared(vertex);
        [x, y, self.frame.shear[2] * z]
    }

    /// Which rays may hit the triangle with such corners, wherever that is; `SIGNS` as for
    /// [`prospects`](Pooled::prospects).
    #[inline(always)]
    pub fn sift<const SIGNS: bool>(&self, corners: &[Lanes3<L>; 3]) -> L::Mask {
        let edges = edges(corners);
        if SIGNS {
            return one_sign(&edges);
        }
        let ([nearest, farthest], size) = (depths(corners), size_of(corners));
        let doubt = L::splat(DOUBT) * scope(far([nearest, farthest], size, self.speed), size);
        let [a, b, c] = edges;
        !(a.min(b).min(c).lt(L::splat(0.0) - doubt) & doubt.lt(a.max(b).max(c)))
    }

    /// What the rays may find in it between `tnear` and `tfar`.
    #[inline(always)]
    pub fn prospects<const SIGNS: bool>(
        &self,
        corners: &[Lanes3<L>; 3],
        tnear: L,
        tfar: L,
    ) -> Prospects<W, L> {
        let sight = Sight { speed: self.speed, scale: self.frame.shear[2].abs(), tnear, tfar };
        prospects::<W, L, SIGNS>(corners, size_of(corners), &sight)
    }
}

/// The sum of the magnitudes of a triangle's sheared coordinates.
#[inline(always)]
fn size_of<const W: usize, L: Lanes<W>>([a, b, c]: &[Lanes3<L>; 3]) -> L {
    (a[0].abs() + a[1].abs()) + (b[0].abs() + b[1].abs()) + (c[0].abs() + c[1].abs())
}

/// The nearest depth of a triangle's corners, and the farthest.
#[inline(always)]
fn depths<const W: usize, L: Lanes<W>>([[.., a], [.., b], [.., c]]: &[Lanes3<L>; 3]) -> [L; 2] {
    [a.min(*b).min(*c), a.max(*b).max(*c)]
}

/// How far the corners of a triangle of such depths and such a size are from the origins at most.
#[inline(always)]
fn far<const W: usize, L: Lanes<W>>([nearest, farthest]: [L; 2], size: L, speed: L) -> L {
    farthest.max(L::splat(0.0) - nearest).mul_add(speed, size)
}

/// What errors of edge functions are in proportion to.
#[inline(always)]
fn scope<const W: usize, L: Lanes<W>>(far: L, size: L) -> L {
    far.mul_add(L::splat(DOUBT).mul_add(far, size), L::splat(TINY))
}

/// What rays may find in triangles of such sizes: sheared corners, and their depths.
#[inline(always)]
fn prospects<const W: usize, L: Lanes<W>, const SIGNS: bool>(
    corners: &[Lanes3<L>; 3],
    size: L,
    sight: &Sight<L>,
) -> Prospects<W, L> {
    let [[.., depth_a], [.., depth_b], [.., depth_c]] = *corners;
    let [a, b, c] = edges(corners);
    let [nearest, farthest] = depths(corners);
    let far = far([nearest, farthest], size, sight.speed);
    let scope = scope(far, size);

    // Whether it may hit, and whether it does.
    let (least, greatest) = (a.min(b).min(c), a.max(b).max(c));
    let doubt = if SIGNS { L::splat(0.0) } else { L::splat(DOUBT) * scope };
    let (below, above) = (least.lt(L::splat(0.0) - doubt), doubt.lt(greatest));
    let sure = doubt.lt(least) | greatest.lt(L::splat(0.0) - doubt);

    // Where.
    let share = L::splat(1.0) / (a + b + c);
    let t = c.mul_add(depth_c, b.mul_add(depth_b, a * depth_a)) * share;
    let share = share.abs();
    // (Of numbers so small that processors take their time over them, hardly ever one comes about.)
    let lost = share.mul_add(L::splat(TINY), L::splat(TINY));
    let error = (L::splat(BLUR) * scope * (farthest - nearest)).mul_add(share, lost);
    let slack = (L::splat(SLACK) * sight.scale).mul_add(far, L::splat(TINY));
    let first = (t - error).max(nearest) - slack;
    let last = (t + error).min(farthest) + slack;

    let possible = !(below & above) & first.le(sight.tfar) & sight.tnear.le(last);
    let certain = possible & sure & sight.tnear.le(first) & last.le(sight.tfar);
    Prospects { possible, certain, first, last }
}

#[cfg(test)]
mod tests;
