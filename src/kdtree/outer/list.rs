//! A large node's references, on a shelf.

use super::{Job, PIECE, Shelf, Triangles};
use crate::error::Result;
use crate::geometry::triangle::{Corners, Triangle};
use crate::kdtree::build::Context;
use crate::kdtree::build::Reference;
use crate::kdtree::build::large::{CHUNK, Gather, whole};
use crate::kdtree::build::partition::{Divider, Lookup};
use crate::kdtree::sah::Split;
use crate::spool::scattered;
use bytemuck::Zeroable;
use rayon::prelude::*;
use std::ops::Range;

/// References with ascending primitive ids, piece after piece.
#[derive(Debug, Default)]
pub struct List(Vec<Piece>);

/// Some references, at most [`CHUNK`].
#[derive(Clone, Debug)]
enum Piece {
    /// Those of whole triangles, made of them whenever they are wanted.
    Whole(Range<usize>),
    /// So many at a place of the shelf.
    Shelved(usize, usize),
}

/// Pieces that are divided side by side, for each thread.
const AT_ONCE: usize = 4;

/// What passes over lists keep in memory: for each piece on its way its triangles, its references, and those
/// below the plane.
pub fn passes_bytes() -> usize {
    let each = CHUNK * (size_of::<Triangle>() + 3 * size_of::<Reference>());
    AT_ONCE * rayon::current_num_threads() * each
}

impl Piece {
    fn count(&self) -> usize {
        match self {
            Self::Whole(triangles) => triangles.len(),
            Self::Shelved(_, count) => *count,
        }
    }

    fn load(&self, job: &Job<'_>) -> Result<Vec<Reference>> {
        match self {
            Self::Whole(range) => {
                let mut triangles = vec![Triangle::zeroed(); range.len()];
                job.triangles.read(range.start, &mut triangles)?;
                Ok(whole(range.start as u32, &triangles).collect())
            }
            Self::Shelved(place, count) => {
                let mut references = vec![Reference::NONE; *count];
                job.shelf.get(*place, bytemuck::cast_slice_mut(&mut references))?;
                Ok(references)
            }
        }
    }

    fn clear(&self, shelf: &dyn Shelf) {
        if let Self::Shelved(place, _) = self {
            shelf.clear(*place);
        }
    }
}

impl List {
    /// The references of all triangles.
    pub fn of_triangles(count: usize) -> Self {
        Self((0..count).step_by(CHUNK).map(|first| Piece::Whole(first..count.min(first + CHUNK))).collect())
    }

    /// How many references there are.
    pub fn count(&self) -> usize {
        self.0.iter().map(Piece::count).sum()
    }

    /// Both, one behind the other.
    pub fn and(mut self, other: Self) -> Self {
        self.0.extend(other.0);
        self
    }

    /// To be shown to all threads.
    pub fn on<'a>(&'a self, job: &'a Job<'a>) -> OnShelf<'a> {
        OnShelf { list: self, job }
    }

    /// Takes all into memory; it stays on the shelf.
    pub fn load(&self, job: &Job<'_>) -> Result<Vec<Vec<Reference>>> {
        self.0.par_iter().map(|piece| piece.load(job)).collect()
    }

    /// Takes all off the shelf.
    pub fn clear(self, job: &Job<'_>) {
        self.0.iter().for_each(|piece| piece.clear(job.shelf));
    }

    /// The primitive ids, off the shelf.
    pub fn primitives(self, job: &Job<'_>) -> Result<Vec<u32>> {
        let mut primitives = Vec::with_capacity(self.count());
        for piece in &self.0 {
            primitives.extend(piece.load(job)?.iter().map(Reference::primitive));
            piece.clear(job.shelf);
        }
        Ok(primitives)
    }

    /// The references below a plane and above; see [`Divider::divide`].
    pub fn divide(self, job: &Job<'_>, context: &Context<'_>, split: &Split) -> Result<[Self; 2]> {
        let mut sides: [Side; 2] = Default::default();
        for pieces in self.0.chunks(AT_ONCE * rayon::current_num_threads()) {
            let divide = |divider: &mut Divider, piece: &Piece| {
                let mut references = piece.load(job)?;
                let cut = Cut::new(job, &references, split)?;
                let clips = context.params.perfect;
                let below = divider.divide(context.isa, &mut references, 0, &cut, split, clips).to_vec();
                piece.clear(job.shelf);
                Ok([below, references])
            };
            let divided: Vec<[Vec<Reference>; 2]> =
                pieces.par_iter().map_init(Divider::default, divide).collect::<Result<_>>()?;
            for parts in divided {
                for (side, part) in sides.iter_mut().zip(parts) {
                    side.add(&part, job.shelf)?;
                }
            }
        }
        let [below, above] = sides;
        Ok([below.finish(job.shelf)?, above.finish(job.shelf)?])
    }
}

/// A list, and where its references are.
pub struct OnShelf<'a> {
    list: &'a List,
    job: &'a Job<'a>,
}

impl Gather for OnShelf<'_> {
    type Error = crate::error::Error;

    fn gather<T: Send>(
        &self,
        empty: impl Fn() -> T + Sync + Send,
        add: impl Fn(T, &[Reference]) -> T + Sync + Send,
        join: impl Fn(T, T) -> T + Sync + Send,
    ) -> Result<T> {
        let add = |value: T, piece: &Piece| Ok(add(value, &piece.load(self.job)?));
        self.list.0.par_iter().try_fold(&empty, add).try_reduce(&empty, |a, b| Ok(join(a, b)))
    }
}

/// One side of a plane, on its way to the shelf.
#[derive(Default)]
struct Side {
    list: List,
    /// Fewer than [`CHUNK`] that are not on the shelf yet.
    last: Vec<Reference>,
}

impl Side {
    fn add(&mut self, mut part: &[Reference], shelf: &dyn Shelf) -> Result<()> {
        while self.last.len() + part.len() >= CHUNK {
            let (full, rest) = part.split_at(CHUNK - self.last.len());
            self.last.extend_from_slice(full);
            self.put(shelf)?;
            part = rest;
        }
        self.last.extend_from_slice(part);
        Ok(())
    }

    fn put(&mut self, shelf: &dyn Shelf) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(&self.last);
        debug_assert!(bytes.len() <= PIECE);
        self.list.0.push(Piece::Shelved(shelf.put(bytes)?, self.last.len()));
        self.last.clear();
        Ok(())
    }

    fn finish(mut self, shelf: &dyn Shelf) -> Result<List> {
        if !self.last.is_empty() {
            self.put(shelf)?;
        }
        Ok(self.list)
    }
}

/// The triangles that a plane cuts.
struct Cut {
    primitives: Vec<u32>,
    triangles: Vec<Triangle>,
}

impl Cut {
    fn new(job: &Job<'_>, references: &[Reference], split: &Split) -> Result<Self> {
        let (axis, position) = (split.axis, split.position);
        let crosses = |part: &&Reference| !(part.max(axis) <= position || part.min(axis) >= position);
        let primitives: Vec<u32> = references.iter().filter(crosses).map(Reference::primitive).collect();
        let triangles = read_scattered(job.triangles, &primitives)?;
        Ok(Self { primitives, triangles })
    }
}

impl Lookup for Cut {
    fn corners(&self, primitive: u32) -> &Corners {
        let place = self.primitives.binary_search(&primitive).expect("the plane cuts it");
        &self.triangles[place].corners
    }
}

/// The triangles of some primitives, which ascend.
pub fn read_scattered(triangles: &dyn Triangles, primitives: &[u32]) -> Result<Vec<Triangle>> {
    scattered(primitives, |first, into| triangles.read(first, into))
}
