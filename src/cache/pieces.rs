//! Room to read into.
//!
//! A file's bytes have checksums in pieces. So pieces are read whole, to where nobody else looks, and what was wanted of
//! them is copied when they have been found to be what was written.

use bytemuck::{Pod, Zeroable};
use std::cell::Cell;

/// Bytes that have a checksum of their own: see [`Source`](super::source::Source).
pub const PIECE: usize = 4096;

/// Bytes that one read brings at most, unless a block is longer.
pub const READ: usize = 16 << 10;

/// Memory that a thread which reads blocks of so many bytes keeps for that.
pub fn most_bytes(block: usize) -> usize {
    block.max(READ)
}

/// A piece, aligned as reads past the system's memory demand.
#[derive(Clone, Copy, Debug, Pod, Zeroable)]
#[repr(C, align(4096))]
struct Piece([u8; PIECE]);

/// Pieces that follow one another.
#[derive(Debug, Default)]
pub struct Room(Vec<Piece>);

impl Room {
    /// The bytes of all of them.
    pub fn bytes_mut(&mut self) -> &mut [u8] {
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

thread_local! {
    static ROOM: Cell<Room> = const { Cell::new(Room(Vec::new())) };
}

/// So many pieces, with whatever was in them before.
pub fn take(count: usize) -> Room {
    let mut room = ROOM.take();
    room.0.resize(count, Piece::zeroed());
    room
}

/// Keeps them for the thread's next read.
pub fn put_back(room: Room) {
    ROOM.set(room);
}
