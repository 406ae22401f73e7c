//! From rays to pictures.
//!
//! A [`Renderer`] cuts a picture into tiles along a Hilbert curve, hands them to workers that
//! steal from one another, and shades what the packets of each tile hit. At no time is there
//! more than a handful of packets per worker. **The picture is the same, bit for bit, for every
//! number of threads, tile size, packet width and instruction set.**

mod bounded;
mod effects;
mod frame;
pub mod image;
mod lookahead;
mod matt;
mod offset;
mod order;
mod renderer;
mod sampling;
pub mod scatter;
mod scheduler;
mod settings;
mod shade;
mod stats;
mod tile;

pub use bounded::{First, FirstStats};
pub use effects::{Appearance, EffectCost, EffectCosts, FINE, Limits, MANY, Staged, Wishes, memory_beside};
pub use frame::Frame;
pub use offset::offset_point;
pub use order::{Tile, tiles};
pub use renderer::Renderer;
pub use scheduler::{Outcome, Sharing, Workers};
pub use settings::{Aovs, RenderSettings, Size, Tuning};
pub(crate) use stats::quantile;
pub use stats::{FrameStats, RayCount};
