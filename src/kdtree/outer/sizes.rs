//! How large parts may be.
//!
//! What a build is sure to stay within is what a tree of `max_duplication` takes, and trees have a third of that. So a
//! part is tried in one that fits if its triangles are cut as those of the parts before were. If it turns out that it
//! does not fit, it is thrown away and split from files, and the guess is raised.

use super::NAME;
use crate::kdtree::memory::build_bytes;

/// What parts may have, as far as is known.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sizes {
    /// References of a part that is sure to fit.
    pub sure: usize,
    /// Bytes that a part's arrays may take.
    pub memory: usize,
    /// References of the parts that are done, and what has become of them: nodes, and the leaves' references.
    references: f64,
    nodes: f64,
    in_leaves: f64,
    /// The guess is so many times what parts have become on average.
    margin: f64,
}

impl Sizes {
    /// Before the first part is done, nothing is tried that may not fit.
    pub fn new(sure: usize, memory: usize) -> Self {
        Self { sure, memory, references: 0.0, nodes: 0.0, in_leaves: 0.0, margin: 1.25 }
    }

    /// Whether a part is worth trying that has so many references, and so many nodes and references in the end at
    /// the very most.
    pub fn may_fit(&self, references: usize, most: usize) -> bool {
        if self.references == 0.0 {
            return false;
        }
        let count = references as f64;
        let times = self.margin * count / self.references;
        let times = times.min(most as f64 / (self.nodes + self.in_leaves));
        let bytes = build_bytes(count, times * self.nodes, times * self.in_leaves) + NAME as f64 * count;
        bytes <= self.memory as f64
    }

    /// A part of so many references has become so many nodes, with so many references in leaves.
    pub fn learn(&mut self, references: usize, nodes: usize, in_leaves: usize) {
        self.references += references as f64;
        self.nodes += nodes as f64;
        self.in_leaves += in_leaves as f64;
    }

    /// A part did not fit.
    pub fn raise(&mut self) {
        self.margin *= 1.25;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guesses_follow_what_parts_became() {
        let mut sizes = Sizes::new(1000, 1_000_000);
        assert!(!sizes.may_fit(1, 8), "nothing is known");
        sizes.learn(1000, 1000, 2000);
        let fits = |sizes: &Sizes| (1..).take_while(|&count| sizes.may_fit(count, usize::MAX)).count();
        let at_first = fits(&sizes);
        // 52 bytes a reference and 64 of those in flight, and 1.25 times 16 of what becomes of it.
        assert!((7300..7600).contains(&at_first), "{at_first}");
        assert!(sizes.may_fit(at_first + 500, at_first), "there is a limit to what it may become");
        sizes.raise();
        let then = fits(&sizes);
        assert!(then < at_first);
        sizes.learn(9000, 9000 * 3, 9000 * 5);
        assert!(fits(&sizes) < then);
    }
}
