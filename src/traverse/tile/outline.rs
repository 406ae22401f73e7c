//! Triangles as a beam sees them, and which of them some ray of a packet may hit.
//!
//! The question is asked three times, each time of sixteen pairs at once, by the same code:
//! sixteen triangles against the whole beam, then the triangles that are left one by one against
//! sixteen packets, or the packets one by one against sixteen triangles. A [`Window`] is what a packet
//! (or the beam) sees: slopes `a` and `b` in a rectangle, depths in an interval. An [`Outline`] is what
//! is seen of a triangle:
//!
//! - **Edges.** With corners `p`, `q` relative to the apex, a ray `(a, b, 1)` passes the edge on the
//!   side of the sign of `(a, b, 1) . (p x q)`: linear in the slopes, so its range over a rectangle is
//!   that at the centre plus and minus a half-width. A ray that hits is on the same side of all three
//!   edges.
//! - **Box.** The corners' slopes `x / z` and `y / z`.
//! - **Depth.** The corners' `z`.
//! - **Plane.** A ray meets the plane `n . x = d` at the depth `d / (n . (a, b, 1))`, so that over a
//!   rectangle of slopes the plane has a least and a greatest depth too. A wall that reaches from the
//!   eye to the horizon is where it is, not where its corners are: it is tested in the cell in which it
//!   is hit, and not at all behind what hides it.
//!
//! **Nothing is lost.** Every test of [`crate::geometry::triangle`] answers for corners moved by no
//! more than some 16 roundings of `far`, the greatest coordinate of the triangle relative to the apex.
//! Outlines are widened by [`SLACK`], 128 roundings of it, which covers that and the roundings of what
//! is computed here. What is left goes through the mode's own test: culling decides about time, never
//! about a hit.

use super::beam::Beam;
use crate::geometry::triangle::Triangle;
use crate::simd::Lanes;

/// By how much outlines are widened, relative to the farthest corner.
const SLACK: f32 = 128.0 / (1 << 24) as f32;

/// Keeps the slack above what underflows.
const TINY: f32 = 1e-36;

/// What sixteen packets see of the scene, or one (in every lane).
#[derive(Clone, Copy)]
pub struct Window<L> {
    /// Least and greatest slopes.
    pub low: [L; 2],
    pub high: [L; 2],
    /// Their middle, and half their width.
    pub center: [L; 2],
    pub half: [L; 2],
    /// Depths.
    pub nearest: L,
    pub farthest: L,
}

impl<L: Lanes<16>> Window<L> {
    /// The window of slopes from `low` to `high`.
    #[inline(always)]
    pub fn new(low: [L; 2], high: [L; 2], nearest: L, farthest: L) -> Self {
        let half = L::splat(0.5);
        let center = [(low[0] + high[0]) * half, (low[1] + high[1]) * half];
        // Half the width and a few roundings of the slopes themselves.
        let more = L::splat(1e-6);
        let half = [(high[0] - low[0]) * half + more, (high[1] - low[1]) * half + more];
        Self { low, high, center, half, nearest, farthest }
    }
}

/// What is seen of sixteen triangles, or of one (in every lane).
pub struct Outline<L> {
    /// For each edge `p x q`, and its slack.
    edges: [[L; 4]; 3],
    /// The plane's normal, its distance from the apex (not negative), and that one's slack.
    plane: [L; 5],
    /// Slopes and depths, slack included.
    low: [L; 2],
    high: [L; 2],
    near: L,
    far: L,
}

impl<L: Lanes<16>> Outline<L> {
    /// The pairs of triangle and window in which a ray may hit.
    #[inline(always)]
    pub fn meets(&self, window: &Window<L>) -> L::Mask {
        let zero = L::splat(0.0);
        let [a, b] = window.center;
        let [half_a, half_b] = window.half;
        let (mut least, mut greatest) = (L::splat(f32::INFINITY), L::splat(f32::NEG_INFINITY));
        for edge in &self.edges {
            let [x, y, z, slack] = *edge;
            let center = x.mul_add(a, y.mul_add(b, z));
            let width = x.abs().mul_add(half_a, y.abs().mul_add(half_b, slack));
            // The least of the greatest values, and the greatest of the least.
            least = least.min(center + width);
            greatest = greatest.max(center - width);
        }
        // How fast rays come nearer to the plane.
        let [x, y, z, distance, slack] = self.plane;
        let center = x.mul_add(a, y.mul_add(b, z));
        let width = x.abs().mul_add(half_a, y.abs() * half_b);
        (zero.le(least) | greatest.le(zero))
            & (distance - slack).le(window.farthest * (center + width))
            & (window.nearest * (center - width)).le(distance + slack)
            & self.near.le(window.farthest)
            & window.nearest.le(self.far)
            & self.low[0].le(window.high[0])
            & window.low[0].le(self.high[0])
            & self.low[1].le(window.high[1])
            & window.low[1].le(self.high[1])
    }
}

/// Rows of sixteen numbers, as vectors take them.
type Row = [f32; 16];

/// Up to sixteen triangles, coordinate by coordinate.
#[derive(Clone)]
#[repr(C, align(64))]
pub struct Block {
    /// `corners[corner][axis]`, in the scene's axes.
    corners: [[Row; 3]; 3],
    /// Their planes' normals, likewise.
    normal: [Row; 3],
    /// The rows of their outlines.
    edges: [[Row; 4]; 3],
    plane: [Row; 5],
    low: [Row; 2],
    high: [Row; 2],
    near: Row,
    far: Row,
}

impl Block {
    /// A block of zeros.
    pub const fn new() -> Self {
        const ROW: Row = [0.0; 16];
        Self {
            corners: [[ROW; 3]; 3],
            normal: [ROW; 3],
            plane: [ROW; 5],
            edges: [[ROW; 4]; 3],
            low: [ROW; 2],
            high: [ROW; 2],
            near: ROW,
            far: ROW,
        }
    }

    /// Puts a triangle into a lane.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, triangle: &Triangle) {
        let lane = lane & 15;
        for i in 0..3 {
            for j in 0..3 {
                self.corners[i][j][lane] = triangle.corners[i][j];
            }
            self.normal[i][lane] = triangle.plane[i];
        }
    }

    /// Works out all lanes' outlines, which it keeps, and gives them.
    #[inline(always)]
    pub fn outline<L: Lanes<16>>(&mut self, beam: &Beam<L>) -> Outline<L> {
        let zero = L::splat(0.0);
        let apex = [0, 1, 2].map(|i| beam.apex[beam.axes[i]]);
        let mut points = [[zero; 3]; 3];
        let mut original = [[zero; 3]; 3];
        let mut far = zero;
        for corner in 0..3 {
            for axis in 0..3 {
                let place = L::load(&self.corners[corner][beam.axes[axis]]);
                original[corner][axis] = place;
                let offset = place - L::splat(apex[axis]);
                far = far.max(offset.abs());
                points[corner][axis] = if axis == 2 { offset * L::splat(beam.sign) } else { offset };
            }
        }
        let slack = far * L::splat(SLACK) + L::splat(TINY);

        // Each edge with the apex spans a plane. From p x (q - p) instead of p x q: an edge is known to
        // a rounding of its own length, not of its distance.
        let mut edges = [[zero; 4]; 3];
        for i in 0..3 {
            let (p, from, to) = (&points[i], &original[i], &original[(i + 1) % 3]);
            let e = [to[0] - from[0], to[1] - from[1], (to[2] - from[2]) * L::splat(beam.sign)];
            let size = e[0].abs() + e[1].abs() + e[2].abs();
            edges[i] = [
                p[1] * e[2] - p[2] * e[1],
                p[2] * e[0] - p[0] * e[2],
                p[0] * e[1] - p[1] * e[0],
                slack * (size + slack) + L::splat(TINY),
            ];
        }

        // The box that the corners span, if all are in front.
        let [z0, z1, z2] = [points[0][2], points[1][2], points[2][2]];
        let (near, back) = (z0.min(z1).min(z2), z0.max(z1).max(z2));
        let in_front = (slack + slack).lt(near);
        let one = L::splat(1.0);
        let rates = [one / z0, one / z1, one / z2];
        let widen = (slack + slack) * rates[0].max(rates[1]).max(rates[2]);
        let infinite = L::splat(f32::INFINITY);
        let (mut low, mut high) = ([zero; 2], [zero; 2]);
        for side in 0..2 {
            let slopes = [points[0][side] * rates[0], points[1][side] * rates[1], points[2][side] * rates[2]];
            let least = slopes[0].min(slopes[1]).min(slopes[2]) - widen;
            let greatest = slopes[0].max(slopes[1]).max(slopes[2]) + widen;
            low[side] = L::select(in_front, least, zero - infinite);
            high[side] = L::select(in_front, greatest, infinite);
        }

        // The plane, turned so that the apex is behind it. Too near, it may be on either side; so it is
        // for a triangle without area, whose normal is zero.
        let n = [
            L::load(&self.normal[beam.axes[0]]),
            L::load(&self.normal[beam.axes[1]]),
            L::load(&self.normal[beam.axes[2]]) * L::splat(beam.sign),
        ];
        let distance = n[0] * points[0][0] + n[1] * points[0][1] + n[2] * points[0][2];
        let sure = slack.lt(distance.abs());
        let turned = L::splat(1.0).copysign(distance);
        let turned = L::select(sure, turned, zero);
        let plane = [n[0] * turned, n[1] * turned, n[2] * turned, distance * turned, slack];

        let outline = Outline { edges, plane, low, high, near: near - slack, far: back + slack };
        self.keep(&outline);
        outline
    }

    #[inline(always)]
    fn keep<L: Lanes<16>>(&mut self, outline: &Outline<L>) {
        for i in 0..3 {
            for j in 0..4 {
                self.edges[i][j] = outline.edges[i][j].store();
            }
        }
        for j in 0..5 {
            self.plane[j] = outline.plane[j].store();
        }
        for side in 0..2 {
            self.low[side] = outline.low[side].store();
            self.high[side] = outline.high[side].store();
        }
        self.near = outline.near.store();
        self.far = outline.far.store();
    }

    /// The edges of one lane's triangle: coefficients over the slopes, and slacks.
    #[inline(always)]
    pub fn edges_of(&self, lane: usize) -> [[f32; 4]; 3] {
        let lane = lane & 15;
        let mut edges = [[0.0; 4]; 3];
        for i in 0..3 {
            for j in 0..4 {
                edges[i][j] = self.edges[i][j][lane];
            }
        }
        edges
    }

    /// The outline of one lane's triangle, in every lane.
    #[inline(always)]
    pub fn one<L: Lanes<16>>(&self, lane: usize) -> Outline<L> {
        let lane = lane & 15;
        let zero = L::splat(0.0);
        let mut edges = [[zero; 4]; 3];
        for i in 0..3 {
            for j in 0..4 {
                edges[i][j] = L::splat(self.edges[i][j][lane]);
            }
        }
        let mut plane = [zero; 5];
        for j in 0..5 {
            plane[j] = L::splat(self.plane[j][lane]);
        }
        Outline {
            edges,
            plane,
            low: [L::splat(self.low[0][lane]), L::splat(self.low[1][lane])],
            high: [L::splat(self.high[0][lane]), L::splat(self.high[1][lane])],
            near: L::splat(self.near[lane]),
            far: L::splat(self.far[lane]),
        }
    }
}
