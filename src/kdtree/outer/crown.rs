//! The lines of the top, and the order of all lines.
//!
//! A line holds three levels of the tree, counted from the root, so a line of the top may reach two levels down
//! into a part. These levels of each part, its *crown*, are kept until the top is known; below them begin
//! *pieces*, whose lines were packed with the part. In the array, the lines of a subtree follow its first
//! one, larger exits first: the plan is a walk over the crowns in that order, and says where each piece goes.

use crate::geometry::Aabb;
use crate::kdtree::lines::{Exit, Line};
use crate::kdtree::node::Node;

/// An inner node of a crown whose children would be from here on is the root of a piece: the so-manieth.
pub const PIECES: usize = 1 << 29;

/// The top of a tree.
pub enum Top {
    /// An inner node.
    Inner {
        /// Its axis.
        axis: usize,
        /// Its plane.
        split: f32,
        /// Below the plane, and above.
        children: Box<[Self; 2]>,
    },
    /// The root of a part.
    Part(Finished),
}

/// What is kept of a part that is finished.
pub struct Finished {
    /// Its uppermost nodes, the root first.
    pub crown: Vec<Node>,
}

impl Top {
    /// Puts its root to a place of a longer array, and all else behind.
    fn place(&self, nodes: &mut Vec<Node>, at: usize) {
        match self {
            Self::Inner { axis, split, children } => {
                let pair = nodes.len();
                nodes.extend([Node::leaf(0, 0); 2]);
                nodes[at] = Node::inner(*axis, *split, pair);
                for (child, top) in children.iter().enumerate() {
                    top.place(nodes, pair + child);
                }
            }
            Self::Part(Finished { crown }) => {
                // The root is at `at`, what was at 1 comes next.
                let by = nodes.len() - 1;
                let mut moved = crown.iter().map(|node| {
                    let in_crown = !node.is_leaf() && (node.below() as usize) < PIECES;
                    if in_crown { node.moved(by, 0) } else { *node }
                });
                nodes[at] = moved.next().expect("a part has a root");
                nodes.extend(moved);
            }
        }
    }
}

/// Where lines go.
#[derive(Debug)]
pub struct Plan {
    steps: Vec<Step>,
    lines: usize,
}

/// What comes next.
#[derive(Debug)]
enum Step {
    /// A line of the top.
    Line(Line),
    /// All lines of a piece, which begins so many lines into the unordered ones, has so many, and is moved by
    /// so many.
    Piece { first: usize, count: usize, by: usize },
}

impl Plan {
    /// The plan for a tree whose pieces have so many lines.
    pub(super) fn new(top: &Top, bounds: Aabb, pieces: &[usize]) -> Self {
        let mut nodes = vec![Node::leaf(0, 0)];
        top.place(&mut nodes, 0);
        let begins = |first: &mut usize, count: &usize| {
            let begin = *first;
            *first += count;
            Some((begin, *count))
        };
        let pieces: Vec<(usize, usize)> = pieces.iter().scan(0, begins).collect();
        let mut plan = Self { steps: Vec::new(), lines: 0 };
        plan.subtree(&nodes, nodes[0], &bounds, &pieces);
        plan
    }

    fn subtree(&mut self, nodes: &[Node], root: Node, cell: &Aabb, pieces: &[(usize, usize)]) {
        if !root.is_leaf()
            && let Some(&(first, count)) =
                (root.below() as usize).checked_sub(PIECES).map(|piece| &pieces[piece])
        {
            self.steps.push(Step::Piece { first, count, by: self.lines });
            self.lines += count;
            return;
        }
        let (mut line, below) = Line::of_treelet(nodes, root, cell);
        let at = self.steps.len();
        self.steps.push(Step::Line(line));
        self.lines += 1;
        for (exit, node, cell) in below {
            line.exits[exit] |= Exit::of_line(self.lines).0;
            self.subtree(nodes, node, &cell, pieces);
        }
        self.steps[at] = Step::Line(line);
    }

    /// How many lines there are.
    pub fn lines(&self) -> usize {
        self.lines
    }

    /// Gives all lines in their order, so many at a time; `read` fetches unordered ones from a place on.
    ///
    /// # Errors
    /// What `read` and `give` fail with.
    pub fn each<E>(
        &self,
        mut read: impl FnMut(usize, &mut [Line]) -> Result<(), E>,
        mut give: impl FnMut(&[Line]) -> Result<(), E>,
    ) -> Result<(), E> {
        const AT_ONCE: usize = 1 << 14;
        let mut lines = Vec::new();
        for step in &self.steps {
            match *step {
                Step::Line(line) => give(&[line])?,
                Step::Piece { first, count, by } => {
                    for from in (0..count).step_by(AT_ONCE) {
                        lines.resize(AT_ONCE.min(count - from), Line::NOTHING);
                        read(first + from, &mut lines)?;
                        lines.iter_mut().for_each(|line| *line = line.moved(by, 0));
                        give(&lines)?;
                    }
                }
            }
        }
        Ok(())
    }
}
