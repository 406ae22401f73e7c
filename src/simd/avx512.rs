//! AVX-512: 16 lanes in a ZMM register, masks in mask registers; 4 and 8 lanes as for AVX2.
//!
//! # Safety
//! As in `avx2.rs`: the type here is named by [`Avx512`] alone, which is instantiated only in
//! the `#[target_feature]` entry that a [`super::Chosen`] reaches after the machine was asked.

use super::avx2;
use super::isa::{Task, run_avx512};
use super::lanes::{Lanes, Mask, Simd, TAGS};
use super::sixteen::Sixteen;
use std::arch::x86_64::*;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// AVX-512 F, VL, BW and DQ.
#[derive(Clone, Copy, Debug)]
pub struct Avx512;

impl Simd for Avx512 {
    const NATIVE: usize = 16;
    type F4 = avx2::F32x4;
    type F8 = avx2::F32x8;
    type F16 = F32x16;

    #[inline(always)]
    fn apart<T: Task>(task: T) -> T::Output {
        // SAFETY: this runs only on machines that have AVX-512 (see the head of the file).
        unsafe { run_avx512(task) }
    }
}

/// Calls an intrinsic. The one `unsafe` of this file.
macro_rules! avx512 {
    ($call:expr) => {
        // SAFETY: this runs only on machines that have AVX-512 (see the head of the file); loads
        // and stores go through references to arrays of exactly the vector's size.
        unsafe { $call }
    };
}

/// Floats in one register.
#[derive(Clone, Copy, Debug)]
pub struct F32x16(__m512);

/// One bit a lane.
#[derive(Clone, Copy, Debug)]
pub struct Mask16(__mmask16);

macro_rules! operator {
    ($trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for F32x16 {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(avx512!($intrinsic(self.0, other.0)))
            }
        }
    };
}

operator!(Add, add, _mm512_add_ps);
operator!(Sub, sub, _mm512_sub_ps);
operator!(Mul, mul, _mm512_mul_ps);
operator!(Div, div, _mm512_div_ps);

impl BitAnd for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(self.0 & other.0)
    }
}

impl BitOr for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }
}

impl Not for Mask16 {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0)
    }
}

impl Mask for Mask16 {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self.0)
    }
}

impl Lanes<16> for F32x16 {
    type Mask = Mask16;
    type Ids = __m512i;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(avx512!(_mm512_set1_ps(value)))
    }
    #[inline(always)]
    fn load(values: &[f32; 16]) -> Self {
        Self(avx512!(_mm512_loadu_ps(values.as_ptr())))
    }
    #[inline(always)]
    fn store(self) -> [f32; 16] {
        let mut values = [0.0; 16];
        avx512!(_mm512_storeu_ps(values.as_mut_ptr(), self.0));
        values
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(avx512!(_mm512_min_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(avx512!(_mm512_max_ps(self.0, other.0)))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(avx512!(_mm512_fmadd_ps(self.0, factor.0, addend.0)))
    }
    #[inline(always)]
    fn least(self) -> f32 {
        avx512!(_mm512_reduce_min_ps(self.0))
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        avx512!(_mm512_reduce_max_ps(self.0))
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(avx512!(_mm512_andnot_ps(_mm512_set1_ps(-0.0), self.0)))
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        let bit = avx512!(_mm512_set1_ps(-0.0));
        Self(avx512!(_mm512_or_ps(_mm512_andnot_ps(bit, self.0), _mm512_and_ps(bit, sign.0))))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmp_ps_mask::<_CMP_LT_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmp_ps_mask::<_CMP_LE_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Mask16 {
        Mask16(avx512!(_mm512_cmp_ps_mask::<_CMP_EQ_OQ>(self.0, other.0)))
    }
    #[inline(always)]
    fn select(mask: Mask16, a: Self, b: Self) -> Self {
        Self(avx512!(_mm512_mask_blend_ps(mask.0, b.0, a.0)))
    }
    #[inline(always)]
    fn mask_from_bits(bits: u32) -> Mask16 {
        Mask16(bits as u16)
    }
    #[inline(always)]
    fn ids(id: i32) -> __m512i {
        avx512!(_mm512_set1_epi32(id))
    }
    #[inline(always)]
    fn ids_less(a: __m512i, b: __m512i) -> Mask16 {
        Mask16(avx512!(_mm512_cmplt_epi32_mask(a, b)))
    }
    #[inline(always)]
    fn ids_select(mask: Mask16, a: __m512i, b: __m512i) -> __m512i {
        avx512!(_mm512_mask_blend_epi32(mask.0, b, a))
    }
    #[inline(always)]
    fn ids_with(mask: Mask16, ids: __m512i, bits: i32) -> __m512i {
        avx512!(_mm512_mask_or_epi32(ids, mask.0, ids, Self::ids(bits)))
    }
    #[inline(always)]
    fn ids_store(ids: __m512i) -> [i32; 16] {
        let mut values = [0; 16];
        avx512!(_mm512_storeu_si512(values.as_mut_ptr().cast(), ids));
        values
    }
    #[inline(always)]
    fn tag(self, ids: __m512i) -> __m512i {
        // Of three bits, the third one where the first is set, the second one elsewhere.
        let tags = Self::ids(TAGS);
        avx512!(_mm512_ternarylogic_epi32::<0b1010_1100>(tags, _mm512_castps_si512(self.0), ids))
    }
    #[inline(always)]
    fn of_tagged(tagged: __m512i) -> Self {
        Self(avx512!(_mm512_castsi512_ps(_mm512_andnot_si512(Self::ids(TAGS), tagged))))
    }
    #[inline(always)]
    fn tags(tagged: __m512i) -> __m512i {
        avx512!(_mm512_and_si512(Self::ids(TAGS), tagged))
    }
}

/// Four lanes from `4 * part` on, each four times.
#[inline(always)]
fn quarters(part: usize) -> __m512i {
    let order = avx512!(_mm512_setr_epi32(0, 0, 0, 0, 1, 1, 1, 1, 2, 2, 2, 2, 3, 3, 3, 3));
    avx512!(_mm512_add_epi32(_mm512_set1_epi32(4 * part as i32), order))
}

/// Four fours side by side.
#[inline(always)]
fn side_by_side(fours: [&[f32; 4]; 4]) -> __m512 {
    let [a, b, c, d] = fours;
    let row = avx512!(_mm512_castps128_ps512(_mm_loadu_ps(a.as_ptr())));
    let row = avx512!(_mm512_insertf32x4::<1>(row, _mm_loadu_ps(b.as_ptr())));
    let row = avx512!(_mm512_insertf32x4::<2>(row, _mm_loadu_ps(c.as_ptr())));
    avx512!(_mm512_insertf32x4::<3>(row, _mm_loadu_ps(d.as_ptr())))
}

/// Sixteen vectors folded into one: lane `i` is what is left of vector `i`. Two vectors at a time, what is left of
/// each half as long, so that it takes 45 operations instead of 8 for each vector.
macro_rules! fold_each {
    ($vectors:expr, $of:ident) => {{
        let vectors = $vectors;
        let mut fours = [vectors[0]; 4];
        for i in 0..4 {
            let [a, b, c, d] = [vectors[4 * i], vectors[4 * i + 1], vectors[4 * i + 2], vectors[4 * i + 3]];
            // Within quarters: of four vectors, a lane each.
            let ab = avx512!($of(_mm512_unpacklo_ps(a.0, b.0), _mm512_unpackhi_ps(a.0, b.0)));
            let cd = avx512!($of(_mm512_unpacklo_ps(c.0, d.0), _mm512_unpackhi_ps(c.0, d.0)));
            let (low, high) =
                (avx512!(_mm512_shuffle_ps::<0x44>(ab, cd)), avx512!(_mm512_shuffle_ps::<0xee>(ab, cd)));
            fours[i] = Self(avx512!($of(low, high)));
        }
        // Then the quarters.
        let [a, b, c, d] = fours;
        let low =
            avx512!($of(_mm512_shuffle_f32x4::<0x44>(a.0, b.0), _mm512_shuffle_f32x4::<0xee>(a.0, b.0)));
        let high =
            avx512!($of(_mm512_shuffle_f32x4::<0x44>(c.0, d.0), _mm512_shuffle_f32x4::<0xee>(c.0, d.0)));
        let (even, odd) = (
            avx512!(_mm512_shuffle_f32x4::<0x88>(low, high)),
            avx512!(_mm512_shuffle_f32x4::<0xdd>(low, high)),
        );
        Self(avx512!($of(even, odd)))
    }};
}

/// Four vectors folded into one, four lanes to one.
macro_rules! fold_fours {
    ($vectors:expr, $of:ident) => {{
        let [a, b, c, d] = $vectors;
        // Within quarters: of each vector, two numbers, then one.
        let ab = avx512!($of(_mm512_shuffle_ps::<0x88>(a.0, b.0), _mm512_shuffle_ps::<0xdd>(a.0, b.0)));
        let cd = avx512!($of(_mm512_shuffle_ps::<0x88>(c.0, d.0), _mm512_shuffle_ps::<0xdd>(c.0, d.0)));
        let folded = avx512!($of(_mm512_shuffle_ps::<0x88>(ab, cd), _mm512_shuffle_ps::<0xdd>(ab, cd)));
        // A quarter holds a number of each vector.
        let order = avx512!(_mm512_setr_epi32(0, 4, 8, 12, 1, 5, 9, 13, 2, 6, 10, 14, 3, 7, 11, 15));
        Self(avx512!(_mm512_permutexvar_ps(order, folded)))
    }};
}

impl Sixteen for F32x16 {
    type Half = avx2::F32x8;
    const HALVES_PAY: bool = false;

    #[inline(always)]
    fn pick_half(self, ids: __m256i) -> avx2::F32x8 {
        let ids = avx512!(_mm512_castsi256_si512(ids));
        avx2::F32x8(avx512!(_mm512_castps512_ps256(_mm512_permutexvar_ps(ids, self.0))))
    }
    #[inline(always)]
    fn of_half(half: avx2::F32x8) -> Self {
        Self(avx512!(_mm512_castps256_ps512(half.0)))
    }
    #[inline(always)]
    fn side_by_side(fours: [&[f32; 4]; 4]) -> Self {
        Self(side_by_side(fours))
    }
    #[inline(always)]
    fn ids_of_four(ids: &[i32; 4]) -> __m512i {
        avx512!(_mm512_broadcast_i32x4(_mm_loadu_si128(ids.as_ptr().cast())))
    }
    #[inline(always)]
    fn ids_spread(ids: __m256i, part: usize) -> __m512i {
        avx512!(_mm512_permutexvar_epi32(quarters(part), _mm512_castsi256_si512(ids)))
    }
    #[inline(always)]
    fn ids_load(ids: &[i32; 16]) -> __m512i {
        avx512!(_mm512_loadu_si512(ids.as_ptr().cast()))
    }
    #[inline(always)]
    fn ids_widen(ids: &[u16; 16]) -> __m512i {
        avx512!(_mm512_cvtepu16_epi32(_mm256_loadu_si256(ids.as_ptr().cast())))
    }
    #[inline(always)]
    fn ids_shift<const BITS: i32>(ids: __m512i) -> __m512i {
        avx512!(_mm512_srl_epi32(ids, _mm_cvtsi32_si128(BITS)))
    }
    #[inline(always)]
    fn pick(self, ids: __m512i) -> Self {
        Self(avx512!(_mm512_permutexvar_ps(ids, self.0)))
    }
    // Closed up in the register, and stored whole: stores of single lanes are slow.
    #[inline(always)]
    fn compact(self, bits: u32, to: &mut [f32; 16]) {
        avx512!(_mm512_storeu_ps(to.as_mut_ptr(), _mm512_maskz_compress_ps(bits as u16, self.0)));
    }
    #[inline(always)]
    fn ids_compact(ids: __m512i, bits: u32, to: &mut [i32; 16]) {
        avx512!(_mm512_storeu_si512(to.as_mut_ptr().cast(), _mm512_maskz_compress_epi32(bits as u16, ids)));
    }
    #[inline(always)]
    fn least_of_fours(vectors: &[Self; 4]) -> Self {
        fold_fours!(vectors, _mm512_min_ps)
    }
    #[inline(always)]
    fn greatest_of_fours(vectors: &[Self; 4]) -> Self {
        fold_fours!(vectors, _mm512_max_ps)
    }
    #[inline(always)]
    fn spread(self, part: usize) -> Self {
        Self(avx512!(_mm512_permutexvar_ps(quarters(part), self.0)))
    }
    #[inline(always)]
    fn least_of_each(vectors: &[Self; 16]) -> Self {
        fold_each!(vectors, _mm512_min_ps)
    }
    #[inline(always)]
    fn greatest_of_each(vectors: &[Self; 16]) -> Self {
        fold_each!(vectors, _mm512_max_ps)
    }
    #[inline(always)]
    fn of_fours(fours: &[&[f32; 4]; 16]) -> [Self; 4] {
        // Row `i` holds the fours i, i + 4, i + 8 and i + 12, so that exchanging rows and columns in each
        // quarter puts all lanes in order.
        let a = side_by_side([fours[0], fours[4], fours[8], fours[12]]);
        let b = side_by_side([fours[1], fours[5], fours[9], fours[13]]);
        let c = side_by_side([fours[2], fours[6], fours[10], fours[14]]);
        let d = side_by_side([fours[3], fours[7], fours[11], fours[15]]);
        let [a, b, c, d] = turn_quarters([a, b, c, d]);
        [Self(a), Self(b), Self(c), Self(d)]
    }
    #[inline(always)]
    fn fours(columns: &[Self; 4]) -> [[f32; 4]; 16] {
        let [a, b, c, d] = columns;
        let rows = turn_quarters([a.0, b.0, c.0, d.0]);
        let mut fours = [[0.0; 4]; 16];
        for (i, row) in rows.into_iter().enumerate() {
            let row = Self(row).store();
            for quarter in 0..4 {
                fours[4 * quarter + i].copy_from_slice(&row[4 * quarter..][..4]);
            }
        }
        fours
    }
}

/// Rows and columns exchanged in each quarter.
#[inline(always)]
fn turn_quarters([a, b, c, d]: [__m512; 4]) -> [__m512; 4] {
    let (low_ab, high_ab) = (avx512!(_mm512_unpacklo_ps(a, b)), avx512!(_mm512_unpackhi_ps(a, b)));
    let (low_cd, high_cd) = (avx512!(_mm512_unpacklo_ps(c, d)), avx512!(_mm512_unpackhi_ps(c, d)));
    [
        avx512!(_mm512_shuffle_ps::<0x44>(low_ab, low_cd)),
        avx512!(_mm512_shuffle_ps::<0xee>(low_ab, low_cd)),
        avx512!(_mm512_shuffle_ps::<0x44>(high_ab, high_cd)),
        avx512!(_mm512_shuffle_ps::<0xee>(high_ab, high_cd)),
    ]
}
