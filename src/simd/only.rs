//! The one instruction set of a build for fuzzers: the best that the target of the build has.
//!
//! A fuzzer's build, in which every access is checked and every branch counted, takes longest of all; and what it is for
//! runs on the machine that built it. So kernels are compiled once there, and not for a choice at run time.

use super::isa::Isa;

// Each of the three has AVX-512 F with it.
#[cfg(all(target_feature = "avx512vl", target_feature = "avx512bw", target_feature = "avx512dq"))]
mod best {
    pub use crate::simd::avx512::Avx512 as Only;
    pub const ISA: super::Isa = super::Isa::Avx512;
}

#[cfg(all(
    all(target_feature = "avx2", target_feature = "fma"),
    not(all(target_feature = "avx512vl", target_feature = "avx512bw", target_feature = "avx512dq"))
))]
mod best {
    pub use crate::simd::avx2::Avx2 as Only;
    pub const ISA: super::Isa = super::Isa::Avx2;
}

#[cfg(not(all(target_feature = "avx2", target_feature = "fma")))]
mod best {
    pub use crate::simd::portable::Portable as Only;
    pub const ISA: super::Isa = super::Isa::Portable;
}

pub use best::{ISA, Only};
