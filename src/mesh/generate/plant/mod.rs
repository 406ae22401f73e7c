//! A process plant: tanks, columns, spheres, furnaces and steel structures between pipe racks, with the
//! stairs, gratings and cables that belong to them.
//!
//! Its triangles are as those of models that engineers draw: many long and thin, tiny ones (bolts) beside
//! huge ones (the ground), and some that coincide, where two parts touch or both bring the same plate.
//!
//! Y is up, lengths are metres, the ground is at 0 and the plant is centred on the origin. It is
//! laid out in cells of one unit and its stretch of pipe rack, in a spiral from the middle, as many
//! as fit the number of triangles asked for; storage yards of drums and pipes fill what is left.

mod cables;
mod grating;
mod layout;
mod palette;
mod piping;
mod plates;
mod spool;
mod steel;
mod units;
mod vessels;
mod write;

use super::part::{Part, Size, Whole};
use crate::mesh::Mesh;
use glam::Vec3;
use std::convert::Infallible;
use std::ops::RangeInclusive;

pub use spool::spool;
pub use write::write;

/// The numbers of triangles that a plant comes within 5 % of.
pub const TRIANGLES: RangeInclusive<u64> = 10_000..=200_000_000;

/// What plant to make.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlantParams {
    /// How many triangles it shall have; if that is in [`TRIANGLES`], it will within 5 %.
    pub triangles: u64,
    /// Which of the plants of that size.
    pub seed: u64,
}

/// A plant of about `params.triangles` triangles. The same parameters give the same plant.
pub fn generate(params: PlantParams) -> Mesh {
    let mut whole = Whole::with_capacity(params.triangles as usize);
    let Ok(()) = parts::<Infallible>(params, |part| {
        whole.push(part);
        Ok(())
    });
    whole.finish(palette::materials())
}

/// The same plant, part by part: `each` is lent one part after the other, of not more than some hundred
/// thousand triangles however large the plant is. Their order is the mesh's.
///
/// # Errors
///
/// The first that `each` gives; nothing more is made then.
pub fn parts<E>(params: PlantParams, each: impl FnMut(Part<'_>) -> Result<(), E>) -> Result<(), E> {
    layout::parts(params, each)
}

/// How large the plant is, which takes as long as to make it, but no memory.
pub fn size(params: PlantParams) -> Size {
    let mut size = Size::default();
    let Ok(()) = parts::<Infallible>(params, |part| {
        size += part.size();
        Ok(())
    });
    size
}

/// The plant of the demo: some 300,000 triangles.
pub fn demo() -> Mesh {
    generate(PlantParams { triangles: 300_000, seed: 1 })
}

/// Where to stand and how the sun should shine for a good picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DemoView {
    /// Where the camera is.
    pub eye: Vec3,
    /// What it looks at.
    pub at: Vec3,
    /// Its vertical field of view.
    pub fov_degrees: f32,
    /// The direction towards the sun, normalised.
    pub sun: Vec3,
}

/// The view of [`demo`] for wide pictures, such as 16 to 9.
pub fn demo_view() -> DemoView {
    DemoView {
        eye: Vec3::new(84.0, 27.0, 80.0),
        at: Vec3::new(0.0, 9.5, -2.0),
        fov_degrees: 38.0,
        sun: Vec3::new(-0.50, 0.62, 0.60).normalize(),
    }
}

/// The larger the plant, the finer its round parts, so that size comes from both.
fn quality(triangles: u64) -> f32 {
    match triangles {
        0..50_000 => 0.4,
        50_000..150_000 => 0.65,
        150_000..1_000_000 => 0.93,
        1_000_000..8_000_000 => 1.4,
        _ => 1.8,
    }
}

#[cfg(test)]
mod tests;
