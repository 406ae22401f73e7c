//! The stack of lists: rays that wait at places of the tree, with their intervals there.

use super::lot::LOT;
use crate::simd::{Dense, Eight, Lanes};

/// Lines, or nodes of boxes, on a way from the root to a leaf. (A line is three levels, a node of boxes can be one.)
const LEVELS: usize = crate::kdtree::MAX_DEPTH;

/// Lists that can wait: of the eight exits of each line on a way all but one do; and room for the one that is written in vain.
pub const DEPTH: usize = (LEVELS * 7 + 2).next_power_of_two();

/// What a list may take beyond its rays: it is written by whole registers.
const SLACK: usize = 16;

/// Entries that so many rays of an octant can take: at each line on a way those of the list that was cut, and up to as many
/// at each exit.
const fn room(rays: usize) -> usize {
    LEVELS * 9 * (rays + 2 * SLACK)
}

/// Entries that can wait.
const ENTRIES: usize = (room(LOT) + 7 * room(0)).next_power_of_two();

/// Rays at a place of the tree.
#[derive(Clone, Copy)]
pub struct List {
    /// The place: an exit of a line, or a way out of a node of boxes.
    pub exit: i32,
    /// Where the list's first entry is, and how many there are.
    pub at: u32,
    pub len: u32,
}

impl List {
    /// Where eight lists begin behind this one, each with room for all of its rays.
    #[inline(always)]
    pub fn behind(&self) -> [usize; 8] {
        let (at, len) = (self.at as usize, self.len as usize);
        let stride = (len + 2 * SLACK - 1) & !(SLACK - 1);
        [1, 2, 3, 4, 5, 6, 7, 8].map(|place| at + place * stride)
    }
}

/// Lists that wait.
pub struct Heads {
    exits: [i32; DEPTH + SLACK],
    ats: [i32; DEPTH + SLACK],
    lens: [i32; DEPTH + SLACK],
    count: usize,
}

/// Their entries: a ray and its interval. What stands behind a list's last one means nothing.
///
/// A ray's number and where its interval begins are one word ([`Lanes::tag`](crate::simd::Lanes::tag)): each is written once for each box that is met,
/// at any place of a line of the cache. So a beginning, which is not negative, is rounded down to nine digits: that says somewhat later of a ray
/// that it is done, and is no matter otherwise.
///
/// Memory that was never written takes none: of what could wait, a hundredth does.
pub struct Entries {
    words: Box<[i32; ENTRIES + SLACK]>,
    tmax: Box<[f32; ENTRIES + SLACK]>,
}

impl Heads {
    /// No lists.
    pub const fn new() -> Self {
        Self { exits: [0; DEPTH + SLACK], ats: [0; DEPTH + SLACK], lens: [0; DEPTH + SLACK], count: 0 }
    }

    /// Takes the list on top.
    #[inline(always)]
    pub fn pop(&mut self) -> Option<List> {
        self.count = self.count.checked_sub(1)?;
        let place = self.count % DEPTH;
        Some(List { exit: self.exits[place], at: self.ats[place] as u32, len: self.lens[place] as u32 })
    }

    /// Puts the list that was taken back.
    #[inline(always)]
    pub fn keep(&mut self) {
        self.count += 1;
    }

    /// Where the list on top is. (If there is none, some place that a list was at.)
    #[inline(always)]
    pub fn top(&self) -> i32 {
        self.exits[self.count.wrapping_sub(1) % DEPTH]
    }

    /// Puts lists of one ray each on top, one behind the other from `at` on: a list for each lane whose bit is set.
    #[inline(always)]
    pub fn push_each<L: Eight>(&mut self, exits: L::Ids, bits: u32, at: usize) {
        let (place, room) = (self.count % DEPTH, "a register behind each");
        L::ids_compact(exits, bits, self.exits[place..].first_chunk_mut().expect(room));
        for lane in 0..8 {
            (self.ats[place + lane], self.lens[place + lane]) = ((at + lane) as i32, 1);
        }
        self.count += bits.count_ones() as usize;
    }

    /// Puts a list on top, unless it is empty.
    #[inline(always)]
    pub fn push(&mut self, exit: i32, at: usize, len: usize) {
        let place = self.count % DEPTH;
        (self.exits[place], self.ats[place], self.lens[place]) = (exit, at as i32, len as i32);
        self.count += usize::from(len != 0);
    }
}

impl Entries {
    /// None.
    pub fn new() -> Self {
        let room = "as many as asked for";
        Self {
            words: vec![0; ENTRIES + SLACK].try_into().expect(room),
            tmax: vec![0.0; ENTRIES + SLACK].try_into().expect(room),
        }
    }

    /// Writes rays of an octant from `at` on, and the ends of their intervals inside of the scene's bounds, if somebody asks for
    /// them; where the next octant's may begin.
    #[inline(always)]
    pub fn begin(&mut self, words: &[i32], tmax: Option<&[f32]>, at: usize) -> usize {
        self.words[at..][..words.len()].copy_from_slice(words);
        if let Some(tmax) = tmax {
            self.tmax[at..][..words.len()].copy_from_slice(tmax);
        }
        at + room(words.len())
    }

    /// Some rays' words, and the ends of their intervals.
    #[inline(always)]
    pub fn load<const W: usize, L: Dense<W>>(&self, at: usize) -> (&[i32; W], L) {
        (self.words(at), L::load(self.tmax[at % ENTRIES..].first_chunk().expect("a register behind each")))
    }

    /// Some rays' words.
    #[inline(always)]
    pub fn words<const W: usize>(&self, at: usize) -> &[i32; W] {
        self.words[at % ENTRIES..].first_chunk().expect("a register behind each")
    }

    /// One ray's word, and where its interval begins and ends.
    #[inline(always)]
    pub fn one(&self, at: usize) -> (i32, f32, f32) {
        let at = at % ENTRIES;
        let word = self.words[at];
        (word, f32::of_tagged(word), self.tmax[at])
    }

    /// Writes one ray's intervals whose bits are set one behind the other.
    #[inline(always)]
    pub fn write_each<L: Eight>(&mut self, at: usize, bits: u32, word: i32, tmin: L, tmax: L) {
        self.write_starts::<8, L>(at, bits, tmin.tag(L::ids(word)));
        tmax.compact(bits, self.tmax[at % ENTRIES..].first_chunk_mut().expect("a register behind each"));
    }

    /// Writes those of some rays whose bits are set one behind the other.
    #[inline(always)]
    pub fn write<const W: usize, L: Dense<W>>(&mut self, at: usize, bits: u32, words: L::Ids, tmax: L) {
        self.write_starts::<W, L>(at, bits, words);
        tmax.close_up(bits, self.tmax[at % ENTRIES..].first_chunk_mut().expect("a register behind each"));
    }

    /// The same without the ends of the intervals, for who does not ask for them.
    #[inline(always)]
    pub fn write_starts<const W: usize, L: Dense<W>>(&mut self, at: usize, bits: u32, words: L::Ids) {
        let to = self.words[at % ENTRIES..].first_chunk_mut().expect("a register behind each");
        L::close_up_ids(words, bits, to);
    }

    /// Writes one ray's word at eight places.
    #[inline(always)]
    pub fn write_one(&mut self, at: usize, word: i32) {
        *self.words[at % ENTRIES..].first_chunk_mut().expect("a register behind each") = [word; 8];
    }
}
