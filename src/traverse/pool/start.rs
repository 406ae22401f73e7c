//! Rays made ready, eight together.

use super::step::{Octant, Slabs, thick};
use crate::geometry::triangle::pooled::{Pooled, shears, speed};
use crate::geometry::{Aabb, Ray};
use crate::simd::{Eight, Mask};
use crate::traverse::columns::columns;
use crate::traverse::ready::Ready;
use std::array;

/// Eight rays about to start, number by number.
pub struct Starts {
    inverse: [[f32; 8]; 3],
    near: [[f32; 8]; 3],
    far: [[f32; 8]; 3],
    octants: [u32; 8],
    tfar: [f32; 8],
    /// Shears, speeds and numbers of the greatest axes, for pools.
    shears: [[f32; 8]; 3],
    speeds: [f32; 8],
    axes: [u8; 8],
    /// Rays that meet the bounds.
    pub flies: u32,
    /// Rays whose numbers lie near the ends of the floats' range, or that are none.
    pub odd: u32,
}

impl Starts {
    /// Prepares up to eight rays.
    #[inline(always)]
    pub fn new<L: Eight>(rays: &[Ray], bounds: &Aabb) -> Self {
        let present = (1u32 << rays.len().min(8)) - 1;
        let [[x, y, z, tnear], [dx, dy, dz, tfar]] = columns::<8, L>(rays);
        let origin = [x, y, z];
        let Ready { inverse, margin, closest, ordinary, flies, .. } =
            Ready::new(&origin, &[dx, dy, dz], tnear, tfar, bounds);
        let ([mut near, mut far], mut octants) = ([[[0.0; 8]; 3]; 2], [0; 8]);
        for axis in 0..3 {
            let [less, more] = thick(origin[axis], inverse[axis], margin[axis]);
            (near[axis], far[axis]) = (less.store(), more.store());
            let down = inverse[axis].lt(L::splat(0.0)).bits();
            for (lane, octant) in octants.iter_mut().enumerate() {
                *octant |= (down >> lane & 1) << axis;
            }
        }
        let (shear, [is_x, is_y]) = shears(&origin, &[dx, dy, dz]);
        let (is_x, is_y) = (is_x.bits(), is_y.bits());
        let axes = array::from_fn(|lane| match [is_x, is_y].map(|bits| bits >> lane & 1) {
            [0, 0] => 2,
            [0, _] => 1,
            _ => 0,
        });
        Self {
            shears: [shear[0].store(), shear[1].store(), shear[2].store()],
            speeds: speed(shear[2]).store(),
            axes,
            inverse: [inverse[0].store(), inverse[1].store(), inverse[2].store()],
            near,
            far,
            octants,
            tfar: closest.store(),
            flies: flies & present,
            odd: !ordinary & present,
        }
    }

    /// The ray in a lane as boxes see it.
    #[inline(always)]
    pub fn slabs(&self, lane: usize) -> Slabs {
        let three = |rows: &[[f32; 8]; 3]| [rows[0][lane], rows[1][lane], rows[2][lane]];
        Slabs {
            inverse: three(&self.inverse),
            near: three(&self.near),
            far: three(&self.far),
            octant: Octant::new(self.octants[lane]),
        }
    }

    /// The ray in a lane, which starts there, as pools see it.
    #[inline(always)]
    pub fn pooled(&self, lane: usize, origin: &[f32; 3]) -> Pooled {
        let [x, y, z] = &self.shears;
        Pooled::of_speed(origin, [x[lane], y[lane], z[lane]], self.speeds[lane], usize::from(self.axes[lane]))
    }

    /// What a hit of the ray must not lie beyond.
    #[inline(always)]
    pub fn tfar(&self, lane: usize) -> f32 {
        self.tfar[lane]
    }
}
