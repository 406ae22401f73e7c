//! Twice the lanes: two vectors that act as one, for instruction sets narrower than a packet.

use super::eight::Eight;
use super::lanes::{Lanes, Mask};
use super::sixteen::Sixteen;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// Lanes `0..W/2` in the first, the others in the second.
#[derive(Clone, Copy, Debug)]
pub struct Pair<T>(T, T);

macro_rules! operator {
    ($trait:ident, $method:ident) => {
        impl<T: $trait<Output = T>> $trait for Pair<T> {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0), self.1.$method(other.1))
            }
        }
    };
}

operator!(Add, add);
operator!(Sub, sub);
operator!(Mul, mul);
operator!(Div, div);
operator!(BitAnd, bitand);
operator!(BitOr, bitor);

impl<T: Not<Output = T>> Not for Pair<T> {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(!self.0, !self.1)
    }
}

/// The halves of an array.
#[inline(always)]
fn halves(values: &[f32; 16]) -> (&[f32; 8], &[f32; 8]) {
    let (low, high) = values.split_at(8);
    (low.try_into().expect("8 of 16"), high.try_into().expect("8 of 16"))
}

/// The array of two halves.
#[inline(always)]
fn joined<T: Copy + Default>(low: [T; 8], high: [T; 8]) -> [T; 16] {
    let mut all = [T::default(); 16];
    all[..8].copy_from_slice(&low);
    all[8..].copy_from_slice(&high);
    all
}

/// A mask of 8 + 8 lanes.
impl<M: Mask> Mask for Pair<M> {
    #[inline(always)]
    fn bits(self) -> u32 {
        self.0.bits() | self.1.bits() << 8
    }
    #[inline(always)]
    fn any(self) -> bool {
        (self.0 | self.1).any()
    }
}

impl<L: Lanes<8>> Lanes<16> for Pair<L> {
    type Mask = Pair<L::Mask>;
    type Ids = Pair<L::Ids>;

    #[inline(always)]
    fn splat(value: f32) -> Self {
        Self(L::splat(value), L::splat(value))
    }
    #[inline(always)]
    fn load(values: &[f32; 16]) -> Self {
        let (low, high) = halves(values);
        Self(L::load(low), L::load(high))
    }
    #[inline(always)]
    fn store(self) -> [f32; 16] {
        joined(self.0.store(), self.1.store())
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self(self.0.min(other.0), self.1.min(other.1))
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self(self.0.max(other.0), self.1.max(other.1))
    }
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        Self(self.0.mul_add(factor.0, addend.0), self.1.mul_add(factor.1, addend.1))
    }
    #[inline(always)]
    fn least(self) -> f32 {
        self.0.min(self.1).least()
    }
    #[inline(always)]
    fn greatest(self) -> f32 {
        self.0.max(self.1).greatest()
    }
    #[inline(always)]
    fn abs(self) -> Self {
        Self(self.0.abs(), self.1.abs())
    }
    #[inline(always)]
    fn copysign(self, sign: Self) -> Self {
        Self(self.0.copysign(sign.0), self.1.copysign(sign.1))
    }
    #[inline(always)]
    fn lt(self, other: Self) -> Self::Mask {
        Pair(self.0.lt(other.0), self.1.lt(other.1))
    }
    #[inline(always)]
    fn le(self, other: Self) -> Self::Mask {
        Pair(self.0.le(other.0), self.1.le(other.1))
    }
    #[inline(always)]
    fn eq(self, other: Self) -> Self::Mask {
        Pair(self.0.eq(other.0), self.1.eq(other.1))
    }
    #[inline(always)]
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self {
        Self(L::select(mask.0, a.0, b.0), L::select(mask.1, a.1, b.1))
    }
    #[inline(always)]
    fn mask_from_bits(bits: u32) -> Self::Mask {
        Pair(L::mask_from_bits(bits & 0xff), L::mask_from_bits(bits >> 8))
    }
    #[inline(always)]
    fn ids(id: i32) -> Self::Ids {
        Pair(L::ids(id), L::ids(id))
    }
    #[inline(always)]
    fn ids_less(a: Self::Ids, b: Self::Ids) -> Self::Mask {
        Pair(L::ids_less(a.0, b.0), L::ids_less(a.1, b.1))
    }
    #[inline(always)]
    fn ids_select(mask: Self::Mask, a: Self::Ids, b: Self::Ids) -> Self::Ids {
        Pair(L::ids_select(mask.0, a.0, b.0), L::ids_select(mask.1, a.1, b.1))
    }
    #[inline(always)]
    fn ids_with(mask: Self::Mask, ids: Self::Ids, bits: i32) -> Self::Ids {
        Pair(L::ids_with(mask.0, ids.0, bits), L::ids_with(mask.1, ids.1, bits))
    }
    #[inline(always)]
    fn ids_store(ids: Self::Ids) -> [i32; 16] {
        joined(L::ids_store(ids.0), L::ids_store(ids.1))
    }
    #[inline(always)]
    fn tag(self, ids: Self::Ids) -> Self::Ids {
        Pair(self.0.tag(ids.0), self.1.tag(ids.1))
    }
    #[inline(always)]
    fn of_tagged(tagged: Self::Ids) -> Self {
        Self(L::of_tagged(tagged.0), L::of_tagged(tagged.1))
    }
    #[inline(always)]
    fn tags(tagged: Self::Ids) -> Self::Ids {
        Pair(L::tags(tagged.0), L::tags(tagged.1))
    }
}

impl<L: Eight> Sixteen for Pair<L> {
    type Half = L;

    #[inline(always)]
    fn pick_half(self, ids: L::Ids) -> L {
        let is_low = L::ids_less(L::ids_and(ids, L::ids(15)), L::ids(8));
        L::select(is_low, self.0.pick(ids), self.1.pick(ids))
    }
    #[inline(always)]
    fn ids_load(ids: &[i32; 16]) -> Self::Ids {
        let [low, high] = ids.as_chunks::<8>().0 else { unreachable!("sixteen are two eights") };
        Pair(L::ids_load(low), L::ids_load(high))
    }
    #[inline(always)]
    fn ids_widen(ids: &[u16; 16]) -> Self::Ids {
        let [low, high] = ids.as_chunks::<8>().0 else { unreachable!("sixteen are two eights") };
        Pair(L::ids_widen(low), L::ids_widen(high))
    }
    #[inline(always)]
    fn ids_shift<const BITS: i32>(ids: Self::Ids) -> Self::Ids {
        Pair(L::ids_shift::<BITS>(ids.0), L::ids_shift::<BITS>(ids.1))
    }
    #[inline(always)]
    fn pick(self, ids: Self::Ids) -> Self {
        Self(self.pick_half(ids.0), self.pick_half(ids.1))
    }
    #[inline(always)]
    fn compact(self, bits: u32, to: &mut [f32; 16]) {
        self.0.compact(bits & 0xff, eight_from(0, to));
        self.1.compact(bits >> 8 & 0xff, eight_from(set_in_low(bits), to));
    }
    #[inline(always)]
    fn ids_compact(ids: Self::Ids, bits: u32, to: &mut [i32; 16]) {
        L::ids_compact(ids.0, bits & 0xff, eight_from(0, to));
        L::ids_compact(ids.1, bits >> 8 & 0xff, eight_from(set_in_low(bits), to));
    }
    #[inline(always)]
    fn of_fours(fours: &[&[f32; 4]; 16]) -> [Self; 4] {
        let [a, b, c, d] = half_of_fours::<L>(fours, 0);
        let [e, f, g, h] = half_of_fours::<L>(fours, 8);
        [Self(a, e), Self(b, f), Self(c, g), Self(d, h)]
    }
    #[inline(always)]
    fn fours(columns: &[Self; 4]) -> [[f32; 4]; 16] {
        let [a, b, c, d] = columns;
        let mut fours = [[0.0; 4]; 16];
        for (half, columns) in [[a.0, b.0, c.0, d.0], [a.1, b.1, c.1, d.1]].into_iter().enumerate() {
            for (i, pair) in L::transpose_fours(columns).into_iter().enumerate() {
                let pair = pair.store();
                fours[8 * half + i].copy_from_slice(&pair[..4]);
                fours[8 * half + i + 4].copy_from_slice(&pair[4..]);
            }
        }
        fours
    }
}

/// How many bits are set for lanes of the low half.
#[inline(always)]
fn set_in_low(bits: u32) -> usize {
    (bits & 0xff).count_ones() as usize
}

/// Eight of sixteen, from one of the first nine places on.
#[inline(always)]
fn eight_from<T>(place: usize, all: &mut [T; 16]) -> &mut [T; 8] {
    all[place.min(8)..].first_chunk_mut().expect("eight of sixteen")
}

/// [`Sixteen::of_fours`] of the eight from `first` on.
#[inline(always)]
fn half_of_fours<L: Eight>(fours: &[&[f32; 4]; 16], first: usize) -> [L; 4] {
    L::transpose_fours([
        L::of_fours([fours[first], fours[first + 4]]),
        L::of_fours([fours[first + 1], fours[first + 5]]),
        L::of_fours([fours[first + 2], fours[first + 6]]),
        L::of_fours([fours[first + 3], fours[first + 7]]),
    ])
}
