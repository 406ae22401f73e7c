//! Pictures that show more than matt surfaces.
//!
//! A scene that calls for no [effects](crate::scene::effects) is rendered by the plain tile task, which knows
//! nothing of them. Of one that does, a square of pixels is rendered by waves: all rays of a kind are traced together,
//! what they hit is shaded by the least of four kernels that does all that these surfaces call for, and that
//! makes the rays of the next wave. So a square in which nothing is shiny costs no reflection, in a scene full of mirrors
//! too.
//!
//! | file | what is in it |
//! |---|---|
//! | `task` | tiles, squares, samples; when a pixel has enough of them |
//! | `wave` | wave after wave: trace, shade, light |
//! | `shade` | what a wave's rays hit: by the least of four kernels |
//! | `path` | a ray, and what has become of the light by the time it is where the ray is |
//! | `trace` | which kernel gets which rays |
//! | `point` | a place on a surface: normals, pictures |
//! | `direct` | light straight from where it is made |
//! | `bounce` | light that goes on: mirrors, glass, matt surfaces |
//! | `holes` | where pictures cut holes into surfaces |
//! | `meter` | what shading does for effects that cast no rays: counted, and timed for a few hits |
//! | `cost` | rays, uses and time by effect |

mod appearance;
mod bounce;
mod cost;
mod direct;
mod holes;
mod meter;
mod path;
mod point;
mod setup;
mod shade;
mod task;
mod trace;
mod wave;

pub use appearance::{Appearance, Limits};
pub(super) use cost::Tallies;
pub use cost::{EffectCost, EffectCosts};
pub use setup::{FINE, MANY, Staged, Wishes, memory_beside};
pub(super) use task::{EffectScratch, EffectTask};
