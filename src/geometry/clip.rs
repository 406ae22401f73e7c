//! A triangle clipped to a box: the tight bounds that perfect splits ask for (Wald & Havran,
//! "On building fast kd-Trees for Ray Tracing", 2006; polygon clipping after Sutherland &
//! Hodgman, 1974).
//!
//! The work is done in double precision. Coordinates that come straight from a corner or from a
//! face of the box are exact; interpolated ones carry an error bound. Bounds are rounded outward
//! by it and to the enclosing floats, so a clipped box always holds the true intersection.

use super::Aabb;
use super::triangle::Corners;

/// A corner of the clipped polygon and how far it may be off, axis by axis. The fourth lanes are there
/// for registers of four.
#[derive(Clone, Copy)]
struct Vertex {
    at: [f64; 4],
    /// Its last lane is 0 where the true polygon has this vertex for certain, not just a number near it.
    error: [f64; 4],
}

const NOWHERE: Vertex = Vertex { at: [0.0; 4], error: [0.0; 4] };

impl Vertex {
    /// Whether the true polygon has it.
    fn is_certain(&self) -> bool {
        self.error[3] == 0.0
    }
}

/// A triangle has three corners, and each of six planes adds at most one; rounding can make a
/// sliver of a polygon not quite convex, so there is room for a few more.
const MAX_VERTICES: usize = 16;

/// Relative error of an interpolated coordinate: some roundings of 2^-53 each.
const INTERPOLATION_ERROR: f64 = 1.0 / (1u64 << 49) as f64;

/// A convex polygon: what is left of a triangle.
#[derive(Clone)]
pub struct Polygon {
    vertices: [Vertex; MAX_VERTICES],
    count: usize,
    /// Bound of the absolute error that one interpolation adds, axis by axis.
    step_error: [f64; 4],
}

impl Polygon {
    /// Nothing.
    const NONE: Self = Self { vertices: [NOWHERE; MAX_VERTICES], count: 0, step_error: [0.0; 4] };

    /// A whole triangle. Its corners must be finite.
    pub fn new(corners: &Corners) -> Self {
        let mut polygon = Self::NONE;
        polygon.start(corners);
        polygon
    }

    /// Becomes a whole triangle.
    #[inline(always)]
    fn start(&mut self, corners: &Corners) {
        self.count = 3;
        self.step_error = [0.0; 4];
        for (vertex, &[x, y, z]) in self.vertices.iter_mut().zip(corners) {
            *vertex = Vertex { at: [x.into(), y.into(), z.into(), 0.0], ..NOWHERE };
            for axis in 0..4 {
                let error = vertex.at[axis].abs() * INTERPOLATION_ERROR;
                self.step_error[axis] = greater(error, self.step_error[axis]);
            }
        }
    }

    #[inline(always)]
    fn vertices(&self) -> &[Vertex] {
        &self.vertices[..self.count]
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Least and greatest coordinate along an axis, narrowed by the error bounds: what the true
    /// polygon reaches for certain. An empty range if nothing is.
    pub fn certain_range(&self, axis: usize) -> (f64, f64) {
        let certain = self.vertices().iter().filter(|vertex| vertex.is_certain());
        certain.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), vertex| {
            (low.min(vertex.at[axis] + vertex.error[axis]), high.max(vertex.at[axis] - vertex.error[axis]))
        })
    }

    /// Keeps what lies on one side of an axis-aligned plane, the plane included: coordinates of
    /// at most `position` if `below`, of at least `position` otherwise. What could lie there
    /// within its error is kept.
    pub fn clip(&mut self, axis: usize, position: f32, below: bool) {
        if self.reaches_beyond(axis, position, below) {
            let mut kept = Self::NONE;
            self.cut(axis, position, below, &mut kept);
            *self = kept;
        }
    }

    /// Whether [`Polygon::clip`] has anything to do.
    #[inline(always)]
    fn reaches_beyond(&self, axis: usize, position: f32, below: bool) -> bool {
        let position = f64::from(position);
        let mut beyond = false;
        for vertex in self.vertices() {
            let at = vertex.at[axis];
            beyond |= if below { at > position } else { at < position };
        }
        beyond
    }

    /// Writes to `kept` what [`Polygon::clip`] keeps.
    #[inline(always)]
    fn cut(&self, axis: usize, position: f32, below: bool, kept: &mut Self) {
        let position = f64::from(position);
        let sign = if below { -1.0 } else { 1.0 };
        kept.count = 0;
        kept.step_error = self.step_error;
        let Some(mut from) = self.vertices().last() else { return };
        let mut df = (from.at[axis] - position) * sign;
        for to in self.vertices() {
            let dt = (to.at[axis] - position) * sign;
            if (df > 0.0 && dt < 0.0) || (df < 0.0 && dt > 0.0) {
                kept.keep(&self.crossing(from, to, [df, dt], axis, position));
            }
            let error = to.error[axis];
            if dt >= -error {
                kept.keep(to);
                if dt < error {
                    kept.vertices[kept.count - 1].error[3] = 1.0;
                }
            }
            (from, df) = (to, dt);
        }
    }

    /// Adds a vertex; [`MAX_VERTICES`] are enough.
    #[inline(always)]
    fn keep(&mut self, vertex: &Vertex) {
        if self.count < MAX_VERTICES {
            self.vertices[self.count] = *vertex;
            self.count += 1;
        }
    }

    /// The bounds of what lies below a plane and above it, the plane included in both; empty where
    /// nothing does.
    #[inline(always)]
    fn bounds_of_halves(&self, axis: usize, position: f32) -> [Range; 2] {
        let position = f64::from(position);
        let [mut below, mut above] = [Range::EMPTY; 2];
        let Some(mut from) = self.vertices().last() else { return [below, above] };
        let mut df = from.at[axis] - position;
        for to in self.vertices() {
            let dt = to.at[axis] - position;
            if (df > 0.0 && dt < 0.0) || (df < 0.0 && dt > 0.0) {
                let crossing = self.crossing(from, to, [df, dt], axis, position);
                below.grow(&crossing);
                above.grow(&crossing);
            }
            if dt <= to.error[axis] {
                below.grow(to);
            }
            if dt >= -to.error[axis] {
                above.grow(to);
            }
            (from, df) = (to, dt);
        }
        [below, above]
    }

    /// Where the edge between two vertices crosses the plane that they are `distances` away from, on
    /// opposite sides.
    #[inline(always)]
    fn crossing(&self, from: &Vertex, to: &Vertex, [df, dt]: [f64; 2], axis: usize, position: f64) -> Vertex {
        let s = df / (df - dt);
        // An edge nearly parallel to the plane crosses it wherever its ends' errors let it.
        let (error_from, error_to) = (from.error[axis], to.error[axis]);
        let error = greater(error_from, error_to);
        let slack = if error > 0.0 { lesser(error / (df - dt).abs(), 1.0) } else { 0.0 };
        let mut point = NOWHERE;
        for i in 0..4 {
            let (a, b) = (from.at[i], to.at[i]);
            let way = b - a;
            point.at[i] = greater(lesser(a + way * s, greater(a, b)), lesser(a, b));
            let step = self.step_error[i] + way.abs() * slack;
            // What both ends have in common is not interpolated.
            let step = if way == 0.0 { 0.0 } else { step };
            point.error[i] = greater(from.error[i], to.error[i]) + step;
        }
        (point.at[axis], point.error[axis]) = (position, 0.0);
        let crosses = (df.abs() >= error_from) & (dt.abs() >= error_to);
        point.error[3] += if crosses { 0.0 } else { 1.0 };
        point
    }
}

/// The lesser of two numbers, neither NaN: one instruction, where `f64::min` is several.
#[inline(always)]
fn lesser(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

/// The greater of two numbers, neither NaN.
#[inline(always)]
fn greater(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

/// Bounds in the making.
#[derive(Clone, Copy)]
struct Range {
    low: [f64; 4],
    high: [f64; 4],
}

impl Range {
    const EMPTY: Self = Self { low: [f64::INFINITY; 4], high: [f64::NEG_INFINITY; 4] };

    /// Takes in a vertex and its error.
    #[inline(always)]
    fn grow(&mut self, vertex: &Vertex) {
        for i in 0..4 {
            self.low[i] = lesser(vertex.at[i] - vertex.error[i], self.low[i]);
            self.high[i] = greater(vertex.at[i] + vertex.error[i], self.high[i]);
        }
    }

    /// The least box of floats around its part inside a box; `None` where that is empty.
    #[inline(always)]
    fn within(&self, within: &Aabb) -> Option<Aabb> {
        if self.low[0] > self.high[0] {
            return None;
        }
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            // Faces are floats already.
            let (low, high) = (self.low[axis], self.high[axis]);
            let (least, greatest) = (within.min[axis], within.max[axis]);
            bounds.min[axis] = if low <= f64::from(least) { least } else { round_down(low) };
            bounds.max[axis] = if high >= f64::from(greatest) { greatest } else { round_up(high) };
        }
        (!bounds.is_empty()).then_some(bounds)
    }
}

/// Clips triangles, with memory that it keeps from one to the next.
pub struct Clipper {
    /// What a plane is about to cut, and where the rest goes.
    polygons: [Polygon; 2],
}

impl Default for Clipper {
    fn default() -> Self {
        Self { polygons: [const { Polygon::NONE }; 2] }
    }
}

impl Clipper {
    /// The bounds of the part of a triangle inside a box on each side of a plane across it: below, and
    /// above. Each lies inside its half of the box; `None` where the triangle shares no point with that
    /// half. Faces and the plane belong to what they bound.
    #[inline(always)]
    pub fn halves(
        &mut self,
        corners: &Corners,
        within: &Aabb,
        axis: usize,
        position: f32,
    ) -> [Option<Aabb>; 2] {
        let Some(polygon) = self.clip(corners, within) else { return [None; 2] };
        let [below, above] = polygon.bounds_of_halves(axis, position);
        let [half_below, half_above] = within.halves(axis, position);
        [below.within(&half_below), above.within(&half_above)]
    }

    /// The bounds of the part of a triangle inside a box, faces included; `None` if there is none.
    pub fn part(&mut self, corners: &Corners, within: &Aabb) -> Option<Aabb> {
        let polygon = self.clip(corners, within)?;
        let mut range = Range::EMPTY;
        for vertex in polygon.vertices() {
            range.grow(vertex);
        }
        range.within(within)
    }

    /// What is left of a triangle inside a box, if anything is.
    #[inline(always)]
    fn clip(&mut self, corners: &Corners, within: &Aabb) -> Option<&Polygon> {
        let [mut polygon, mut spare] = self.polygons.each_mut();
        polygon.start(corners);
        for axis in 0..3 {
            for (face, below) in [(within.min[axis], false), (within.max[axis], true)] {
                if polygon.reaches_beyond(axis, face, below) {
                    polygon.cut(axis, face, below, spare);
                    std::mem::swap(&mut polygon, &mut spare);
                    if polygon.is_empty() {
                        return None;
                    }
                }
            }
        }
        Some(polygon)
    }
}

/// The greatest float that is not above `x`.
fn round_down(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) > x { nearest.next_down() } else { nearest }
}

/// The least float that is not below `x`.
fn round_up(x: f64) -> f32 {
    let nearest = x as f32;
    if f64::from(nearest) < x { nearest.next_up() } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    const TRIANGLE: Corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn cube(min: [f32; 3], max: [f32; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
    }

    /// The bounds inside a box that some planes around it cut to size.
    fn clipped_bounds(corners: &Corners, within: &Aabb) -> Option<Aabb> {
        let mut clipper = Clipper::default();
        // A plane in the upper face: all is below.
        let [below, _] = clipper.halves(corners, within, 0, within.max.x);
        // One in the lower face: all is above, and the same.
        let [_, above] = clipper.halves(corners, within, 0, within.min.x);
        assert_eq!(below, above);
        below
    }

    #[test]
    fn a_box_around_the_triangle_changes_nothing() {
        let bounds = clipped_bounds(&TRIANGLE, &cube([-1.0; 3], [5.0; 3])).expect("inside");
        assert_eq!(bounds, cube([0.0; 3], [4.0, 4.0, 0.0]));
    }

    #[test]
    fn bounds_are_tight_on_the_slanted_side() {
        let bounds = clipped_bounds(&TRIANGLE, &cube([3.0, -1.0, -1.0], [9.0; 3])).expect("a corner");
        assert_eq!(bounds.min, Vec3::new(3.0, 0.0, 0.0));
        assert_eq!(bounds.max.x, 4.0);
        assert!(bounds.max.y >= 1.0 && bounds.max.y <= 1.0f32.next_up());
    }

    #[test]
    fn a_box_beyond_the_slanted_side_is_missed() {
        assert_eq!(clipped_bounds(&TRIANGLE, &cube([2.5, 2.5, -1.0], [4.0, 4.0, 1.0])), None);
    }

    #[test]
    fn touching_counts() {
        let touched = clipped_bounds(&TRIANGLE, &cube([4.0, -1.0, -1.0], [5.0, 1.0, 1.0])).expect("a corner");
        assert_eq!(touched, cube([4.0, 0.0, 0.0], [4.0, 0.0, 0.0]));
    }

    #[test]
    fn the_clipped_box_holds_points_of_the_triangle_in_the_box() {
        // Points p0 + a e1 + b e2 in double precision that fall into the box must be in the bounds.
        let corners: Corners = [[0.1, -3.3, 7.7], [5.9, 2.2, -1.3], [-2.7, 4.1, 3.9]];
        let within = cube([0.3, -0.7, 1.1], [1.9, 1.3, 3.7]);
        let bounds = clipped_bounds(&corners, &within).expect("they meet");
        let [p0, p1, p2] = corners.map(|c| glam::DVec3::from_array(c.map(f64::from)));
        let mut seen = 0;
        for i in 0..400 {
            for j in 0..400 - i {
                let p = p0 + (p1 - p0) * (f64::from(i) / 400.0) + (p2 - p0) * (f64::from(j) / 400.0);
                if p.cmpge(within.min.as_dvec3()).all() && p.cmple(within.max.as_dvec3()).all() {
                    seen += 1;
                    assert!(p.cmpge(bounds.min.as_dvec3()).all() && p.cmple(bounds.max.as_dvec3()).all());
                }
            }
        }
        assert!(seen > 100);
    }

    #[test]
    fn halves_hold_the_parts_on_their_sides() {
        let mut clipper = Clipper::default();
        let [below, above] = clipper.halves(&TRIANGLE, &cube([-1.0; 3], [5.0; 3]), 0, 1.0);
        assert_eq!(below, Some(cube([0.0; 3], [1.0, 4.0, 0.0])));
        let above = above.expect("most of it");
        assert_eq!((above.min, above.max.x), (Vec3::new(1.0, 0.0, 0.0), 4.0));
        assert!(above.max.y >= 3.0 && above.max.y <= 3.0f32.next_up());
        // The box reaches across the plane, the triangle inside it does not.
        let corner = cube([2.5, 1.0, -1.0], [4.0, 2.0, 1.0]);
        let [below, above] = clipper.halves(&TRIANGLE, &corner, 0, 3.5);
        assert_eq!(above, None);
        let below = below.expect("the corner at 2.5, 1");
        assert!(below.max.x >= 3.0 && below.max.x <= 3.0f32.next_up() && below.max.y >= 1.5);
    }
}
