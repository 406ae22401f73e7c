//! The proof that pools are whole.

use super::chunk::SPAN;
use super::{Boxes, Chunk, MAX_WORD, MOST, Pools, Way};
use crate::geometry::Aabb;
use crate::geometry::triangle::Triangle;
use crate::kdtree::MAX_DEPTH;
use glam::Vec3;

/// All corners of a triangle.
const ALL_CORNERS: u8 = 0b111;

impl Pools {
    /// Checks that these are pools of some triangles: one box leads to each node, and holds the node's boxes; what chunks hold of a
    /// triangle are its corners, to the bit; and each corner of every triangle lies in a box around a pool that names it.
    /// (That all points between do is not looked at.)
    ///
    /// # Errors
    /// A sentence about the first thing that is wrong.
    pub fn validate(&self, triangles: &[Triangle]) -> Result<(), String> {
        let mut is_led_to = vec![false; self.nodes.len()];
        // A bit for each corner that is found.
        let mut found = vec![0u8; triangles.len()];
        let everything = Aabb { min: Vec3::NEG_INFINITY, max: Vec3::INFINITY };
        let mut stack = vec![(Way::ROOT, everything, 0)];
        while let Some((way, around, depth)) = stack.pop() {
            let (number, node) = (way.node(), self.nodes.get(way.node()));
            let Some(node) = node.filter(|_| depth <= MAX_DEPTH) else {
                return Err(format!("there is no node of boxes {number}, {depth} levels deep"));
            };
            if std::mem::replace(&mut is_led_to[number], true) {
                return Err(format!("two boxes lead to node of boxes {number}"));
            }
            check_orders(node).map_err(|what| format!("{what} of node of boxes {number}"))?;
            for lane in 0..8 {
                let (bounds, way) = (node.bounds(lane), Way(node.ways[lane]));
                if bounds.is_empty() {
                    if way != Way::NOTHING {
                        return Err(format!(
                            "a box of node of boxes {number} is empty, and leads to something"
                        ));
                    }
                    continue;
                }
                if !around.contains(bounds.min) || !around.contains(bounds.max) {
                    return Err(format!("a box of node of boxes {number} is larger than the node"));
                }
                if way.is_pool() {
                    self.check_pool(way.word(), &bounds, triangles, &mut found)
                        .map_err(|what| format!("a pool below node of boxes {number} {what}"))?;
                } else {
                    stack.push((way, bounds, depth + 1));
                }
            }
        }
        if let Some(number) = is_led_to.iter().position(|&is_led_to| !is_led_to) {
            return Err(format!("no box leads to node of boxes {number}"));
        }
        match found.iter().position(|&corners| corners != ALL_CORNERS) {
            Some(id) => Err(format!("no box around a corner of triangle {id} leads to it")),
            None => Ok(()),
        }
    }

    /// Checks the chunks of the pool that begins at a word, and takes note of the corners that they hold and the box does.
    fn check_pool(
        &self,
        mut word: usize,
        bounds: &Aabb,
        triangles: &[Triangle],
        found: &mut [u8],
    ) -> Result<(), String> {
        loop {
            if word > MAX_WORD || word + SPAN > self.words.len() {
                return Err(format!("begins at word {word}, beyond the last"));
            }
            let chunk = Chunk::at(&self.words, word);
            let (count, vertices) = (chunk.count(), chunk.vertices());
            if !(1..=MOST).contains(&count) || !(1..=MOST).contains(&vertices) {
                return Err(format!("has a chunk of {count} triangles and {vertices} vertices"));
            }
            let rows = [chunk.row(0), chunk.row(1), chunk.row(2)];
            for (&numbers, &id) in chunk.corners().iter().zip(chunk.ids()).take(count) {
                let Some(triangle) = triangles.get(id as usize) else {
                    return Err(format!("names triangle {id}"));
                };
                for (corner, place) in triangle.corners.iter().enumerate() {
                    let vertex = usize::from(numbers >> (4 * corner) & 15);
                    let held = rows.map(|row| row[vertex].to_bits());
                    if vertex >= vertices || held != place.map(f32::to_bits) {
                        return Err(format!("holds another corner {corner} of triangle {id}"));
                    }
                    let is_inside = bounds.contains(Vec3::from_array(*place));
                    found[id as usize] |= u8::from(is_inside) << corner;
                }
            }
            match chunk.next() {
                0 => return Ok(()),
                next => word += next,
            }
        }
    }
}

/// Whether each octant's order names each box once.
fn check_orders(node: &Boxes) -> Result<(), String> {
    for octant in 0..8 {
        let named = node.lanes(octant).into_iter().fold(0, |named, lane| named | 1u32 << lane);
        let has_more = (0..8).any(|place| node.orders[octant] >> (4 * place) & 8 != 0);
        if named != 0xff || has_more {
            return Err(format!("the order for octant {octant}"));
        }
    }
    Ok(())
}
