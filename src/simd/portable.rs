//! The portable implementation, through `wide`: SSE2 on x86-64, NEON on AArch64, and so on.

use super::eight::Eight;
use super::isa::{Task, run_portable};
use super::lanes::{Lanes, Mask, Simd, TAGS};
use super::sixteen::Sixteen;
use bytemuck::cast;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};
use wide::f32x4;

/// The instruction set that the target guarantees.
#[derive(Clone, Copy, Debug)]
pub struct Portable;

impl Simd for Portable {
    const NATIVE: usize = 8;
    type F4 = F32x4;
    type F8 = F32x8;
    type F16 = F32x16;

    #[inline(always)]
    fn apart<T: Task>(task: T) -> T::Output {
        run_portable(task)
    }
}

macro_rules! portable_lanes {
    ($width:literal, $lanes:ident, $mask:ident, $float:ident, $int:ident) => {
        /// `wide`'s vector; a type of our own, so that operations mean what [`Lanes`] says.
        #[derive(Clone, Copy, Debug)]
        pub struct $lanes(wide::$float);

        /// All bits of a lane set, or none.
        #[derive(Clone, Copy, Debug)]
        pub struct $mask(wide::$float);

        portable_lanes!(@operator $lanes, Add, add);
        portable_lanes!(@operator $lanes, Sub, sub);
        portable_lanes!(@operator $lanes, Mul, mul);
        portable_lanes!(@operator $lanes, Div, div);
        portable_lanes!(@operator $mask, BitAnd, bitand);
        portable_lanes!(@operator $mask, BitOr, bitor);

        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(!self.0)
            }
        }

        impl Mask for $mask {
            #[inline(always)]
            fn bits(self) -> u32 {
                self.0.to_bitmask()
            }
        }

        impl Lanes<$width> for $lanes {
            type Mask = $mask;
            type Ids = wide::$int;

            #[inline(always)]
            fn splat(value: f32) -> Self {
                Self(wide::$float::splat(value))
            }
            #[inline(always)]
            fn load(values: &[f32; $width]) -> Self {
                Self(wide::$float::new(*values))
            }
            #[inline(always)]
            fn store(self) -> [f32; $width] {
                self.0.to_array()
            }
            // `wide`'s own minimum spends two more instructions on NaN than our rule asks for. Its quick one is one
            // instruction of SSE, whose rule is ours; elsewhere its rule is another one.
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if cfg!(target_arch = "x86_64") {
                    Self(self.0.fast_min(other.0))
                } else {
                    Self::select(self.lt(other), self, other)
                }
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if cfg!(target_arch = "x86_64") {
                    Self(self.0.fast_max(other.0))
                } else {
                    Self::select(other.lt(self), self, other)
                }
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(self.0.abs())
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                let bit = wide::$float::splat(-0.0);
                Self(self.0.abs() | (sign.0 & bit))
            }
            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                $mask(self.0.simd_lt(other.0))
            }
            #[inline(always)]
            fn le(self, other: Self) -> $mask {
                $mask(self.0.simd_le(other.0))
            }
            #[inline(always)]
            fn eq(self, other: Self) -> $mask {
                $mask(self.0.simd_eq(other.0))
            }
            #[inline(always)]
            fn select(mask: $mask, a: Self, b: Self) -> Self {
                Self(mask.0.bitselect(a.0, b.0))
            }
            #[inline(always)]
            fn mask_from_bits(bits: u32) -> $mask {
                let lanes = wide::$int::new(std::array::from_fn(
                    #[inline(always)]
                    |lane| 1 << lane,
                ));
                $mask(cast((wide::$int::splat(bits as i32) & lanes).simd_eq(lanes)))
            }
            #[inline(always)]
            fn ids(id: i32) -> wide::$int {
                wide::$int::splat(id)
            }
            #[inline(always)]
            fn ids_less(a: wide::$int, b: wide::$int) -> $mask {
                $mask(cast(a.simd_lt(b)))
            }
            #[inline(always)]
            fn ids_select(mask: $mask, a: wide::$int, b: wide::$int) -> wide::$int {
                cast(mask.0.bitselect(cast(a), cast(b)))
            }
            #[inline(always)]
            fn ids_with(mask: $mask, ids: wide::$int, bits: i32) -> wide::$int {
                let mask: wide::$int = cast(mask.0);
                ids | (mask & wide::$int::splat(bits))
            }
            #[inline(always)]
            fn ids_store(ids: wide::$int) -> [i32; $width] {
                ids.to_array()
            }
            #[inline(always)]
            fn tag(self, ids: wide::$int) -> wide::$int {
                let tags = wide::$int::splat(TAGS);
                let bits: wide::$int = cast(self.0);
                (bits & !tags) | (ids & tags)
            }
            #[inline(always)]
            fn of_tagged(tagged: wide::$int) -> Self {
                Self(cast(tagged & wide::$int::splat(!TAGS)))
            }
            #[inline(always)]
            fn tags(tagged: wide::$int) -> wide::$int {
                tagged & wide::$int::splat(TAGS)
            }
        }
    };
    (@operator $type:ident, $trait:ident, $method:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self($trait::$method(self.0, other.0))
            }
        }
    };
}

portable_lanes!(4, F32x4, Mask4, f32x4, i32x4);
portable_lanes!(8, F32x8, Mask8, f32x8, i32x8);
portable_lanes!(16, F32x16, Mask16, f32x16, i32x16);

/// Sixteen lanes as four registers, as most targets have them.
#[inline(always)]
fn registers(lanes: F32x16) -> [f32x4; 4] {
    cast(lanes.0)
}

/// For each of four vectors its four registers folded into one: lanes `4 j` to `4 j + 3` into lane `j`.
#[inline(always)]
fn fold_registers(vectors: &[F32x16; 4], of: impl Fn(F32x4, F32x4) -> F32x4) -> F32x16 {
    let mut folded = [f32x4::ZERO; 4];
    for i in 0..4 {
        let [a, b, c, d] = f32x4::transpose(registers(vectors[i])).map(F32x4);
        folded[i] = of(of(a, b), of(c, d)).0;
    }
    F32x16(cast(folded))
}

impl Sixteen for F32x16 {
    type Half = F32x8;

    #[inline(always)]
    fn of_fours(fours: &[&[f32; 4]; 16]) -> [Self; 4] {
        let mut columns = [[f32x4::ZERO; 4]; 4];
        for part in 0..4 {
            let rows = [0, 1, 2, 3].map(
                #[inline(always)]
                |row| f32x4::new(*fours[4 * part + row]),
            );
            let turned = f32x4::transpose(rows);
            for i in 0..4 {
                columns[i][part] = turned[i];
            }
        }
        columns.map(
            #[inline(always)]
            |column| Self(cast(column)),
        )
    }

    #[inline(always)]
    fn fours(columns: &[Self; 4]) -> [[f32; 4]; 16] {
        let columns = columns.map(registers);
        let mut fours = [[f32x4::ZERO; 4]; 4];
        for part in 0..4 {
            fours[part] =
                f32x4::transpose([columns[0][part], columns[1][part], columns[2][part], columns[3][part]]);
        }
        cast(fours)
    }

    #[inline(always)]
    fn ids_load(ids: &[i32; 16]) -> wide::i32x16 {
        wide::i32x16::new(*ids)
    }

    #[inline(always)]
    fn ids_shift<const BITS: i32>(ids: wide::i32x16) -> wide::i32x16 {
        let bits: wide::u32x16 = cast(ids);
        cast(bits >> BITS)
    }

    #[inline(always)]
    fn least_of_fours(vectors: &[Self; 4]) -> Self {
        fold_registers(vectors, Lanes::min)
    }

    #[inline(always)]
    fn greatest_of_fours(vectors: &[Self; 4]) -> Self {
        fold_registers(vectors, Lanes::max)
    }
}

impl Eight for F32x8 {
    #[inline(always)]
    fn ids_load(ids: &[i32; 8]) -> wide::i32x8 {
        wide::i32x8::new(*ids)
    }

    #[inline(always)]
    fn ids_shift<const BITS: i32>(ids: wide::i32x8) -> wide::i32x8 {
        let bits: wide::u32x8 = cast(ids);
        cast(bits >> BITS)
    }
}
