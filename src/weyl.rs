//! Numbers for tests: a Weyl sequence, which is random enough there, and the same in every run.

/// Numbers spread evenly from `low` to `high`.
pub fn uniform(low: f64, high: f64) -> impl FnMut() -> f32 {
    let mut state = 0.0f64;
    move || {
        state = (state + 0.618_033_988_749_895).fract();
        (state * (high - low) + low) as f32
    }
}
