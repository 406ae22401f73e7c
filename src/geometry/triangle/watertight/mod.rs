//! The watertight ray-triangle test: Woop, Benthin & Wald, "Watertight Ray/Triangle
//! Intersection", JCGT 2(1), 2013.
//!
//! The ray becomes the z axis: the coordinate in which its direction is greatest is renamed z,
//! and a shear takes x and y along. What is left is whether the origin lies in a 2D triangle,
//! decided by three edge functions. Two triangles that share an edge compute the same sheared
//! corners and negated edge functions, bit for bit, so no ray passes between them.
//!
//! The sign of an edge function `a*b - c*d` is right whenever the result is not zero, because
//! rounding is monotone and the products are rounded alike; where it is zero, double precision
//! (in which products of two floats are exact) decides. That is why nothing here is fused.
//!
//! `t` is not the paper's: see `distance`.
//!
//! There is no culling, so the paper's swap of x and y for rays that run against z is left out:
//! it would only turn all three signs round.

mod alone;
mod distance;
mod placed;
pub mod pooled;

use super::{Candidate, Corners, Lanes3, Placed, RENAMED, Test, Triangle};
use crate::simd::{Lanes, Mask};

/// What the test needs to know of `W` rays: the shear that takes each to the z axis.
#[derive(Clone, Copy)]
pub struct Shear<const W: usize, L: Lanes<W>> {
    /// The greatest axis of the directions if all lanes share it.
    major: Option<usize>,
    /// Lanes whose greatest axis is x, y; in the others it is z.
    major_x: L::Mask,
    major_y: L::Mask,
    /// Origins in renamed coordinates: the third is along the greatest axis.
    origin: Lanes3<L>,
    /// Directions in renamed coordinates.
    direction: Lanes3<L>,
    /// `(dx/dz, dy/dz, 1/dz)` in renamed coordinates.
    shear: Lanes3<L>,
}

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// Coordinates renamed lane by lane so that each lane's greatest axis comes last.
    #[inline(always)]
    fn renamed(&self, [x, y, z]: &Lanes3<L>) -> Lanes3<L> {
        [self.pick(*y, *z, *x), self.pick(*z, *x, *y), self.pick(*x, *y, *z)]
    }

    /// The value that belongs to each lane's greatest axis.
    #[inline(always)]
    fn pick(&self, if_x: L, if_y: L, if_z: L) -> L {
        L::select(self.major_x, if_x, L::select(self.major_y, if_y, if_z))
    }

    /// The same point or vector in every lane, with its coordinates renamed.
    #[inline(always)]
    fn splat_renamed(&self, point: &[f32; 3]) -> Lanes3<L> {
        match self.major {
            Some(axis) => {
                let [i, j, k] = RENAMED[axis];
                [L::splat(point[i]), L::splat(point[j]), L::splat(point[k])]
            }
            None => self.renamed(&[L::splat(point[0]), L::splat(point[1]), L::splat(point[2])]),
        }
    }

    /// A corner relative to the origins, with its coordinates renamed.
    #[inline(always)]
    fn translated(&self, corner: &[f32; 3]) -> Lanes3<L> {
        let [x, y, z] = self.splat_renamed(corner);
        [x - self.origin[0], y - self.origin[1], z - self.origin[2]]
    }

    /// The same with x and y sheared so that the rays run along z.
    #[inline(always)]
    fn sheared(&self, corner: &[f32; 3]) -> Lanes3<L> {
        self.shear(self.translated(corner))
    }

    /// A translated point with x and y sheared so that the rays run along z.
    #[inline(always)]
    fn shear(&self, [x, y, z]: Lanes3<L>) -> Lanes3<L> {
        let [sx, sy, _] = self.shear;
        [x - sx * z, y - sy * z, z]
    }

    /// Lanes whose line cannot be shown to miss a triangle: all that hit it, and few others.
    ///
    /// With `u = 2^-24` and `far` the greatest translated coordinate, sheared ones are off by at
    /// most `6u far`; so with `wide` the greatest sheared one, edge functions are off by at most
    /// `36u far (wide + 2u far)`, and by some of the smallest floats where products underflow.
    /// Where anything overflows, so does the bound, and the lane is likely.
    #[inline(always)]
    pub(super) fn likely(&self, corners: &Corners) -> L::Mask {
        likely([self.sheared(&corners[0]), self.sheared(&corners[1]), self.sheared(&corners[2])])
    }
}

/// Lanes in which a triangle with its corners sheared is likely.
#[inline(always)]
fn likely<const W: usize, L: Lanes<W>>(
    [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: [Lanes3<L>; 3],
) -> L::Mask {
    let a = cx * by - cy * bx;
    let b = ax * cy - ay * cx;
    let c = bx * ay - by * ax;

    // Translated x and y are at most the sheared ones and z together.
    let wide = ax.abs().max(ay.abs()).max(bx.abs()).max(by.abs()).max(cx.abs()).max(cy.abs());
    let far = wide + az.abs().max(bz.abs()).max(cz.abs());
    let tiny = L::splat(1e-43);
    let error =
        L::splat(1.0 / (1 << 18) as f32) * far * (wide + L::splat(1.0 / (1 << 20) as f32) * far) + tiny;
    !(a.min(b).min(c).lt(L::splat(0.0) - error) & error.lt(a.max(b).max(c)))
}

/// `1/dz` in renamed coordinates, kept.
#[derive(Clone, Copy)]
pub struct Scale<const W: usize, L: Lanes<W>>(L);

impl<const W: usize, L: Lanes<W>> Default for Scale<W, L> {
    #[inline(always)]
    fn default() -> Self {
        Self(L::splat(0.0))
    }
}

impl<const W: usize, L: Lanes<W>> Test<W, L> for Shear<W, L> {
    type Record = Triangle;
    /// Beside slopes, what is left of the shear.
    type Kept = Scale<W, L>;
    type Weights = ();

    #[inline(always)]
    fn keep(along: L) -> Self::Kept {
        Scale(L::splat(1.0) / along)
    }

    #[inline(always)]
    fn revive(
        kept: &Self::Kept,
        [x, y]: [L; 2],
        apex: &[f32; 3],
        direction: &Lanes3<L>,
        axis: usize,
    ) -> Self {
        let [i, j, k] = RENAMED[axis];
        // With one axis for all, nobody asks which lanes have it.
        let nobody = L::mask_from_bits(0);
        Self {
            major: Some(axis),
            major_x: nobody,
            major_y: nobody,
            origin: [L::splat(apex[i]), L::splat(apex[j]), L::splat(apex[k])],
            direction: [direction[i], direction[j], direction[k]],
            shear: [x, y, kept.0],
        }
    }

    /// Lanes that are not active do not keep the one renaming for all from being taken. A lane
    /// whose direction is zero or not finite gets a shear of NaNs, and so never a hit.
    #[inline(always)]
    fn new(origin: &Lanes3<L>, direction: &Lanes3<L>, active: u32) -> Self {
        let (x, y, z) = (direction[0].abs(), direction[1].abs(), direction[2].abs());
        // Ties go to the earlier axis, so that every width picks alike.
        let major_x = y.le(x) & z.le(x);
        let major_y = !major_x & z.le(y);
        let (bits_x, bits_y) = (major_x.bits() & active, major_y.bits() & active);
        let major = if bits_x == active {
            Some(0)
        } else if bits_y == active {
            Some(1)
        } else if bits_x | bits_y == 0 {
            Some(2)
        } else {
            None
        };
        let mut frame =
            Self { major, major_x, major_y, origin: *origin, direction: *direction, shear: *direction };
        frame.origin = frame.renamed(origin);
        frame.direction = frame.renamed(direction);
        let [dx, dy, dz] = frame.direction;
        frame.shear = [dx / dz, dy / dz, L::splat(1.0) / dz];
        frame
    }

    #[inline(always)]
    fn test(&self, triangle: &Triangle, lanes: L::Mask) -> Candidate<W, L> {
        let [a, b, c] = &triangle.corners;
        self.decide(triangle, [self.sheared(a), self.sheared(b), self.sheared(c)], lanes)
    }

    /// The signs of the edge functions before any is looked at in double precision: that takes lanes out, and never one in.
    #[inline(always)]
    fn sift(&self, triangle: &Triangle, lanes: L::Mask) -> L::Mask {
        let [a, b, c] = &triangle.corners;
        let (a, b, c) = (self.sheared(a), self.sheared(b), self.sheared(c));
        lanes & one_sign(&edges(&[a, b, c]))
    }

    #[inline(always)]
    fn weigh(&self, triangle: &Triangle, lanes: L::Mask) -> [L; 2] {
        let [a, b, c] = &triangle.corners;
        let corners = [self.sheared(a), self.sheared(b), self.sheared(c)];
        let (_, [_, b, c], sum) = edge_functions(&corners, lanes);
        [b / sum, c / sum]
    }

    #[inline(always)]
    fn test_placed(
        kept: &Self::Kept,
        [x, y]: [L; 2],
        direction: &Lanes3<L>,
        placed: &Placed,
        which: usize,
        lanes: L::Mask,
    ) -> Option<Candidate<W, L>> {
        placed::test_beam(&[x, y, kept.0], direction, placed, which, lanes)
    }
}

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// The test of a triangle with its corners sheared.
    #[inline(always)]
    fn decide(&self, triangle: &Triangle, corners: [Lanes3<L>; 3], lanes: L::Mask) -> Candidate<W, L> {
        let (inside, edges, sum) = edge_functions(&corners, lanes);
        if !inside.any() {
            return Candidate::none(inside);
        }
        let t = self.distance(triangle, inside, &corners, &edges);
        let [_, b, c] = edges;
        // No reciprocal: that of a denormal sum would be infinite.
        Candidate { inside, t, u: b / sum, v: c / sum }
    }
}

/// The edge functions of a triangle with its corners sheared, each opposite to the corner whose weight it is.
#[inline(always)]
fn edges<const W: usize, L: Lanes<W>>([[ax, ay, _], [bx, by, _], [cx, cy, _]]: &[Lanes3<L>; 3]) -> Lanes3<L> {
    [*cx * *by - *cy * *bx, *ax * *cy - *ay * *cx, *bx * *ay - *by * *ax]
}

/// The lanes in which all are of one sign, zeros allowed: not both a negative and a positive one.
#[inline(always)]
fn one_sign<const W: usize, L: Lanes<W>>([a, b, c]: &Lanes3<L>) -> L::Mask {
    let zero = L::splat(0.0);
    !((a.min(*b).min(*c).lt(zero)) & zero.lt(a.max(*b).max(*c)))
}

/// Which of the lanes in `lanes` are inside of a triangle with its corners sheared; the edge functions, each
/// opposite to the corner whose weight it is, and their sum.
#[inline(always)]
fn edge_functions<const W: usize, L: Lanes<W>>(
    corners: &[Lanes3<L>; 3],
    lanes: L::Mask,
) -> (L::Mask, Lanes3<L>, L) {
    let [mut a, mut b, mut c] = edges(corners);
    let mut inside = lanes & one_sign(&[a, b, c]);

    // Where an edge function is zero, its sign is not known: ask double precision.
    let zero = L::splat(0.0);
    let unsure = (a.eq(zero) | b.eq(zero) | c.eq(zero)) & inside;
    if unsure.any() {
        let [[ax, ay, _], [bx, by, _], [cx, cy, _]] = corners;
        let sheared = [ax.store(), ay.store(), bx.store(), by.store(), cx.store(), cy.store()];
        let edges = edges_in_double(unsure.bits(), &sheared, [a.store(), b.store(), c.store()]);
        (a, b, c) = (L::load(&edges[0]), L::load(&edges[1]), L::load(&edges[2]));
        inside = inside & one_sign(&[a, b, c]);
    }

    // The weights' sum is zero for a triangle seen edge-on, NaN where anything was NaN.
    let sum = a + b + c;
    (inside & (sum.lt(zero) | zero.lt(sum)), [a, b, c], sum)
}

/// The edge functions of the lanes in `lanes`, computed in double precision; those of the other
/// lanes as they were. `sheared` is `ax ay bx by cx cy`.
#[cold]
#[inline(never)]
fn edges_in_double<const W: usize>(
    lanes: u32,
    sheared: &[[f32; W]; 6],
    mut edges: [[f32; W]; 3],
) -> [[f32; W]; 3] {
    for lane in (0..W).filter(|lane| lanes >> lane & 1 == 1) {
        let [ax, ay, bx, by, cx, cy] = sheared.map(|s| f64::from(s[lane]));
        let exact = [cx * by - cy * bx, ax * cy - ay * cx, bx * ay - by * ax];
        for (edge, exact) in edges.iter_mut().zip(exact) {
            edge[lane] = to_f32_with_sign(exact);
        }
    }
    edges
}

/// The nearest float, but never zero unless `x` is: a tiny value keeps its sign.
fn to_f32_with_sign(x: f64) -> f32 {
    let rounded = x as f32;
    if rounded == 0.0 && x != 0.0 { f32::from_bits(1).copysign(x as f32) } else { rounded }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weyl::uniform;
    use glam::Vec3;

    /// One ray against one triangle: its `t`, or `None`.
    fn shoot(origin: Vec3, direction: Vec3, corners: &[Vec3; 3]) -> Option<f32> {
        let shear = Shear::<1, f32>::new(&origin.to_array(), &direction.to_array(), 1);
        let found = shear.test(&Triangle::new(corners.map(|corner| corner.to_array())), true);
        found.inside.then_some(found.t)
    }

    #[test]
    fn nothing_passes_between_triangles_that_share_an_edge() {
        let mut number = uniform(-1.0, 1.0);
        let mut point = || Vec3::new(number(), number(), number());
        for _ in 0..200_000 {
            // A quadrilateral that opens toward the ray's origin, and a ray at its diagonal.
            let (a, c, origin) = (point(), point(), point() * 3.0 + Vec3::Z * 10.0);
            let across = (c - a).cross(Vec3::Z).normalize_or(Vec3::X);
            let (b, d) = (a + across, a - across);
            let aim = a + (c - a) * (0.1 + 0.8 * point().x.abs());
            let hits = [[a, c, b], [c, a, d]].map(|triangle| shoot(origin, aim - origin, &triangle));
            assert!(hits.iter().any(Option::is_some), "{origin} to {aim} slips between {a} and {c}");
        }
    }

    #[test]
    fn t_is_right_on_a_huge_floor() {
        let floor =
            [Vec3::new(-450.0, -0.1, -450.0), Vec3::new(450.0, -0.1, 500.0), Vec3::new(470.0, -0.1, -450.0)];
        let mut number = uniform(-1.0, 1.0);
        for _ in 0..10_000 {
            let origin = Vec3::new(100.0 + 90.0 * number(), 0.05 * number(), -300.0 + 90.0 * number());
            let direction = Vec3::new(number(), -0.2 - number().abs(), number());
            let t = shoot(origin, direction, &floor).expect("it is below");
            let expected = (f64::from(-0.1f32) - f64::from(origin.y)) / f64::from(direction.y);
            assert!((f64::from(t) / expected - 1.0).abs() < 1e-6, "{t} is not {expected}");
        }
    }

    #[test]
    fn t_lies_between_the_corners_depths_for_slivers_too() {
        let mut number = uniform(-1.0, 1.0);
        let mut hits = 0;
        for _ in 0..50_000 {
            let (p, q) = (Vec3::new(number(), number(), number()), Vec3::new(number(), number(), number()));
            let sliver = [p, q, q + Vec3::new(number(), number(), number()) * 1e-6];
            let origin = Vec3::new(number(), number(), 4.0);
            let direction = (p + q) * 0.5 - origin;
            if let Some(t) = shoot(origin, direction, &sliver) {
                hits += 1;
                let depths = sliver.map(|corner| (corner.z - origin.z) / direction.z);
                let (low, high) =
                    (depths[0].min(depths[1]).min(depths[2]), depths[0].max(depths[1]).max(depths[2]));
                assert!(t >= low * 0.999_999 && t <= high * 1.000_001, "{t} of {depths:?}");
            }
        }
        assert!(hits > 1000, "{hits} hits");
    }
}
