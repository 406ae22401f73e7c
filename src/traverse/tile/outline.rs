//! Triangles as a beam sees them, and which of them some ray of a packet may hit.
//!
//! The question is asked three times, each time of sixteen pairs at once, by the same code:
//! sixteen triangles against the whole beam, then the triangles that are left one by one against
//! sixteen packets, or the packets one by one against sixteen triangles. A [`Window`] is what a packet
//! (or the beam) sees: places `a` and `b` in a rectangle, depths in an interval. An [`Outline`] is what
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
//! Parallel rays see corners where they would cross `z = 0` with them, at depth 1 as it were; and meet a
//! plane at the depth `(d - n . (a, b, 0)) / (n . slopes)`.
//!
//! **Nothing is lost.** Every test of [`crate::geometry::triangle`] answers for corners moved by no
//! more than some 16 roundings of `far`, the greatest coordinate of the triangle relative to the apex.
//! Outlines are widened by [`SLACK`], 128 roundings of it, which covers that and the roundings of what
//! is computed here. What is left goes through the mode's own test: culling decides about time, never
//! about a hit.

use super::beam::{Beam, Frame, Spread};
use crate::geometry::triangle::{Placed, Row, side};
use crate::kdtree::Tree;
use crate::simd::{Lanes, Sixteen};

/// By how much outlines are widened, relative to the farthest corner.
const SLACK: f32 = 128.0 / (1 << 24) as f32;

impl Spread {
    /// By how much outlines are widened whatever their distance.
    #[inline(always)]
    fn slack(&self) -> f32 {
        self.range * SLACK + self.stray * 4.0
    }

    /// What places in a window may be off by: a few roundings of slopes, or of coordinates.
    #[inline(always)]
    pub fn blur<const PARALLEL: bool>(&self) -> f32 {
        if PARALLEL { self.range * 1e-6 + TINY } else { 1e-6 }
    }
}

/// Keeps the slack above what underflows.
const TINY: f32 = 1e-36;

/// What sixteen packets see of the scene, or one (in every lane).
#[derive(Clone, Copy)]
pub struct Window<L> {
    /// Least and greatest places.
    pub low: [L; 2],
    pub high: [L; 2],
    /// Their middle, and half their width.
    pub center: [L; 2],
    pub half: [L; 2],
    /// Depths.
    pub nearest: L,
    pub farthest: L,
}

impl<L: Sixteen> Window<L> {
    /// The window of places from `low` to `high`, which are off by less than `blur`.
    #[inline(always)]
    pub fn new(low: [L; 2], high: [L; 2], nearest: L, farthest: L, blur: f32) -> Self {
        let half = L::splat(0.5);
        let center = [(low[0] + high[0]) * half, (low[1] + high[1]) * half];
        let more = L::splat(blur);
        let half = [(high[0] - low[0]) * half + more, (high[1] - low[1]) * half + more];
        Self { low, high, center, half, nearest, farthest }
    }

    /// The same in memory, for the packets to be taken one by one.
    #[inline(always)]
    pub fn rows(&self) -> Rows {
        let Self { low, high, center, half, nearest, farthest } = self;
        let [low, high] = [[low[0].store(), low[1].store()], [high[0].store(), high[1].store()]];
        let [center, half] = [[center[0].store(), center[1].store()], [half[0].store(), half[1].store()]];
        Rows { low, high, center, half, nearest: nearest.store(), farthest: farthest.store() }
    }
}

/// A [`Window`] in memory.
#[repr(C, align(64))]
pub struct Rows {
    low: [Row; 2],
    high: [Row; 2],
    center: [Row; 2],
    half: [Row; 2],
    nearest: Row,
    farthest: Row,
}

impl Rows {
    /// What one packet sees, in every lane.
    #[inline(always)]
    pub fn one<L: Sixteen>(&self, packet: usize) -> Window<L> {
        let packet = packet & 15;
        Window {
            low: [L::splat(self.low[0][packet]), L::splat(self.low[1][packet])],
            high: [L::splat(self.high[0][packet]), L::splat(self.high[1][packet])],
            center: [L::splat(self.center[0][packet]), L::splat(self.center[1][packet])],
            half: [L::splat(self.half[0][packet]), L::splat(self.half[1][packet])],
            nearest: L::splat(self.nearest[packet]),
            farthest: L::splat(self.farthest[packet]),
        }
    }
}

/// What is seen of sixteen triangles, or of one (in every lane).
pub struct Outline<L, const PARALLEL: bool> {
    /// For each edge `p x q`, and its slack.
    edges: [[L; 4]; 3],
    /// The plane: the last is the slack of its distance from the apex. From an apex, the normal, and the
    /// distance, which is not negative; parallel, the distance as a function of the place, and how fast
    /// rays come nearer, which is not negative.
    plane: [L; 5],
    /// Slopes and depths, slack included.
    low: [L; 2],
    high: [L; 2],
    near: L,
    far: L,
}

impl<L: Sixteen, const PARALLEL: bool> Outline<L, PARALLEL> {
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
        // From an apex: how fast rays come nearer to the plane. Parallel: how far away it is.
        let [x, y, z, other, slack] = self.plane;
        let center = x.mul_add(a, y.mul_add(b, z));
        let width = x.abs().mul_add(half_a, y.abs() * half_b);
        let in_time = if PARALLEL {
            (center - width - slack).le(window.farthest * other)
                & (window.nearest * other).le(center + width + slack)
        } else {
            (other - slack).le(window.farthest * (center + width))
                & (window.nearest * (center - width)).le(other + slack)
        };
        (zero.le(least) | greatest.le(zero))
            & in_time
            & self.near.le(window.farthest)
            & window.nearest.le(self.far)
            & self.low[0].le(window.high[0])
            & window.low[0].le(self.high[0])
            & self.low[1].le(window.high[1])
            & window.low[1].le(self.high[1])
    }
}

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
    /// What the tests of rays from an apex want.
    pub placed: Placed,
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
            placed: Placed::at_apex(),
        }
    }

    /// Puts triangles of a tree into the first lanes; the lanes beyond the last repeat the first one.
    #[inline(always)]
    pub fn fill<L: Sixteen, T: Tree>(&mut self, primitives: &[u32], tree: &T) {
        let mut triangles = [tree.triangle(primitives[0]); 16];
        for (lane, id) in primitives.iter().enumerate().take(16) {
            triangles[lane] = tree.triangle(*id);
        }
        for four in 0..3 {
            let mut fours = [&[0.0; 4]; 16];
            for lane in 0..16 {
                fours[lane] = &triangles[lane].fours()[four];
            }
            let columns = L::of_fours(&fours);
            for (i, column) in columns.into_iter().enumerate() {
                let place = 4 * four + i;
                let row = match place / 3 {
                    3 => &mut self.normal[place % 3],
                    corner => &mut self.corners[corner][place % 3],
                };
                *row = column.store();
            }
        }
    }

    /// Works out all lanes' outlines.
    #[inline(always)]
    pub fn outline<L: Sixteen, const PARALLEL: bool>(
        &mut self,
        beam: &Beam<L, PARALLEL>,
    ) -> Outline<L, PARALLEL> {
        let zero = L::splat(0.0);
        let Frame { axes, sign, slopes, .. } = &beam.frame;
        let apex = [0, 1, 2].map(|i| beam.frame.apex[axes[i]]);
        let mut points = [[zero; 3]; 3];
        let mut original = [[zero; 3]; 3];
        let along = [L::splat(slopes[0]), L::splat(slopes[1])];
        let mut far = zero;
        for corner in 0..3 {
            for axis in 0..3 {
                let place = L::load(&self.corners[corner][axes[axis]]);
                original[corner][axis] = place;
                let offset = place - L::splat(apex[axis]);
                far = far.max(offset.abs());
                points[corner][axis] = if axis == 2 { offset * L::splat(*sign) } else { offset };
            }
        }
        let slack = far * L::splat(SLACK) + L::splat(beam.spread.slack() + TINY);
        let (z0, z1, z2) = (points[0][2], points[1][2], points[2][2]);
        let (near, back) = (z0.min(z1).min(z2), z0.max(z1).max(z2));
        let normal = [
            L::load(&self.normal[axes[0]]),
            L::load(&self.normal[axes[1]]),
            L::load(&self.normal[axes[2]]) * L::splat(*sign),
        ];
        let height = normal[0] * points[0][0] + normal[1] * points[0][1] + normal[2] * points[0][2];
        self.placed.height = height.store();
        let plane = plane::<L, PARALLEL>(&normal, height, &along, slack);

        // Each edge with the apex spans a plane. From p x (q - p) instead of p x q: an edge is known to
        // a rounding of its own length, not of its distance.
        let one = L::splat(1.0);
        let mut edges = [[zero; 4]; 3];
        for i in 0..3 {
            let (mut p, from, to) = (points[i], &original[i], &original[(i + 1) % 3]);
            let mut e = [to[0] - from[0], to[1] - from[1], (to[2] - from[2]) * L::splat(*sign)];
            if PARALLEL {
                p = [p[0] - along[0] * p[2], p[1] - along[1] * p[2], one];
                e = [e[0] - along[0] * e[2], e[1] - along[1] * e[2], zero];
            }
            let size = e[0].abs() + e[1].abs() + e[2].abs();
            let off = if PARALLEL { slack + slack } else { slack };
            edges[i] = [
                p[1] * e[2] - p[2] * e[1],
                p[2] * e[0] - p[0] * e[2],
                p[0] * e[1] - p[1] * e[0],
                off * (size + off) + L::splat(TINY),
            ];
            if PARALLEL {
                points[i] = p;
            }
        }

        // The box that the corners span; from an apex, if all are in front.
        let infinite = L::splat(f32::INFINITY);
        let (mut low, mut high) = ([zero; 2], [zero; 2]);
        if PARALLEL {
            let widen = slack + slack;
            for side in 0..2 {
                let places = [points[0][side], points[1][side], points[2][side]];
                low[side] = places[0].min(places[1]).min(places[2]) - widen;
                high[side] = places[0].max(places[1]).max(places[2]) + widen;
            }
        } else {
            let in_front = (slack + slack).lt(near);
            let rates = [one / z0, one / z1, one / z2];
            let widen = (slack + slack) * rates[0].max(rates[1]).max(rates[2]);
            for side in 0..2 {
                let places =
                    [points[0][side] * rates[0], points[1][side] * rates[1], points[2][side] * rates[2]];
                let least = places[0].min(places[1]).min(places[2]) - widen;
                let greatest = places[0].max(places[1]).max(places[2]) + widen;
                low[side] = L::select(in_front, least, zero - infinite);
                high[side] = L::select(in_front, greatest, infinite);
            }
        }

        self.placed.depths = [(near * L::splat(*sign)).store(), (back * L::splat(*sign)).store()];
        Outline { edges, plane, low, high, near: near - slack, far: back + slack }
    }

    /// Keeps the outlines for [`one`](Self::one), and what the tests want.
    #[inline(always)]
    pub fn keep<L: Sixteen, const PARALLEL: bool>(&mut self, outline: &Outline<L, PARALLEL>, frame: &Frame) {
        let (zero, sign) = (L::splat(0.0), L::splat(frame.sign));
        let mut flat = L::mask_from_bits(0xffff);
        for i in 0..3 {
            self.placed.normal[i] = self.normal[frame.axes[i]];
            flat = flat & L::load(&self.placed.normal[i]).eq(zero);
            // A slope in the frame is the ray's times the sign.
            let [x, y, z, _] = outline.edges[i];
            self.placed.edges[i] = [(x * sign).store(), (y * sign).store(), z.store()];
        }
        let slack = outline.edges[0][3].max(outline.edges[1][3]).max(outline.edges[2][3]);
        self.placed.slack = L::select(flat, L::splat(f32::INFINITY), slack).store();
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

    /// What an edge of one lane's triangle is for rays at places `a` and `b`.
    #[inline(always)]
    pub fn side<const W: usize, R: Lanes<W>>(&self, lane: usize, edge: usize, a: R, b: R) -> R {
        let [x, y, z, _] = &self.edges[edge];
        side([x, y, z], lane, a, b)
    }

    /// The plane of one lane's triangle.
    #[inline(always)]
    pub fn plane_of(&self, lane: usize) -> [f32; 5] {
        let lane = lane & 15;
        [0, 1, 2, 3, 4].map(|i| self.plane[i][lane])
    }

    /// The outline of one lane's triangle, in every lane.
    #[inline(always)]
    pub fn one<L: Sixteen, const PARALLEL: bool>(&self, lane: usize) -> Outline<L, PARALLEL> {
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

/// What an outline keeps of planes at a distance from the apex.
#[inline(always)]
fn plane<L: Sixteen, const PARALLEL: bool>(n: &[L; 3], distance: L, along: &[L; 2], slack: L) -> [L; 5] {
    let (zero, one) = (L::splat(0.0), L::splat(1.0));
    if PARALLEL {
        let speed = n[0] * along[0] + n[1] * along[1] + n[2];
        let turned = one.copysign(speed);
        return [(zero - n[0]) * turned, (zero - n[1]) * turned, distance * turned, speed * turned, slack];
    }
    // Turned so that the apex is behind it. Too near, it may be on either side; so it is for a triangle
    // without area, whose normal is zero.
    let turned = L::select(slack.lt(distance.abs()), one.copysign(distance), zero);
    [n[0] * turned, n[1] * turned, n[2] * turned, distance * turned, slack]
}
