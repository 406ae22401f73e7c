//! Parts of the tree that are built in memory.

use super::crown::{Finished, PIECES, Top};
use super::list::{List, read_scattered};
use super::{Array, Builder, Patch, Places};
use crate::error::Result;
use crate::geometry::Aabb;
use crate::kdtree::build::{BuildProgress, Built, Context, Place, Reference, large};
use crate::kdtree::lines::{self, Line};
use crate::kdtree::memory::{bytes_of, finishing_bytes};
use crate::kdtree::node::Node;
use crate::kdtree::pages::{Pages, sort_and_dedup};
use crate::kdtree::spread;
use crate::simd::Chosen;
use crate::stage::Stage;
use rayon::prelude::*;

/// Levels of the tree in a line.
const LEVELS: usize = 3;

impl Builder<'_> {
    /// Builds a node in memory, and appends what is below it. `None` if it turns out that it does not fit, which what
    /// `is_sure` to fit does.
    pub(super) fn part(
        &mut self,
        list: &List,
        place: Place,
        places: Places,
        is_sure: bool,
    ) -> Result<Option<Top>> {
        Stage::Building.begin();
        let mark = self.job.progress.map(BuildProgress::mark);
        self.ledger.begin((!is_sure).then_some(self.sizes.memory));
        let Some(built) = self.built(list, place)? else {
            self.ledger.begin(None);
            self.sizes.raise();
            self.given_up += 1;
            if let Some((progress, mark)) = self.job.progress.zip(mark) {
                progress.go_back(mark);
            }
            return Ok(None);
        };
        self.sizes.learn(list.count(), built.nodes.len(), built.references.len());
        let top = self.append_part(built, &place, places)?;
        // What splits from files has no limit here.
        self.ledger.begin(None);
        Ok(Some(top))
    }

    /// The nodes and references below a node, on the ledger; `None` if they, or what is made of them, do not fit.
    fn built(&self, list: &List, place: Place) -> Result<Option<Built>> {
        let mut chunks = list.load(self.job)?;
        // Primitives ascend: within the part, a triangle goes by its place among them.
        let primitives: Vec<u32> = chunks.iter().flatten().map(Reference::primitive).collect();
        debug_assert!(primitives.is_sorted_by(|a, b| a < b));
        let mut first = 0;
        for chunk in &mut chunks {
            for (reference, name) in chunk.iter_mut().zip(first..) {
                *reference = reference.renamed(name);
            }
            first += chunk.len() as u32;
        }
        let triangles = read_scattered(self.job.triangles, &primitives)?;
        let held = bytes_of(&primitives) + bytes_of(&triangles);
        self.ledger.add(held + chunks.iter().map(bytes_of).sum::<usize>());
        let context = Context {
            params: self.job.params,
            triangles: &triangles,
            depth_limit: self.depth_limit,
            isa: Chosen::best(),
            ledger: &self.ledger,
            progress: self.job.progress,
        };
        let part = large::build(&context, chunks, place);
        let finishing = finishing_bytes(part.nodes() as f64, part.references() as f64) as usize;
        // They are copied first, beside the triangles, and then finished.
        let copies = part.nodes() * size_of::<Node>() + part.references() * size_of::<u32>();
        if self.ledger.is_over() || self.ledger.has_no_room(copies) {
            return Ok(None);
        }
        let Built { nodes, mut references } = part.gathered(&self.ledger);
        drop(triangles);
        references.par_iter_mut().for_each(|reference| *reference = primitives[*reference as usize]);
        drop(primitives);
        self.ledger.sub(held);
        let more = finishing.saturating_sub(bytes_of(&nodes) + bytes_of(&references));
        Ok((!self.ledger.has_no_room(more)).then_some(Built { nodes, references }))
    }

    /// One leaf of all references, though they are too many to be built in memory.
    pub(super) fn leaf(&mut self, list: List, place: Place, places: Places) -> Result<Top> {
        let mut references = list.primitives(self.job)?;
        sort_and_dedup(&mut references, 0);
        if let Some(progress) = self.job.progress {
            progress.add(place.share);
        }
        let nodes = vec![Node::leaf(0, references.len()), Node::leaf(0, 0)];
        self.ledger.add(bytes_of(&nodes) + bytes_of(&references));
        self.append_part(Built { nodes, references }, &place, places)
    }

    /// Appends a part that is on the ledger; takes it off.
    fn append_part(&mut self, built: Built, place: &Place, places: Places) -> Result<Top> {
        self.parts += 1;
        let Built { mut nodes, references } = built;
        // A part's root has its place already; its other nodes begin at 2.
        let first_node = self.length(Array::Nodes) - 2;
        let first_upper = self.length(Array::Upper) - 2;

        // Pages and records, as in `KdTree::build`.
        let pages = Pages::cut(&nodes, &references, self.job.params.page);
        self.ledger.add(pages.bytes());
        let records = lines::counted(&mut nodes, &references);
        self.ledger.add(bytes_of(&records));
        self.ledger.sub(bytes_of(&references));
        drop(references);

        let first_record = self.length(Array::References);
        let first_page = self.length(Array::Pages);
        self.spread = spread::greatest(self.spread, spread::of_leaves(&nodes, &records, first_record));
        self.spread =
            spread::greatest(self.spread, spread::of_leaves(&pages.upper, &pages.primitives, first_page));
        self.append(Array::References, &records)?;
        self.ledger.sub(bytes_of(&records));
        drop(records);
        self.append(Array::Pages, &pages.primitives)?;

        self.tally.subtree(&nodes, nodes[0], place.cell, place.depth);
        self.tally.pages(&pages.upper);
        let sizes = pages.upper.iter().filter(|node| node.is_leaf()).map(|page| page.references().len());
        self.largest_page = self.largest_page.max(sizes.max().unwrap_or(0));

        // The lines of what is below the last level that belongs to the top's lines.
        let levels = (LEVELS - place.depth % LEVELS) % LEVELS;
        let mut crown = vec![nodes[0]];
        self.crown(&mut crown, 0, &nodes, place.cell, levels, first_record)?;

        // Nodes, with the places that they now have.
        let upper_root = pages.upper[0].moved(first_upper, first_page);
        let root = moved(nodes[0], first_node, first_record);
        self.patches.push(Patch { places, node: root, upper: upper_root });
        let node_bytes = bytes_of(&nodes);
        nodes[2..].par_iter_mut().for_each(|node| *node = moved(*node, first_node, first_record));
        self.append(Array::Nodes, &nodes[2..])?;
        drop(nodes);
        let upper: Vec<Node> =
            pages.upper[2..].iter().map(|node| node.moved(first_upper, first_page)).collect();
        self.append(Array::Upper, &upper)?;
        let beneath: Vec<u32> = pages.beneath[2..].iter().map(|node| node + first_node as u32).collect();
        self.append(Array::Beneath, &beneath)?;
        self.ledger.sub(node_bytes + pages.bytes());
        Ok(Top::Part(Finished { crown }))
    }

    /// Copies the nodes under `nodes[0]`'s place `at` in the crown that belong to the top's lines: `levels`
    /// levels of them. What is below is packed and appended, piece by piece.
    fn crown(
        &mut self,
        crown: &mut Vec<Node>,
        at: usize,
        nodes: &[Node],
        cell: Aabb,
        levels: usize,
        first_record: usize,
    ) -> Result<()> {
        let node = crown[at];
        if node.is_leaf() {
            crown[at] = moved(node, 0, first_record);
        } else if levels == 0 {
            let mut piece = lines::pack(nodes, node, &cell);
            let held = bytes_of(&piece);
            self.ledger.add(held);
            piece.par_iter_mut().for_each(|line: &mut Line| *line = line.moved(0, first_record));
            self.append(Array::Lines, &piece)?;
            self.ledger.sub(held);
            crown[at] = Node::inner(node.axis(), node.split(), PIECES + self.pieces.len());
            self.pieces.push(piece.len());
        } else {
            let (pair, below) = (crown.len(), node.below() as usize);
            crown.extend([nodes[below], nodes[below + 1]]);
            crown[at] = Node::inner(node.axis(), node.split(), pair);
            let halves = cell.halves(node.axis(), node.split());
            for (child, half) in halves.into_iter().enumerate() {
                self.crown(crown, pair + child, nodes, half, levels - 1, first_record)?;
            }
        }
        Ok(())
    }
}

/// A node in longer arrays; an empty leaf's references are nowhere.
fn moved(node: Node, nodes: usize, references: usize) -> Node {
    let is_empty = node.is_leaf() && node.references().is_empty();
    if is_empty { node } else { node.moved(nodes, references) }
}
