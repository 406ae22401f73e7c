//! Places in memory for the blocks that are here.
//!
//! As long as hardly anything has had to go, a block comes to its *home*: homes follow one another as blocks do, and whoever knows
//! a block's number knows where it lies. Homes have addresses for all of a scene, and memory for what is here.
//!
//! From when many blocks have to go, those that come have *slots* instead, as many as the budget allows, in a stretch of
//! their own; a table says which. So memory that one block has left is the next one's without a word to the system, the
//! stretch can lie in large pages, and a block may be smaller than a page of the system (a ray that hits something smaller
//! than a pixel uses a few hundred bytes of a page; such small blocks have slots from the beginning).
//!
//! ```text
//!           slots                         nowhere   homes
//!          +---+---+---+---+---+---+-----+---------+---+---+---+---+---+---+-----+
//!          | 7 | 2 |   | 9 |   |   | ... |         | 0 | 1 |   | 3 |   |   | ... |
//!          +---+---+---+---+---+---+-----+---------+---+---+---+---+---+---+-----+
//! ```
//!
//! Homes alone cost a page fault for each block that comes, and a page to give back for each that goes: 3 and 1 of some 10
//! microseconds (AMD EPYC 9004, a virtual machine, Linux 6.18). Slots alone make walks 1.05 to 1.1 times as long where all
//! that is needed is here. Where much has to go, blocks that stayed at home [move](Slots::move_in) to slots: large pages
//! make walks shorter, and a block that goes leaves a slot and not a page.
//!
//! **Who may take homes for granted.** A reader that has entered an [epoch](super::epoch) and then sees that blocks are in
//! order may do without the table until it leaves: no block comes to a slot before all readers have left that
//! were there when the order was given up. Until then, blocks go on coming to their homes.

use super::sync::{AtomicBool, AtomicU32, Mutex, MutexGuard, Ordering, PoisonError};
#[cfg(target_os = "linux")]
use memmap2::Advice;
use memmap2::{MmapOptions, MmapRaw};
use std::io;

/// The memory of all blocks that are here.
#[derive(Debug)]
pub struct Slots {
    map: MmapRaw,
    /// By block: its place, or `nowhere`.
    of: Box<[AtomicU32]>,
    /// Whether all blocks that are here are at home.
    in_order: AtomicBool,
    state: Mutex<State>,
    /// A place that is nobody's: what blocks have that are not here. Slots are before it, homes behind.
    nowhere: u32,
    homes: Homes,
    shift: u32,
}

/// Which blocks come to their homes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Homes {
    /// None.
    Never,
    /// Those that come before many have had to go.
    AtFirst,
    /// All: there is room for all.
    Always,
}

#[derive(Debug)]
struct State {
    /// Blocks that have a place.
    used: u32,
    /// Slots that were given back.
    back: Vec<u32>,
    /// From here on, slots have never been anybody's, and have no memory yet.
    next: u32,
    /// The epoch in which the order was given up, unless all readers have left that one.
    left_at: Option<u64>,
    /// Blocks before this one have moved to slots, if they were at home.
    moved: u32,
}

impl State {
    /// A slot that is free, of those before `nowhere`.
    fn slot(&mut self, nowhere: u32) -> u32 {
        self.back.pop().unwrap_or_else(|| {
            assert!(self.next < nowhere, "no more blocks come than there are slots for");
            self.next += 1;
            self.next - 1
        })
    }
}

/// A large page of most machines.
#[cfg(target_os = "linux")]
const LARGE: usize = 2 << 20;

/// Whether some bytes are no less than a page, and the system is known to take pages back.
#[cfg(target_os = "linux")]
fn are_pages(bytes: usize) -> bool {
    // SAFETY: it only asks.
    let page = unsafe { libc::sysconf(libc::_SC_PAGESIZE) };
    usize::try_from(page).is_ok_and(|page| page <= bytes)
}

#[cfg(not(target_os = "linux"))]
fn are_pages(_: usize) -> bool {
    false
}

impl Slots {
    /// Places for up to `most` of `blocks` blocks, of `1 << shift` bytes each.
    ///
    /// # Errors
    /// The system does not give the address space.
    pub fn new(blocks: usize, most: usize, shift: u32) -> io::Result<Self> {
        let homes = match most >= blocks {
            true => Homes::Always,
            false if are_pages(1 << shift) => Homes::AtFirst,
            false => Homes::Never,
        };
        let slots = if homes == Homes::Always { 0 } else { most };
        let places = slots + 1 + if homes == Homes::Never { 0 } else { blocks };
        u32::try_from(places).map_err(io::Error::other)?;
        let map = MmapRaw::from(MmapOptions::new().len(places << shift).no_reserve_swap().map_anon()?);
        #[cfg(target_os = "linux")]
        {
            // Where memory comes for one block, a large page would bring more than may be.
            let large = if homes == Homes::Always { places } else { slots } << shift;
            let advised = map.advise(Advice::NoHugePage).and(match large / LARGE * LARGE {
                0 => Ok(()),
                large => map.advise_range(Advice::HugePage, 0, large),
            });
            if let Err(error) = advised {
                // A kernel without huge pages does not know the words.
                tracing::debug!("no advice about huge pages: {error}");
            }
        }
        let nowhere = slots as u32;
        let state = State { used: 0, back: Vec::new(), next: 0, left_at: None, moved: 0 };
        Ok(Self {
            map,
            of: (0..blocks).map(|_| AtomicU32::new(nowhere)).collect(),
            in_order: AtomicBool::new(homes != Homes::Never),
            state: Mutex::new(state),
            nowhere,
            homes,
            shift,
        })
    }

    /// Memory of the table of so many blocks.
    pub const fn bytes(blocks: usize) -> usize {
        blocks * size_of::<AtomicU32>()
    }

    /// Whether all blocks that are here are [at home](Self::home), and will be for who is in an epoch.
    pub fn are_in_order(&self) -> bool {
        self.in_order.load(Ordering::SeqCst)
    }

    /// Whether there is room for all blocks, at their homes.
    pub fn hold_all(&self) -> bool {
        self.homes == Homes::Always
    }

    /// Where a byte of all blocks lies as long as they are in order.
    pub fn home(&self, byte: usize) -> *const u8 {
        self.place(self.nowhere + 1).wrapping_add(byte)
    }

    /// Where a block lies, for who has seen that it is here. Of others, what is there means nothing.
    #[inline(always)]
    pub fn at(&self, block: usize) -> *const u8 {
        // Whoever saw that the block is here has synchronized with who brought it; but not with who has moved it since.
        self.place(self.of[block].load(Ordering::Acquire))
    }

    /// The first byte of a place.
    #[inline(always)]
    fn place(&self, place: u32) -> *mut u8 {
        self.map.as_mut_ptr().wrapping_add((place as usize) << self.shift)
    }

    /// Whether a block has a place: it is here, or was given up and nobody has its place yet.
    pub fn has(&self, block: u32) -> bool {
        self.of[block as usize].load(Ordering::Relaxed) != self.nowhere
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Gives a block a place with these bytes, and whatever was there behind them. `earliest` says which epoch is the
    /// [earliest](super::epoch::Epochs::earliest) that a reader may be in. Panics if no place is free, the block has
    /// one, or there are too many bytes.
    ///
    /// # Safety
    /// Nobody else does the same for this block at the same time.
    pub unsafe fn put(&self, block: u32, bytes: &[u8], earliest: impl FnOnce() -> u64) {
        let of = &self.of[block as usize];
        assert!(of.load(Ordering::Relaxed) == self.nowhere && bytes.len() <= 1 << self.shift);
        let place = self.take(block, earliest);
        // SAFETY: it lies inside of the mapping, and nobody reads or writes it: it is the block's alone, or was free.
        unsafe { self.place(place).copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        of.store(place, Ordering::Release);
    }

    fn take(&self, block: u32, earliest: impl FnOnce() -> u64) -> u32 {
        let mut state = self.state();
        state.used += 1;
        if self.is_relied_on(&mut state, earliest) {
            return self.nowhere + 1 + block;
        }
        state.slot(self.nowhere)
    }

    /// Whether somebody may look for blocks at their homes without looking at the table.
    fn is_relied_on(&self, state: &mut State, earliest: impl FnOnce() -> u64) -> bool {
        // A reader may still be there that was when the order was given up, and knows nothing of it.
        let is_relied_on = self.are_in_order() || state.left_at.is_some_and(|left| earliest() <= left);
        if !is_relied_on {
            state.left_at = None;
        }
        is_relied_on
    }

    /// Moves up to `most` blocks from their homes to slots, if nobody relies on the order any more, and says which. Their
    /// homes are as they were, for who has looked the blocks up already, until [left](Self::leave_homes).
    ///
    /// # Safety
    /// Meanwhile nobody [gives back](Self::give_back) any block.
    pub unsafe fn move_in(&self, most: usize, earliest: impl FnOnce() -> u64) -> Vec<u32> {
        let (mut state, mut moved) = (self.state(), Vec::new());
        if self.homes != Homes::AtFirst || self.is_relied_on(&mut state, earliest) {
            return moved;
        }
        while moved.len() < most && (state.moved as usize) < self.of.len() {
            let block = state.moved;
            state.moved += 1;
            let of = &self.of[block as usize];
            let home = of.load(Ordering::Acquire);
            if home > self.nowhere {
                let slot = state.slot(self.nowhere);
                // SAFETY: both lie inside of the mapping, which knows no overlaps; the slot is nobody else's, and nobody
                // writes to a block that is here.
                unsafe { self.place(slot).copy_from_nonoverlapping(self.place(home), 1 << self.shift) };
                of.store(slot, Ordering::Release);
                moved.push(block);
            }
        }
        moved
    }

    /// Gives the memory of homes back whose blocks have moved. They are in ascending order.
    ///
    /// # Safety
    /// Nobody has a reference into them.
    pub unsafe fn leave_homes(&self, blocks: &[u32]) {
        for run in blocks.chunk_by(|&block, &next| block + 1 == next) {
            let home = (self.nowhere + 1 + run[0]) as usize;
            // SAFETY: nobody has a reference into it.
            unsafe { self.empty(home << self.shift, run.len() << self.shift) };
        }
    }

    /// Gives up the order, where there is one and it is not for ever; `retire` [ends the epoch](
    /// super::epoch::Epochs::retire).
    pub fn leave_order(&self, retire: impl FnOnce() -> u64) {
        if self.homes == Homes::AtFirst && self.are_in_order() {
            let mut state = self.state();
            if self.are_in_order() {
                self.in_order.store(false, Ordering::SeqCst);
                state.left_at = Some(retire());
            }
        }
    }

    /// Takes the places of blocks back. Panics if one has none.
    ///
    /// # Safety
    /// Nobody has a reference into them, or looks for one.
    pub unsafe fn give_back(&self, blocks: &[u32]) {
        let mut state = self.state();
        for &block in blocks {
            let place = self.of[block as usize].swap(self.nowhere, Ordering::Relaxed);
            assert!(place != self.nowhere, "it is here");
            if cfg!(debug_assertions) {
                // Whoever keeps a reference beyond its end is to see that at once.
                // SAFETY: inside of the mapping, and nobody has a reference.
                unsafe { self.place(place).write_bytes(0xff, 1 << self.shift) };
            }
            state.used -= 1;
            if place < self.nowhere {
                state.back.push(place);
            } else if self.homes == Homes::AtFirst {
                // SAFETY: nobody has a reference into it.
                unsafe { self.empty((place as usize) << self.shift, 1 << self.shift) };
            }
        }
    }

    /// Where no block has a place, blocks come to their homes again. No home may wait to be [left](Self::leave_homes).
    pub fn begin_anew(&self) {
        let mut state = self.state();
        if state.used == 0 && self.homes == Homes::AtFirst {
            // SAFETY: there are no blocks to have references into.
            unsafe { self.empty(0, (self.nowhere as usize) << self.shift) };
            *state = State { used: 0, back: Vec::new(), next: 0, left_at: None, moved: 0 };
            self.in_order.store(true, Ordering::SeqCst);
        }
    }

    /// Gives memory back to the system; it reads as zeros afterwards.
    ///
    /// # Safety
    /// Nobody has a reference into it. It is whole pages.
    unsafe fn empty(&self, byte: usize, len: usize) {
        #[cfg(target_os = "linux")]
        // SAFETY: the mapping is private and anonymous, and nobody has a reference.
        unsafe { self.map.unchecked_advise_range(memmap2::UncheckedAdvice::DontNeed, byte, len) }
            .expect("the mapping takes this advice");
        #[cfg(not(target_os = "linux"))]
        unreachable!("{byte} and {len} bytes more are no pages here");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(slots: &Slots, block: usize) -> [u8; 2] {
        // SAFETY: every place has memory behind it, and nobody writes meanwhile.
        unsafe { *slots.at(block).cast() }
    }

    fn put(slots: &Slots, block: u32, byte: u8, earliest: u64) {
        // SAFETY: nobody else knows of the slots.
        unsafe { slots.put(block, &[byte; 512], || earliest) };
    }

    fn give_back(slots: &Slots, blocks: &[u32]) {
        // SAFETY: nobody keeps a reference.
        unsafe { slots.give_back(blocks) };
    }

    fn is_at_home(slots: &Slots, block: usize) -> bool {
        slots.at(block) == slots.home(block << slots.shift)
    }

    #[test]
    fn a_slot_is_one_block_s_at_a_time() {
        const LAST: u32 = (1 << 20) - 1;
        let slots = Slots::new(1 << 20, 3, 9).expect("addresses are free");
        assert!(!slots.are_in_order(), "no page is so small");
        for (block, byte) in [(0, 1), (1, 2), (LAST, 3)] {
            assert!(!slots.has(block));
            put(&slots, block, byte, 0);
            assert!(slots.has(block));
        }
        assert_eq!([0, 1, LAST].map(|block| read(&slots, block as usize)), [[1; 2], [2; 2], [3; 2]]);
        give_back(&slots, &[1, 0]);
        assert_eq!([0, 1, LAST].map(|block| slots.has(block)), [false, false, true]);
        put(&slots, 7, 4, 0);
        put(&slots, 1, 5, 0);
        assert_eq!([7, 1, LAST].map(|block| read(&slots, block as usize)), [[4; 2], [5; 2], [3; 2]]);
        assert_eq!([slots.at(0), slots.at(2)], [slots.place(slots.nowhere).cast_const(); 2]);
        assert!([7, 1].iter().all(|&block| slots.place(slots.nowhere).cast_const() != slots.at(block)));
    }

    #[test]
    fn where_there_is_room_for_all_they_stay_in_order() {
        let slots = Slots::new(10, 10, 9).expect("addresses are free");
        [7, 0, 9].into_iter().for_each(|block| put(&slots, block, block as u8, 0));
        slots.leave_order(|| unreachable!("it is for ever"));
        give_back(&slots, &[7]);
        put(&slots, 7, 1, 0);
        assert!(slots.are_in_order() && [7, 0, 9].into_iter().all(|block| is_at_home(&slots, block)));
        assert_eq!([7, 9].map(|block| read(&slots, block)), [[1; 2], [9; 2]]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn who_relies_on_the_order_is_waited_for() {
        let slots = Slots::new(100, 5, 16).expect("addresses are free");
        [70, 71].into_iter().for_each(|block| put(&slots, block, block as u8, 0));
        assert!(slots.are_in_order() && is_at_home(&slots, 70) && is_at_home(&slots, 71));
        slots.leave_order(|| 5);
        slots.leave_order(|| unreachable!("it has been left"));
        assert!(!slots.are_in_order());
        // A reader may still be there that knows nothing of it.
        put(&slots, 72, 72, 5);
        assert!(is_at_home(&slots, 72));
        put(&slots, 73, 73, 6);
        put(&slots, 74, 74, 0);
        assert!(!is_at_home(&slots, 73) && !is_at_home(&slots, 74));
        assert_eq!([70, 72, 73, 74].map(|block| read(&slots, block)), [[70; 2], [72; 2], [73; 2], [74; 2]]);
        give_back(&slots, &[70, 73]);
        put(&slots, 70, 1, 0);
        assert!(!is_at_home(&slots, 70) && read(&slots, 70) == [1; 2]);
        slots.begin_anew();
        assert!(!slots.are_in_order(), "some are here");
        give_back(&slots, &[70, 71, 72, 74]);
        slots.begin_anew();
        put(&slots, 70, 2, 0);
        assert!(slots.are_in_order() && is_at_home(&slots, 70) && read(&slots, 70) == [2; 2]);
        assert_eq!(read(&slots, 71), [0; 2]);
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn blocks_move_when_nobody_relies_on_the_order_any_more() {
        // SAFETY: nobody gives anything back meanwhile.
        let move_in = |slots: &Slots, most, earliest| unsafe { slots.move_in(most, || earliest) };
        let slots = Slots::new(100, 6, 16).expect("addresses are free");
        [3, 4, 5, 90].into_iter().for_each(|block| put(&slots, block, block as u8, 0));
        assert!(move_in(&slots, 10, 9).is_empty(), "they are in order");
        slots.leave_order(|| 5);
        assert!(move_in(&slots, 10, 5).is_empty(), "somebody may not know yet");
        let homes = [3, 4, 5, 90].map(|block| slots.at(block));
        assert_eq!(move_in(&slots, 2, 6), [3, 4]);
        put(&slots, 50, 50, 6);
        assert_eq!(
            [3, 4, 5, 50, 90].map(|block| is_at_home(&slots, block)),
            [false, false, true, false, true]
        );
        assert_eq!(
            [3, 4, 5, 50, 90].map(|block| read(&slots, block)),
            [[3; 2], [4; 2], [5; 2], [50; 2], [90; 2]]
        );
        // SAFETY: homes have memory behind them for who has not left yet.
        assert_eq!(homes.map(|home| unsafe { *home }), [3, 4, 5, 90]);
        // SAFETY: nobody has a reference.
        unsafe { slots.leave_homes(&[3, 4]) };
        // SAFETY: as before.
        assert_eq!(homes.map(|home| unsafe { *home }), [0, 0, 5, 90]);
        assert_eq!(move_in(&slots, 10, 6), [5, 90]);
        assert!(move_in(&slots, 10, 6).is_empty(), "all have moved");
        // SAFETY: nobody has a reference.
        unsafe { slots.leave_homes(&[5, 90]) };
        give_back(&slots, &[3, 4, 5, 50, 90]);
        slots.begin_anew();
        put(&slots, 90, 1, 0);
        assert!(is_at_home(&slots, 90) && read(&slots, 90) == [1; 2]);
        slots.leave_order(|| 7);
        assert_eq!(move_in(&slots, 10, 8), [90], "the table is gone through anew");
    }

    #[test]
    #[should_panic(expected = "no more blocks come")]
    fn there_are_no_more_than_that() {
        let slots = Slots::new(10, 2, 9).expect("addresses are free");
        (0..3).for_each(|block| put(&slots, block, 1, 0));
    }
}
