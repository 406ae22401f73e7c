//! The tree as far as it is here, looked at to ask for what is not.

use super::Cached;
use super::view::View;
use crate::kdtree::Node;

/// A look at the tree that never waits and counts as no use. What it would need and is not here is asked for ahead
/// of need when it ends.
#[derive(Debug)]
pub struct Glance<'a> {
    cached: &'a Cached,
    view: View<'a>,
    lacking: Vec<u32>,
}

/// Blocks that one look asks for, or a few more: what a tile lacks is some tens, and more than that would drive one
/// another out of the queue.
const MOST: usize = 64;

impl<'a> Glance<'a> {
    pub(super) fn new(cached: &'a Cached) -> Self {
        Self { cached, view: cached.view(), lacking: Vec::new() }
    }

    /// Whether enough is asked for.
    pub fn is_full(&self) -> bool {
        self.lacking.len() >= MOST
    }

    /// The place in the full tree of what is at a place of the upper one.
    pub fn beneath(&self, place: usize) -> usize {
        self.cached.beneath[place] as usize
    }

    /// A node of the full tree, if it is here.
    pub fn node(&mut self, place: usize) -> Option<Node> {
        self.view.peek_node(place, &mut self.lacking)
    }

    /// Asks for what a leaf of the full tree holds, or a page: its list, or its triangles if the list is here.
    pub fn list(&mut self, leaf: Node, is_page: bool) {
        self.view.peek_list(leaf, is_page, &mut self.lacking, MOST);
    }
}

impl Drop for Glance<'_> {
    fn drop(&mut self) {
        if !self.lacking.is_empty() {
            self.cached.loaders.ahead(&self.lacking);
        }
    }
}
