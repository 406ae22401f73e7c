//! What sixteen lanes can do beside the rest: take up records that lie anywhere, coordinate by coordinate.

use super::lanes::Lanes;

/// Sixteen lanes that can be filled four numbers at a time.
pub trait Sixteen: Lanes<16> {
    /// Rows and columns exchanged: lane `j` of vector `i` is number `i` of `fours[j]`.
    #[inline(always)]
    fn of_fours(fours: &[&[f32; 4]; 16]) -> [Self; 4] {
        let mut columns = [[0.0; 16]; 4];
        for lane in 0..16 {
            for i in 0..4 {
                columns[i][lane] = fours[lane][i];
            }
        }
        [Self::load(&columns[0]), Self::load(&columns[1]), Self::load(&columns[2]), Self::load(&columns[3])]
    }

    /// The least number of each row among those whose bit is set in `counted`: that of row `i` in lane `i`, infinity
    /// if there is none. None that counts may be NaN.
    #[inline(always)]
    fn least_of_rows(rows: &[[f32; 16]; 16], counted: &[u32; 16]) -> Self {
        let mut least = [0.0; 16];
        for i in 0..16 {
            let (counts, row) = (Self::mask_from_bits(counted[i]), Self::load(&rows[i]));
            least[i] = Self::select(counts, row, Self::splat(f32::INFINITY)).least();
        }
        Self::load(&least)
    }

    /// The greatest number of each row likewise, minus infinity if there is none.
    #[inline(always)]
    fn greatest_of_rows(rows: &[[f32; 16]; 16], counted: &[u32; 16]) -> Self {
        let mut greatest = [0.0; 16];
        for i in 0..16 {
            let (counts, row) = (Self::mask_from_bits(counted[i]), Self::load(&rows[i]));
            greatest[i] = Self::select(counts, row, Self::splat(f32::NEG_INFINITY)).greatest();
        }
        Self::load(&greatest)
    }
}
