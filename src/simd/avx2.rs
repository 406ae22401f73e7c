//! AVX2: 4 lanes in an XMM register, 8 in a YMM, 16 in two.
//!
//! # Safety
//! The types here call AVX and AVX2 intrinsics from safe methods. They are private to `simd`,
//! and only [`Avx2`] and `Avx512` name them; those two are instantiated in one place each, the
//! `#[target_feature]` entries of `isa.rs`, which a [`super::Chosen`] reaches only after the
//! machine has been asked, and what runs there already by [`Simd::apart`]. So wherever a method of these types runs, the
//! machine has AVX2.

use super::eight::{Eight, LANES_OF};
use super::isa::{Task, run_avx2};
use super::lanes::{Lanes, Mask, Simd, TAGS};
use super::pair::Pair;
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// AVX2, FMA, BMI and what else every such machine has.
#[derive(Clone, Copy, Debug)]
pub struct Avx2;

impl Simd for Avx2 {
    const NATIVE: usize = 8;
    type F4 = F32x4;
    type F8 = F32x8;
    type F16 = Pair<F32x8>;

    #[inline(always)]
    fn apart<T: Task>(task: T) -> T::Output {
        // SAFETY: this runs only on machines that have AVX2 (see the head of the file).
        unsafe { run_avx2(task) }
    }
}

/// Calls an intrinsic. The one `unsafe` of this file.
macro_rules! avx {
    ($call:expr) => {
        // SAFETY: this runs only on machines that have AVX2 (see the head of the file); loads and
        // stores go through references to arrays of exactly the vector's size.
        unsafe { $call }
    };
}

/// One width. The intrinsics are named one by one because their names follow no pattern that a
/// macro could build.
macro_rules! avx2_lanes {
    ($width:literal, $lanes:ident, $mask:ident, $float:ty, $int:ty,
     $add:ident $sub:ident $mul:ident $fmadd:ident $div:ident $min:ident $max:ident $and:ident $andnot:ident $or:ident $xor:ident
     $cmp:ident $blend:ident $movemask:ident $splat:ident $load:ident $store:ident
     $iset:ident $igt:ident $isetr:ident $iand:ident $ieq:ident $istore:ident
     $to_float:ident $to_int:ident) => {
        /// Floats in one register.
        #[derive(Clone, Copy, Debug)]
        pub struct $lanes(pub(super) $float);

        /// All bits of a lane set, or none.
        #[derive(Clone, Copy, Debug)]
        pub struct $mask($float);

        avx2_lanes!(@operator $lanes, Add, add, $add);
        avx2_lanes!(@operator $lanes, Sub, sub, $sub);
        avx2_lanes!(@operator $lanes, Mul, mul, $mul);
        avx2_lanes!(@operator $lanes, Div, div, $div);
        avx2_lanes!(@operator $mask, BitAnd, bitand, $and);
        avx2_lanes!(@operator $mask, BitOr, bitor, $or);

        impl Not for $mask {
            type Output = Self;
            #[inline(always)]
            fn not(self) -> Self {
                Self(avx!($xor(self.0, $to_float($iset(-1)))))
            }
        }

        impl Mask for $mask {
            #[inline(always)]
            fn bits(self) -> u32 {
                avx!($movemask(self.0)) as u32
            }
        }

        impl Lanes<$width> for $lanes {
            type Mask = $mask;
            type Ids = $int;

            #[inline(always)]
            fn splat(value: f32) -> Self {
                Self(avx!($splat(value)))
            }
            #[inline(always)]
            fn load(values: &[f32; $width]) -> Self {
                Self(avx!($load(values.as_ptr())))
            }
            #[inline(always)]
            fn store(self) -> [f32; $width] {
                let mut values = [0.0; $width];
                avx!($store(values.as_mut_ptr(), self.0));
                values
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self(avx!($min(self.0, other.0)))
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self(avx!($max(self.0, other.0)))
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, addend: Self) -> Self {
                Self(avx!($fmadd(self.0, factor.0, addend.0)))
            }
            #[inline(always)]
            fn abs(self) -> Self {
                Self(avx!($andnot($splat(-0.0), self.0)))
            }
            #[inline(always)]
            fn copysign(self, sign: Self) -> Self {
                let bit = avx!($splat(-0.0));
                Self(avx!($or($andnot(bit, self.0), $and(bit, sign.0))))
            }
            #[inline(always)]
            fn lt(self, other: Self) -> $mask {
                $mask(avx!($cmp::<_CMP_LT_OQ>(self.0, other.0)))
            }
            #[inline(always)]
            fn le(self, other: Self) -> $mask {
                $mask(avx!($cmp::<_CMP_LE_OQ>(self.0, other.0)))
            }
            #[inline(always)]
            fn eq(self, other: Self) -> $mask {
                $mask(avx!($cmp::<_CMP_EQ_OQ>(self.0, other.0)))
            }
            #[inline(always)]
            fn select(mask: $mask, a: Self, b: Self) -> Self {
                Self(avx!($blend(b.0, a.0, mask.0)))
            }
            #[inline(always)]
            fn mask_from_bits(bits: u32) -> $mask {
                let weights = avx!($isetr());
                let bits = avx!($iset(bits as i32));
                $mask(avx!($to_float($ieq($iand(bits, weights), weights))))
            }
            #[inline(always)]
            fn mask_of_first(count: usize) -> $mask {
                $mask(avx!($to_float($igt($iset(1 << (count & 31)), $isetr()))))
            }
            #[inline(always)]
            fn ids(id: i32) -> $int {
                avx!($iset(id))
            }
            #[inline(always)]
            fn ids_less(a: $int, b: $int) -> $mask {
                $mask(avx!($to_float($igt(b, a))))
            }
            #[inline(always)]
            fn ids_select(mask: $mask, a: $int, b: $int) -> $int {
                avx!($to_int($blend($to_float(b), $to_float(a), mask.0)))
            }
            #[inline(always)]
            fn ids_with(mask: $mask, ids: $int, bits: i32) -> $int {
                avx!($to_int($or($to_float(ids), $and(mask.0, $to_float($iset(bits))))))
            }
            #[inline(always)]
            fn ids_store(ids: $int) -> [i32; $width] {
                let mut values = [0; $width];
                avx!($istore(values.as_mut_ptr().cast(), ids));
                values
            }
            #[inline(always)]
            fn tag(self, ids: $int) -> $int {
                let tags = avx!($to_float($iset(TAGS)));
                avx!($to_int($or($andnot(tags, self.0), $and(tags, $to_float(ids)))))
            }
            #[inline(always)]
            fn of_tagged(tagged: $int) -> Self {
                Self(avx!($andnot($to_float($iset(TAGS)), $to_float(tagged))))
            }
            #[inline(always)]
            fn tags(tagged: $int) -> $int {
                avx!($iand($iset(TAGS), tagged))
            }
        }
    };
    (@operator $type:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(avx!($intrinsic(self.0, other.0)))
            }
        }
    };
}

/// Lane `i` holds `1 << i`.
#[inline(always)]
unsafe fn weights4() -> __m128i {
    // SAFETY: the caller's promise, that of the whole file.
    unsafe { _mm_setr_epi32(1, 2, 4, 8) }
}

/// Lane `i` holds `1 << i`.
#[inline(always)]
unsafe fn weights8() -> __m256i {
    // SAFETY: the caller's promise, that of the whole file.
    unsafe { _mm256_setr_epi32(1, 2, 4, 8, 16, 32, 64, 128) }
}

avx2_lanes!(4, F32x4, Mask4, __m128, __m128i,
    _mm_add_ps _mm_sub_ps _mm_mul_ps _mm_fmadd_ps _mm_div_ps _mm_min_ps _mm_max_ps _mm_and_ps _mm_andnot_ps _mm_or_ps _mm_xor_ps
    _mm_cmp_ps _mm_blendv_ps _mm_movemask_ps _mm_set1_ps _mm_loadu_ps _mm_storeu_ps
    _mm_set1_epi32 _mm_cmpgt_epi32 weights4 _mm_and_si128 _mm_cmpeq_epi32 _mm_storeu_si128
    _mm_castsi128_ps _mm_castps_si128);

avx2_lanes!(8, F32x8, Mask8, __m256, __m256i,
    _mm256_add_ps _mm256_sub_ps _mm256_mul_ps _mm256_fmadd_ps _mm256_div_ps _mm256_min_ps _mm256_max_ps _mm256_and_ps _mm256_andnot_ps _mm256_or_ps _mm256_xor_ps
    _mm256_cmp_ps _mm256_blendv_ps _mm256_movemask_ps _mm256_set1_ps _mm256_loadu_ps _mm256_storeu_ps
    _mm256_set1_epi32 _mm256_cmpgt_epi32 weights8 _mm256_and_si256 _mm256_cmpeq_epi32 _mm256_storeu_si256
    _mm256_castsi256_ps _mm256_castps_si256);

/// The lanes in `bits`, one behind the other, as a permutation.
#[inline(always)]
fn lanes_of(bits: u32) -> __m256i {
    let row = &LANES_OF[(bits & 0xff) as usize];
    avx!(_mm256_cvtepu8_epi32(_mm_loadl_epi64(row.as_ptr().cast())))
}

impl Eight for F32x8 {
    #[inline(always)]
    fn of_fours([low, high]: [&[f32; 4]; 2]) -> Self {
        let low = avx!(_mm256_castps128_ps256(_mm_loadu_ps(low.as_ptr())));
        Self(avx!(_mm256_insertf128_ps::<1>(low, _mm_loadu_ps(high.as_ptr()))))
    }
    #[inline(always)]
    fn pick_in_fours(self, ids: __m256i) -> Self {
        Self(avx!(_mm256_permutevar_ps(self.0, ids)))
    }
    #[inline(always)]
    fn splat_in_fours<const I: usize>(self) -> Self {
        Self(avx!(match I & 3 {
            0 => _mm256_permute_ps::<0x00>(self.0),
            1 => _mm256_permute_ps::<0x55>(self.0),
            2 => _mm256_permute_ps::<0xaa>(self.0),
            _ => _mm256_permute_ps::<0xff>(self.0),
        }))
    }
    #[inline(always)]
    fn pick(self, ids: __m256i) -> Self {
        Self(avx!(_mm256_permutevar8x32_ps(self.0, ids)))
    }
    #[inline(always)]
    fn first_pairs(self, other: Self) -> Self {
        Self(avx!(_mm256_shuffle_ps::<0x44>(self.0, other.0)))
    }
    #[inline(always)]
    fn last_pairs(self, other: Self) -> Self {
        Self(avx!(_mm256_shuffle_ps::<0xee>(self.0, other.0)))
    }
    #[inline(always)]
    fn transpose_fours([a, b, c, d]: [Self; 4]) -> [Self; 4] {
        let low_ab = avx!(_mm256_unpacklo_ps(a.0, b.0));
        let low_cd = avx!(_mm256_unpacklo_ps(c.0, d.0));
        let high_ab = avx!(_mm256_unpackhi_ps(a.0, b.0));
        let high_cd = avx!(_mm256_unpackhi_ps(c.0, d.0));
        let (low_ab, low_cd) = (Self(low_ab), Self(low_cd));
        let (high_ab, high_cd) = (Self(high_ab), Self(high_cd));
        [
            low_ab.first_pairs(low_cd),
            low_ab.last_pairs(low_cd),
            high_ab.first_pairs(high_cd),
            high_ab.last_pairs(high_cd),
        ]
    }
    #[inline(always)]
    fn compact(self, bits: u32, to: &mut [f32; 8]) {
        avx!(_mm256_storeu_ps(to.as_mut_ptr(), _mm256_permutevar8x32_ps(self.0, lanes_of(bits))));
    }
    #[inline(always)]
    fn ids_load(ids: &[i32; 8]) -> __m256i {
        avx!(_mm256_loadu_si256(ids.as_ptr().cast()))
    }
    #[inline(always)]
    fn ids_widen(ids: &[u16; 8]) -> __m256i {
        avx!(_mm256_cvtepu16_epi32(_mm_loadu_si128(ids.as_ptr().cast())))
    }
    #[inline(always)]
    fn ids_shift<const BITS: i32>(ids: __m256i) -> __m256i {
        avx!(_mm256_srli_epi32::<BITS>(ids))
    }
    #[inline(always)]
    fn ids_and(a: __m256i, b: __m256i) -> __m256i {
        avx!(_mm256_and_si256(a, b))
    }
    #[inline(always)]
    fn ids_pick(ids: __m256i, places: __m256i) -> __m256i {
        avx!(_mm256_permutevar8x32_epi32(ids, places))
    }
    #[inline(always)]
    fn ids_nibbles(nibbles: u32) -> __m256i {
        avx!(_mm256_srlv_epi32(
            _mm256_set1_epi32(nibbles as i32),
            _mm256_setr_epi32(0, 4, 8, 12, 16, 20, 24, 28)
        ))
    }
    #[inline(always)]
    fn ids_compact(ids: __m256i, bits: u32, to: &mut [i32; 8]) {
        avx!(_mm256_storeu_si256(to.as_mut_ptr().cast(), _mm256_permutevar8x32_epi32(ids, lanes_of(bits))));
    }
}
