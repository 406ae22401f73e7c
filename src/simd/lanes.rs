//! What a vector of `W` floats can do.

use super::eight::Eight;
use super::isa::Task;
use super::sixteen::Sixteen;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Not, Sub};

/// One bit a lane: the result of comparing [`Lanes`].
pub trait Mask: Copy + BitAnd<Output = Self> + BitOr<Output = Self> + Not<Output = Self> {
    /// Bit `i` of the result is lane `i`; bits beyond the width are 0.
    fn bits(self) -> u32;

    /// Whether any lane is set.
    #[inline(always)]
    fn any(self) -> bool {
        self.bits() != 0
    }
}

/// `W` floats, and `W` integers beside them for primitive ids.
///
/// Every operation rounds exactly as IEEE 754 binary32 does, lane by lane, so that all
/// implementations agree bit for bit.
pub trait Lanes<const W: usize>:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Div<Output = Self>
{
    /// What a comparison gives.
    type Mask: Mask;
    /// `W` signed 32-bit integers.
    type Ids: Copy;

    /// The same value in every lane.
    fn splat(value: f32) -> Self;
    /// Lane `i` is `values[i]`.
    fn load(values: &[f32; W]) -> Self;
    /// Lane `i` becomes element `i`.
    fn store(self) -> [f32; W];

    /// `self < other ? self : other`, lane by lane: **`other` where either is NaN**.
    fn min(self, other: Self) -> Self;
    /// `self > other ? self : other`, lane by lane: **`other` where either is NaN**.
    fn max(self, other: Self) -> Self;
    /// `self * factor + addend`, with one rounding or with two: **implementations differ**, so that this
    /// is for bounds, not for anything that a hit depends on.
    #[inline(always)]
    fn mul_add(self, factor: Self, addend: Self) -> Self {
        self * factor + addend
    }
    /// The least lane. No lane may be NaN.
    #[inline(always)]
    fn least(self) -> f32 {
        fold::<W>(self.store(), |a, b| if b < a { b } else { a })
    }
    /// The greatest lane. No lane may be NaN.
    #[inline(always)]
    fn greatest(self) -> f32 {
        fold::<W>(self.store(), |a, b| if b > a { b } else { a })
    }
    /// One lane's value in every lane. Panics if there is no such lane.
    #[inline(always)]
    fn lane(self, lane: usize) -> Self {
        Self::splat(self.store()[lane])
    }
    /// The magnitude: the sign bit cleared, NaN included.
    fn abs(self) -> Self;
    /// The magnitude of `self` with the sign bit of `sign`.
    fn copysign(self, sign: Self) -> Self;

    /// `self < other`; false where either is NaN.
    fn lt(self, other: Self) -> Self::Mask;
    /// `self <= other`; false where either is NaN.
    fn le(self, other: Self) -> Self::Mask;
    /// `self == other`; false where either is NaN.
    fn eq(self, other: Self) -> Self::Mask;

    /// `mask ? a : b`, lane by lane.
    fn select(mask: Self::Mask, a: Self, b: Self) -> Self;
    /// The mask whose lane `i` is bit `i` of `bits`.
    fn mask_from_bits(bits: u32) -> Self::Mask;

    /// The first `count` lanes, or all if there are not as many. `count` is at most 30.
    #[inline(always)]
    fn mask_of_first(count: usize) -> Self::Mask {
        Self::mask_from_bits((1 << count.min(W)) - 1)
    }

    /// The same id in every lane.
    fn ids(id: i32) -> Self::Ids;
    /// `a < b`, signed.
    fn ids_less(a: Self::Ids, b: Self::Ids) -> Self::Mask;
    /// `mask ? a : b`, lane by lane.
    fn ids_select(mask: Self::Mask, a: Self::Ids, b: Self::Ids) -> Self::Ids;
    /// `mask ? ids | bits : ids`, lane by lane.
    fn ids_with(mask: Self::Mask, ids: Self::Ids, bits: i32) -> Self::Ids;
    /// Lane `i` becomes element `i`.
    fn ids_store(ids: Self::Ids) -> [i32; W];

    /// The last [`TAG`] bits of each id, and before them the first bits of each lane.
    fn tag(self, ids: Self::Ids) -> Self::Ids;
    /// The lanes that were tagged, rounded toward zero: zeros in place of ids.
    fn of_tagged(tagged: Self::Ids) -> Self;
    /// The ids that they were tagged with.
    fn tags(tagged: Self::Ids) -> Self::Ids;
}

/// Bits of an id that a float can be [tagged](Lanes::tag) with. Nine of its digits are left.
pub const TAG: u32 = 14;

/// The bits of an id.
pub const TAGS: i32 = (1 << TAG) - 1;

/// Folds lanes by halves, as registers do it best. `W` is a power of two.
#[inline(always)]
fn fold<const W: usize>(mut values: [f32; W], of: impl Fn(f32, f32) -> f32) -> f32 {
    let mut width = W;
    while width > 1 {
        width /= 2;
        for lane in 0..width {
            values[lane] = of(values[lane], values[lane + width]);
        }
    }
    values[0]
}

/// The vector types of an instruction set.
pub trait Simd: Sized {
    /// Lanes that a register holds, 8 or 16: wider vectors run out of registers in long kernels.
    const NATIVE: usize;
    /// Four floats.
    type F4: Lanes<4>;
    /// Eight floats.
    type F8: Eight;
    /// Sixteen floats.
    type F16: Sixteen;

    /// Does a part of a kernel's work out of line, compiled for this instruction set as the kernel is: what is long, and is
    /// come to from several places, or in several kernels, is compiled once so, and not once for each.
    ///
    /// What a task borrows lies in memory while the kernel runs: it should borrow nothing that is better kept in registers.
    fn apart<T: Task>(task: T) -> T::Output;
}
