//! Blocks and their checksums.
//!
//! A block's checksum is the lower half of its XXH3 (64 bits, seed 0). The table of them makes it possible to
//! check any piece of the file that begins and ends at blocks without reading another.

use rayon::prelude::*;
use std::ops::Range;
use std::sync::atomic::{AtomicU64, Ordering};
use xxhash_rust::xxh3::xxh3_64;

/// Bytes that have a checksum of their own.
pub const BLOCK: usize = 4096;

/// Blocks that a task checks: 256 KiB.
const BLOCKS_PER_TASK: usize = 64;

/// The checksum of a whole block.
pub fn of_block(block: &[u8]) -> u32 {
    debug_assert_eq!(block.len(), BLOCK);
    xxh3_64(block) as u32
}

/// The checksums of the blocks that bytes fill, the last one with zeros behind.
pub(super) fn of_blocks(bytes: &[u8]) -> Vec<u32> {
    let (blocks, rest) = bytes.as_chunks::<BLOCK>();
    let mut checksums = blocks.par_iter().map(|block| of_block(block)).collect::<Vec<_>>();
    if !rest.is_empty() {
        let mut last = [0; BLOCK];
        last[..rest.len()].copy_from_slice(rest);
        checksums.push(of_block(&last));
    }
    checksums
}

/// The checksum of a table, whole.
pub(super) fn of_table(table: &[u8]) -> u64 {
    xxh3_64(table)
}

/// The first of a file's blocks, in the order of the ranges given, whose bytes are not those that its checksum
/// was made of. `progress` is told now and then what part (0 to 1) is behind.
///
/// Panics if a range goes beyond the blocks that have checksums.
pub(super) fn first_damaged(
    file: &[u8],
    checksums: &[u32],
    ranges: &[Range<usize>],
    progress: &(dyn Fn(f64) + Sync),
) -> Option<usize> {
    let pieces = |range: &Range<usize>| {
        let end = range.end;
        range.clone().step_by(BLOCKS_PER_TASK).map(move |first| first..end.min(first + BLOCKS_PER_TASK))
    };
    let tasks: Vec<Range<usize>> = ranges.iter().flat_map(pieces).collect();
    let done = AtomicU64::new(0);
    tasks.par_iter().find_map_first(|blocks| {
        let bytes = &file[blocks.start * BLOCK..blocks.end * BLOCK];
        let found = bytes
            .as_chunks::<BLOCK>()
            .0
            .iter()
            .zip(&checksums[blocks.clone()])
            .position(|(block, &checksum)| of_block(block) != checksum);
        progress((done.fetch_add(1, Ordering::Relaxed) + 1) as f64 / tasks.len() as f64);
        found.map(|place| blocks.start + place)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Any change of the checksum, or of XXH3, is another format.
    #[test]
    fn the_checksum_is_what_the_format_says() {
        assert_eq!(of_table(b""), 0x2d06_8005_38d3_94c2);
        assert_eq!(of_block(&[0; BLOCK]), xxh3_64(&[0; BLOCK]) as u32);
        let mut padded = [0; 2 * BLOCK];
        padded[..BLOCK + 3].fill(9);
        assert_eq!(of_blocks(&[9; BLOCK + 3]), of_blocks(&padded));
        assert!(of_blocks(&[]).is_empty());
    }

    #[test]
    fn the_first_damaged_block_is_named() {
        let mut file: Vec<u8> = (0..500 * BLOCK).map(|i| (i * 7 + i / 300) as u8).collect();
        let checksums = of_blocks(&file);
        let all = 0..500;
        let all = std::slice::from_ref(&all);
        assert_eq!(first_damaged(&file, &checksums, all, &|_| ()), None);
        for block in [499, 311, 64, 63, 0] {
            file[block * BLOCK + block % BLOCK] ^= 0x10;
            assert_eq!(first_damaged(&file, &checksums, all, &|_| ()), Some(block));
        }
        assert_eq!(first_damaged(&file, &checksums, &[65..311, 312..499], &|_| ()), None);
        assert_eq!(first_damaged(&file, &checksums, &[65..100, 300..400], &|_| ()), Some(311));
    }
}
