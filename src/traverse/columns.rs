//! Rays one after the other into lanes, by whole registers.
//!
//! A ray is two rows of four numbers: origin and `tnear`, direction and `tfar`. Rows and columns are exchanged.

use crate::geometry::Ray;
use crate::simd::Dense;

/// Up to `W` rays, the first of some, number by number: origins and `tnear`, directions and `tfar`. Lanes without a ray hold the
/// first one.
#[inline(always)]
pub fn columns<const W: usize, L: Dense<W>>(rays: &[Ray]) -> [[L; 4]; 2] {
    columns_by(
        #[inline(always)]
        |lane| rays.get(lane).or(rays.first()),
    )
}

/// The same of a ray for each lane, which is read where it lies; zeros where there is none.
#[inline(always)]
pub fn columns_by<'a, const W: usize, L: Dense<W>>(ray: impl Fn(usize) -> Option<&'a Ray>) -> [[L; 4]; 2] {
    let nowhere = &[0.0; 4];
    let (mut starts, mut ways) = ([nowhere; W], [nowhere; W]);
    for lane in 0..W {
        if let Some(ray) = ray(lane) {
            let [start, way]: &[[f32; 4]; 2] = bytemuck::cast_ref(ray);
            (starts[lane], ways[lane]) = (start, way);
        }
    }
    [L::columns(&starts), L::columns(&ways)]
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Lanes, Simd, Task};
    use glam::Vec3;

    /// Rays' numbers by sixteens, and by eights.
    struct Columns<'a>(&'a [Ray]);

    impl Task for Columns<'_> {
        type Output = ([[[f32; 16]; 4]; 2], [[[f32; 8]; 4]; 2]);

        #[inline(always)]
        fn run<S: Simd>(self) -> Self::Output {
            let [starts, ways] = columns::<16, S::F16>(self.0);
            let [few_starts, few_ways] = columns::<8, S::F8>(self.0);
            (
                [starts, ways].map(|columns| columns.map(|column| column.store())),
                [few_starts, few_ways].map(|columns| columns.map(|column| column.store())),
            )
        }
    }

    /// Rays that differ in every number.
    pub fn rays(count: usize) -> Vec<Ray> {
        let point = |i: usize| Vec3::new(i as f32, i as f32 + 0.25, i as f32 - 0.5);
        let ray = |i: usize| Ray::segment(point(i), -point(100 + i), i as f32 / 8.0, 1000.0 + i as f32);
        (0..count).map(ray).collect()
    }

    #[test]
    fn rays_come_into_lanes_and_the_first_one_fills_up() {
        let rays = rays(20);
        for isa in Isa::available() {
            for count in 1..=20 {
                let chosen = Chosen::new(isa).expect("it is available");
                let (sixteen, eight) = chosen.run(Columns(&rays[..count]));
                for lane in 0..16 {
                    let expected: [[f32; 4]; 2] = bytemuck::cast(rays[if lane < count { lane } else { 0 }]);
                    let about = format!("lane {lane} of {count} on {isa}");
                    assert_eq!(sixteen.map(|four| four.map(|column| column[lane])), expected, "{about}");
                    if lane < 8 {
                        assert_eq!(eight.map(|four| four.map(|column| column[lane])), expected, "{about}");
                    }
                }
            }
        }
    }
}
