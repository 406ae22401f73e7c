//! Where along its ray a hit lies.
//!
//! The paper weights the corners' depths with the edge functions, whose errors grow with the
//! triangle: on the sides of a square of 900 m `t` was off by up to 5 mm two metres from the ray's
//! origin, and the weights of a sliver are mostly noise. Here `t` is where the ray meets the
//! triangle's plane, with a normal from double precision that the triangle's record keeps.
//!
//! **What is guaranteed.** The point `origin + t * direction` is within some 16 roundings (of the
//! greatest distance between origin and corner) of a point *of the triangle*, so it lies in a cell,
//! walls included, that lists the triangle: a walk that looks at cells in any order finds the same
//! closest hit. For a plane met squarely that follows from the rounding of `t`. A ray that grazes
//! the plane moves far along it while it comes nearer by one rounding, so `t` alone may lie far
//! outside of the triangle's edges, and is clipped to them there: a ray in the plane but for rounding
//! hits where it enters the triangle. Last, `t` is kept between the corners' depths.

use super::Shear;
use crate::geometry::triangle::{Corners, Lanes3, Triangle, normal_in_double};
use crate::simd::{Lanes, Mask};
use glam::DVec3;

/// A ray whose cosine with the normal is less than about this grazes the plane.
const GRAZING: f32 = 0.25;

/// The same for a ray that passes all edges by a margin: there is nothing to clip then.
///
/// With `u = 2^-24`, `far` the greatest coordinate of a corner relative to the origin, and the direction's greatest
/// component 1: the height of the plane above the origin is off by at most `15 u far`, and the speed by `12 u`, so
/// with a speed `s` of more than this, `t` is off by less than `30 u far / s`, and the point along the plane by less
/// than `sqrt(3)` times as much, some `52 u far / s`. A ray's point lies `f / (e s)` inside of an edge of length `e`
/// for which its edge function is `f`. So a ray with `f > 52 u far e` for each edge comes out inside of all edges,
/// and the clip's bounds, which have a slack of their own for what they are off by, do not touch it.
pub(super) const FLAT: f32 = 1.0 / 4096.0;

/// How large edge functions have to be, relative to `far` and the triangle's extent, for rays to be so: four times
/// `52 u` for an edge's length (at most twice the width and thrice the depth), and what the functions are off by
/// (see `likely`).
const WELL_INSIDE: f32 = 1.0 / (1 << 15) as f32;

/// How far beyond an edge a ray may pass a triangle that it hits, relative to the farthest corner:
/// sheared coordinates are off by up to six roundings, and what is computed here by about as many.
const SLACK: f32 = 16.0 / (1 << 24) as f32;

impl<const W: usize, L: Lanes<W>> Shear<W, L> {
    /// `t` of the lanes in `inside`, from the sheared corners and the edge functions.
    #[inline(always)]
    pub(super) fn distance(
        &self,
        triangle: &Triangle,
        inside: L::Mask,
        sheared: &[Lanes3<L>; 3],
        edges: &Lanes3<L>,
    ) -> L {
        let Triangle { corners, plane } = triangle;
        let (t, speed) =
            if *plane == [0.0; 3] { self.meet_line(corners) } else { self.meet_plane(*plane, &corners[0]) };
        let clipped = are_clipped(inside, sheared, edges, speed, self.direction[2].abs());
        let t = if clipped.any() { L::select(clipped, self.clip(corners, t), t) } else { t };

        let [[_, _, az], [_, _, bz], [_, _, cz]] = *sheared;
        let scale = self.shear[2];
        let (az, bz, cz) = (scale * az, scale * bz, scale * cz);
        let (nearest, farthest) = (az.min(bz).min(cz), az.max(bz).max(cz));
        t.max(nearest).min(farthest)
    }

    /// Where the rays meet a plane, and their speed along its normal.
    #[inline(always)]
    fn meet_plane(&self, normal: [f32; 3], point: &[f32; 3]) -> (L, L) {
        let normal = self.splat_renamed(&normal);
        let ([nx, ny, nz], [px, py, pz]) = (normal, self.translated(point));
        self.meet(&normal, nx * px + ny * py + nz * pz)
    }

    /// The same for a plane at a height along its normal, renamed, from the origins.
    #[inline(always)]
    fn meet(&self, [nx, ny, nz]: &Lanes3<L>, height: L) -> (L, L) {
        let [dx, dy, dz] = self.direction;
        let speed = *nx * dx + *ny * dy + *nz * dz;
        (height / speed, speed)
    }

    /// Where the rays pass a triangle that is no more than a line. (It has to be hit: neighbours on
    /// either side of it see its corners moved by roundings, and it fills what opens between them.)
    #[inline(always)]
    fn meet_line(&self, corners: &Corners) -> (L, L) {
        // Of two planes that hold the line, each lane takes the one it meets more steeply.
        let [p0, p1, p2] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
        let (e, f) = (p1 - p0, p2 - p0);
        let along = if e.length_squared() > f.length_squared() { e } else { f };
        let (one, other) = along.normalize_or(DVec3::X).any_orthonormal_pair();
        let (t, slow) = self.meet_plane(one.as_vec3().to_array(), &corners[0]);
        let (u, fast) = self.meet_plane(other.as_vec3().to_array(), &corners[0]);
        let better = slow.abs().lt(fast.abs());
        (L::select(better, u, t), L::select(better, fast, slow))
    }

    /// Moves `t` to where the rays are between the planes that stand on the triangle's edges.
    #[inline(always)]
    fn clip(&self, corners: &Corners, t: L) -> L {
        let normal = normal_in_double(corners);
        let points =
            [self.translated(&corners[0]), self.translated(&corners[1]), self.translated(&corners[2])];
        let mut far = L::splat(0.0);
        for [x, y, z] in points {
            far = far.max(x.abs()).max(y.abs()).max(z.abs());
        }
        let slack = far * L::splat(SLACK);

        let zero = L::splat(0.0);
        let (mut first, mut last) = (L::splat(f32::NEG_INFINITY), L::splat(f32::INFINITY));
        for i in 0..3 {
            let edge = DVec3::from_array(
                [0, 1, 2].map(|axis| f64::from(corners[(i + 1) % 3][axis]) - f64::from(corners[i][axis])),
            );
            let inward = normal.cross(edge);
            let size = inward.abs().max_element();
            if size == 0.0 {
                continue;
            }
            // Inside is where inward . (direction * t - point) >= -slack.
            let [mx, my, mz] = self.splat_renamed(&(inward / size).as_vec3().to_array());
            let ([px, py, pz], [dx, dy, dz]) = (points[i], self.direction);
            let width = slack * (mx.abs() + my.abs() + mz.abs());
            let speed = mx * dx + my * dy + mz * dz;
            let crossing = (mx * px + my * py + mz * pz - width) / speed;
            first = L::select(zero.lt(speed), crossing.max(first), first);
            last = L::select(speed.lt(zero), crossing.min(last), last);
        }
        t.max(first).min(last)
    }
}

/// The lanes in `inside` whose `t` may have to be clipped: those that graze the plane, because the `speed` along its
/// normal is small beside that along the greatest axis, or is none (a NaN), and that pass near an edge. (Of a triangle
/// without area the clip leaves `t` as it is.)
#[inline(always)]
pub(super) fn are_clipped<const W: usize, L: Lanes<W>>(
    inside: L::Mask,
    sheared: &[Lanes3<L>; 3],
    edges: &Lanes3<L>,
    speed: L,
    along: L,
) -> L::Mask {
    let grazing = inside & !(L::splat(GRAZING) * along).le(speed.abs());
    if !grazing.any() {
        return grazing;
    }
    grazing & !(is_well_inside(sheared, edges) & (L::splat(FLAT) * along).le(speed.abs()))
}

/// Lanes whose ray passes the edges of a triangle with its corners sheared by so much that nothing is to be clipped,
/// unless the ray is all but in the plane: see `FLAT`.
#[inline(always)]
fn is_well_inside<const W: usize, L: Lanes<W>>(
    [[ax, ay, az], [bx, by, bz], [cx, cy, cz]]: &[Lanes3<L>; 3],
    [a, b, c]: &Lanes3<L>,
) -> L::Mask {
    let wide = ax.abs().max(ay.abs()).max(bx.abs()).max(by.abs()).max(cx.abs()).max(cy.abs());
    let far = wide + az.abs().max(bz.abs()).max(cz.abs());
    let deep = az.max(*bz).max(*cz) - az.min(*bz).min(*cz);
    let least = L::splat(1.0 / (1 << 20) as f32) * far;
    let margin = L::splat(WELL_INSIDE) * far * (wide + deep + least) + L::splat(1e-36);
    margin.lt(a.abs().min(b.abs()).min(c.abs()))
}

#[cfg(test)]
mod tests {
    use super::super::edge_functions;
    use super::*;
    use crate::geometry::triangle::Test;
    use crate::weyl::uniform;
    use glam::Vec3;

    /// A ray, at its end: whether nothing is to be clipped by [`is_well_inside`], and `t` before and after clipping.
    fn clip(origin: Vec3, direction: Vec3, corners: &Corners) -> (bool, f32, f32) {
        let ray = Shear::<1, f32>::new(&origin.to_array(), &direction.to_array(), 1);
        let triangle = Triangle::new(*corners);
        let sheared = [ray.sheared(&corners[0]), ray.sheared(&corners[1]), ray.sheared(&corners[2])];
        let (inside, edges, _) = edge_functions(&sheared, true);
        let (t, speed) = ray.meet_plane(triangle.plane, &corners[0]);
        let steep = FLAT * ray.direction[2].abs() <= speed.abs();
        (inside && steep && is_well_inside(&sheared, &edges), t, ray.clip(corners, t))
    }

    #[test]
    fn what_passes_well_inside_is_not_clipped() {
        let mut number = uniform(-1.0, 1.0);
        let mut point = || Vec3::new(number(), number(), number());
        let (mut well, mut moved) = (0, 0);
        for i in 0..300_000 {
            // Triangles of many sizes and shapes, far away or near, and rays that graze them anywhere.
            let size = 10f32.powi(i % 7 - 3);
            let center = point() * 10f32.powi(i / 7 % 6 - 2);
            let thin = 10f32.powi(-(i / 42 % 4));
            let (p, e, f) = (center + point() * size, point() * size, point() * size * thin);
            let corners = [p, p + e, p + e * point().x.abs() + f];
            let weights = point().abs();
            let target = (corners[0] * weights.x + corners[1] * weights.y + corners[2] * weights.z)
                / (weights.x + weights.y + weights.z);
            let normal = e.cross(f).normalize_or(Vec3::X);
            let along = point().cross(normal).normalize_or(Vec3::Y);
            let slope = 10f32.powi(-(i / 168 % 4)) * (0.3 + point().x.abs());
            let direction = along + normal * slope;
            let origin = target - direction * (size * 10f32.powi(i % 4 - 2));
            let (vouched, t, clipped) = clip(origin, direction, &corners.map(|corner| corner.to_array()));
            moved += i32::from(t != clipped);
            if vouched {
                well += 1;
                assert_eq!(t.to_bits(), clipped.to_bits(), "{origin} {direction} {corners:?}");
            }
        }
        assert!(well > 100_000, "{well} rays pass well inside");
        assert!(moved > 1000, "clipping moves {moved}");
    }
}
