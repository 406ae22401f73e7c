//! SIMD lanes and the run-time choice of an instruction set.
//!
//! A kernel is written once, generic over [`Lanes`], and handed to [`Chosen::run`] as a
//! [`Task`]. `run` enters one function per instruction set that carries `#[target_feature]`;
//! everything below it is `#[inline(always)]` and so is compiled for that instruction set. What several
//! kernels share, and what is long and seldom, is a task of its own that they run by [`Simd::apart`].
//! A stock build is therefore fast on every x86-64, and `wide` alone, which chooses at compile
//! time, serves as the portable implementation and as the reference.
//!
//! No operation that a hit depends on fuses a multiplication with an addition: each is rounded on its
//! own, so every instruction set gives the same bits, and the sign arguments of the watertight
//! triangle test hold (a fused difference of products can have the wrong sign). [`Lanes::mul_add`]
//! alone may fuse: it is for bounds.

mod branch;
mod dense;
mod eight;
mod isa;
mod lanes;
#[cfg(fuzzing)]
mod only;
#[cfg_attr(fuzzing, allow(dead_code))]
mod portable;
mod prefetch;
mod scalar;
mod sixteen;

#[cfg(target_arch = "x86_64")]
#[cfg_attr(fuzzing, allow(dead_code))]
mod avx2;
#[cfg(target_arch = "x86_64")]
#[cfg_attr(fuzzing, allow(dead_code))]
mod avx512;
#[cfg(target_arch = "x86_64")]
mod pair;

pub use branch::stay_a_branch;
pub use dense::Dense;
pub use eight::Eight;
pub use isa::{Chosen, Isa, Task, run_portable};
pub use lanes::{Lanes, Mask, Simd, TAG, TAGS};
pub use prefetch::{prefetch, prefetch_both};
pub use sixteen::Sixteen;

#[cfg(test)]
mod tests;
