//! Rays of a list in a pool.
//!
//! What meets is not the triangles' records but what the pool says of them: a ray by itself meets a chunk's triangles at once, as
//! in a [stream](crate::traverse::pool); of a longer list, each vertex is seen by as many rays as a register holds, and each
//! triangle is put together of what was seen. What may be hit goes to the lot's [`Candidates`].

use super::candidates::Candidates;
use super::cut::present;
use super::ground::Chunks;
use super::lists::{Entries, List};
use super::lot::Lot;
use crate::geometry::triangle::Mode;
use crate::geometry::triangle::pooled::{Listed, Prospects};
use crate::kdtree::Chunk;
use crate::simd::{Dense, Mask, Sixteen};
use crate::traverse::closest::NONE;
use crate::traverse::pool::ways::{Finder, look};

/// Vertices of a chunk as rays see them: two coordinates, and the depth.
#[repr(C, align(64))]
pub struct Seen([[[f32; 16]; 3]; crate::kdtree::MOST]);

impl Seen {
    /// Nothing.
    pub const NOTHING: Self = Self([[[0.0; 16]; 3]; crate::kdtree::MOST]);

    /// Has rays see a chunk's vertices.
    #[inline(always)]
    fn see<const W: usize, L: Dense<W>>(&mut self, rays: &Listed<W, L>, chunk: Chunk<'_>) {
        let rows = [chunk.row(0), chunk.row(1), chunk.row(2)];
        for (vertex, seen) in self.0.iter_mut().enumerate().take(chunk.vertices()) {
            let [x, y, depth] = rays.see(&[rows[0][vertex], rows[1][vertex], rows[2][vertex]]);
            let (room, [to_x, to_y, to_depth]) = ("a row holds a register", seen);
            *to_x.first_chunk_mut().expect(room) = x.store();
            *to_y.first_chunk_mut().expect(room) = y.store();
            *to_depth.first_chunk_mut().expect(room) = depth.store();
        }
    }

    /// The corners of a triangle: numbers of its vertices in four bits each.
    #[inline(always)]
    fn corners<const W: usize, L: Dense<W>>(&self, numbers: u16) -> [[L; 3]; 3] {
        let corner = |shift: u16| &self.0[usize::from(numbers >> shift & 15)];
        let [a, b, c] = [corner(0), corner(4), corner(8)];
        [
            [of_row(&a[0]), of_row(&a[1]), of_row(&a[2])],
            [of_row(&b[0]), of_row(&b[1]), of_row(&b[2])],
            [of_row(&c[0]), of_row(&c[1]), of_row(&c[2])],
        ]
    }
}

/// As many of a row's numbers as a register holds.
#[inline(always)]
fn of_row<const W: usize, L: Dense<W>>(row: &[f32; 16]) -> L {
    L::load(row.first_chunk().expect("a row holds a register"))
}

/// Has the ray of an entry meet a pool's triangles. With `ANY`, it is done when it hits one for certain.
#[inline(always)]
pub fn meet_one<L: Sixteen, M: Mode, const ANY: bool>(
    lot: &mut Lot,
    entries: &Entries,
    at: usize,
    chunks: Chunks<'_>,
    candidates: &mut Candidates,
) {
    let (id, tmin, _) = entries.one(at);
    let (pooled, [tnear, before]) = lot.pooled(id);
    // (What is done ends before anything.)
    if before < if ANY { tnear } else { tmin } {
        return;
    }
    let mut one = One::<ANY> { id, closest: before, is_done: false, candidates };
    for chunk in chunks {
        look::<L, M, false>(&pooled, chunk, tnear, &mut one);
        if ANY && one.is_done {
            lot.end(id);
            return;
        }
    }
    // What was found beyond does not count any more.
    if !ANY && one.closest < before {
        lot.keep_one(id, one.closest, NONE);
    }
}

/// A ray of a list by itself.
struct One<'a, const ANY: bool> {
    id: i32,
    /// What a hit must not lie beyond.
    closest: f32,
    /// Whether it hits something for certain, and that is enough.
    is_done: bool,
    candidates: &'a mut Candidates,
}

impl<const ANY: bool> Finder for One<'_, ANY> {
    #[inline(always)]
    fn tfar(&self) -> f32 {
        self.closest
    }

    #[inline(always)]
    fn take<const W: usize, L: Dense<W>>(&mut self, found: Prospects<W, L>, ids: &[i32; W]) {
        let Prospects { possible, certain, first, last } = found;
        if ANY {
            self.is_done |= certain.any();
        } else {
            self.closest = L::select(certain, last, L::splat(self.closest)).least();
        }
        if !self.is_done {
            self.candidates.add::<W, L>(possible.bits(), L::ids(self.id), L::ids_of(ids), first);
        }
    }
}

/// Has the rays of a list meet a pool's triangles, likewise.
#[inline(always)]
pub fn meet<const W: usize, L: Dense<W>, M: Mode, const ANY: bool>(
    lot: &mut Lot,
    entries: &Entries,
    list: &List,
    chunks: Chunks<'_>,
    candidates: &mut Candidates,
    seen: &mut Seen,
) {
    let (at, len) = (list.at as usize, list.len as usize);
    for done in (0..len).step_by(W) {
        let ids = entries.words::<W>(at + done);
        let (rays, [tnear, before]) = lot.listed::<W, L>(ids);
        let tmin = if ANY { tnear } else { L::of_tagged(L::ids_of(ids)) };
        let mut live = tmin.le(before).bits() & present((len - done).min(W));
        if live == 0 {
            continue;
        }
        let (mut closest, mut changed) = (before, 0);
        for chunk in chunks.clone() {
            seen.see(&rays, chunk);

            // Which triangles a ray may hit, without a branch on it.
            let (mut left, lanes) = (0, L::mask_from_bits(live));
            let triangles = chunk.corners().iter().enumerate().take(chunk.count());
            for (i, &numbers) in triangles {
                let meets = if M::SIGNS {
                    rays.sift::<true>(&seen.corners(numbers))
                } else {
                    rays.sift::<false>(&seen.corners(numbers))
                };
                left |= u32::from((meets & lanes).any()) << i;
            }

            // Where.
            while left != 0 {
                let triangle = left.trailing_zeros() as usize % 16;
                left &= left - 1;
                let corners = seen.corners(chunk.corners()[triangle]);
                let Prospects { possible, certain, first, last } = if M::SIGNS {
                    rays.prospects::<true>(&corners, tnear, closest)
                } else {
                    rays.prospects::<false>(&corners, tnear, closest)
                };
                let (mut possible, certain) = (possible.bits() & live, certain.bits() & live);
                if ANY {
                    live &= !certain;
                    changed |= certain;
                    possible &= !certain;
                } else {
                    let nearer = L::mask_from_bits(certain) & last.lt(closest);
                    closest = L::select(nearer, last, closest);
                    changed |= nearer.bits();
                }
                candidates.add(possible, L::ids_of(ids), L::ids(chunk.ids()[triangle]), first);
            }
            if ANY && live == 0 {
                break;
            }
        }
        if ANY {
            while changed != 0 {
                lot.end(ids[changed.trailing_zeros() as usize % W]);
                changed &= changed - 1;
            }
        } else if changed != 0 {
            let closest = closest.store();
            lot.keep_each(ids, changed, |lane| (closest[lane], NONE));
        }
    }
}
