//! A tree whose arrays are where blocks have their homes.

use super::blocks::Blocks;
use super::layout::Array;
use super::sync::Arc;
use crate::column::Column;
use crate::geometry::Aabb;
use crate::kdtree::{KdTree, Node, Scale, Walked};
use bytemuck::AnyBitPattern;
use std::fmt;
use std::ptr::NonNull;

/// The tree of a scene for all of which there is room. It is looked at by who is in an epoch in which all of it [is
/// here](Blocks::is_whole), and by nobody else: what a block's home holds that is not here means nothing.
pub struct InHomes(KdTree);

impl InHomes {
    /// `None` if there is not room for all blocks.
    pub fn new(
        blocks: &Arc<Blocks>,
        upper: &Arc<Vec<Node>>,
        beneath: &Arc<Vec<u32>>,
        bounds: Aabb,
        scale: Scale,
    ) -> Option<Self> {
        let walked = || Walked {
            nodes: column(blocks, Array::Nodes),
            references: column(blocks, Array::References),
            upper: Arc::clone(upper).into(),
            beneath: Arc::clone(beneath).into(),
            pages: column(blocks, Array::Pages),
            triangles: column(blocks, Array::Triangles),
            bounds,
            scale,
        };
        blocks.slots.hold_all().then(|| Self(walked().into()))
    }

    /// The tree.
    #[inline(always)]
    pub fn tree(&self) -> &KdTree {
        &self.0
    }
}

/// An array at its home.
fn column<T: AnyBitPattern>(blocks: &Arc<Blocks>, array: Array) -> Column<T> {
    let place = blocks.layout.column(array);
    let (count, owner) = (place.bytes / size_of::<T>(), Arc::clone(blocks));
    let home = NonNull::new(blocks.slots.home(place.base).cast_mut()).expect("a mapping is not at zero");
    assert!(home.cast::<T>().is_aligned(), "every array begins at the start of a block");
    // SAFETY: homes of all blocks follow one another in a mapping that lives and stays where it is as long as `blocks`
    // does, so all of the array lies in it. Where the tree is looked at, all blocks are here, and nobody writes to them
    // before who looks has left.
    unsafe { Column::in_memory(home.cast(), count, owner) }
}

impl fmt::Debug for InHomes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // Nobody says here that all blocks are.
        f.debug_struct("InHomes").finish_non_exhaustive()
    }
}
