//! What sixteen lanes can do beside the rest: take up records that lie anywhere, coordinate by coordinate.

use super::eight::Eight;
use super::lanes::Lanes;

/// Sixteen lanes that can be filled four numbers at a time.
pub trait Sixteen: Lanes<16> {
    /// Eight of them.
    type Half: Eight;

    /// Whether half of the lanes take half the time, as one register does not hold all of them.
    const HALVES_PAY: bool = true;

    /// Of eight lanes number `i` is lane `ids[i] & 15`.
    #[inline(always)]
    fn pick_half(self, ids: <Self::Half as Lanes<8>>::Ids) -> Self::Half {
        let (values, ids) = (self.store(), Self::Half::ids_store(ids));
        let mut picked = [0.0; 8];
        for lane in 0..8 {
            picked[lane] = values[(ids[lane] & 15) as usize];
        }
        Self::Half::load(&picked)
    }

    /// The lanes of a half, and behind them any others.
    #[inline(always)]
    fn of_half(half: Self::Half) -> Self {
        let mut values = [0.0; 16];
        values[..8].copy_from_slice(&half.store());
        Self::load(&values)
    }

    /// Lane `i` is number `i % 4` of `fours[i / 4]`.
    #[inline(always)]
    fn side_by_side(fours: [&[f32; 4]; 4]) -> Self {
        let mut values = [0.0; 16];
        for lane in 0..16 {
            values[lane] = fours[lane / 4][lane % 4];
        }
        Self::load(&values)
    }

    /// Rows and columns exchanged: lane `j` of vector `i` is number `i` of `fours[j]`.
    fn of_fours(fours: &[&[f32; 4]; 16]) -> [Self; 4];

    /// The same back: number `i` of four `j` is lane `j` of vector `i`.
    fn fours(columns: &[Self; 4]) -> [[f32; 4]; 16];

    /// Lane `i` is `ids[i]`.
    fn ids_load(ids: &[i32; 16]) -> Self::Ids;

    /// Lane `i` is `ids[i % 4]`.
    #[inline(always)]
    fn ids_of_four(ids: &[i32; 4]) -> Self::Ids {
        let mut four_times = [0; 16];
        for lane in 0..16 {
            four_times[lane] = ids[lane % 4];
        }
        Self::ids_load(&four_times)
    }

    /// Lane `i` is lane `4 * part + i / 4` of a half. `part` is 0 or 1.
    #[inline(always)]
    fn ids_spread(ids: <Self::Half as Lanes<8>>::Ids, part: usize) -> Self::Ids {
        let (half, mut spread) = (Self::Half::ids_store(ids), [0; 16]);
        for lane in 0..16 {
            spread[lane] = half[4 * (part & 1) + lane / 4];
        }
        Self::ids_load(&spread)
    }

    /// Lane `i` is `ids[i]`, widened without a sign.
    #[inline(always)]
    fn ids_widen(ids: &[u16; 16]) -> Self::Ids {
        let mut wide = [0; 16];
        for lane in 0..16 {
            wide[lane] = i32::from(ids[lane]);
        }
        Self::ids_load(&wide)
    }

    /// Every lane shifted right by `BITS`; zeros come in.
    fn ids_shift<const BITS: i32>(ids: Self::Ids) -> Self::Ids;

    /// Lane `i` becomes lane `ids[i] & 15`.
    #[inline(always)]
    fn pick(self, ids: Self::Ids) -> Self {
        let (values, ids) = (self.store(), Self::ids_store(ids));
        let mut picked = [0.0; 16];
        for lane in 0..16 {
            picked[lane] = values[(ids[lane] & 15) as usize];
        }
        Self::load(&picked)
    }

    /// Writes the lanes whose bit is set in `bits` one behind the other. What follows them in `to` means nothing.
    #[inline(always)]
    fn compact(self, bits: u32, to: &mut [f32; 16]) {
        let values = self.store();
        let mut next = 0;
        for lane in 0..16 {
            to[next & 15] = values[lane];
            next += (bits >> lane & 1) as usize;
        }
    }

    /// The same of ids.
    #[inline(always)]
    fn ids_compact(ids: Self::Ids, bits: u32, to: &mut [i32; 16]) {
        let ids = Self::ids_store(ids);
        let mut next = 0;
        for lane in 0..16 {
            to[next & 15] = ids[lane];
            next += (bits >> lane & 1) as usize;
        }
    }

    /// The least lane of each of sixteen vectors: that of vector `i` in lane `i`. No lane may be NaN.
    #[inline(always)]
    fn least_of_each(vectors: &[Self; 16]) -> Self {
        let mut least = [0.0; 16];
        for i in 0..16 {
            least[i] = vectors[i].least();
        }
        Self::load(&least)
    }

    /// The greatest likewise.
    #[inline(always)]
    fn greatest_of_each(vectors: &[Self; 16]) -> Self {
        let mut greatest = [0.0; 16];
        for i in 0..16 {
            greatest[i] = vectors[i].greatest();
        }
        Self::load(&greatest)
    }

    /// The least number of each row among those whose bit is set in `counted`: that of row `i` in lane `i`, infinity
    /// if there is none. None that counts may be NaN.
    #[inline(always)]
    fn least_of_rows(rows: &[[f32; 16]; 16], counted: &[u32; 16]) -> Self {
        Self::least_of_each(&counted_of_rows(rows, counted, f32::INFINITY))
    }

    /// The greatest number of each row likewise, minus infinity if there is none.
    #[inline(always)]
    fn greatest_of_rows(rows: &[[f32; 16]; 16], counted: &[u32; 16]) -> Self {
        Self::greatest_of_each(&counted_of_rows(rows, counted, f32::NEG_INFINITY))
    }

    /// Four vectors' sixty-four lanes, four to one: the least of lanes `4 j` to `4 j + 3` of vector `i` in lane
    /// `4 i + j`. No lane may be NaN.
    #[inline(always)]
    fn least_of_fours(vectors: &[Self; 4]) -> Self {
        fold_fours(vectors, |a, b| if b < a { b } else { a })
    }

    /// The greatest likewise.
    #[inline(always)]
    fn greatest_of_fours(vectors: &[Self; 4]) -> Self {
        fold_fours(vectors, |a, b| if b > a { b } else { a })
    }

    /// Four lanes, each in four: lane `4 part + j` in the lanes `4 j` to `4 j + 3`. `part` is less than 4.
    #[inline(always)]
    fn spread(self, part: usize) -> Self {
        let values = self.store();
        let mut spread = [0.0; 16];
        for lane in 0..16 {
            spread[lane] = values[(4 * part + lane / 4) & 15];
        }
        Self::load(&spread)
    }
}

#[inline(always)]
fn fold_fours<L: Sixteen>(vectors: &[L; 4], of: impl Fn(f32, f32) -> f32) -> L {
    let mut folded = [0.0; 16];
    for i in 0..4 {
        let values = vectors[i].store();
        for j in 0..4 {
            let [a, b, c, d] = [values[4 * j], values[4 * j + 1], values[4 * j + 2], values[4 * j + 3]];
            folded[4 * i + j] = of(of(a, b), of(c, d));
        }
    }
    L::load(&folded)
}

/// Rows' numbers whose bit is set in `counted`, and `other` in place of the rest.
#[inline(always)]
fn counted_of_rows<L: Sixteen>(rows: &[[f32; 16]; 16], counted: &[u32; 16], other: f32) -> [L; 16] {
    let other = L::splat(other);
    let mut counts = [other; 16];
    for i in 0..16 {
        counts[i] = L::select(L::mask_from_bits(counted[i]), L::load(&rows[i]), other);
    }
    counts
}
