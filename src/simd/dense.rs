//! Lanes that are kept dense: what belongs to rays comes from where each has its own, and what is left of them is closed up.

use super::eight::Eight;
use super::lanes::Lanes;
use super::sixteen::Sixteen;

/// `W` lanes that are filled from rows here and there, and written without those that do not count.
pub trait Dense<const W: usize>: Lanes<W> {
    /// Rows of four become four columns: lane `i` of column `j` is `rows[i][j]`.
    fn columns(rows: &[&[f32; 4]; W]) -> [Self; 4];

    /// Lane `i` is `ids[i]`.
    fn ids_of(ids: &[i32; W]) -> Self::Ids;

    /// Writes the lanes whose bit is set in `bits` one behind the other. What follows them in `to` means nothing.
    fn close_up(self, bits: u32, to: &mut [f32; W]);

    /// The same of ids.
    fn close_up_ids(ids: Self::Ids, bits: u32, to: &mut [i32; W]);
}

impl<L: Eight> Dense<8> for L {
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]; 8]) -> [Self; 4] {
        L::transpose_fours([
            L::of_fours([rows[0], rows[4]]),
            L::of_fours([rows[1], rows[5]]),
            L::of_fours([rows[2], rows[6]]),
            L::of_fours([rows[3], rows[7]]),
        ])
    }
    #[inline(always)]
    fn ids_of(ids: &[i32; 8]) -> Self::Ids {
        L::ids_load(ids)
    }
    #[inline(always)]
    fn close_up(self, bits: u32, to: &mut [f32; 8]) {
        self.compact(bits, to);
    }
    #[inline(always)]
    fn close_up_ids(ids: Self::Ids, bits: u32, to: &mut [i32; 8]) {
        L::ids_compact(ids, bits, to);
    }
}

impl<L: Sixteen> Dense<16> for L {
    #[inline(always)]
    fn columns(rows: &[&[f32; 4]; 16]) -> [Self; 4] {
        L::of_fours(rows)
    }
    #[inline(always)]
    fn ids_of(ids: &[i32; 16]) -> Self::Ids {
        L::ids_load(ids)
    }
    #[inline(always)]
    fn close_up(self, bits: u32, to: &mut [f32; 16]) {
        self.compact(bits, to);
    }
    #[inline(always)]
    fn close_up_ids(ids: Self::Ids, bits: u32, to: &mut [i32; 16]) {
        L::ids_compact(ids, bits, to);
    }
}
