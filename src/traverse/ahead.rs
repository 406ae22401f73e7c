//! What rays will need that are not traced yet.

use super::coarse::Way;
use crate::cache::{Cached, Glance};
use crate::geometry::Ray;
use std::ops::ControlFlow;

/// Leaves or pages with something in them that a ray is thought to look at before it hits.
const LEAVES: usize = 2;

/// Asks for what some rays will need first of a scene that is in memory in part: lists of pages if they go in beams, and
/// otherwise nodes of the full tree and lists of its leaves, and the triangles of lists that are here.
///
/// Each ray goes on from what is here to the first that is not, so that what hangs on something else is asked for when
/// that has come, if the same rays are asked about again. Needs no block, never waits, and is no use of any.
pub fn look_ahead(cached: &Cached, rays: impl Iterator<Item = Ray>, in_beams: bool) {
    let mut glance = cached.glance();
    for ray in rays {
        if glance.is_full() {
            break;
        }
        if let Some(way) = Way::through(cached, &ray) {
            follow(cached, &mut glance, way, in_beams);
        }
    }
}

fn follow(cached: &Cached, glance: &mut Glance<'_>, way: Way, in_beams: bool) {
    let mut left = LEAVES;
    let one_less = |left: &mut usize| {
        *left -= 1;
        if *left == 0 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    };
    // How it ended is of no interest.
    let _ = way.leaves(
        0,
        |place| Some(cached.upper()[place]),
        |place, page, way| {
            if page.references().is_empty() {
                return ControlFlow::Continue(());
            }
            if in_beams {
                glance.list(page, true);
                return one_less(&mut left);
            }
            // The page's part of the full tree.
            let mut leaves = Vec::new();
            let whole = way.leaves(
                glance.beneath(place),
                |place| glance.node(place),
                |_, leaf, _| {
                    if leaf.references().is_empty() {
                        return ControlFlow::Continue(());
                    }
                    leaves.push(leaf);
                    one_less(&mut left)
                },
            );
            leaves.into_iter().for_each(|leaf| glance.list(leaf, false));
            whole
        },
    );
}
