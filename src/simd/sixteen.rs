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

    /// The least lane of each row: that of row `i` in lane `i`. No lane may be NaN.
    #[inline(always)]
    fn least_of_rows(rows: [Self; 16]) -> Self {
        let mut least = [0.0; 16];
        for lane in 0..16 {
            least[lane] = rows[lane].least();
        }
        Self::load(&least)
    }

    /// The greatest lane of each row, likewise.
    #[inline(always)]
    fn greatest_of_rows(rows: [Self; 16]) -> Self {
        let mut greatest = [0.0; 16];
        for lane in 0..16 {
            greatest[lane] = rows[lane].greatest();
        }
        Self::load(&greatest)
    }
}
