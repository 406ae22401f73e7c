//! Parts that would do better elsewhere are taken out and put in again there.
//!
//! What is built from the top down knows little of what comes below. So afterwards each part of those with the largest boxes looks for
//! the place that makes all boxes together smallest: beside some other part, under a new box around both. All look at the same
//! hierarchy, side by side; then those that gain most move first, and who looked at what has changed since does
//! not move (Meister & Bittner, "Parallel reinsertion for bounding volume hierarchy optimization", 2018).

use crate::geometry::Aabb;
use crate::kdtree::MAX_DEPTH;
use rayon::prelude::*;

/// How often parts move.
const ROUNDS: usize = 4;

/// What share of all parts looks for a better place, each time.
const SHARE: f64 = 0.2;

/// A hierarchy whose parts can move. Siblings lie side by side, the first of them at an even place; the root is the first, and
/// has no sibling.
pub struct Loose(pub Vec<Place>);

/// A part in its place.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    pub bounds: Aabb,
    pub above: u32,
    pub holds: Holds,
}

/// What a part holds.
#[derive(Clone, Debug, PartialEq)]
pub enum Holds {
    /// Triangles.
    Triangles(Vec<u32>),
    /// Two parts, from this place on.
    Parts(u32),
}

/// A part, and where it would do better.
#[derive(Clone, Copy, Debug)]
struct Move {
    from: usize,
    to: usize,
    /// By how much boxes' areas become less.
    gain: f64,
}

impl Loose {
    /// Moves parts as long as that pays.
    pub fn optimize(&mut self) {
        let mut order: Vec<usize> = (2..self.0.len()).collect();
        for _ in 0..ROUNDS {
            let areas: Vec<f64> = self.0.iter().map(|place| place.bounds.area()).collect();
            order.sort_unstable_by(|&a, &b| areas[b].total_cmp(&areas[a]).then(a.cmp(&b)));
            let share = (order.len() as f64 * SHARE) as usize;
            let mut moves: Vec<Move> =
                order[..share].par_iter().filter_map(|&from| self.best(from, &areas)).collect();
            moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.from.cmp(&b.from)));
            if moves.is_empty() {
                break;
            }
            let before = self.0.clone();
            self.take(&moves);
            if self.depth() > MAX_DEPTH {
                // Stacks have no room for that.
                self.0 = before;
                break;
            }
        }
    }

    /// The best place for a part, if that is not where it is.
    fn best(&self, from: usize, areas: &[f64]) -> Option<Move> {
        let part = self.0[from].bounds;
        let above = self.above(from);
        let mut best = Move { from, to: 0, gain: 0.0 };
        // What is gained if it goes somewhere below `beside`, before anything there has become larger.
        let mut gain = areas[above];
        let (mut beside, mut pivot) = (from ^ 1, above);
        let mut rest = self.0[from ^ 1].bounds;
        let mut stack = Vec::with_capacity(64);
        loop {
            stack.push((gain, beside));
            while let Some((gain, to)) = stack.pop() {
                // Around both there is a box that is no smaller than the part's.
                if gain - areas[from] <= best.gain {
                    continue;
                }
                let gain = gain - self.0[to].bounds.union(part).area();
                if gain > best.gain {
                    best = Move { from, to, gain };
                }
                if let Holds::Parts(below) = self.0[to].holds {
                    let gain = gain + areas[to];
                    stack.extend([(gain, below as usize), (gain, below as usize + 1)]);
                }
            }
            if pivot != above {
                rest = rest.union(self.0[beside].bounds);
                gain += areas[pivot] - rest.area();
            }
            if pivot == 0 {
                break;
            }
            (beside, pivot) = (pivot ^ 1, self.above(pivot));
        }
        // (Beside its sibling is where it is.)
        (best.gain > 0.0 && best.to != from ^ 1 && best.to != above).then_some(best)
    }

    /// Moves parts, but those of which something has changed.
    fn take(&mut self, moves: &[Move]) {
        let mut changed = vec![false; self.0.len()];
        for &Move { from, to, .. } in moves {
            let above = self.above(from);
            let touched = [from, from ^ 1, above, self.above(above), to, self.above(to)];
            if touched.iter().any(|&place| changed[place]) {
                continue;
            }
            touched.iter().for_each(|&place| changed[place] = true);
            self.move_one(from, to);
        }
    }

    /// Puts a part beside another one. Its sibling takes the place above.
    fn move_one(&mut self, from: usize, to: usize) {
        let (above, free) = (self.above(from), from ^ 1);
        self.put(free, above);
        self.put(to, free);
        let pair = from as u32 & !1;
        self.0[to].holds = Holds::Parts(pair);
        self.0[from].above = to as u32;
        self.0[free].above = to as u32;
        self.refit(to);
        self.refit(above);
    }

    /// Has what is in one place be in another.
    fn put(&mut self, from: usize, to: usize) {
        let holds = std::mem::replace(&mut self.0[from].holds, Holds::Parts(0));
        if let Holds::Parts(below) = holds {
            for below in [below as usize, below as usize + 1] {
                self.0[below].above = to as u32;
            }
        }
        self.0[to].holds = holds;
        self.0[to].bounds = self.0[from].bounds;
    }

    /// Makes the boxes of a place and of those above it fit.
    fn refit(&mut self, mut place: usize) {
        loop {
            if let Holds::Parts(below) = self.0[place].holds {
                let below = below as usize;
                self.0[place].bounds = self.0[below].bounds.union(self.0[below + 1].bounds);
            }
            if place == 0 {
                return;
            }
            place = self.above(place);
        }
    }

    /// The place above another one; above the root is the root.
    fn above(&self, place: usize) -> usize {
        self.0[place].above as usize
    }

    /// How deep the deepest part lies.
    fn depth(&self) -> usize {
        let (mut deepest, mut stack) = (0, vec![(0, 0)]);
        while let Some((place, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            if let Holds::Parts(below) = self.0[place].holds {
                stack.extend([(below as usize, depth + 1), (below as usize + 1, depth + 1)]);
            }
        }
        deepest
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::weyl::uniform;
    use glam::Vec3;

    /// A hierarchy of boxes in places that have nothing to do with one another.
    fn scattered(leaves: usize) -> Loose {
        let mut number = uniform(0.0, 100.0);
        let mut loose = Loose(vec![Place { bounds: Aabb::EMPTY, above: 0, holds: Holds::Parts(2) }; 2]);
        for place in 0..2 * leaves as u32 - 2 {
            let holds_parts = (place as usize) < leaves - 2;
            let above = if place < 2 { 0 } else { place / 2 + 1 };
            let low = Vec3::new(number(), number(), number());
            let bounds = Aabb { min: low, max: low + Vec3::ONE };
            let holds = if holds_parts { Holds::Parts(2 * place + 4) } else { Holds::Triangles(vec![place]) };
            loose.0.push(Place { bounds, above, holds });
        }
        for place in (2..loose.0.len()).rev() {
            if matches!(loose.0[place].holds, Holds::Triangles(_)) {
                loose.refit(place);
            }
        }
        loose
    }

    /// The sum of all boxes' areas, after a look at whether all is in order: which leaves there are.
    fn check(loose: &Loose) -> (f64, Vec<u32>) {
        let (mut area, mut leaves, mut stack) = (0.0, Vec::new(), vec![0]);
        while let Some(place) = stack.pop() {
            let Place { bounds, holds, .. } = &loose.0[place];
            match holds {
                Holds::Triangles(ids) => leaves.extend(ids),
                Holds::Parts(below) => {
                    area += bounds.area();
                    assert_eq!(below % 2, 0);
                    let below = [*below as usize, *below as usize + 1];
                    assert!(below.iter().all(|&part| loose.above(part) == place));
                    assert_eq!(*bounds, loose.0[below[0]].bounds.union(loose.0[below[1]].bounds));
                    stack.extend(below);
                }
            }
        }
        leaves.sort_unstable();
        (area, leaves)
    }

    #[test]
    fn a_move_gains_what_it_promises() {
        for leaves in [3, 4, 5, 9, 40, 300] {
            let mut loose = scattered(leaves);
            let (mut area, all) = check(&loose);
            let mut moved = 0;
            for from in 2..loose.0.len() {
                let areas: Vec<f64> = loose.0.iter().map(|place| place.bounds.area()).collect();
                let Some(Move { to, gain, .. }) = loose.best(from, &areas) else { continue };
                // No other place is better: it is tried.
                for other in 2..loose.0.len() {
                    let is_below = |mut place: usize| {
                        while place != 0 && place != from {
                            place = loose.above(place);
                        }
                        place == from
                    };
                    if leaves <= 40 && !is_below(other) && other != from ^ 1 && other != loose.above(from) {
                        let mut tried = Loose(loose.0.clone());
                        tried.move_one(from, other);
                        assert!(area - check(&tried).0 <= gain * (1.0 + 1e-9) + 1e-6);
                    }
                }
                loose.move_one(from, to);
                let (now, same) = check(&loose);
                assert!((area - now - gain).abs() <= 1e-6 * area, "{area} to {now}, {gain} promised");
                assert_eq!(same, all);
                (area, moved) = (now, moved + 1);
            }
            assert!(leaves < 9 || moved > 0);
        }
    }

    #[test]
    fn all_together_gain_and_lose_nothing() {
        let mut loose = scattered(2000);
        let (before, all) = check(&loose);
        loose.optimize();
        let (after, same) = check(&loose);
        assert!(after < 0.9 * before, "{before} to {after}");
        assert_eq!(same, all);
    }
}
