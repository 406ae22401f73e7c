//! Numbers for tests, the same in every run: a Weyl sequence, which is random enough for most, and one that is scattered.

/// Numbers spread evenly from `low` to `high`.
pub fn uniform(low: f64, high: f64) -> impl FnMut() -> f32 {
    let mut state = 0.0f64;
    move || {
        state = (state + 0.618_033_988_749_895).fract();
        (state * (high - low) + low) as f32
    }
}

/// Numbers that have nothing to do with one another, from `low` to `high`: for tests that take several for each case, of which those that
/// [`uniform`] gives would lie on few lines. SplitMix: Steele, Lea & Flood, "Fast Splittable Pseudorandom Number Generators", 2014.
pub fn scattered(low: f32, high: f32) -> impl FnMut() -> f32 {
    let mut state = 0u64;
    move || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (state ^ state >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ mixed >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
        let part = ((mixed ^ mixed >> 31) >> 40) as f32 / (1 << 24) as f32;
        part * (high - low) + low
    }
}
