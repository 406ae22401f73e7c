//! Choosing one of many by weight in a time that does not depend on how many there are.

/// A table of slots of which each is chosen as often, and of what is behind each: its own item or another one (Walker's
/// method; built as by Vose, "A linear algorithm for generating random numbers with a given distribution", 1991).
/// Eight bytes an item.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct AliasTable {
    slots: Box<[Slot]>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
struct Slot {
    /// The share of the slot that is its own item's,
    own: f32,
    /// and the item that has the rest.
    other: u32,
}

impl AliasTable {
    /// The table for these weights, which are finite and not negative, and of which one at least is positive. Their
    /// number fits into `u32`.
    pub fn new(weights: &[f64]) -> Self {
        let mean = weights.iter().sum::<f64>() / weights.len() as f64;
        let mut left: Vec<f64> = weights.iter().map(|weight| weight / mean).collect();
        let mut slots: Box<[Slot]> =
            (0..weights.len() as u32).map(|other| Slot { own: 1.0, other }).collect();
        let (mut less, mut more): (Vec<u32>, Vec<u32>) =
            (0..weights.len() as u32).partition(|&i| left[i as usize] < 1.0);
        // A slot that an item does not fill is filled by one that has more than a slot's worth. What rounding leaves
        // over has a slot's worth, all but an ulp or two.
        while let (Some(&low), Some(&high)) = (less.last(), more.last()) {
            less.pop();
            let own = left[low as usize] as f32;
            slots[low as usize] = Slot { own, other: high };
            // What was rounded off in the slot is not lost.
            left[high as usize] -= 1.0 - f64::from(own);
            if left[high as usize] < 1.0 {
                more.pop();
                less.push(high);
            }
        }
        Self { slots }
    }

    /// Bytes of memory that it takes up.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.slots)
    }

    /// The item for a pair of numbers in [0, 1), the second one the first one's continuation. If the first ones of many
    /// pairs are evenly spread, so are the slots.
    #[inline]
    pub fn pick(&self, pair: [f32; 2]) -> usize {
        let (slot, along) = place(pair, self.slots.len());
        let Slot { own, other } = self.slots[slot];
        if along < f64::from(own) { slot } else { other as usize }
    }
}

/// In which of `count` slots a pair of numbers falls, and how far along in it, 0 to 1.
#[inline]
fn place(pair: [f32; 2], count: usize) -> (usize, f64) {
    let place = joined(pair) * count as f64;
    // Rounding may lead to the end itself.
    let slot = (place as usize).min(count - 1);
    (slot, place - slot as f64)
}

/// The number in [0, 1) of which a pair of numbers in [0, 1) has the first 24 binary digits and the next 24.
///
/// One number is not enough: with a hundred thousand slots seven digits are left for the place in the slot, and beyond
/// 2^24 there are slots that it does not reach.
#[inline]
pub(super) fn joined([coarse, fine]: [f32; 2]) -> f64 {
    const STEP: f64 = 1.0 / (1 << 24) as f64;
    f64::from(coarse) + f64::from(fine) * STEP
}

#[cfg(test)]
mod tests {
    use super::*;

    /// How much of [0, 1) leads to each item, by what the slots say.
    fn shares(table: &AliasTable) -> Vec<f64> {
        let mut shares = vec![0.0; table.slots.len()];
        for (i, slot) in table.slots.iter().enumerate() {
            shares[i] += f64::from(slot.own) / table.slots.len() as f64;
            shares[slot.other as usize] += (1.0 - f64::from(slot.own)) / table.slots.len() as f64;
        }
        shares
    }

    #[test]
    fn shares_are_as_the_weights() {
        let uneven: Vec<f64> =
            (0..100_000u32).map(|i| f64::from(i.wrapping_mul(2_654_435_761) >> 8)).collect();
        let lists = [vec![3.0], vec![1.0, 0.0, 3.0], vec![5.0; 17], vec![1e-100, 2e-100, 1e-120], uneven];
        for weights in lists {
            let sum: f64 = weights.iter().sum();
            let table = AliasTable::new(&weights);
            for (share, weight) in shares(&table).iter().zip(&weights) {
                // What all slots together are rounded by ends in one of them.
                assert!((share - weight / sum).abs() < 2e-5 / weights.len() as f64, "{share} {weight}");
            }
        }
    }

    #[test]
    fn picks_are_as_the_shares() {
        let table = AliasTable::new(&[1.0, 0.0, 3.0, 12.0]);
        let mut counts = [0; 4];
        for i in 0..1600 {
            counts[table.pick([i as f32 / 1600.0, 0.5])] += 1;
        }
        assert_eq!(counts, [100, 0, 300, 1200]);
    }

    #[test]
    fn many_slots_are_told_apart_by_the_second_number() {
        // Four slots to each step of the first number's last digit.
        const COUNT: usize = 1 << 26;
        assert_eq!([0.1, 0.3, 0.6, 0.9].map(|fine| place([0.0, fine], COUNT).0), [0, 1, 2, 3]);
        let last = 1.0f32.next_down();
        for count in [1, 7, COUNT, u32::MAX as usize] {
            let (slot, along) = place([last; 2], count);
            assert!(slot == count - 1 && along > 0.99 && along <= 1.0, "{count}: {slot} {along}");
        }
    }
}
