//! Embree 4, loaded at run time: nobody needs it to build raypack.
//!
//! [`Device::new`] finds the library, [`Scene::new`] builds, [`Prepared`] holds rays in Embree's own
//! layout, and [`Scene::closest`] and [`Scene::any`] trace them with the coherent flag or without.
//!
//! All `unsafe` of the study room is in this folder: the interface is C's.

mod abi;
mod device;
mod flush;
mod locate;
mod scene;
mod stream;

pub use device::{Device, Version};
pub use scene::{Build, Scene};
pub use stream::{Coherence, PacketHits, Prepared};
