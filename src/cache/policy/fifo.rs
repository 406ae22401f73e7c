//! First in, first out.

use super::{Policy, Use, Way};

/// Gives up what came first.
#[derive(Debug)]
pub struct Fifo;

impl Policy for Fifo {
    fn victim(&mut self, ways: &mut Vec<Way>, uses: &dyn Fn(u32) -> Option<Use>) -> Option<usize> {
        ways.iter().position(|way| uses(way.block).is_some())
    }
}
