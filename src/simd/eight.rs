//! What eight lanes can do beside the rest: move values across lanes.
//!
//! One ray meets eight planes, exits or triangles at once, so that lanes hold what belongs together and
//! have to be brought next to one another. Most methods have a body in plain code, which the portable
//! implementation uses as it is.

use super::lanes::Lanes;

/// Eight lanes whose values can change places. A *four* is a half: lanes 0 to 3, or 4 to 7.
pub trait Eight: Lanes<8> {
    /// `fours[0]` in the lower half, `fours[1]` in the upper.
    #[inline(always)]
    fn of_fours(fours: [&[f32; 4]; 2]) -> Self {
        let mut values = [0.0; 8];
        values[..4].copy_from_slice(fours[0]);
        values[4..].copy_from_slice(fours[1]);
        Self::load(&values)
    }

    /// Lane `i` becomes lane `ids[i] & 3` of the same half.
    #[inline(always)]
    fn pick_in_fours(self, ids: Self::Ids) -> Self {
        let (values, ids) = (self.store(), Self::ids_store(ids));
        let mut picked = [0.0; 8];
        for lane in 0..8 {
            picked[lane] = values[lane & 4 | (ids[lane] & 3) as usize];
        }
        Self::load(&picked)
    }

    /// Lane `I` of each half in all lanes of that half.
    #[inline(always)]
    fn splat_in_fours<const I: usize>(self) -> Self {
        let values = self.store();
        let (low, high) = (values[I & 3], values[I & 3 | 4]);
        Self::load(&[low, low, low, low, high, high, high, high])
    }

    /// Lane `i` becomes lane `ids[i] & 7`.
    #[inline(always)]
    fn pick(self, ids: Self::Ids) -> Self {
        let (values, ids) = (self.store(), Self::ids_store(ids));
        let mut picked = [0.0; 8];
        for lane in 0..8 {
            picked[lane] = values[(ids[lane] & 7) as usize];
        }
        Self::load(&picked)
    }

    /// In each half the first two lanes of `self`, then those of `other`.
    #[inline(always)]
    fn first_pairs(self, other: Self) -> Self {
        let (a, b) = (self.store(), other.store());
        Self::load(&[a[0], a[1], b[0], b[1], a[4], a[5], b[4], b[5]])
    }

    /// In each half the last two lanes of `self`, then those of `other`.
    #[inline(always)]
    fn last_pairs(self, other: Self) -> Self {
        let (a, b) = (self.store(), other.store());
        Self::load(&[a[2], a[3], b[2], b[3], a[6], a[7], b[6], b[7]])
    }

    /// Rows and columns exchanged, half by half: lane `j` of row `i` becomes lane `i` of row `j`.
    #[inline(always)]
    fn transpose_fours(rows: [Self; 4]) -> [Self; 4] {
        let rows = [rows[0].store(), rows[1].store(), rows[2].store(), rows[3].store()];
        let mut turned = [[0.0; 8]; 4];
        for i in 0..4 {
            for j in 0..4 {
                turned[j][i] = rows[i][j];
                turned[j][i + 4] = rows[i][j + 4];
            }
        }
        [Self::load(&turned[0]), Self::load(&turned[1]), Self::load(&turned[2]), Self::load(&turned[3])]
    }

    /// Writes the lanes whose bit is set in `bits`, at most eight of them, one behind the other. What
    /// follows them in `to` means nothing.
    #[inline(always)]
    fn compact(self, bits: u32, to: &mut [f32; 8]) {
        let values = self.store();
        let mut next = 0;
        for lane in 0..8 {
            to[next & 7] = values[lane];
            next += (bits >> lane & 1) as usize;
        }
    }

    /// Lane `i` is `ids[i]`.
    fn ids_load(ids: &[i32; 8]) -> Self::Ids;

    /// Lane `i` is `ids[i]`, widened without a sign.
    #[inline(always)]
    fn ids_widen(ids: &[u16; 8]) -> Self::Ids {
        let mut wide = [0; 8];
        for lane in 0..8 {
            wide[lane] = i32::from(ids[lane]);
        }
        Self::ids_load(&wide)
    }

    /// Lane `i` is `nibbles >> 4 i`.
    #[inline(always)]
    fn ids_nibbles(nibbles: u32) -> Self::Ids {
        let mut ids = [0; 8];
        for (lane, id) in ids.iter_mut().enumerate() {
            *id = (nibbles >> (4 * lane)) as i32;
        }
        Self::ids_load(&ids)
    }

    /// Every lane shifted right by `BITS`; zeros come in.
    fn ids_shift<const BITS: i32>(ids: Self::Ids) -> Self::Ids;

    /// The bits that are set in both.
    #[inline(always)]
    fn ids_and(a: Self::Ids, b: Self::Ids) -> Self::Ids {
        let (mut a, b) = (Self::ids_store(a), Self::ids_store(b));
        for lane in 0..8 {
            a[lane] &= b[lane];
        }
        Self::ids_load(&a)
    }

    /// Lane `i` becomes lane `places[i] & 7`.
    #[inline(always)]
    fn ids_pick(ids: Self::Ids, places: Self::Ids) -> Self::Ids {
        let (ids, places) = (Self::ids_store(ids), Self::ids_store(places));
        let mut picked = [0; 8];
        for lane in 0..8 {
            picked[lane] = ids[(places[lane] & 7) as usize];
        }
        Self::ids_load(&picked)
    }

    /// As [`compact`](Self::compact).
    #[inline(always)]
    fn ids_compact(ids: Self::Ids, bits: u32, to: &mut [i32; 8]) {
        let ids = Self::ids_store(ids);
        let mut next = 0;
        for lane in 0..8 {
            to[next & 7] = ids[lane];
            next += (bits >> lane & 1) as usize;
        }
    }
}

/// For each set of lanes their numbers one behind the other, as [`Eight::compact`] wants them.
pub(super) static LANES_OF: [[u8; 8]; 256] = {
    let mut rows = [[0; 8]; 256];
    let mut bits = 0;
    while bits < 256 {
        let (mut lane, mut next) = (0, 0);
        while lane < 8 {
            if bits >> lane & 1 == 1 {
                rows[bits][next] = lane as u8;
                next += 1;
            }
            lane += 1;
        }
        bits += 1;
    }
    rows
};
