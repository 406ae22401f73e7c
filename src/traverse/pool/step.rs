//! One ray through one node: eight boxes at once.
//!
//! The ray meets the three near faces and the three far faces of each box, and goes into those that it enters before it
//! leaves them (Kay & Kajiya, "Ray tracing complex scenes", 1986). They are put on its stack, the farthest first,
//! with the places where it enters them.
//!
//! **Faces are as thick as walls.** What [`walk`](crate::traverse::walk) says of the planes of cells holds for boxes around
//! what lies in a cell, too: the point of a hit lies within 16 roundings of the scene's reach of a point of the triangle, that
//! point lies in a box, and faces are 32 such roundings away from where they are. But a face's parameter is computed as
//! `face * inverse - origin * inverse` here, which is off by some roundings of `origin`'s coordinate, however near the face is;
//! so eight roundings of that are added. A NaN, which comes of numbers that overflow, is no face that stops a ray:
//! such a ray goes into boxes for nothing.

use crate::kdtree::{Boxes, Way};
use crate::simd::{Eight, Lanes, Mask};
use crate::traverse::stream::step::{Waiting, eight};
use std::hint::select_unpredictable;

/// Eight roundings.
const SLIP: f32 = 1.0 / (1 << 21) as f32;

/// A ray as boxes see it.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Slabs {
    /// 1 / direction.
    pub inverse: [f32; 3],
    /// What is added for near faces, and for far ones: `-origin / direction`, and their thickness.
    pub near: [f32; 3],
    pub far: [f32; 3],
    pub octant: Octant,
}

/// Which way a ray runs along the axes.
#[derive(Clone, Copy, Debug)]
pub struct Octant(
    /// A bit for each axis along which the ray runs downward, from bit 3 on: there it counts the lanes that the other face of a box
    /// is away, so that a node's numbers are found without a shift for each. (A node takes a fourteenth fewer instructions.)
    u32,
);

impl Octant {
    /// Of a ray that runs downward along the axes whose bit is set.
    #[inline(always)]
    pub const fn new(number: u32) -> Self {
        Self(number << 3)
    }

    /// A bit for each axis along which the ray runs downward.
    #[inline(always)]
    const fn number(self) -> usize {
        (self.0 >> 3 & 7) as usize
    }

    /// Where the near faces of eight boxes across an axis begin among all of theirs across it. (The far ones begin at the other of 0
    /// and 8.)
    #[inline(always)]
    const fn near(self, axis: u32) -> usize {
        (self.0 >> axis & 8) as usize
    }
}

impl Slabs {
    /// Those of no ray.
    pub const NONE: Self = Self { inverse: [0.0; 3], near: [0.0; 3], far: [0.0; 3], octant: Octant::new(0) };

    /// Of a ray from an origin, with 1 / direction and the walls' half-thickness in units of the parameter.
    #[inline(always)]
    pub fn new(origin: &[f32; 3], inverse: &[f32; 3], margin: &[f32; 3]) -> Self {
        let (mut slabs, mut octant) = (Self { inverse: *inverse, ..Self::NONE }, 0);
        for axis in 0..3 {
            [slabs.near[axis], slabs.far[axis]] = thick(origin[axis], inverse[axis], margin[axis]);
            octant |= u32::from(inverse[axis] < 0.0) << axis;
        }
        Self { octant: Octant::new(octant), ..slabs }
    }
}

/// The same with each number in every lane: a ray that goes through many nodes on end spreads it once.
#[derive(Clone, Copy)]
pub struct Spread<L> {
    inverse: [L; 3],
    near: [L; 3],
    far: [L; 3],
    pub octant: Octant,
}

impl<L: Eight> Spread<L> {
    /// Of the numbers that [`Slabs`] has, in all lanes.
    #[inline(always)]
    pub const fn of_numbers(inverse: [L; 3], near: [L; 3], far: [L; 3], octant: Octant) -> Self {
        Self { inverse, near, far, octant }
    }

    /// Of the slabs of a ray.
    #[inline(always)]
    pub fn new(slabs: &Slabs) -> Self {
        Self {
            inverse: spread(&slabs.inverse),
            near: spread(&slabs.near),
            far: spread(&slabs.far),
            octant: slabs.octant,
        }
    }
}

#[cfg(test)]
impl<L: Eight> Spread<L> {
    /// The numbers of which it has one in all lanes.
    pub fn numbers(&self) -> Slabs {
        let first = |[x, y, z]: [L; 3]| [x.store()[0], y.store()[0], z.store()[0]];
        let Self { inverse, near, far, octant } = *self;
        Slabs { inverse: first(inverse), near: first(near), far: first(far), octant }
    }
}

/// Each of three numbers in every lane.
#[inline(always)]
fn spread<L: Eight>([x, y, z]: &[f32; 3]) -> [L; 3] {
    [L::splat(*x), L::splat(*y), L::splat(*z)]
}

/// What is added for the near faces and for the far faces across an axis.
#[inline(always)]
pub fn thick<const W: usize, L: Lanes<W>>(origin: L, inverse: L, margin: L) -> [L; 2] {
    let zero = L::splat(0.0);
    let margin = (origin * inverse).abs().mul_add(L::splat(SLIP), margin);
    [zero - origin * inverse - margin, margin - origin * inverse]
}

/// Takes a node, which was on top of a stack, puts there the boxes that the ray goes into between its ends, and gives the new
/// top and what is there. With `any`, nobody asks which of them is nearest, nor where the ray enters them.
#[inline(always)]
pub fn step<L: Eight>(
    nodes: &[Boxes],
    ray: &Slabs,
    waiting: &mut Waiting,
    (top, way): (usize, Way),
    tnear: f32,
    tfar: f32,
    any: bool,
) -> (usize, Way) {
    let node = &nodes[way.node()];
    let met = meet(node, &Spread::<L>::new(ray), L::splat(tnear), L::splat(tfar), any);
    let count = met.put(waiting, top, any);
    // What is on top now is known before it can be read there.
    let before = waiting.exits[top - 1];
    let way = select_unpredictable(count == 0, before, met.way(node, met.last(), any).0);
    (top + count - 1, Way(way))
}

/// The boxes of a node that a ray goes into, the farthest first, or as the node has them.
pub struct Met<L: Eight> {
    /// The way to what is in each lane's box.
    pub ways: L::Ids,
    /// Which box each lane is, in four bits each, unless they are as the node has them.
    nibbles: u32,
    /// Where the ray enters it.
    pub enters: L,
    /// A bit for each that the ray goes into.
    pub bits: u32,
}

impl<L: Eight> Met<L> {
    /// Those of a node, given where a ray into an octant enters each of its boxes and leaves it. With `any` they stay in the order that the
    /// node has them in.
    #[inline(always)]
    pub fn new(node: &Boxes, octant: Octant, [enters, leaves]: [L; 2], any: bool) -> Self {
        let ways = L::ids_load(&node.ways);
        if any {
            return Self { ways, nibbles: 0, enters, bits: enters.le(leaves).bits() & 0xff };
        }
        // The farthest first.
        let nibbles = node.orders[octant.number()];
        let order = L::ids_nibbles(nibbles);
        let (enters, leaves) = (enters.pick(order), leaves.pick(order));
        let ways = L::ids_pick(ways, order);
        Self { ways, nibbles, enters, bits: enters.le(leaves).bits() & 0xff }
    }

    /// The last lane whose box the ray goes into. (If it goes into none, it means nothing.)
    #[inline(always)]
    pub fn last(&self) -> u32 {
        (self.bits | 1).ilog2()
    }

    /// The way to what is in a lane's box.
    #[inline(always)]
    pub fn way(&self, node: &Boxes, lane: u32, any: bool) -> Way {
        Way(node.ways[if any { lane & 7 } else { self.nibbles >> (4 * lane) & 7 } as usize])
    }

    /// Puts those that the ray goes into on a stack, from a place on, and where it enters them unless it asks for `any` hit; how many
    /// they are.
    #[inline(always)]
    pub fn put(&self, waiting: &mut Waiting, place: usize, any: bool) -> usize {
        L::ids_compact(self.ways, self.bits, eight(&mut waiting.exits, place));
        if !any {
            self.enters.compact(self.bits, eight(&mut waiting.tmin, place));
        }
        self.bits.count_ones() as usize
    }
}

/// Where a ray enters a node's boxes, between its ends, and where it leaves them: those it goes into that it enters first.
#[inline(always)]
pub fn cross<L: Eight>(node: &Boxes, ray: &Spread<L>, tnear: L, tfar: L) -> [L; 2] {
    let [x, y, z] = &node.faces;
    let Spread { inverse, near, far, octant } = *ray;
    let [near_x, near_y, near_z] = [octant.near(0), octant.near(1), octant.near(2)];
    let enters_x = faces::<L>(x, near_x).mul_add(inverse[0], near[0]);
    let enters_y = faces::<L>(y, near_y).mul_add(inverse[1], near[1]);
    let enters_z = faces::<L>(z, near_z).mul_add(inverse[2], near[2]);
    let leaves_x = faces::<L>(x, near_x ^ 8).mul_add(inverse[0], far[0]);
    let leaves_y = faces::<L>(y, near_y ^ 8).mul_add(inverse[1], far[1]);
    let leaves_z = faces::<L>(z, near_z ^ 8).mul_add(inverse[2], far[2]);
    // (`max` and `min` keep a NaN that stands on their right.)
    let enters = enters_x.max(enters_y).max(enters_z.max(tnear));
    let leaves = leaves_x.min(leaves_y).min(leaves_z.min(tfar));
    [enters, leaves]
}

/// The faces of eight boxes on one side, from 0 or 8 on.
#[inline(always)]
fn faces<L: Eight>(both: &[[f32; 8]; 2], from: usize) -> L {
    L::load(both.as_flattened()[from..].first_chunk().expect("eight from 0 or 8 on"))
}

/// Has a ray meet a node's boxes between its ends. With `any` they stay in the order that the node has them in.
#[inline(always)]
pub fn meet<L: Eight>(node: &Boxes, ray: &Spread<L>, tnear: L, tfar: L, any: bool) -> Met<L> {
    Met::new(node, ray.octant, cross(node, ray, tnear, tfar), any)
}

#[cfg(test)]
mod tests {
    use super::super::start::Starts;
    use super::*;
    use crate::geometry::{Aabb, Ray};
    use crate::simd::{Chosen, Isa, Simd, Task};
    use crate::weyl::uniform;
    use glam::Vec3;

    /// A ray's ways out of a node, the next one last, and where it enters the boxes.
    struct Out<'a>(&'a Boxes, &'a Ray, &'a Aabb);

    impl Task for Out<'_> {
        type Output = Vec<(i32, f32)>;

        #[inline(always)]
        fn run<S: Simd>(self) -> Self::Output {
            let Self(node, ray, bounds) = self;
            let starts = Starts::new::<S::F8>(&[*ray], bounds);
            assert_eq!(starts.odd, 0);
            if starts.flies == 0 {
                return Vec::new();
            }
            let mut waiting = Waiting::new();
            waiting.exits[3] = Way::ROOT.0;
            let nodes = std::slice::from_ref(node);
            let at = (3, Way::ROOT);
            let (top, way) =
                step::<S::F8>(nodes, &starts.slabs(0), &mut waiting, at, ray.tnear, ray.tfar, false);
            assert_eq!(way.0, waiting.exits[top]);
            // Who asks for any hit goes the same ways, in whatever order.
            let mut any = Waiting::new();
            any.exits[3] = Way::ROOT.0;
            let (any_top, any_way) =
                step::<S::F8>(nodes, &starts.slabs(0), &mut any, at, ray.tnear, ray.tfar, true);
            assert_eq!(any_way.0, any.exits[any_top]);
            let sorted = |waiting: &Waiting, top: usize| {
                let mut ways = waiting.exits[3..=top].to_vec();
                ways.sort_unstable();
                ways
            };
            assert_eq!(sorted(&any, any_top), sorted(&waiting, top));
            (3..=top).map(|place| (waiting.exits[place], waiting.tmin[place])).collect()
        }
    }

    /// Two rows of four cubes, a width apart, that begin at a corner. In the order of octant 0.
    fn cubes(corner: Vec3, width: f32) -> Boxes {
        let mut node =
            Boxes { faces: [[[0.0; 8]; 2]; 3], ways: std::array::from_fn(|i| 10 + i as i32), orders: [0; 8] };
        for lane in 0..8 {
            let least = corner + width * Vec3::new((lane / 2 * 2) as f32, (lane % 2 * 2) as f32, 0.0);
            for axis in 0..3 {
                (node.faces[axis][0][lane], node.faces[axis][1][lane]) = (least[axis], least[axis] + width);
            }
        }
        for (octant, order) in node.orders.iter_mut().enumerate() {
            // The farthest first.
            let flipped = (octant & 1) * 6 + (octant >> 1 & 1);
            *order =
                (0..8).fold(0, |order, place| order | ((7 - place) as u32 ^ flipped as u32) << (4 * place));
        }
        node
    }

    #[test]
    fn a_ray_enters_each_box_that_it_touches_the_nearest_last_and_few_others() {
        let mut number = uniform(-1.0, 1.0);
        let (mut entered, mut touched) = (0, 0);
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            for round in 0..3000 {
                // Near the origin of all coordinates or far away; some rays run along an axis, or next to it.
                let corner = Vec3::splat([0.0, 3.0, 1000.0, -70_000.0][round % 4]);
                let width = [1.0, 0.125, 16.0][round / 4 % 3];
                let node = cubes(corner, width);
                let bounds = Aabb { min: corner, max: corner + width * Vec3::new(7.0, 3.0, 1.0) };
                let flat = Vec3::from(
                    [[1.0; 3], [1.0, 0.0, 1.0], [-0.0, 1e-20, 1.0], [1.0, 1e-9, -0.0]][round / 12 % 4],
                );
                let direction = Vec3::new(number(), number(), number()) * flat;
                let part = Vec3::new(number(), number(), number()) * 0.5 + 0.5;
                let aim = bounds.min + bounds.extent() * part;
                let origin = aim - direction * (number() * 2.0 + 2.0) * width;
                let tfar = if round % 5 == 0 { 2.0 * width } else { f32::MAX };
                let ray = Ray::segment(origin, direction, 0.0, tfar);
                let meets = |slack: f64| -> Vec<(i32, f64)> {
                    let mut met = Vec::new();
                    for lane in 0..8 {
                        let (mut tmin, mut tmax) = (0.0, f64::from(ray.tfar));
                        for axis in 0..3 {
                            let [o, d] = [origin, ray.direction].map(|v| f64::from(v[axis]));
                            let [least, greatest] = node.faces[axis].map(|row| f64::from(row[lane]));
                            let [least, greatest] = [least - slack - o, greatest + slack - o];
                            if d == 0.0 {
                                if least > 0.0 || greatest < 0.0 {
                                    tmax = -1.0;
                                }
                                continue;
                            }
                            let (a, b) = (least / d, greatest / d);
                            (tmin, tmax) = (a.min(b).max(tmin), a.max(b).min(tmax));
                        }
                        if tmin <= tmax {
                            met.push((10 + lane as i32, tmin));
                        }
                    }
                    met
                };
                let reach =
                    f64::from((bounds.max - origin).abs().max((bounds.min - origin).abs()).max_element());
                let far = reach + f64::from(origin.abs().max_element());
                let out = chosen.run(Out(&node, &ray, &bounds));
                let about = format!("{isa}, {ray:?}, {node:?}, {out:?}");
                // What a hit lies at is within sixteen roundings of its triangle.
                let [sure, perhaps] = [meets(reach * 2f64.powi(-20)), meets(far * 2f64.powi(-17))];
                for (way, tmin) in &sure {
                    let found = out.iter().find(|(other, _)| other == way);
                    let (_, enters) = found.unwrap_or_else(|| panic!("{way} is not entered: {about}"));
                    assert!(f64::from(*enters) <= tmin + 1e-30, "{way} is entered late: {about}");
                }
                for (way, _) in &out {
                    assert!(perhaps.iter().any(|(other, _)| other == way), "{way} is entered: {about}");
                }
                let order: Vec<f64> = out
                    .iter()
                    .filter_map(|(way, _)| sure.iter().find(|(other, _)| other == way).map(|(_, tmin)| *tmin))
                    .collect();
                assert!(order.is_sorted_by(|a, b| a >= b), "the nearest is last: {about}");
                if round % 4 < 2 {
                    (entered, touched) = (entered + out.len(), touched + sure.len());
                }
            }
        }
        assert!(touched > 1500 && entered < touched + touched / 50, "{entered} entered, {touched} touched");
    }

    #[test]
    fn numbers_that_overflow_stop_no_ray() {
        let mut node = cubes(Vec3::ZERO, 1.0);
        node.faces = [[[-3e38; 8], [3e38; 8]]; 3];
        let bounds = Aabb { min: Vec3::splat(-3e38), max: Vec3::splat(3e38) };
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            for direction in
                [Vec3::new(1.0, 1e-12, 0.0), Vec3::new(-1e-8, 0.0, 1e-9), Vec3::new(0.0, 1.0, -1e9)]
            {
                let ray = Ray::new(Vec3::new(3e38, -3e38, 1e38), direction);
                assert_eq!(chosen.run(Out(&node, &ray, &bounds)).len(), 8, "{isa}, {direction}");
            }
        }
    }
}
