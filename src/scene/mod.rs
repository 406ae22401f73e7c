//! What is looked at, from where, in what light.
//!
//! [`Camera`] says where the eye is; [`View`] makes its rays for one image size; [`Orbit`] moves
//! it; [`Lighting`] is the light that falls on the scene, [`Environment`] that from infinitely far;
//! [`Surface`] is what it falls on, [`texture`] the pictures there.

mod cached;
mod camera;
pub mod effects;
mod emitters;
mod environment;
mod framing;
mod light;
mod lights;
mod parse;
mod path;
mod surface;
pub mod texture;
mod view;

pub use cached::{CachedReader, CachedSurface};
pub use camera::{Camera, DEFAULT_FOV};
pub use emitters::{EmitterSample, Emitters, uniform_triangle};
pub use environment::{Environment, EnvironmentSample};
pub use light::{Ambient, Light, Lighting, ShadowRay};
pub use lights::Lights;
pub use path::Orbit;
pub use surface::{Detail, Face, Look, Surface};
pub use view::View;
