//! The exact ray-triangle test: hit or miss as if numbers were real.
//!
//! Single precision only sorts out what is missed for certain. What is left is decided in double
//! precision, lane by lane, and where even that leaves a sign in doubt, by exact arithmetic
//! (`determinant`). So a ray hits a triangle if and only if the half-line and the closed triangle
//! that the `f32` numbers stand for share exactly one point. `t`, `u` and `v` are quotients of
//! determinants that are right to some 30 bits before they are rounded: right to the last bit, or
//! to the one before where the true value lies next to halfway between two floats.

mod determinant;

use super::watertight::Shear;
use super::{Alone, Candidate, Corners, Finds, Lanes3, Test, Triangle};
use crate::simd::{Eight, Lanes, Mask};
use determinant::{along_normal, volume};
use glam::{DVec3, Vec3};

/// `W` rays prepared for being sorted out, and as they came.
#[derive(Clone, Copy)]
pub struct Filter<const W: usize, L: Lanes<W>> {
    shear: Shear<W, L>,
    origin: [[f32; W]; 3],
    direction: [[f32; W]; 3],
}

impl<const W: usize, L: Lanes<W>> Test<W, L> for Filter<W, L> {
    type Record = Triangle;
    type Kept = <Shear<W, L> as Test<W, L>>::Kept;
    type Weights = [L; 2];

    #[inline(always)]
    fn keep(along: L) -> Self::Kept {
        Shear::keep(along)
    }

    #[inline(always)]
    fn revive(
        kept: &Self::Kept,
        slopes: [L; 2],
        apex: &[f32; 3],
        direction: &Lanes3<L>,
        axis: usize,
    ) -> Self {
        Self {
            shear: Shear::revive(kept, slopes, apex, direction, axis),
            origin: apex.map(|coordinate| [coordinate; W]),
            direction: [direction[0].store(), direction[1].store(), direction[2].store()],
        }
    }

    #[inline(always)]
    fn new(origin: &Lanes3<L>, direction: &Lanes3<L>, active: u32) -> Self {
        Self {
            shear: Shear::new(origin, direction, active),
            origin: [origin[0].store(), origin[1].store(), origin[2].store()],
            direction: [direction[0].store(), direction[1].store(), direction[2].store()],
        }
    }

    #[inline(always)]
    fn sift(&self, triangle: &Triangle, lanes: L::Mask) -> L::Mask {
        self.shear.likely(&triangle.corners) & lanes
    }

    #[inline(always)]
    fn test(&self, triangle: &Triangle, lanes: L::Mask) -> Candidate<W, L> {
        let corners = &triangle.corners;
        let likely = self.sift(triangle, lanes);
        if !likely.any() {
            return Candidate::none(likely);
        }
        let met = meet_lanes(likely.bits(), &self.origin, &self.direction, corners);
        Candidate {
            inside: L::mask_from_bits(met.inside),
            t: L::load(&met.t),
            u: L::load(&met.u),
            v: L::load(&met.v),
        }
    }
}

impl Alone for Filter<1, f32> {
    #[inline(always)]
    fn find<L: Eight>(&self, triangles: &[&Triangle; 8], _tnear: f32, _tfar: f32) -> Finds<L> {
        Finds::open(self.shear.likely_of_eight::<L>(triangles))
    }
}

/// A [`Candidate`] in memory.
struct Met<const W: usize> {
    inside: u32,
    t: [f32; W],
    u: [f32; W],
    v: [f32; W],
}

/// Tests the lanes in `lanes` one by one.
#[inline(never)]
fn meet_lanes<const W: usize>(
    lanes: u32,
    origin: &[[f32; W]; 3],
    direction: &[[f32; W]; 3],
    corners: &Corners,
) -> Met<W> {
    let mut met = Met { inside: 0, t: [0.0; W], u: [0.0; W], v: [0.0; W] };
    let corners = corners.map(|corner| Vec3::from_array(corner).as_dvec3());
    for lane in (0..W).filter(|lane| lanes >> lane & 1 == 1) {
        let vector = |v: &[[f32; W]; 3]| Vec3::new(v[0][lane], v[1][lane], v[2][lane]).as_dvec3();
        if let Some([t, u, v]) = meet(vector(origin), vector(direction), &corners) {
            met.inside |= 1 << lane;
            (met.t[lane], met.u[lane], met.v[lane]) = (t, u, v);
        }
    }
    met
}

/// `t`, `u` and `v` where the line of a ray meets a closed triangle, if it does in one point. All
/// numbers must be floats that were widened.
fn meet(origin: DVec3, direction: DVec3, [p0, p1, p2]: &[DVec3; 3]) -> Option<[f32; 3]> {
    // The weights' numerators: the volume that ray and opposite edge span.
    let w0 = volume(direction, *p1, *p2, origin);
    let w1 = volume(direction, *p2, *p0, origin);
    if w0.sign() * w1.sign() < 0 {
        return None;
    }
    let w2 = volume(direction, *p0, *p1, origin);
    if w0.sign() * w2.sign() < 0 || w1.sign() * w2.sign() < 0 {
        return None;
    }
    // Of one sign, they do not cancel: the sum is as right as they are.
    let sum = w0.value() + w1.value() + w2.value();
    if sum == 0.0 {
        return None;
    }
    let t = along_normal(*p0, *p1, *p2, origin).value() / sum;
    Some([t as f32, (w1.value() / sum) as f32, (w2.value() / sum) as f32])
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shoot(origin: [f32; 3], direction: [f32; 3], corners: &Corners) -> Option<[f32; 3]> {
        let found = Filter::<1, f32>::new(&origin, &direction, 1).test(&Triangle::new(*corners), true);
        found.inside.then_some([found.t, found.u, found.v])
    }

    const TRIANGLE: Corners = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];

    #[test]
    fn the_border_belongs_to_the_triangle_and_nothing_beyond() {
        for (x, y, inside) in [
            (0.25, 0.25, true),
            (0.0, 0.0, true),
            (1.0, 0.0, true),
            (0.5, 0.5, true),
            (-f32::MIN_POSITIVE, 0.5, false),
            (0.5, 0.5f32.next_up(), false),
            (0.5f32.next_up(), 0.5, false),
            (0.5, 0.5f32.next_down(), true),
            (1.0f32.next_up(), 0.0, false),
        ] {
            for (z, down) in [(3.0, -1.0), (1e-30, -1e-30), (-7.0, 0.3)] {
                let hit = shoot([x, y, z], [0.0, 0.0, down], &TRIANGLE);
                assert_eq!(hit.is_some(), inside, "({x}, {y}) from {z}");
                if let Some([t, u, v]) = hit {
                    assert_eq!([t, u, v], [-z / down, x, y]);
                }
            }
        }
    }

    #[test]
    fn edge_on_is_no_hit() {
        assert_eq!(shoot([-1.0, 0.25, 0.0], [1.0, 0.0, 0.0], &TRIANGLE), None);
        assert_eq!(shoot([-1.0, 0.0, 0.0], [1.0, 0.0, 0.0], &TRIANGLE), None);
        let line = [[0.0; 3], [1.0; 3], [2.0; 3]];
        assert_eq!(shoot([0.0, 0.0, 1.0], [0.5, 0.5, -0.5], &line), None);
    }

    #[test]
    fn a_sliver_that_single_precision_cannot_see() {
        // Two long triangles, a millionth wide, on either side of a line that the ray crosses.
        let (a, b) = ([-1.0, 0.1, 0.3], [1.0, 0.7, 0.9]);
        let width = 1e-6;
        let above = [a, b, [0.0, 0.4 + width, 0.6]];
        let below = [a, b, [0.0, 0.4 - width, 0.6]];
        let mut hits = [0, 0];
        for i in 0..2000 {
            let shift = (i - 1000) as f32 * 1e-9;
            let (origin, direction) = ([0.1, 0.43 + shift, 5.0], [0.0, 0.0, -1.0]);
            let found = [above, below].map(|triangle| shoot(origin, direction, &triangle).is_some());
            assert!(found[0] || found[1] || shift.abs() > width * 0.8, "{shift} slips between");
            hits = [hits[0] + i32::from(found[0]), hits[1] + i32::from(found[1])];
        }
        assert!(hits[0] > 100 && hits[1] > 100, "{hits:?}");
    }
}
