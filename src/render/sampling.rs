//! Where in a pixel a sample goes.

/// The place of sample `index` in every pixel: (0, 0) is the top left corner, components are
/// less than 1. Sample 0 is in the middle.
///
/// The additive recurrence with the plastic number's powers (Roberts, "The Unreasonable
/// Effectiveness of Quasirandom Sequences", 2018): any number of samples, taken from the
/// beginning, is spread evenly, and a sample depends on its number alone. Integer arithmetic
/// modulo 2^32 makes it the same everywhere.
#[inline]
pub fn subpixel(index: u32) -> [f32; 2] {
    // 2^32 / p and 2^32 / p^2, where p^3 = p + 1.
    const STEP: [u32; 2] = [3_242_174_889, 2_447_445_414];
    STEP.map(|step| {
        let fraction = step.wrapping_mul(index).wrapping_add(1 << 31);
        (fraction >> 8) as f32 / (1 << 24) as f32
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_is_in_the_middle() {
        assert_eq!(subpixel(0), [0.5, 0.5]);
    }

    #[test]
    fn they_spread_over_the_pixel() {
        // Of 64 samples each of 16 cells gets four, give or take two.
        let mut cells = [0; 16];
        for [x, y] in (0..64).map(subpixel) {
            assert!((0.0..1.0).contains(&x) && (0.0..1.0).contains(&y));
            cells[(y * 4.0) as usize * 4 + (x * 4.0) as usize] += 1;
        }
        assert!(cells.iter().all(|n| (2..=6).contains(n)), "{cells:?}");
    }
}
