//! Rays one after the other into lanes, and back, eight at a time and by whole registers.
//!
//! A ray is two rows of four numbers: origin and `tnear`, direction and `tfar`. Eight rows are four columns.

use crate::geometry::Ray;
use crate::simd::Eight;

/// Up to eight rays, number by number: origins and `tnear`, directions and `tfar`. Lanes without a ray hold the first one.
#[inline(always)]
pub fn columns<L: Eight>(rays: &[Ray]) -> [[L; 4]; 2] {
    let nowhere = &[0.0; 4];
    let (mut starts, mut ways) = ([nowhere; 8], [nowhere; 8]);
    for lane in 0..8 {
        if let Some(ray) = rays.get(lane).or(rays.first()) {
            let [start, way]: &[[f32; 4]; 2] = bytemuck::cast_ref(ray);
            (starts[lane], ways[lane]) = (start, way);
        }
    }
    [turned(&starts), turned(&ways)]
}

/// Rows and columns exchanged: lane `j` of vector `i` is number `i` of `fours[j]`.
#[inline(always)]
fn turned<L: Eight>(fours: &[&[f32; 4]; 8]) -> [L; 4] {
    L::transpose_fours([
        L::of_fours([fours[0], fours[4]]),
        L::of_fours([fours[1], fours[5]]),
        L::of_fours([fours[2], fours[6]]),
        L::of_fours([fours[3], fours[7]]),
    ])
}

/// The same back: number `i` of row `j` is lane `j` of column `i`.
#[inline(always)]
pub fn rows<L: Eight>(columns: [L; 4]) -> [[f32; 4]; 8] {
    let mut rows = [[0.0; 4]; 8];
    for (i, two) in L::transpose_fours(columns).into_iter().enumerate() {
        let [low, high] = bytemuck::cast::<[f32; 8], [[f32; 4]; 2]>(two.store());
        (rows[i], rows[4 + i]) = (low, high);
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Simd, Task};
    use glam::Vec3;

    struct ThereAndBack<'a>(&'a [Ray]);

    impl Task for ThereAndBack<'_> {
        type Output = [[[f32; 4]; 8]; 2];

        #[inline(always)]
        fn run<S: Simd>(self) -> Self::Output {
            let [starts, ways] = columns::<S::F8>(self.0);
            [rows(starts), rows(ways)]
        }
    }

    #[test]
    fn rays_come_back_and_the_first_one_fills_up() {
        let point = |i: usize| Vec3::new(i as f32, i as f32 + 0.25, i as f32 - 0.5);
        let ray = |i: usize| Ray::segment(point(i), -point(100 + i), i as f32 / 8.0, 1000.0 + i as f32);
        let rays: Vec<Ray> = (0..8).map(ray).collect();
        for isa in Isa::available() {
            for count in 1..=8 {
                let chosen = Chosen::new(isa).expect("it is available");
                let [starts, ways] = chosen.run(ThereAndBack(&rays[..count]));
                for lane in 0..8 {
                    let expected: [[f32; 4]; 2] = bytemuck::cast(rays[if lane < count { lane } else { 0 }]);
                    assert_eq!([starts[lane], ways[lane]], expected, "lane {lane} of {count} on {isa}");
                }
            }
        }
    }
}
