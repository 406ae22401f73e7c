//! The fewest misses that any policy could have had (Belady, "A study of replacement algorithms for a
//! virtual-storage computer", 1966).

use std::collections::{BTreeSet, HashMap};

/// How often a cache of `capacity` blocks misses that always gives up the block whose next use is farthest
/// away, over the uses in `trace`; it starts with what a first run over the trace leaves in it if `warm`.
///
/// Nothing that keeps to demand, one block for another, does better.
pub fn misses(trace: &[u32], capacity: usize, warm: bool) -> u64 {
    if capacity == 0 {
        return trace.len() as u64;
    }
    let runs = if warm { 2 } else { 1 };
    let uses = || (0..runs).flat_map(|_| trace.iter().copied());

    // When each use's block is used again.
    let count = runs * trace.len();
    let mut next = vec![usize::MAX; count];
    let mut later: HashMap<u32, usize> = HashMap::new();
    let all: Vec<u32> = uses().collect();
    for at in (0..count).rev() {
        if let Some(again) = later.insert(all[at], at) {
            next[at] = again;
        }
    }

    // Blocks that are here, by when they are used next.
    let mut here: BTreeSet<(usize, u32)> = BTreeSet::new();
    let mut missed = 0;
    for (at, &block) in all.iter().enumerate() {
        // A block that is here waits for this very use.
        if !here.remove(&(at, block)) {
            missed += u64::from(at + trace.len() >= count);
            if here.len() == capacity {
                here.pop_last();
            }
        }
        here.insert((next[at], block));
    }
    missed
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_farthest_use_goes() {
        // 1 2 3 fill it; 4 takes the place of 3, whose use is farthest; then 3 that of 4 (or 1, or 2).
        let trace = [1, 2, 3, 4, 1, 2, 3];
        assert_eq!(misses(&trace, 3, false), 5);
        assert_eq!(misses(&trace, 4, false), 4);
        assert_eq!(misses(&trace, 0, false), 7);
    }

    #[test]
    fn a_cycle_that_is_too_large_misses_as_little_as_can_be() {
        // Five blocks round and round in four places: one miss in each four uses, LRU would miss all.
        let trace: Vec<u32> = (0..400).map(|i| i % 5).collect();
        let missed = misses(&trace, 4, false);
        assert!((100..=103).contains(&missed), "{missed}");
        assert_eq!(misses(&trace, 5, false), 5);
        assert_eq!(misses(&trace, 5, true), 0, "all is there from the first run");
    }

    #[test]
    fn it_is_the_least_of_all_choices() {
        /// Every choice tried.
        fn least(trace: &[u32], here: Vec<u32>, capacity: usize) -> u64 {
            let Some((&block, rest)) = trace.split_first() else { return 0 };
            if here.contains(&block) {
                return least(rest, here, capacity);
            }
            let with = |mut here: Vec<u32>| {
                here.push(block);
                1 + least(rest, here, capacity)
            };
            if here.len() < capacity {
                return with(here);
            }
            let without = |gone: usize| {
                let mut here = here.clone();
                here.remove(gone);
                with(here)
            };
            (0..here.len()).map(without).min().expect("something is here")
        }
        let mut state = 1u32;
        for _ in 0..50 {
            let trace: Vec<u32> = (0..12)
                .map(|_| {
                    state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
                    state >> 24 & 3
                })
                .collect();
            for capacity in [1, 2, 3] {
                assert_eq!(misses(&trace, capacity, false), least(&trace, vec![], capacity), "{trace:?}");
            }
        }
    }
}
