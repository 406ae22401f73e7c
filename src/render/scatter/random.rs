//! Random numbers that are a pure function of what they are for: pixel, sample and dimension.
//!
//! No state, so a picture does not depend on the order in which its samples are taken, nor on who takes them. For
//! each pixel and dimension, the samples of a power of two in number (and any number of them fairly) are spread
//! evenly: they are Sobol' points, scrambled as Owen does it, with a hash instead of stored bits, in shuffled order so
//! that dimensions and pixels have nothing to do with one another (Burley, "Practical hash-based Owen scrambling",
//! 2020).

/// The numbers of one sample of a pixel. What it is asked for is told apart by a *dimension*: any `u32`, each used
/// for one decision only.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sequence {
    pixel: u64,
    sample: u32,
}

impl Sequence {
    /// The numbers of a pixel's sample. Pixels have unrelated ones; the samples of a pixel are numbered from 0.
    #[inline]
    pub fn of(pixel: [u32; 2], sample: u32) -> Self {
        Self { pixel: mix(u64::from(pixel[0]) | u64::from(pixel[1]) << 32), sample }
    }

    /// Two numbers in [0, 1). Among the first `2^k` samples of a pixel, and each `2^k` after them, each of the boxes of
    /// area `2^-k`, with sides that are powers of two, gets one such pair.
    #[inline]
    pub fn pair(&self, dimension: u32) -> [f32; 2] {
        let (index, [x, y]) = self.scrambling(dimension);
        // The bits of van der Corput's number of an index are the index's own, the other way round.
        [scramble(index, x), scramble(sobol(index), y)].map(|bits| unit(bits.reverse_bits()))
    }

    /// A number in [0, 1), the first of [`pair`](Self::pair). Among the first `2^k` samples of a pixel, and each `2^k`
    /// after them, each interval of length `2^-k` gets one.
    #[inline]
    pub fn one(&self, dimension: u32) -> f32 {
        let (index, [x, _]) = self.scrambling(dimension);
        unit(scramble(index, x).reverse_bits())
    }

    /// The place in the Sobol' sequence and what its numbers are scrambled with.
    #[inline]
    fn scrambling(&self, dimension: u32) -> (u32, [u32; 2]) {
        let first = mix(self.pixel ^ u64::from(dimension).wrapping_mul(0x9E37_79B9_7F4A_7C15));
        let second = mix(first);
        // Shuffled by scrambling the bits from the highest on: what is in one aligned block of 2^k samples stays in
        // one, and such blocks are what Sobol' points are even in.
        let index = scramble(self.sample.reverse_bits(), first as u32).reverse_bits();
        (index, [(first >> 32) as u32, second as u32])
    }
}

/// The bits, lowest first where the number has its highest, of the second coordinate of a Sobol' point.
///
/// Its matrix is Pascal's triangle modulo 2, where `k` over `j` is odd if the bits of `j` are among those of `k`: bit
/// `j` is the sum of the bits `k` of the index for all such `k`, which five steps add up, one for each bit of `k`.
#[inline]
fn sobol(index: u32) -> u32 {
    let mut bits = index;
    bits ^= bits >> 16;
    bits ^= (bits >> 8) & 0x00FF_00FF;
    bits ^= (bits >> 4) & 0x0F0F_0F0F;
    bits ^= (bits >> 2) & 0x3333_3333;
    bits ^ ((bits >> 1) & 0x5555_5555)
}

/// Flips each bit or not, by what is in the bits below it: Owen's scrambling of the number with these bits the other
/// way round. A hash of the kind of Laine & Karras ("Stratified sampling for stochastic transparency", 2011), with
/// the constants of Vegdahl ("Building a better LK hash", 2021).
#[inline]
fn scramble(bits: u32, seed: u32) -> u32 {
    // No step moves a bit downward: sums and products carry upward, and an even product's own bit is one above.
    let mut bits = bits ^ bits.wrapping_mul(0x3D20_ADEA);
    bits = bits.wrapping_add(seed);
    bits = bits.wrapping_mul((seed >> 16) | 1);
    bits ^= bits.wrapping_mul(0x0552_6C56);
    bits ^ bits.wrapping_mul(0x53A2_2864)
}

/// A number whose every bit depends on every bit of `z` (Steele et al., "Fast splittable pseudorandom number
/// generators", 2014).
#[inline]
fn mix(z: u64) -> u64 {
    let z = z.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    z ^ (z >> 31)
}

/// The number in [0, 1) with these bits behind the point, cut to what an `f32` holds at all of its places.
#[inline]
fn unit(bits: u32) -> f32 {
    (bits >> 8) as f32 / (1 << 24) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The pairs of `2^log` samples of a pixel from `first` on.
    fn pairs(pixel: [u32; 2], dimension: u32, first: u32, log: u32) -> impl Iterator<Item = [f32; 2]> {
        (first..first + (1 << log)).map(move |i| Sequence::of(pixel, i).pair(dimension))
    }

    #[test]
    fn every_box_gets_one_sample() {
        for (pixel, dimension) in [([0, 0], 0), ([7, 3], 1), ([1919, 1079], 77), ([5, 1 << 31], u32::MAX)] {
            for (first, log) in [(0, 0), (0, 1), (0, 4), (16, 4), (0, 9), (512, 9), (3 << 10, 10)] {
                for across in 0..=log {
                    let mut hits = vec![0; 1 << log];
                    for [x, y] in pairs(pixel, dimension, first, log) {
                        let column = (x * (1 << across) as f32) as usize;
                        let row = (y * (1 << (log - across)) as f32) as usize;
                        hits[(row << across) + column] += 1;
                    }
                    assert!(hits.iter().all(|&n| n == 1), "{pixel:?} {dimension} {first} {log} {across}");
                }
            }
        }
    }

    #[test]
    fn numbers_stay_what_they_are() {
        // In units of 2^-24; from a program of its own, bit by bit as the papers say.
        for (pixel, sample, dimension, expected) in [
            ([0, 0], 0, 0, [14_329_050, 5_910_790]),
            ([1, 0], 0, 0, [8_675_049, 1_659_901]),
            ([0, 1], 1, 3, [16_004_779, 9_264_859]),
            ([1919, 1079], 4096, 7, [10_308_674, 14_644_080]),
            ([u32::MAX; 2], u32::MAX, u32::MAX, [9_539_354, 7_338_350]),
        ] {
            let found = Sequence::of(pixel, sample).pair(dimension).map(|x| (x * (1 << 24) as f32) as u32);
            assert_eq!(found, expected, "{pixel:?} {sample} {dimension}");
        }
    }

    #[test]
    fn one_is_the_first_of_the_pair() {
        for i in 0..100 {
            let sequence = Sequence::of([i, 9], i * i);
            assert_eq!(sequence.one(i), sequence.pair(i)[0]);
        }
    }

    #[test]
    fn steps_of_pascals_triangle() {
        // Bit by bit: each row of the triangle comes from the one before it.
        let slow = |index: u32| {
            let (mut row, mut sum) = (1u32 << 31, 0);
            for k in 0..32 {
                sum ^= if index >> k & 1 == 1 { row } else { 0 };
                row ^= row >> 1;
            }
            sum
        };
        for index in (0..5000).chain([u32::MAX, 1 << 31, 0xDEAD_BEEF]) {
            assert_eq!(sobol(index).reverse_bits(), slow(index), "{index}");
        }
    }

    /// The correlation of two lists, and what noise makes of none.
    fn correlation(pairs: impl Iterator<Item = [f32; 2]>) -> f64 {
        let (mut n, mut sum) = (0.0, 0.0);
        for [x, y] in pairs {
            sum += (f64::from(x) - 0.5) * (f64::from(y) - 0.5) * 12.0;
            n += 1.0;
        }
        sum / n
    }

    #[test]
    fn dimensions_pixels_and_coordinates_are_unrelated() {
        const N: u32 = 1 << 14;
        // Noise of 2^14 unrelated numbers is 0.008.
        for other in [1, 2, 3, 8, 1 << 16, u32::MAX] {
            let dimensions = (0..N).map(|i| [0, other].map(|d| Sequence::of([4, 4], i).one(d)));
            let pixels = (0..N).map(|i| [0, other].map(|x| Sequence::of([x, 4], i).one(0)));
            // Of the same few samples in pixels side by side, as an image has them.
            let neighbours =
                (0..N).map(|i| [0, other].map(|x| Sequence::of([(i % 128) ^ x, i / 128], 1).one(2)));
            for (what, r) in [correlation(dimensions), correlation(pixels), correlation(neighbours)]
                .into_iter()
                .enumerate()
            {
                assert!(r.abs() < 0.035, "{what} {other}: {r}");
            }
        }
        assert!(correlation(pairs([4, 4], 0, 0, 14)).abs() < 1e-3, "the net itself is even");
    }

    #[test]
    fn first_samples_are_spread_over_pixels() {
        // The first samples of all pixels fill the square, although each is only one.
        let mut cells = [0; 64];
        for i in 0..1u32 << 14 {
            let [x, y] = Sequence::of([i % 128, i / 128], 0).pair(0);
            cells[(y * 8.0) as usize * 8 + (x * 8.0) as usize] += 1;
        }
        // 256 each, give or take five deviations.
        assert!(cells.iter().all(|n| (176..=336).contains(n)), "{cells:?}");
    }

    proptest! {
        #[test]
        fn they_are_from_zero_to_less_than_one(x: u32, y: u32, sample: u32, dimension: u32) {
            let sequence = Sequence::of([x, y], sample);
            for number in sequence.pair(dimension) {
                prop_assert!((0.0..1.0).contains(&number));
            }
        }

        #[test]
        fn scrambling_keeps_blocks_together(a: u32, b: u32, seed: u32, low in 1u32..32) {
            // Numbers whose `low` lowest bits agree agree there afterwards, and only those do.
            let same = |a: u32, b: u32| (a ^ b) << (32 - low) == 0;
            prop_assert_eq!(same(a, b), same(scramble(a, seed), scramble(b, seed)));
            let twin = a ^ (b << low);
            prop_assert!(same(scramble(a, seed), scramble(twin, seed)));
        }
    }
}
