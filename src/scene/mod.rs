//! What is looked at, from where, in what light.
//!
//! [`Camera`] says where the eye is; [`View`] makes its rays for one image size; [`Orbit`] moves
//! it; [`Lighting`] is the light that falls on the scene; [`Surface`] is what it falls on,
//! and [`Emitters`] are those of its triangles that shine.

mod camera;
mod emitters;
mod framing;
mod light;
mod parse;
mod path;
mod surface;
mod view;

pub use camera::{Camera, DEFAULT_FOV};
pub use emitters::{EmitterSample, Emitters, uniform_triangle};
pub use light::{Ambient, Light, Lighting, ShadowRay};
pub use path::Orbit;
pub use surface::{CachedReader, CachedSurface, Detail, Look, Surface};
pub use view::View;
