//! Light at a surface: which way it goes on, how much of it does, and random numbers to decide with.
//!
//! | file | what is in it |
//! |---|---|
//! | `basis` | a surface's own coordinates |
//! | `fresnel` | how much is thrown back, where the rest is bent to |
//! | `ggx` | surfaces that are a little or very rough |
//! | `medium` | what a ray is inside of, and what is lost there |
//! | `random` | numbers that depend on what they are for alone |
//! | `sampling` | from such numbers to directions |
//! | `terminator` | normals that differ from the triangle's |
//!
//! Directions are unit vectors. Those called `wo` and `wi` are in local coordinates, in which the normal is +Z, and
//! point away from the surface: `wo` to where the ray came from, `wi` to where light comes from. Others are in the
//! scene's coordinates. `alpha` is GGX's roughness. `eta` is the index of refraction beyond a surface divided by
//! that before it.
//!
//! Everything is `f32` arithmetic in a fixed order, with sines and exponentials from `libm` instead of the
//! platform: the results are the same bits everywhere.

mod basis;
mod fresnel;
pub mod ggx;
mod medium;
mod random;
mod sampling;
mod terminator;

pub use basis::Basis;
pub use fresnel::{dielectric, refract, schlick};
pub use medium::{Media, Medium};
pub use random::Sequence;
pub use sampling::{by_solid_angle, cosine_density, cosine_hemisphere, disk, power_heuristic};
pub use terminator::{consistent_normal, terminator_offset};
