//! One ray against the triangles of a leaf, eight at a time.
//!
//! The mode sifts eight triangles at once, and what it finds is kept with the ray. Most eights hold nothing: those
//! rays go on at once, by arithmetic alone. The others stand in a set of their own, in which every ray has
//! something to look at: what is in doubt goes through the mode's own test, and the nearest is taken. So hits are
//! what packets find, bit for bit, and no branch depends on whether a triangle is hit.

use super::flight::Flight;
use crate::geometry::triangle::Alone;
use crate::simd::{Eight, Mask, prefetch_both};
use std::hint::select_unpredictable;

/// Where a ray is in its leaf: eight triangles, and what it found in them.
#[derive(Clone, Copy)]
#[repr(C, align(32))]
pub struct Leaf {
    /// The triangles' ids. Behind the leaf's last one is the first of the eight again.
    primitives: [i32; 8],
    /// `t` of those in `hits`.
    t: [f32; 8],
    /// Triangles that are hit, and those that are in doubt.
    hits: u32,
    open: u32,
    /// The word behind the eight, and how many triangles are left with them.
    next: u32,
    left: u32,
}

impl Leaf {
    /// No leaf.
    pub const NONE: Self = Self { primitives: [0; 8], t: [0.0; 8], hits: 0, open: 0, next: 0, left: 0 };

    /// Whether the eight have something to look at.
    #[inline(always)]
    pub fn has_found(&self) -> bool {
        self.hits | self.open != 0
    }

    /// Whether others of the leaf follow. (In no leaf they do not.)
    #[inline(always)]
    pub fn goes_on(&self) -> bool {
        self.left > 8
    }

    /// Fetches the next eight triangles: others of the same leaf if some are left, or else the first ones of the leaf
    /// whose record begins at `record` in `words`.
    #[inline(always)]
    pub fn fetch<L: Eight, R>(&mut self, words: &[u32], record: usize, records: &[R]) {
        let goes_on = self.goes_on();
        self.next = select_unpredictable(goes_on, self.next, record as u32 + 1);
        self.left = select_unpredictable(goes_on, self.left.wrapping_sub(8), words[record]);
        let words = words[self.next as usize..].first_chunk().expect("words behind the last record");
        self.next += 8;
        let ids = L::ids_load(bytemuck::cast_ref::<[u32; 8], [i32; 8]>(words));
        let present = L::mask_of_first(self.left.min(8) as usize);
        self.primitives = L::ids_store(L::ids_select(present, ids, L::ids(words[0] as i32)));
        for primitive in self.primitives {
            prefetch_both(records.as_ptr().wrapping_add(primitive as usize));
        }
    }
}

impl<A: Alone> Flight<A> {
    /// Sifts the eight triangles that were fetched.
    #[inline(always)]
    pub fn sift<L: Eight>(&mut self, records: &[A::Record]) {
        let mut triangles = [&records[0]; 8];
        for lane in 0..8 {
            triangles[lane] = &records[self.leaf.primitives[lane] as usize];
        }
        let lanes = (1 << self.leaf.left.min(8)) - 1;
        let finds = self.test.find::<L>(&triangles, self.tnear, self.tfar);
        self.leaf.t = finds.t.store();
        self.leaf.hits = finds.hits.bits() & lanes;
        self.leaf.open = finds.open & lanes;
    }

    /// Takes the nearest of what was found, and says whether it is nearer than what the ray had.
    #[inline(always)]
    pub fn settle<L: Eight>(&mut self, records: &[A::Record]) -> bool {
        let Leaf { primitives, t, hits, mut open, .. } = self.leaf;
        let mut found = false;
        while open != 0 {
            let lane = open.trailing_zeros() as usize & 7;
            open &= open - 1;
            let candidate = self.test.test(&records[primitives[lane] as usize], true);
            if candidate.inside && self.tnear <= candidate.t {
                found |= self.take(candidate.t, primitives[lane] as u32);
            }
        }

        // Of several that are as near the one with the lowest id counts.
        let t = L::select(L::mask_from_bits(hits), L::load(&t), L::splat(f32::INFINITY));
        let least = t.least();
        let mut nearest = t.eq(L::splat(least)).bits() & hits;
        while nearest != 0 {
            let lane = nearest.trailing_zeros() as usize & 7;
            nearest &= nearest - 1;
            found |= self.take(least, primitives[lane] as u32);
        }
        found
    }

    /// Takes a hit if it is nearer than what the ray has, or as near and of a lower id; says whether it is.
    #[inline(always)]
    fn take(&mut self, t: f32, primitive: u32) -> bool {
        let nearer = t < self.tfar || t == self.tfar && primitive < self.primitive;
        self.tfar = select_unpredictable(nearer, t, self.tfar);
        self.primitive = select_unpredictable(nearer, primitive, self.primitive);
        nearer
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
