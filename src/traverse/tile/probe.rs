//! Looking over the kernel's shoulder: where its time goes, in counts.

use serde::Serialize;

/// What is told of the steps of a walk. All methods do nothing unless they are said to.
pub trait Probe {
    /// A node of the upper tree was entered by so many packets.
    #[inline(always)]
    fn node(&mut self, _packets: u32) {}
    /// A page that is not empty was entered by so many packets.
    #[inline(always)]
    fn page(&mut self, _packets: u32) {}
    /// A block of so many triangles came, of which so many were left for the beam.
    #[inline(always)]
    fn block(&mut self, _triangles: usize, _left: u32) {}
    /// A packet was tested against so many triangles.
    #[inline(always)]
    fn tests(&mut self, _triangles: u32) {}
    /// So many packets went on alone.
    #[inline(always)]
    fn alone(&mut self, _packets: u32) {}
}

/// Nobody looks.
impl Probe for () {}

/// Counts of what the tile kernel did, for [`Accel::count_tile`](crate::traverse::Accel::count_tile).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize)]
pub struct TileCounts {
    /// Tiles that were beams; the others went packet by packet.
    pub beams: u64,
    /// Nodes of the upper tree entered, pages included.
    pub nodes: u64,
    /// Packets that were live in them.
    pub node_packets: u64,
    /// Pages entered that hold anything.
    pub pages: u64,
    /// Packets that were live in them.
    pub page_packets: u64,
    /// Blocks of sixteen triangles looked at.
    pub blocks: u64,
    /// Triangles in them.
    pub triangles: u64,
    /// Triangles left after culling for the beam.
    pub left: u64,
    /// Packets tested against a triangle.
    pub tests: u64,
    /// Packets that went on alone.
    pub alone: u64,
}

impl Probe for TileCounts {
    fn node(&mut self, packets: u32) {
        self.nodes += 1;
        self.node_packets += u64::from(packets);
    }

    fn page(&mut self, packets: u32) {
        self.pages += 1;
        self.page_packets += u64::from(packets);
    }

    fn block(&mut self, triangles: usize, left: u32) {
        self.blocks += 1;
        self.triangles += triangles as u64;
        self.left += u64::from(left);
    }

    fn tests(&mut self, triangles: u32) {
        self.tests += u64::from(triangles);
    }

    fn alone(&mut self, packets: u32) {
        self.alone += u64::from(packets);
    }
}
