//! How rays begin: eight together.
//!
//! **Rays that follow one another mostly start near one another**, and what they do first is to go down the
//! tree to the cell that they start in: half of all steps, for rays that leave a surface. Eight rays go that
//! way together, line by line, as long as all start on the same side of each plane. What they leave on their
//! stacks is the lines that they went through, *without* the exits that they took: each from where the ray
//! comes to the first of the three walls on the way to that exit, to where it leaves the line's cell.
//!
//! Nothing is lost by that. The other exits of such a line are across one of the three planes. A ray that
//! runs toward that plane comes to its wall first; one that runs away from it never does, unless it starts in
//! the wall, and then what is left of the line begins where the ray does.
//!
//! **If they end up in one leaf, they are a packet there**: each of its triangles is tested against all eight rays at
//! once, and is fetched once. Only then each goes its own way. To go on together in what lies around that leaf, with what
//! few rays meet put on their own stacks, was slower than to part: one packet waits for itself, a stream has other rays.

use super::flight::{Flight, NONE};
use super::leaf::Leaf;
use super::step::{Crossing, END, Waiting};
use crate::geometry::triangle::{Mode, Test};
use crate::geometry::{Aabb, Ray};
use crate::kdtree::{Exit, Line};
use crate::simd::{Eight, Mask};
use crate::traverse::closest::Closest;
use crate::traverse::packet::test_leaf;
use crate::traverse::ready::Ready;
use crate::traverse::records::Resident;
use crate::traverse::walk::load3;

/// Lines that eight rays can go through together.
const CHAIN: usize = crate::kdtree::MAX_DEPTH.div_ceil(3);

/// An exit to where nothing is. (There are others in a line; 0 is the way to its root here.)
const NOWHERE: i32 = 1;

/// Rays that are worth a packet's test of the leaf that they start in.
const FEW: u32 = 2;

/// Eight rays about to start, coordinate by coordinate.
pub struct Group {
    origin: [[f32; 8]; 3],
    direction: [[f32; 8]; 3],
    inverse: [[f32; 8]; 3],
    margin: [[f32; 8]; 3],
    tnear: [f32; 8],
    tmin: [f32; 8],
    tmax: [f32; 8],
    /// The closest hits so far, or `tfar`, and [`NONE`]. With any hit, rays that have one look for nothing any more.
    closest: [f32; 8],
    primitive: [i32; 8],
    /// Rays that meet the bounds.
    pub flies: u32,
    /// Rays whose numbers lie near the ends of the floats' range, or that are none.
    pub odd: u32,
    /// The lines that they went through, with the exits taken, the top of the tree first.
    chain: [i32; CHAIN],
    /// Where each ray enters what is left of them, and where it leaves it.
    enters: [[f32; 8]; CHAIN],
    leaves: [[f32; 8]; CHAIN],
    len: usize,
    /// Where they are then, and where each ray leaves that.
    exit: i32,
    last: [f32; 8],
}

impl Group {
    /// A group that nothing is known of.
    pub const fn new() -> Self {
        const ROW: [f32; 8] = [0.0; 8];
        Self {
            origin: [ROW; 3],
            direction: [ROW; 3],
            inverse: [ROW; 3],
            margin: [ROW; 3],
            tnear: ROW,
            tmin: ROW,
            tmax: ROW,
            closest: ROW,
            primitive: [0; 8],
            flies: 0,
            odd: 0,
            chain: [0; CHAIN],
            enters: [ROW; CHAIN],
            leaves: [ROW; CHAIN],
            len: 0,
            exit: 0,
            last: ROW,
        }
    }

    /// Prepares up to eight rays.
    #[inline(always)]
    pub fn prepare<L: Eight>(&mut self, rays: &[Ray], bounds: &Aabb, lines: &[Line]) {
        for (lane, ray) in rays.iter().enumerate().take(8) {
            for axis in 0..3 {
                self.origin[axis][lane] = ray.origin[axis];
                self.direction[axis][lane] = ray.direction[axis];
            }
            self.tnear[lane] = ray.tnear;
            self.closest[lane] = ray.tfar;
        }
        let present = (1u32 << rays.len().min(8)) - 1;
        let (origin, direction) = (load3::<8, L>(&self.origin), load3::<8, L>(&self.direction));
        let (tnear, tfar) = (L::load(&self.tnear), L::load(&self.closest));
        let Ready { inverse, thickness, margin, tmin, tmax, closest, ordinary, flies, .. } =
            Ready::new(&origin, &direction, tnear, tfar, bounds);
        self.odd = !ordinary & present;
        self.flies = flies & present;
        for axis in 0..3 {
            self.inverse[axis] = inverse[axis].store();
            self.margin[axis] = margin[axis].store();
        }
        (self.tmin, self.tmax, self.closest) = (tmin.store(), tmax.store(), closest.store());
        self.primitive = [NONE as i32; 8];
        (self.len, self.exit) = (0, 0);
        self.last = self.tmax;
        // Behind their origins rays may run anywhere.
        let from_origin = L::splat(0.0).le(tnear).bits() & self.flies == self.flies;
        if self.flies != 0 && from_origin {
            self.descend::<L>(lines, &origin, &inverse, &margin, thickness + thickness, tmin, tmax);
        }
    }

    /// Goes down as far as all rays start in the same cell.
    #[expect(clippy::too_many_arguments, reason = "it is the second half of a function")]
    #[inline(always)]
    fn descend<L: Eight>(
        &mut self,
        lines: &[Line],
        origin: &[L; 3],
        inverse: &[L; 3],
        margin: &[L; 3],
        apart: L,
        tmin: L,
        tmax: L,
    ) {
        // Where the rays leave the cell that they are in.
        let mut leaves = tmax;
        let zero = L::splat(0.0);
        let mut index = 0;
        while self.len < CHAIN {
            let line = &lines[index];
            let (mut enters, mut end) = (L::splat(f32::MAX), leaves);
            let mut half = 0;
            let mut exit = 0;
            for level in 0..3 {
                let place = [0, half + 1, half + 2 + (exit & 1)][level];
                let axis = ((line.exits[place] & 3) as usize).min(2);
                let gap = L::splat(line.planes[place]) - origin[axis];
                let above = gap.lt(zero).bits() & self.flies;
                if above != 0 && above != self.flies {
                    return;
                }
                let above = above != 0;
                exit = 2 * exit + usize::from(above);
                half = 4 * (exit >> level);
                let t = gap * inverse[axis];
                let ahead = if above { inverse[axis].lt(zero) } else { zero.lt(inverse[axis]) };
                enters = L::select(ahead, t - margin[axis], enters).min(enters);
                enters = L::select(apart.lt(gap.abs()), enters, tmin);
                end = L::select(ahead, t + margin[axis], end).min(end);
            }
            self.chain[self.len] = Exit::of_line(index).without(exit).0;
            self.enters[self.len] = enters.max(tmin).store();
            self.leaves[self.len] = leaves.store();
            self.len += 1;
            leaves = end;
            self.exit = line.exits[exit];
            self.last = leaves.store();
            if Exit(self.exit).is_leaf() {
                return;
            }
            index = Exit(self.exit).line();
            if index == 0 {
                self.exit = NOWHERE;
                return;
            }
        }
    }

    /// Tests the triangles of the leaf that all start in, if they do, as a packet.
    #[inline(always)]
    pub fn test_leaf<L: Eight, M: Mode, const ANY: bool>(&mut self, resident: &Resident<'_, M::Record>) {
        let exit = Exit(self.exit);
        if !exit.is_leaf() {
            return;
        }
        let here = L::load(&self.tmin).le(L::load(&self.last)).bits() & self.flies;
        if here.count_ones() < FEW {
            return;
        }
        let test = M::Test::<8, L>::new(&load3(&self.origin), &load3(&self.direction), self.flies);
        let (tnear, here) = (L::load(&self.tnear), L::mask_from_bits(here));
        let mut closest = Closest::<8, L>::new(L::load(&self.closest));
        let words = &resident.tree.references()[exit.record()..];
        let primitives = &words[1..][..words[0] as usize];
        test_leaf::<8, L, _, M, ANY>(resident, primitives, &test, tnear, here, &mut closest, false);
        (self.closest, self.primitive) = (closest.t.store(), closest.primitives());
        self.exit = NOWHERE;
    }

    /// Starts the ray in a lane: fills its stack. It may be at its end at once.
    #[inline(always)]
    pub fn start<A: Test<1, f32>>(
        &self,
        lane: usize,
        ray: &Ray,
        number: usize,
        waiting: &mut Waiting,
    ) -> Flight<A> {
        let four = |rows: &[[f32; 8]; 3]| [rows[0][lane], rows[1][lane], rows[2][lane], 0.0];
        let tfar = self.closest[lane];
        (waiting.exits[0], waiting.tmin[0], waiting.tmax[0]) = (END, f32::NEG_INFINITY, f32::NEG_INFINITY);
        let mut top = 1;
        for i in 0..self.len {
            let (enters, leaves) = (self.enters[i][lane], self.leaves[i][lane]);
            (waiting.exits[top], waiting.tmin[top], waiting.tmax[top]) = (self.chain[i], enters, leaves);
            top += usize::from(enters <= leaves.min(tfar));
        }
        let (enters, leaves) = (self.tmin[lane], self.last[lane]);
        (waiting.exits[top], waiting.tmin[top], waiting.tmax[top]) = (self.exit, enters, leaves);
        top -= usize::from(self.exit == NOWHERE || enters > leaves);
        Flight {
            crossing: Crossing {
                origin: four(&self.origin),
                inverse: four(&self.inverse),
                margin: four(&self.margin),
            },
            top: top as u32,
            ray: number as u32,
            tnear: ray.tnear,
            tfar,
            primitive: self.primitive[lane] as u32,
            leaf: Leaf::NONE,
            test: A::new(&ray.origin.to_array(), &ray.direction.to_array(), 1),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Hit;
    use crate::geometry::triangle::Watertight;
    use crate::kdtree::{BuildParams, KdTree, Tree};
    use crate::mesh::Mesh;
    use crate::simd::{Isa, Simd, Task};
    use crate::traverse::{Accel, Kernel};
    use crate::weyl::uniform;
    use glam::Vec3;

    /// Hills of some two thousand triangles.
    fn hills() -> Mesh {
        let side = 33u32;
        let point = |i: u32| {
            let (x, y) = ((i % side) as f32 / 32.0, (i / side) as f32 / 32.0);
            Vec3::new(x, y, 0.05 * (20.0 * x).sin() * (17.0 * y).cos())
        };
        let corner = |x: u32, y: u32| y * side + x;
        let square = |i: u32| {
            let (x, y) = (i % (side - 1), i / (side - 1));
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)];
            [[a, b, c], [b, d, c]]
        };
        let triangles = (0..(side - 1) * (side - 1)).flat_map(square).collect();
        Mesh { positions: (0..side * side).map(point).collect(), triangles, ..Mesh::default() }
    }

    /// Eights of rays that start near one another above, on and below the hills, and go everywhere; some of them end soon.
    fn eights() -> Vec<Ray> {
        let mut number = uniform(-1.0, 1.0);
        let mut point = move || Vec3::new(number(), number(), number());
        let mut eight = |i: usize| {
            let place = (point() * Vec3::new(0.5, 0.5, 0.06)) + Vec3::new(0.5, 0.5, 0.0);
            let apart = [0.0, 1e-4, 1e-2][i % 3];
            let end = [f32::INFINITY, 0.04][i / 3 % 2];
            std::array::from_fn::<Ray, 8, _>(|_| Ray::segment(place + point() * apart, point(), 0.0, end))
        };
        (0..600).flat_map(&mut eight).collect()
    }

    /// How many hits eights of rays find before they part.
    struct Together<'a>(&'a KdTree, &'a [Ray]);

    impl Task for Together<'_> {
        type Output = usize;

        #[inline(always)]
        fn run<S: Simd>(self) -> usize {
            let Self(tree, rays) = self;
            let resident = Resident { tree, records: tree.triangles() };
            let (mut group, mut found) = (Group::new(), 0);
            for eight in rays.chunks(8) {
                group.prepare::<S::F8>(eight, resident.tree.bounds(), tree.lines());
                group.test_leaf::<S::F8, Watertight, false>(&resident);
                found += group.primitive.iter().filter(|&&id| id != NONE as i32).count();
            }
            found
        }
    }

    #[test]
    fn rays_that_start_in_one_leaf_find_what_each_finds_alone() {
        let (mesh, rays) = (hills(), eights());
        for isa in Isa::available() {
            let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds").with_isa(isa);
            let together = accel.chosen().run(Together(accel.tree(), &rays));
            assert!(together > 500, "{together} of {} are found by packets on {isa}", rays.len());
            let (mut alone, mut hits) = (vec![Hit::MISS; rays.len()], vec![Hit::MISS; rays.len()]);
            accel.intersect_many(Kernel::Single, &rays, &mut alone);
            accel.intersect_many(Kernel::Stream, &rays, &mut hits);
            assert_eq!(hits, alone, "{isa}");
            let mut occluded = vec![false; rays.len()];
            accel.occluded_many(Kernel::Stream, &rays, &mut occluded);
            assert!(occluded.iter().zip(&alone).all(|(&occluded, hit)| occluded == hit.is_hit()), "{isa}");
        }
    }
}
