//! One ray against the triangles of a leaf, eight at a time.
//!
//! The mode sifts eight triangles at once, and what is left of them is kept with the ray. Of most eights nothing is:
//! those rays go on at once, by arithmetic alone. The others stand in a set of their own, and what they have left goes
//! through the mode's own test, with what others have left ([`pairs`](super::pairs)). The nearest hit is taken. So hits
//! are what packets find, bit for bit, and no branch depends on whether a triangle is hit.

use super::flight::Flight;
use crate::geometry::triangle::Alone;
use crate::simd::{Eight, Simd, prefetch};
use std::hint::select_unpredictable;

/// Where a ray is in its leaf: eight triangles, and which of them it may hit.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Leaf {
    /// The triangles' ids. Behind the leaf's last one is the first of the eight again.
    primitives: [i32; 8],
    /// Those that it may hit.
    open: u32,
    /// The word behind the eight, and how many triangles are left with them.
    next: u32,
    left: u32,
}

impl Leaf {
    /// No leaf.
    pub const NONE: Self = Self { primitives: [0; 8], open: 0, next: 0, left: 0 };

    /// Whether the ray may hit any of the eight.
    #[inline(always)]
    pub fn is_open(&self) -> bool {
        self.open != 0
    }

    /// The eight, and a bit for each that it may hit.
    #[inline(always)]
    pub fn left_open(&self) -> (&[i32; 8], u32) {
        (&self.primitives, self.open)
    }

    /// Whether others of the leaf follow. (In no leaf they do not.)
    #[inline(always)]
    pub fn goes_on(&self) -> bool {
        self.left > 8
    }

    /// Whether there are more than four.
    #[inline(always)]
    pub fn is_more_than_four(&self) -> bool {
        self.left > 4
    }

    /// Takes up the next eight triangles: others of the same leaf if some are left, or else the first ones of the leaf
    /// whose record begins at `record` in `words`. Fetches the first four of them.
    #[inline(always)]
    pub fn fetch<L: Eight, R>(&mut self, words: &[u32], record: usize, records: &[R]) {
        let goes_on = self.goes_on();
        self.next = select_unpredictable(goes_on, self.next, record as u32 + 1);
        self.left = select_unpredictable(goes_on, self.left.wrapping_sub(8), words[record]);
        let words = words[self.next as usize..].first_chunk().expect("words behind the last record");
        self.next += 8;
        let ids = L::ids_load(bytemuck::cast_ref::<[u32; 8], [i32; 8]>(words));
        let present = L::mask_from_bits((1 << self.left.min(8)) - 1);
        self.primitives = L::ids_store(L::ids_select(present, ids, L::ids(words[0] as i32)));
        fetch_four(self.primitives.first_chunk().expect("four of eight"), records);
    }

    /// Fetches the other four.
    #[inline(always)]
    pub fn fetch_others<R>(&self, records: &[R]) {
        fetch_four(self.primitives.last_chunk().expect("four of eight"), records);
    }
}

/// Fetches four triangles.
#[inline(always)]
fn fetch_four<R>(primitives: &[i32; 4], records: &[R]) {
    for &primitive in primitives {
        let record = records.as_ptr().wrapping_add(primitive as usize);
        prefetch(record);
        prefetch(record.cast::<u8>().wrapping_add(size_of::<R>() - 1));
    }
}

impl<A: Alone> Flight<A> {
    /// Sifts the triangles that were fetched, of which there are four at most.
    #[inline(always)]
    pub fn sift_four<S: Simd>(&mut self, records: &[A::Record]) {
        let mut triangles = [&records[0]; 4];
        for lane in 0..4 {
            triangles[lane] = &records[self.leaf.primitives[lane] as usize];
        }
        let lanes = (1 << self.leaf.left.min(4)) - 1;
        self.leaf.open = self.test.sift_four::<S>(&triangles, self.tnear, self.tfar) & lanes;
    }

    /// Sifts the eight triangles that were fetched.
    #[inline(always)]
    pub fn sift<S: Simd>(&mut self, records: &[A::Record]) {
        let mut triangles = [&records[0]; 8];
        for lane in 0..8 {
            triangles[lane] = &records[self.leaf.primitives[lane] as usize];
        }
        let lanes = (1 << self.leaf.left.min(8)) - 1;
        self.leaf.open = self.test.sift::<S>(&triangles, self.tnear, self.tfar) & lanes;
    }

    /// Takes a hit, if it is one in the ray's interval, and nearer than what the ray has or as near and of a lower id.
    #[inline(always)]
    pub fn take(&mut self, is_hit: bool, t: f32, primitive: u32) {
        let nearer = (t < self.tfar) | ((t == self.tfar) & (primitive < self.primitive));
        let taken = is_hit & (self.tnear <= t) & nearer;
        self.tfar = select_unpredictable(taken, t, self.tfar);
        self.primitive = select_unpredictable(taken, primitive, self.primitive);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::{Chosen, Isa, Simd, Task};

    /// Fetches all triangles of the leaves with these records, one leaf after the other.
    struct Fetch<'a>(&'a [u32], &'a [usize]);

    impl Task for Fetch<'_> {
        type Output = Vec<i32>;

        #[inline(always)]
        fn run<S: Simd>(self) -> Vec<i32> {
            let (mut leaf, mut fetched) = (Leaf::NONE, Vec::new());
            for &record in self.1 {
                loop {
                    leaf.fetch::<S::F8, u32>(self.0, record, &[]);
                    let (these, others) = leaf.primitives.split_at(leaf.left.min(8) as usize);
                    fetched.extend(these);
                    assert!(others.iter().all(|&other| other == these[0]), "others are no triangles");
                    if !leaf.goes_on() {
                        break;
                    }
                }
            }
            fetched
        }
    }

    #[test]
    fn a_leafs_triangles_come_by_eights_each_once() {
        // Leaves of 1 to 26 triangles, and the words behind the last record.
        let (mut words, mut records) = (Vec::new(), Vec::new());
        for count in 1..27 {
            records.push(words.len());
            words.push(count);
            words.extend((0..count).map(|i| 100 * count + i));
        }
        words.extend([0; 7]);
        let wanted: Vec<i32> = (1..27).flat_map(|count| (0..count).map(move |i| 100 * count + i)).collect();
        for isa in Isa::available() {
            let chosen = Chosen::new(isa).expect("it is available");
            assert_eq!(chosen.run(Fetch(&words, &records)), wanted, "{isa}");
        }
    }
}
