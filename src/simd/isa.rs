//! Which instruction sets there are, which this machine has, and how a kernel enters one.

use super::lanes::Simd;
#[cfg(fuzzing)]
use super::only;
use super::portable::Portable;
use crate::error::{Error, Result};
use std::fmt;

/// An instruction set that the kernels are compiled for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Isa {
    /// What the target guarantees (SSE2 on x86-64, NEON on AArch64), through `wide`.
    Portable,
    /// AVX2 with FMA, BMI1, BMI2, LZCNT and POPCNT.
    Avx2,
    /// AVX-512 F, VL, BW and DQ.
    Avx512,
}

impl Isa {
    /// All of them, plainest first.
    pub const ALL: [Self; 3] = [Self::Portable, Self::Avx2, Self::Avx512];

    /// The best one that this machine has.
    pub fn detect() -> Self {
        *Self::available().last().expect("every machine has the portable one")
    }

    /// Those that this machine has, plainest first. Never empty.
    pub fn available() -> Vec<Self> {
        Self::ALL.into_iter().filter(|isa| isa.is_available()).collect()
    }

    /// Whether this machine has it, and this build is for it (see `only`).
    pub fn is_available(self) -> bool {
        #[cfg(fuzzing)]
        let built = self == only::ISA;
        #[cfg(not(fuzzing))]
        let built = true;
        built && self.is_had()
    }

    /// Whether this machine has it.
    fn is_had(self) -> bool {
        match self {
            Self::Portable => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => {
                is_x86_feature_detected!("avx2")
                    && is_x86_feature_detected!("fma")
                    && is_x86_feature_detected!("bmi1")
                    && is_x86_feature_detected!("bmi2")
                    && is_x86_feature_detected!("lzcnt")
                    && is_x86_feature_detected!("popcnt")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_had()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                    && is_x86_feature_detected!("avx512dq")
            }
            #[cfg(not(target_arch = "x86_64"))]
            Self::Avx2 | Self::Avx512 => false,
        }
    }

    /// The one that the environment variable `RAYPACK_ISA` names, else [`Isa::detect`].
    ///
    /// # Errors
    /// The variable names no instruction set, or one that this machine lacks.
    pub fn from_env() -> Result<Self> {
        const VARIABLE: &str = "RAYPACK_ISA";
        let Some(value) = std::env::var_os(VARIABLE) else { return Ok(Self::detect()) };
        let named = Self::ALL.into_iter().find(|isa| value.to_str() == Some(isa.name()));
        match named {
            Some(isa) if isa.is_available() => Ok(isa),
            Some(isa) => {
                let here = Self::available().iter().map(|isa| isa.name()).collect::<Vec<_>>().join(", ");
                Err(Error::option(VARIABLE, format!("this machine has no {isa}; it has {here}")))
            }
            None => Err(Error::option(
                VARIABLE,
                format!("\"{}\" is not one of portable, avx2, avx512", value.to_string_lossy()),
            )),
        }
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

impl fmt::Display for Isa {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// Work to be compiled for every instruction set and run on one of them.
pub trait Task {
    /// What it gives.
    type Output;

    /// Does the work. Must be `#[inline(always)]`, and so must be all that it calls with vectors:
    /// what stays out of line is compiled without the instruction set and is many times slower.
    fn run<S: Simd>(self) -> Self::Output;
}

/// An instruction set that this machine is known to have.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct Chosen(Isa);

impl Chosen {
    /// `None` if this machine lacks it.
    pub fn new(isa: Isa) -> Option<Self> {
        isa.is_available().then_some(Self(isa))
    }

    /// The best one that this machine has.
    pub fn best() -> Self {
        Self(Isa::detect())
    }

    /// Which one it is.
    pub const fn isa(self) -> Isa {
        self.0
    }

    /// Runs a task compiled for it.
    #[cfg(fuzzing)]
    #[inline]
    pub fn run<T: Task>(self, task: T) -> T::Output {
        task.run::<only::Only>()
    }

    /// Runs a task compiled for it.
    #[cfg(not(fuzzing))]
    #[inline]
    pub fn run<T: Task>(self, task: T) -> T::Output {
        match self.0 {
            Isa::Portable => run_portable(task),
            // SAFETY: a `Chosen` exists only for an instruction set that the machine has.
            #[cfg(target_arch = "x86_64")]
            Isa::Avx2 => unsafe { run_avx2(task) },
            // SAFETY: as above.
            #[cfg(target_arch = "x86_64")]
            Isa::Avx512 => unsafe { run_avx512(task) },
            #[cfg(not(target_arch = "x86_64"))]
            Isa::Avx2 | Isa::Avx512 => unreachable!("never available on this architecture"),
        }
    }
}

impl fmt::Debug for Chosen {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

// Never inlined: callers would all compile it anew, and what a kernel does apart is apart so.

/// Runs a task compiled for [`Isa::Portable`] alone, which every machine has.
#[inline(never)]
pub fn run_portable<T: Task>(task: T) -> T::Output {
    task.run::<Portable>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
#[cfg_attr(fuzzing, allow(dead_code))]
pub(super) fn run_avx2<T: Task>(task: T) -> T::Output {
    task.run::<super::avx2::Avx2>()
}

#[cfg(target_arch = "x86_64")]
#[target_feature(enable = "avx512f,avx512vl,avx512bw,avx512dq,avx2,fma,bmi1,bmi2,lzcnt,popcnt")]
#[inline(never)]
#[cfg_attr(fuzzing, allow(dead_code))]
pub(super) fn run_avx512<T: Task>(task: T) -> T::Output {
    task.run::<super::avx512::Avx512>()
}
