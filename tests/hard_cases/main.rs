//! Hard cases: what breaks ray tracers, each run in every accuracy mode, by every kernel, at every
//! width, on every instruction set, over a coarse and a fine tree. A kernel that is added to
//! `Kernel::ALL`, or a mode to `Accuracy::ALL`, goes through all of it.
//!
//! [`scene::Scene::trace`] is what every case calls. Whatever the case is about, it checks that
//! all kernels give the same record to the bit, in order and shuffled (so that packets hold rays of all
//! directions), that any-hit agrees with closest-hit, that a ray whose interval is nothing
//! but its hit's `t` still has that hit, and, where the scene is small, that a brute force with the same
//! triangle test gives the same. `fast` may miss at an edge; it must miss alike everywhere.
//!
//! **Seeds.** Each case runs on fixed seeds and on a fresh one, which every failure names. To run a
//! failure again:
//!
//! ```text
//! RAYPACK_SEED=12345 cargo test --test hard_cases NAME
//! ```
//!
//! **Figures.** `cargo test --release --test hard_cases watertight -- --nocapture` prints rays tried and
//! misses, mesh by mesh and mode by mode.

mod aim;
mod meshes;
mod numbers;
mod scene;

mod axis_parallel;
mod beams;
mod belonging;
mod degenerate;
mod garbage;
mod grazing;
mod invariance;
mod planes;
mod properties;
mod range;
mod secondary;
mod shells;
mod sizes;
mod slivers;
mod strange_rays;
mod watertight;

// The oracle suite uses the rest of it.
#[allow(dead_code)]
#[path = "../oracle/brute.rs"]
mod brute;
