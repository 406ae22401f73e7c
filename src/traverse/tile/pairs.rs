//! Which packets of a square may meet which triangles of a block.
//!
//! One list for all, in place of one for each packet or triangle: most of those hold one or two, and how many
//! is what no processor can foresee. What is done for pairs so is one loop, which ends once a block.

use super::beam::PACKETS;
use crate::simd::{Lanes, Sixteen};

/// Triangles of a block.
const TRIANGLES: usize = 16;

/// Pairs of a packet and a triangle, none of which comes twice.
pub struct Pairs {
    /// `16 * triangle + packet`. What is closed up into it is written sixteen at a time.
    list: [i32; Self::MOST + 16],
    count: usize,
}

/// Lane `i` holds `i << SHIFT`.
#[inline(always)]
fn numbers<L: Sixteen, const SHIFT: u32>() -> L::Ids {
    const UP: [i32; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
    L::ids_load(&UP.map(
        #[inline(always)]
        |number| number << SHIFT,
    ))
}

impl Pairs {
    /// So many there are at most.
    pub const MOST: usize = PACKETS * TRIANGLES;

    /// None.
    pub const fn none() -> Self {
        Self { list: [0; Self::MOST + 16], count: 0 }
    }

    /// Takes all out.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
    }

    /// Adds a triangle with the packets whose bits are set.
    #[inline(always)]
    pub fn add_packets<L: Sixteen>(&mut self, triangle: usize, packets: u32) {
        self.add::<L>(numbers::<L, 0>(), (triangle as i32) << 4, packets);
    }

    /// Adds a packet with the triangles whose bits are set.
    #[inline(always)]
    pub fn add_triangles<L: Sixteen>(&mut self, packet: usize, triangles: u32) {
        self.add::<L>(numbers::<L, 4>(), packet as i32, triangles);
    }

    #[inline(always)]
    fn add<L: Sixteen>(&mut self, numbers: L::Ids, other: i32, bits: u32) {
        let all = <L as Lanes<16>>::mask_from_bits(0xffff);
        let to = self.list[self.count.min(Self::MOST)..].first_chunk_mut();
        L::ids_compact(L::ids_with(all, numbers, other), bits, to.expect("there is room for sixteen more"));
        self.count += bits.count_ones() as usize;
    }

    /// How many there are.
    pub const fn len(&self) -> usize {
        self.count
    }

    /// Packets and triangles.
    #[inline(always)]
    pub fn iter(&self) -> impl Iterator<Item = (usize, usize)> {
        self.list[..self.count.min(Self::MOST)].iter().map(
            #[inline(always)]
            |&pair| (pair as usize & 15, pair as usize >> 4 & 15),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Isa, Simd, Task};

    /// All pairs that may be, one way and the other, in part and in full.
    struct Filled;

    impl Task for Filled {
        type Output = ();

        fn run<S: Simd>(self) {
            let mut pairs = Pairs::none();
            for seed in [0, 0x9e37_79b9, u32::MAX] {
                let bits = |i: usize| seed.rotate_left(3 * i as u32) & 0xffff;
                let expected = |swapped: bool| {
                    let all = (0..16).flat_map(|i| (0..16).map(move |j| (i, j)));
                    let set = all.filter(|&(i, j)| bits(i) >> j & 1 == 1);
                    set.map(|(i, j)| if swapped { (j, i) } else { (i, j) }).collect::<Vec<_>>()
                };
                pairs.clear();
                (0..16).for_each(|triangle| pairs.add_packets::<S::F16>(triangle, bits(triangle)));
                assert_eq!(pairs.iter().collect::<Vec<_>>(), expected(true));
                assert_eq!(pairs.len(), expected(true).len());
                pairs.clear();
                (0..16).for_each(|packet| pairs.add_triangles::<S::F16>(packet, bits(packet)));
                assert_eq!(pairs.iter().collect::<Vec<_>>(), expected(false));
            }
        }
    }

    #[test]
    fn pairs_are_those_whose_bits_are_set() {
        for isa in Isa::available() {
            crate::simd::Chosen::new(isa).expect("it is available").run(Filled);
        }
    }
}
