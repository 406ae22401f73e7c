//! Building a tree of more triangles than memory holds.
//!
//! The tree is, node for node, the one that [`KdTree::build`](super::KdTree::build) makes in memory, and its
//! arrays are the same to the byte: the top is split by the same passes over the same references, which wait
//! in files meanwhile, and what fits into memory is built there by the very same code. (A coarse top from a
//! histogram of the scene, as Wald, Dietrich & Slusallek 2004 and most out-of-core builders have it, saves
//! passes and costs quality. The passes are cheap: the power plant within 256 MiB takes 6.6 s from model to file,
//! and 6.8 s in memory.)
//!
//! One rule of the builder in memory has no place here: there, a large node whose triangles have been cut into more
//! than twice its share of references is built by one thread, so that the announced memory holds. Here it goes
//! on being split from files, and below such a node the trees may differ.
//!
//! ```text
//!        o            top: split from files, pass by pass (`list`), depth first
//!       / \
//!      o   o          references of a part wait on the shelf until it is its turn
//!     / \  |
//!    #  #  #          parts that fit: built in memory, packed, appended to the arrays (`part`)
//! ```
//!
//! Parts come in the order of a depth-first walk, which is the order of every array, so that each array only
//! grows; what a part cannot know (its parents' places) is patched at the end. Lines alone have another order
//! and cross from the top into the parts: `crown` says how these are put together.

mod crown;
mod list;
mod part;
mod sizes;

use super::build::{Context, Place, Verdict, budget_of, large};
use super::lines::{AFTER, MAX_LINE, MAX_RECORD};
use super::memory::Ledger;
use super::node::{MAX_INDEX, Node};
use super::spread::Spread;
use super::stats::{Bytes, Tally};
use super::{BuildParams, BuildProgress, Line, TreeStats};
use crate::error::{Error, Result};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::simd::Chosen;
use crate::stage::Stage;
pub use crown::Plan;
use crown::Top;
use list::List;
use sizes::Sizes;

/// All triangles, in the tree's coordinates, wherever they are. Their ids count from 0.
pub trait Triangles: Sync {
    /// How many there are.
    fn count(&self) -> usize;

    /// Reads those from `first` on.
    ///
    /// # Errors
    /// They cannot be read.
    fn read(&self, first: usize, into: &mut [Triangle]) -> Result<()>;
}

/// Where references wait that are not in memory: pieces of at most [`PIECE`] bytes.
pub trait Shelf: Sync {
    /// Puts a piece away, and says where.
    ///
    /// # Errors
    /// There is no room.
    fn put(&self, piece: &[u8]) -> Result<usize>;

    /// Reads the first bytes of a piece.
    ///
    /// # Errors
    /// They cannot be read.
    fn get(&self, place: usize, into: &mut [u8]) -> Result<()>;

    /// Clears a place, so that something else can be put there.
    fn clear(&self, place: usize);
}

/// The most bytes of a piece on a [`Shelf`].
pub const PIECE: usize = large::CHUNK * size_of::<super::build::Reference>();

/// An array of a tree that grows while the tree is built: see [`Arrays`](super::Arrays).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Array {
    /// Nodes.
    Nodes,
    /// The leaves' records.
    References,
    /// The nodes above the pages.
    Upper,
    /// The places of the upper nodes among the nodes.
    Beneath,
    /// The pages' primitive ids.
    Pages,
    /// Lines, part by part, to be ordered by the [`Plan`].
    Lines,
}

impl Array {
    /// All of them; an array's place here is its number.
    pub const ALL: [Self; 6] =
        [Self::Nodes, Self::References, Self::Upper, Self::Beneath, Self::Pages, Self::Lines];
}

/// What takes the arrays.
pub trait Output {
    /// Adds to an array's end.
    ///
    /// # Errors
    /// There is no room.
    fn append(&mut self, array: Array, bytes: &[u8]) -> Result<()>;

    /// Writes over what an array has at a place, in bytes from its beginning.
    ///
    /// # Errors
    /// It cannot be written.
    fn patch(&mut self, array: Array, at: usize, bytes: &[u8]) -> Result<()>;
}

/// What is to be built, of what, and within what.
pub struct Job<'a> {
    /// The triangles.
    pub triangles: &'a dyn Triangles,
    /// The box around them, in the tree's coordinates.
    pub bounds: Aabb,
    /// The settings.
    pub params: &'a BuildParams,
    /// What the build may take, in bytes.
    pub memory: usize,
    /// Where references wait.
    pub shelf: &'a dyn Shelf,
    /// To be read from another thread.
    pub progress: Option<&'a BuildProgress>,
}

/// What is known about a tree whose arrays went to an [`Output`].
#[derive(Debug)]
pub struct Outline {
    /// What [`KdTree::stats`](super::KdTree::stats) would say.
    pub stats: TreeStats,
    /// The most triangles in a page.
    pub largest_page: usize,
    /// What [`KdTree::spread`](super::KdTree::spread) would say.
    pub spread: Spread,
    /// The most bytes that the build's arrays held.
    pub peak: usize,
    /// How the lines are to be ordered.
    pub plan: Plan,
    /// How many parts were built in memory.
    pub parts: usize,
    /// How many were begun that did not fit.
    pub given_up: usize,
}

/// A part's triangles go by their places in it: what each takes to be called by its own id again.
const NAME: usize = size_of::<u32>();

/// The fewest references that are built in memory.
const LEAST_PART: usize = 4 * large::CHUNK;

impl BuildParams {
    /// How large parts that are built in so many bytes may be.
    ///
    /// # Errors
    /// The least memory that does, if that is more.
    fn parts_in(&self, memory: usize) -> Result<Sizes, usize> {
        let fixed = self.peak_bytes(0) + list::passes_bytes();
        let each = (self.peak_bytes(1 << 20) - self.peak_bytes(0)).div_ceil(1 << 20) + NAME;
        let memory = memory.saturating_sub(fixed);
        let sure = memory / each;
        if sure < LEAST_PART {
            Err(fixed + LEAST_PART * each)
        } else {
            Ok(Sizes::new(sure.max(4 * self.page), memory))
        }
    }

    /// The least memory that [`build`] takes.
    pub fn least_outer_bytes(&self) -> usize {
        self.parts_in(0).expect_err("nothing fits into nothing")
    }
}

/// Builds the tree of a [`Job`] into `output`.
///
/// # Errors
/// The memory does not do, the tree would be too large to address, or something cannot be read or written.
pub fn build(job: &Job<'_>, output: &mut dyn Output) -> Result<Outline> {
    let sizes = job.params.parts_in(job.memory).map_err(|least| {
        Error::Mesh(format!("building its tree takes {least} bytes at least, not {}", job.memory))
    })?;
    in_parts(job, sizes, output)
}

/// The same in parts that are no larger than these.
fn in_parts(job: &Job<'_>, sizes: Sizes, output: &mut dyn Output) -> Result<Outline> {
    let count = job.triangles.count();
    let budget = budget_of(count, job.params).min(MAX_RECORD);
    let place = Place::of_root(job.bounds, count, budget);
    let mut builder = Builder {
        job,
        output,
        sizes,
        depth_limit: job.params.depth_limit(count),
        ledger: Ledger::default(),
        lengths: [0; Array::ALL.len()],
        patches: Vec::new(),
        tally: Tally::new(&job.bounds),
        largest_page: 0,
        spread: Spread::default(),
        pieces: Vec::new(),
        parts: 0,
        given_up: 0,
    };
    let root = builder.pair()?;
    let top = builder.node(List::of_triangles(count), place, root.first())?;
    builder.finish(top)
}

/// A build under way.
struct Builder<'a> {
    job: &'a Job<'a>,
    output: &'a mut dyn Output,
    /// What is built in memory.
    sizes: Sizes,
    depth_limit: usize,
    ledger: Ledger,
    /// How many elements each array has.
    lengths: [usize; Array::ALL.len()],
    /// What is to stand at places that were left free.
    patches: Vec<Patch>,
    tally: Tally,
    largest_page: usize,
    spread: Spread,
    /// How many lines each piece of them has, in the order in which they were appended.
    pieces: Vec<usize>,
    parts: usize,
    given_up: usize,
}

/// Places of a node in the full tree and in the upper one.
#[derive(Clone, Copy)]
struct Places {
    node: usize,
    upper: usize,
}

/// Places of two siblings.
struct Pair(Places);

impl Pair {
    fn first(&self) -> Places {
        self.0
    }

    fn second(&self) -> Places {
        Places { node: self.0.node + 1, upper: self.0.upper + 1 }
    }
}

/// What a node turned out to be in both trees.
struct Patch {
    places: Places,
    node: Node,
    upper: Node,
}

impl Builder<'_> {
    fn length(&self, array: Array) -> usize {
        self.lengths[array as usize]
    }

    fn append<T: bytemuck::NoUninit>(&mut self, array: Array, values: &[T]) -> Result<()> {
        self.lengths[array as usize] += values.len();
        let [nodes, references, upper] =
            [Array::Nodes, Array::References, Array::Upper].map(|array| self.length(array));
        if nodes.max(upper) > MAX_INDEX || references > MAX_RECORD {
            return Err(too_large());
        }
        self.output.append(array, bytemuck::cast_slice(values))
    }

    /// Leaves places free for two nodes.
    fn pair(&mut self) -> Result<Pair> {
        let places = Places { node: self.length(Array::Nodes), upper: self.length(Array::Upper) };
        self.append(Array::Nodes, &[Node::leaf(0, 0); 2])?;
        self.append(Array::Upper, &[Node::leaf(0, 0); 2])?;
        self.append(Array::Beneath, &[0_u32; 2])?;
        Ok(Pair(places))
    }

    /// Builds a node and all that is below it.
    fn node(&mut self, list: List, place: Place, places: Places) -> Result<Top> {
        let count = list.count();
        let is_sure = count <= self.sizes.sure;
        if (is_sure || self.sizes.may_fit(count, place.budget))
            && let Some(part) = self.part(&list, place, places, is_sure)?
        {
            list.clear(self.job);
            return Ok(part);
        }
        let params = self.job.params;
        let context = Context {
            params,
            triangles: &[],
            depth_limit: self.depth_limit,
            isa: Chosen::best(),
            ledger: &self.ledger,
            progress: self.job.progress,
        };
        // As a large node in memory: see `large::build`.
        let split = match context.may_split(count, &place) {
            Some(costs) => large::best_split(context.isa, params, &list.on(self.job), count, &costs)?
                .filter(|split| split.cost < costs.leaf(count)),
            None => None,
        };
        let Some(split) = split else { return self.leaf(list, place, places) };
        Stage::Splitting.begin();
        let [below, above] = list.divide(self.job, &context, &split)?;
        let counts = [below.count(), above.count()];
        let Some([place_below, place_above]) = place.children(&split, &Verdict::Good, counts, count) else {
            return self.leaf(below.and(above), place, places);
        };
        self.tally.inner(&place.cell, place.depth);
        let pair = self.pair()?;
        self.patches.push(Patch {
            places,
            node: Node::inner(split.axis, split.position, pair.first().node),
            upper: Node::inner(split.axis, split.position, pair.first().upper),
        });
        let below = self.node(below, place_below, pair.first())?;
        let above = self.node(above, place_above, pair.second())?;
        Ok(Top::Inner { axis: split.axis, split: split.position, children: Box::new([below, above]) })
    }

    /// Writes what is left to be written.
    fn finish(mut self, top: Top) -> Result<Outline> {
        Stage::Joining.begin();
        self.append(Array::References, &[0_u32; AFTER])?;
        for Patch { places, node, upper } in std::mem::take(&mut self.patches) {
            let at = |place: usize| place * size_of::<Node>();
            self.output.patch(Array::Nodes, at(places.node), bytemuck::bytes_of(&node))?;
            self.output.patch(Array::Upper, at(places.upper), bytemuck::bytes_of(&upper))?;
            let beneath = places.node as u32;
            let at = places.upper * size_of::<u32>();
            self.output.patch(Array::Beneath, at, bytemuck::bytes_of(&beneath))?;
        }
        let plan = Plan::new(&top, self.job.bounds, &self.pieces);
        if plan.lines() > MAX_LINE {
            return Err(too_large());
        }
        let count = self.job.triangles.count();
        let of = |array: Array, element: usize| self.lengths[array as usize] * element;
        let bytes = Bytes {
            nodes: of(Array::Nodes, size_of::<Node>()),
            references: of(Array::References, size_of::<u32>()),
            triangles: count * size_of::<Triangle>(),
            pages: of(Array::Upper, size_of::<Node>()) + of(Array::Beneath, 4) + of(Array::Pages, 4),
            lines: plan.lines() * size_of::<Line>(),
        };
        Ok(Outline {
            stats: self.tally.stats(count, self.job.params, &bytes),
            largest_page: self.largest_page,
            spread: self.spread,
            peak: self.ledger.peak(),
            plan,
            parts: self.parts,
            given_up: self.given_up,
        })
    }
}

fn too_large() -> Error {
    let message = "its tree has more nodes or references than a tree can hold: lower max_duplication or raise \
                   traversal_cost in a profile";
    Error::Mesh(message.into())
}

#[cfg(test)]
mod tests;
