//! A triangle clipped to a box: the tight bounds that perfect splits ask for (Wald & Havran,
//! "On building fast kd-Trees for Ray Tracing", 2006; polygon clipping after Sutherland &
//! Hodgman, 1974).
//!
//! The work is done in double precision. Coordinates that come straight from a corner or from a
//! face of the box are exact; interpolated ones carry an error bound. Bounds are rounded outward
//! by it and to the enclosing floats, so a clipped box always holds the true intersection.

use super::Aabb;
use super::triangle::Corners;
use glam::Vec3;

/// A corner of the clipped polygon and how far it may be off, axis by axis.
#[derive(Clone, Copy)]
struct Vertex {
    at: [f64; 3],
    error: [f64; 3],
    /// Whether the true polygon has this vertex, and not just a number near it.
    certain: bool,
}

const NOWHERE: Vertex = Vertex { at: [0.0; 3], error: [0.0; 3], certain: true };

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
    step_error: [f64; 3],
}

impl Polygon {
    /// A whole triangle. Its corners must be finite.
    pub fn new(corners: &Corners) -> Self {
        let mut vertices = [NOWHERE; MAX_VERTICES];
        let mut step_error = [0f64; 3];
        for (vertex, corner) in vertices.iter_mut().zip(corners) {
            vertex.at = corner.map(f64::from);
            for axis in 0..3 {
                step_error[axis] = step_error[axis].max(vertex.at[axis].abs() * INTERPOLATION_ERROR);
            }
        }
        Self { vertices, count: 3, step_error }
    }

    /// Whether nothing is left.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Least and greatest coordinate along an axis, widened by the error bounds.
    pub fn range(&self, axis: usize) -> (f64, f64) {
        self.vertices[..self.count].iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), vertex| {
            (low.min(vertex.at[axis] - vertex.error[axis]), high.max(vertex.at[axis] + vertex.error[axis]))
        })
    }

    /// Least and greatest coordinate along an axis, narrowed by the error bounds: what the true
    /// polygon reaches for certain. An empty range if nothing is.
    pub fn certain_range(&self, axis: usize) -> (f64, f64) {
        let certain = self.vertices[..self.count].iter().filter(|vertex| vertex.certain);
        certain.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), vertex| {
            (low.min(vertex.at[axis] + vertex.error[axis]), high.max(vertex.at[axis] - vertex.error[axis]))
        })
    }

    /// Keeps what lies on one side of an axis-aligned plane, the plane included: coordinates of
    /// at most `position` if `below`, of at least `position` otherwise. What could lie there
    /// within its error is kept.
    pub fn clip(&mut self, axis: usize, position: f32, below: bool) {
        let position = f64::from(position);
        let sign = if below { -1.0 } else { 1.0 };
        let distance = |v: &Vertex| (v.at[axis] - position) * sign;
        let old = &self.vertices[..self.count];
        if old.iter().all(|v| distance(v) >= 0.0) {
            return;
        }

        let mut kept = [NOWHERE; MAX_VERTICES];
        let mut count = 0;
        let mut keep = |vertex: Vertex| {
            if count < MAX_VERTICES {
                kept[count] = vertex;
                count += 1;
            }
        };
        for (i, from) in old.iter().enumerate() {
            let to = &old[(i + 1) % old.len()];
            let (df, dt) = (distance(from), distance(to));
            if df >= -from.error[axis] {
                let certain = from.certain && df >= from.error[axis];
                keep(Vertex { certain, ..*from });
            }
            if (df > 0.0 && dt < 0.0) || (df < 0.0 && dt > 0.0) {
                keep(self.crossing(from, to, [df, dt], axis, position));
            }
        }
        (self.vertices, self.count) = (kept, count);
    }

    /// Where the edge between two vertices crosses the plane that they are `distances` away from, on
    /// opposite sides.
    fn crossing(&self, from: &Vertex, to: &Vertex, [df, dt]: [f64; 2], axis: usize, position: f64) -> Vertex {
        let s = df / (df - dt);
        // An edge nearly parallel to the plane crosses it wherever its ends' errors let it.
        let slack = (from.error[axis].max(to.error[axis]) / (df - dt).abs()).min(1.0);
        let crosses = df.abs() >= from.error[axis] && dt.abs() >= to.error[axis];
        let mut point = Vertex { certain: from.certain && to.certain && crosses, ..NOWHERE };
        for i in 0..3 {
            let (a, b) = (from.at[i], to.at[i]);
            point.error[i] = from.error[i].max(to.error[i]);
            if i == axis {
                (point.at[i], point.error[i]) = (position, 0.0);
            } else if a == b {
                point.at[i] = a;
            } else {
                point.at[i] = (a + (b - a) * s).clamp(a.min(b), a.max(b));
                point.error[i] += self.step_error[i] + (b - a).abs() * slack;
            }
        }
        point
    }

    /// The least box of floats around the polygon and its errors.
    fn bounds(&self) -> Aabb {
        let mut bounds = Aabb::EMPTY;
        for axis in 0..3 {
            let (low, high) = self.range(axis);
            bounds.min[axis] = round_down(low);
            bounds.max[axis] = round_up(high);
        }
        bounds
    }
}

/// The bounds of the part of a triangle inside a box, itself inside the box; `None` where they
/// share no point. Faces of the box belong to it.
pub fn clipped_bounds(corners: &Corners, within: &Aabb) -> Option<Aabb> {
    let mut polygon = Polygon::new(corners);
    for axis in 0..3 {
        polygon.clip(axis, within.min[axis], false);
        polygon.clip(axis, within.max[axis], true);
        if polygon.is_empty() {
            return None;
        }
    }
    let bounds = polygon.bounds();
    let inside = Aabb { min: Vec3::max(bounds.min, within.min), max: Vec3::min(bounds.max, within.max) };
    (!inside.is_empty()).then_some(inside)
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

    const TRIANGLE: Corners = [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]];

    fn cube(min: [f32; 3], max: [f32; 3]) -> Aabb {
        Aabb { min: min.into(), max: max.into() }
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
}
