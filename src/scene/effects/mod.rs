//! What a picture can show, and which of it a scene calls for.
//!
//! An [`Effect`] costs time, so it runs only where something calls for it: a material that triangles have, a light, the
//! camera. [`Analysis`] finds what calls for each, and says so; a [`Request`] overrules it.

mod analysis;
mod effect;
mod request;

pub use analysis::{Analysis, Around, Call, SMOOTH, calls_for};
pub(crate) use analysis::{calls_of, used};
pub use effect::{Effect, EffectSet};
pub use request::Request;
