//! Random numbers, and the seeds that they start from.

use raypack::Vec3;
use std::hash::{BuildHasher, RandomState};
use std::sync::OnceLock;

/// Fixed seeds, and a fresh one: that of the environment variable `RAYPACK_SEED`, or chance.
pub fn seeds() -> [u64; 3] {
    static FRESH: OnceLock<u64> = OnceLock::new();
    let fresh = *FRESH.get_or_init(|| {
        let seed = match std::env::var("RAYPACK_SEED") {
            Ok(text) => text.parse().expect("RAYPACK_SEED is a whole number"),
            // The standard library keys its hash maps with the system's randomness. A short number is
            // easier to type again.
            Err(_) => RandomState::new().hash_one(0) >> 32,
        };
        println!("the fresh seed is RAYPACK_SEED={seed}");
        seed
    });
    [1, 2, fresh]
}

/// SplitMix64.
#[derive(Clone)]
pub struct Numbers(u64);

impl Numbers {
    /// The stream of a seed and a purpose.
    pub fn new(seed: u64, purpose: u64) -> Self {
        let mut numbers = Self(seed);
        numbers.0 = numbers.bits() ^ purpose.wrapping_mul(0xd6e8_feb8_6659_fd93);
        numbers
    }

    pub fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ z >> 31
    }

    /// Below `bound`.
    pub fn below(&mut self, bound: usize) -> usize {
        (self.bits() % bound as u64) as usize
    }

    /// Uniform in 0..1.
    pub fn unit(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 24) as f32
    }

    /// Uniform in -1..1.
    pub fn signed(&mut self) -> f32 {
        (self.bits() >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    /// Uniform in the cube of half-width 1.
    pub fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }

    /// Of length 1, any direction (the corners of a cube are met somewhat more often).
    pub fn direction(&mut self) -> Vec3 {
        self.vector().normalize_or(Vec3::X)
    }

    /// Each coordinate a whole number from `low` to `high`.
    pub fn lattice(&mut self, low: i32, high: i32) -> Vec3 {
        let count = (high - low + 1) as usize;
        Vec3::from_array([0; 3].map(|_| (low + self.below(count) as i32) as f32))
    }

    pub fn pick<T: Copy>(&mut self, items: &[T]) -> T {
        items[self.below(items.len())]
    }

    /// In random order.
    pub fn shuffle<T>(&mut self, items: &mut [T]) {
        for i in (1..items.len()).rev() {
            items.swap(i, self.below(i + 1));
        }
    }
}
