//! One lane: a plain `f32`. The single-ray kernel is the packet kernel over this.

use super::lanes::{Lanes, Mask, TAGS};

impl Mask for bool {
    #[inline(always)]
    fn bits(self) -> u32 {
        u32::from(self)
    }
}

impl Lanes<1> for f32 {
    type Mask = bool;
    type Ids = i32;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        value
    }
    #[inline(always)]
    fn load(values: &[f32; 1]) -> Self {
        values[0]
    }
    #[inline(always)]
    fn store(self) -> [f32; 1] {
        [self]
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        if self < other { self } else { other }
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        if self > other { self } else { other }
    }
    #[inline(always)]
    fn abs(self) -> Self {
        f32::abs(self)
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        f32::copysign(self, sign)
    }
    #[inline(always)]
    fn lt(self, other: Self) -> bool {
        self < other
    }
    #[inline(always)]
    fn le(self, other: Self) -> bool {
        self <= other
    }
    #[inline(always)]
    fn eq(self, other: Self) -> bool {
        self == other
    }
    #[inline(always)]
    fn select(mask: bool, a: Self, b: Self) -> Self {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn mask_from_bits(bits: u32) -> bool {
        bits & 1 == 1
    }
    #[inline(always)]
    fn ids(id: i32) -> i32 {
        id
    }
    #[inline(always)]
    fn ids_less(a: i32, b: i32) -> bool {
        a < b
    }
    #[inline(always)]
    fn ids_select(mask: bool, a: i32, b: i32) -> i32 {
        if mask { a } else { b }
    }
    #[inline(always)]
    fn ids_with(mask: bool, ids: i32, bits: i32) -> i32 {
        if mask { ids | bits } else { ids }
    }
    #[inline(always)]
    fn ids_store(ids: i32) -> [i32; 1] {
        [ids]
    }
    #[inline(always)]
    fn tag(self, ids: i32) -> i32 {
        self.to_bits() as i32 & !TAGS | ids & TAGS
    }
    #[inline(always)]
    fn of_tagged(tagged: i32) -> Self {
        f32::from_bits((tagged & !TAGS) as u32)
    }
    #[inline(always)]
    fn tags(tagged: i32) -> i32 {
        tagged & TAGS
    }
}
