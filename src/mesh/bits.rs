//! A bit for each of many things, and numbers for those whose bit is set.

/// A bit for each of many things.
pub(super) struct Bits(Vec<u64>);

impl Bits {
    /// None of so many is set.
    pub fn new(count: usize) -> Self {
        Self(vec![0; count.div_ceil(64)])
    }

    /// Sets one. Panics if there are not as many.
    #[inline]
    pub fn set(&mut self, place: usize) {
        self.0[place / 64] |= 1 << (place % 64);
    }

    /// Whether one is set. Panics if there are not as many.
    #[inline]
    pub fn get(&self, place: usize) -> bool {
        self.0[place / 64] >> (place % 64) & 1 == 1
    }

    /// Where they are set, rising.
    pub fn set_places(&self) -> impl Iterator<Item = usize> {
        self.0.iter().enumerate().flat_map(|(word, &bits)| {
            // Each time the lowest is taken off.
            let lowest = |bits: &u64| Some(bits & (bits - 1)).filter(|&rest| rest != 0);
            let rests = std::iter::successors(Some(bits).filter(|&bits| bits != 0), lowest);
            rests.map(move |rest| word * 64 + rest.trailing_zeros() as usize)
        })
    }

    /// A number for each one that is set: half as much memory again. There are at most `u32::MAX`.
    pub fn numbers(&self) -> Numbers<'_> {
        let mut sum = 0;
        let before = |word: &u64| {
            sum += word.count_ones();
            sum - word.count_ones()
        };
        Numbers { bits: self, before: self.0.iter().map(before).collect() }
    }
}

/// How many bits are set before each.
pub(super) struct Numbers<'a> {
    bits: &'a Bits,
    /// Before each word.
    before: Vec<u32>,
}

impl Numbers<'_> {
    /// How many are set before this one. Panics if there are not as many.
    #[inline]
    pub fn of(&self, place: usize) -> u32 {
        let (word, bit) = (place / 64, place % 64);
        self.before[word] + (self.bits.0[word] & ((1 << bit) - 1)).count_ones()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_set_is_numbered_in_order() {
        let places = [0, 1, 5, 63, 64, 127, 128, 640, 699];
        let mut bits = Bits::new(700);
        places.iter().for_each(|&place| bits.set(place));
        assert_eq!(bits.set_places().collect::<Vec<_>>(), places);
        let numbers = bits.numbers();
        for place in 0..700 {
            assert_eq!(bits.get(place), places.contains(&place), "{place}");
            assert_eq!(numbers.of(place) as usize, places.iter().filter(|&&set| set < place).count());
        }
        assert_eq!(Bits::new(0).set_places().next(), None);
    }
}
