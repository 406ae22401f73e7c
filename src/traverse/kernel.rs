//! The list of kernels: tests and benches run every entry.

use std::fmt;

/// A way of tracing rays. All give the same hits, bit for bit.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Kernel {
    /// One ray at a time.
    Single,
    /// Four rays in SIMD lanes.
    Packet4,
    /// Eight.
    Packet8,
    /// Sixteen.
    Packet16,
    /// Some thirty rays in flight, each alone: for rays that have nothing in common. It is handed 64 at least.
    Stream,
    /// Up to 4096 rays that need have nothing in common but many of which visit the same places: lists of rays are
    /// filtered down the tree.
    Filter,
    /// Up to 256 rays from one point as sixteen packets; rays that are too unlike go packet by packet.
    Tile,
    /// Up to 1024 rays from one point as four times sixteen packets, likewise; shadow rays go as by [`Tile`](Self::Tile).
    WideTile,
}

impl Kernel {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Single,
        Self::Packet4,
        Self::Packet8,
        Self::Packet16,
        Self::Stream,
        Self::Filter,
        Self::Tile,
        Self::WideTile,
    ];

    /// `single`, `packet4`, `packet8`, `packet16`, `stream`, `filter`, `tile` or `tile1024`.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Single => "single",
            Self::Packet4 => "packet4",
            Self::Packet8 => "packet8",
            Self::Packet16 => "packet16",
            Self::Stream => "stream",
            Self::Filter => "filter",
            Self::Tile => "tile",
            Self::WideTile => "tile1024",
        }
    }

    /// How many rays it traces together.
    pub const fn width(self) -> usize {
        match self {
            Self::Single => 1,
            Self::Packet4 => 4,
            Self::Packet8 => 8,
            Self::Packet16 => 16,
            Self::Stream => 64,
            Self::Filter => 4096,
            Self::Tile => 256,
            Self::WideTile => 1024,
        }
    }

    /// What it traces together, in words.
    pub const fn rays(self) -> &'static str {
        match self {
            Self::Single => "single rays",
            Self::Packet4 => "packets of 4",
            Self::Packet8 => "packets of 8",
            Self::Packet16 => "packets of 16",
            Self::Stream => "streams of 64",
            Self::Filter => "lists of up to 4096",
            Self::Tile => "beams of 256",
            Self::WideTile => "beams of 1024",
        }
    }

    /// The kernel that traces `width` rays together, if there is one.
    pub fn of_width(width: usize) -> Option<Self> {
        Self::ALL.into_iter().find(|kernel| kernel.width() == width)
    }
}

/// Rays by kernel: the sums of what kernels have traced, of which one may be there more than once, without those that traced none.
pub fn tally(traced: impl IntoIterator<Item = (Kernel, u64)>) -> Vec<(Kernel, u64)> {
    let mut sums = Kernel::ALL.map(|kernel| (kernel, 0));
    for (kernel, rays) in traced {
        sums[kernel as usize].1 += rays;
    }
    sums.into_iter().filter(|&(_, rays)| rays > 0).collect()
}

impl fmt::Display for Kernel {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}
