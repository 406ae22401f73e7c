//! Blocks that were given up, until nobody can be reading them any more.

use std::collections::{HashMap, VecDeque};

/// Given-up blocks with the [epoch](super::epoch) that each was retired at.
#[derive(Debug, Default)]
pub struct Retired {
    /// Epochs and blocks, oldest first. An entry whose epoch is not its block's any more is of a time when it was kept.
    queue: VecDeque<(u64, u32)>,
    /// By block: the epoch that it was retired at, if it was and is not kept.
    at: HashMap<u32, u64>,
    /// Homes that blocks have moved away from, likewise: in lots, each in ascending order.
    homes: VecDeque<(u64, Vec<u32>)>,
}

impl Retired {
    /// A block is given up; epochs grow from one call to the next.
    pub fn push(&mut self, epoch: u64, block: u32) {
        let before = self.at.insert(block, epoch);
        debug_assert_eq!(before, None, "nobody gives a block up twice");
        if self.queue.len() > 2 * self.at.len() + 64 {
            let at = &self.at;
            self.queue.retain(|(epoch, block)| at.get(block) == Some(epoch));
        }
        self.queue.push_back((epoch, block));
    }

    /// Keeps a block, if it is retired; whether it was.
    pub fn keep(&mut self, block: u32) -> bool {
        self.at.remove(&block).is_some()
    }

    /// Takes out what was retired before an epoch.
    pub fn take_before(&mut self, epoch: u64) -> Vec<u32> {
        let mut taken = Vec::new();
        while let Some(&(retired, block)) = self.queue.front()
            && retired < epoch
        {
            self.queue.pop_front();
            if self.at.get(&block) == Some(&retired) {
                self.at.remove(&block);
                taken.push(block);
            }
        }
        taken
    }

    /// Blocks have moved away from their homes.
    pub fn push_homes(&mut self, epoch: u64, blocks: Vec<u32>) {
        self.homes.push_back((epoch, blocks));
    }

    /// Whether any such homes wait.
    pub fn has_homes(&self) -> bool {
        !self.homes.is_empty()
    }

    /// Takes out a lot of those that did so before an epoch.
    pub fn take_homes_before(&mut self, epoch: u64) -> Option<Vec<u32>> {
        self.homes.front().filter(|(moved, _)| *moved < epoch)?;
        self.homes.pop_front().map(|(_, blocks)| blocks)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_kept_goes_when_it_is_given_up_once_more_and_not_before() {
        let mut retired = Retired::default();
        for (epoch, block) in [(3, 70), (4, 72), (5, 71)] {
            retired.push(epoch, block);
        }
        assert!(retired.keep(72) && !retired.keep(72) && !retired.keep(9));
        retired.push(6, 72);
        assert!(retired.take_before(3).is_empty());
        assert_eq!(retired.take_before(5), [70]);
        assert_eq!(retired.take_before(6), [71], "72 was given up later, the second time");
        assert_eq!(retired.take_before(7), [72]);
        assert!(!retired.keep(70) && retired.queue.is_empty() && retired.at.is_empty());
    }

    #[test]
    fn homes_are_left_in_the_order_of_moving() {
        let mut retired = Retired::default();
        retired.push_homes(3, vec![7, 8]);
        retired.push_homes(4, vec![9]);
        assert_eq!(retired.take_homes_before(3), None);
        assert_eq!(retired.take_homes_before(5), Some(vec![7, 8]));
        assert_eq!(retired.take_homes_before(4), None);
        assert!(retired.has_homes());
        assert_eq!(retired.take_homes_before(5), Some(vec![9]));
        assert!(!retired.has_homes());
        assert_eq!(retired.take_homes_before(5), None);
    }

    #[test]
    fn what_was_kept_again_and_again_takes_no_room() {
        let mut retired = Retired::default();
        retired.push(0, 50);
        for epoch in 1..10_000 {
            retired.push(epoch, 70);
            assert!(retired.keep(70));
        }
        assert!(retired.queue.len() < 100);
        assert_eq!(retired.take_before(10_000), [50]);
    }
}
