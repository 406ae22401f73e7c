//! The surface area heuristic (MacDonald & Booth 1990): what a split is expected to cost.
//!
//! A ray that meets a cell meets a part of it with a probability of the ratio of their areas, so
//! a split costs `traversal + intersection * (p_below n_below + p_above n_above)`.

use super::params::BuildParams;
use crate::geometry::Aabb;
use crate::simd::Lanes;
use glam::Vec4;

/// An axis-aligned plane that divides a cell, and the side on which triangles that lie in the
/// plane go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Split {
    /// 0, 1 or 2.
    pub axis: usize,
    /// Coordinate along the axis.
    pub position: f32,
    /// Whether triangles in the plane go below it.
    pub planar_below: bool,
    /// Expected cost, in the units of the parameters.
    pub cost: f64,
}

/// The cost model of one cell.
#[derive(Clone, Debug)]
pub struct CellCost<'a> {
    params: &'a BuildParams,
    cell: Aabb,
    clearance: f32,
    inverse_area: f64,
}

impl<'a> CellCost<'a> {
    /// The model for a cell in which planes keep so far away from what they part; `None` if the cell has no area (a
    /// point or a line), where probabilities mean nothing and no split can help.
    pub fn new(params: &'a BuildParams, cell: Aabb, clearance: f32) -> Option<Self> {
        let area = cell.area();
        (area > 0.0 && area.is_finite()).then(|| Self { params, cell, clearance, inverse_area: 1.0 / area })
    }

    /// How far planes keep away from what they part.
    pub fn clearance(&self) -> f32 {
        self.clearance
    }

    /// What a leaf of `count` triangles costs.
    #[inline]
    pub fn leaf(&self, count: usize) -> f64 {
        f64::from(self.params.intersection_cost) * count as f64
    }

    /// Whether planes across an axis could divide anything.
    #[inline(always)]
    pub fn has_extent(&self, axis: usize) -> bool {
        self.cell.min[axis] < self.cell.max[axis]
    }

    /// The cell's faces along an axis.
    #[inline(always)]
    pub fn range(&self, axis: usize) -> (f32, f32) {
        (self.cell.min[axis], self.cell.max[axis])
    }

    /// The planes across all axes at once.
    #[inline]
    pub fn axes(&self) -> AxesCost {
        let [x, y, z] = [0, 1, 2].map(|axis| self.axis(axis).lanes());
        let of = |part: fn(&LaneCost) -> f32| Vec4::new(part(&x), part(&y), part(&z), 1.0);
        AxesCost {
            low: of(|axis| axis.low),
            high: of(|axis| axis.high),
            cap: of(|axis| axis.cap),
            slope: of(|axis| axis.side) / of(|axis| axis.length),
            traversal: Vec4::splat(x.traversal),
        }
    }

    /// What a split costs by what its children are known to cost.
    pub fn of_children(&self, axis: usize, position: f32, [below, above]: [f64; 2]) -> f64 {
        let [p_below, p_above] = self.axis(axis).probabilities(position);
        f64::from(self.params.traversal_cost) + p_below * below + p_above * above
    }

    /// Prepares the planes across one axis.
    #[inline]
    pub fn axis(&self, axis: usize) -> AxisCost {
        let low = f64::from(self.cell.min[axis]);
        let high = f64::from(self.cell.max[axis]);
        let extent = self.cell.max.as_dvec3() - self.cell.min.as_dvec3();
        let (e1, e2) = (extent[(axis + 1) % 3], extent[(axis + 2) % 3]);
        AxisCost {
            axis,
            low,
            high,
            cap: 2.0 * e1 * e2 * self.inverse_area,
            wall: 2.0 * (e1 + e2) * self.inverse_area,
            face: 1.5 * f64::from(self.clearance),
            traversal: f64::from(self.params.traversal_cost),
            intersection: f64::from(self.params.intersection_cost),
            kept: 1.0 - f64::from(self.params.empty_bonus),
        }
    }
}

/// Costs of planes across one axis of a cell.
#[derive(Clone, Copy, Debug)]
pub struct AxisCost {
    axis: usize,
    low: f64,
    high: f64,
    /// Area of both ends, relative to the cell's.
    cap: f64,
    /// Area of the walls for each unit of length, relative to the cell's.
    wall: f64,
    /// How near to a face a plane is in it, if it parts nothing.
    face: f64,
    traversal: f64,
    intersection: f64,
    /// What is left of a cost when one side is empty.
    kept: f64,
}

impl AxisCost {
    /// How likely a ray that meets the cell meets the parts below and above a plane.
    #[inline]
    fn probabilities(&self, position: f32) -> [f64; 2] {
        let x = f64::from(position);
        [self.cap + self.wall * (x - self.low), self.cap + self.wall * (self.high - x)]
    }

    /// The same model in single precision, for many planes at once.
    #[inline]
    pub fn lanes(&self) -> LaneCost {
        let length = self.high - self.low;
        LaneCost {
            low: self.low as f32,
            high: self.high as f32,
            length: length as f32,
            low_face: (self.low + self.face) as f32,
            high_face: (self.high - self.face) as f32,
            cap: (self.cap * self.intersection) as f32,
            side: (self.wall * length * self.intersection) as f32,
            traversal: self.traversal as f32,
            kept: self.kept as f32,
        }
    }

    /// The cost of a plane with `below` and `above` triangles on its sides, or infinity if the
    /// plane divides nothing.
    #[inline]
    pub fn cost(&self, position: f32, below: usize, above: usize) -> f64 {
        let x = f64::from(position);
        let (flat_below, flat_above) = (x <= self.low + self.face, x >= self.high - self.face);
        // A plane in a face cuts off a flat cell: that only helps if the triangles are divided. One that is as near to a
        // face as planes keep away from triangles would be found again and again.
        if (flat_below || flat_above) && (below == 0 || above == 0) {
            return f64::INFINITY;
        }
        let [p_below, p_above] = self.probabilities(position);
        let cost = self.traversal + self.intersection * (p_below * below as f64 + p_above * above as f64);
        if below == 0 || above == 0 { cost * self.kept } else { cost }
    }

    /// The better of the two sides for `planar` triangles that lie in the plane.
    #[inline]
    pub fn split(&self, position: f32, below: usize, planar: usize, above: usize) -> Split {
        let with_below = self.cost(position, below + planar, above);
        let with_above = if planar == 0 { with_below } else { self.cost(position, below, above + planar) };
        let planar_below = with_below <= with_above;
        Split { axis: self.axis, position, planar_below, cost: with_below.min(with_above) }
    }
}

/// [`AxisCost`] for vectors of planes.
#[derive(Clone, Copy, Debug)]
pub struct LaneCost {
    low: f32,
    high: f32,
    length: f32,
    low_face: f32,
    high_face: f32,
    /// What a triangle costs that only the ends' area counts for, and what all the walls add.
    cap: f32,
    side: f32,
    traversal: f32,
    kept: f32,
}

impl LaneCost {
    /// The costs of planes inside or in the faces of the cell with so many triangles on their sides, or
    /// infinity where nothing is divided.
    #[inline(always)]
    pub fn of<const W: usize, L: Lanes<W>>(&self, plane: L, below: L, above: L) -> L {
        let (cap, side, zero) = (L::splat(self.cap), L::splat(self.side), L::splat(0.0));
        let (low, high, length) = (L::splat(self.low), L::splat(self.high), L::splat(self.length));
        let costs_below = (cap + side * ((plane - low) / length)) * below;
        let costs_above = (cap + side * ((high - plane) / length)) * above;
        let cost = L::splat(self.traversal) + (costs_below + costs_above);
        let none = below.le(zero) | above.le(zero);
        let in_face = plane.le(L::splat(self.low_face)) | L::splat(self.high_face).le(plane);
        let cost = L::select(none, cost * L::splat(self.kept), cost);
        L::select(none & in_face, L::splat(f32::INFINITY), cost)
    }
}

/// [`AxisCost`] of three planes, one across each axis, both sides of which hold something. The last lane
/// means nothing.
#[derive(Clone, Copy, Debug)]
pub struct AxesCost {
    low: Vec4,
    high: Vec4,
    cap: Vec4,
    /// What the walls add to `cap` for each unit of length.
    slope: Vec4,
    traversal: Vec4,
}

impl AxesCost {
    /// The costs; NaN or infinite across an axis along which the cell has no extent.
    #[inline(always)]
    pub fn of(&self, planes: Vec4, below: Vec4, above: Vec4) -> Vec4 {
        let costs_below = (self.cap + self.slope * (planes - self.low)) * below;
        let costs_above = (self.cap + self.slope * (self.high - planes)) * above;
        self.traversal + (costs_below + costs_above)
    }
}

/// The cheaper of two splits; the first where they cost the same, so that the result does not
/// depend on anything but the order in which planes are visited.
#[inline]
pub fn cheaper(best: Option<Split>, candidate: Split) -> Option<Split> {
    match best {
        Some(best) if best.cost <= candidate.cost => Some(best),
        _ if candidate.cost.is_finite() => Some(candidate),
        _ => best,
    }
}
