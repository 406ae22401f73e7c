//! A pool as it lies in memory.
//!
//! ```text
//!           0        1            1 + half             + vertices   ...                    + count
//!          +--------+------------+-----------------+---+-----------------+---+------------+
//! words    | header | corners    | x of vertices   | y | of vertices     | z | ids        |
//!          +--------+------------+-----------------+---+-----------------+---+------------+
//!
//!             31   28           21          14          9       4       0
//!            +-------+-----------+-----------+-----------+-------+-------+
//! header     |       | next      | ids       | x         | vert. | count |
//!            +-------+-----------+-----------+-----------+-------+-------+
//!             next, ids and x: how many words behind the first the leaf's next chunk begins (0: this is the last), and
//!             those rows do
//!
//!             15  12 11   8 7    4 3    0
//!            +------+------+------+------+
//! corners    |      |  2   |  1   |  0   |             of each triangle, numbers of its three vertices; two to a word
//!            +------+------+------+------+
//! ```
//!
//! A chunk has up to sixteen triangles and sixteen vertices. Whoever reads one may read sixteen numbers of any row:
//! behind the row's own come others of the chunk or of the next.

use crate::geometry::triangle::{Corners, Triangle};

/// Triangles of a chunk, and vertices, at most.
pub const MOST: usize = 16;

/// Words that may be read from a chunk's first on, whatever its header says: rows begin less than 128 words behind it.
pub const SPAN: usize = 31 + 3 * 31 + 128 + MOST;

/// A chunk of a leaf.
#[derive(Clone, Copy)]
pub struct Chunk<'a>(&'a [u32; SPAN]);

impl<'a> Chunk<'a> {
    /// The chunk that begins at a word.
    #[inline(always)]
    pub fn at(words: &'a [u32], first: usize) -> Self {
        Self(words[first..].first_chunk().expect("words behind the last chunk"))
    }

    /// Some bits of its header.
    #[inline(always)]
    const fn field(self, shift: u32, bits: u32) -> usize {
        (self.0[0] >> shift & ((1 << bits) - 1)) as usize
    }

    /// How many triangles it has.
    #[inline(always)]
    pub const fn count(self) -> usize {
        self.field(0, 5)
    }

    /// How many vertices they have.
    #[inline(always)]
    pub const fn vertices(self) -> usize {
        self.field(5, 5)
    }

    /// How many words behind its first the leaf's next chunk begins; 0 if it is the last.
    #[inline(always)]
    pub const fn next(self) -> usize {
        self.field(22, 7)
    }

    /// The triangles' corners: of each, numbers of vertices in bits 0 to 3, 4 to 7 and 8 to 11.
    #[inline(always)]
    pub fn corners(self) -> &'a [u16; MOST] {
        let words: &[u32; MOST / 2] = self.0[1..].first_chunk().expect("a span holds a row");
        bytemuck::cast_ref(words)
    }

    /// A coordinate of the vertices.
    #[inline(always)]
    pub fn row(self, axis: usize) -> &'a [f32; MOST] {
        let at = self.field(10, 5) + (axis & 3) * self.field(5, 5);
        let words: &[u32; MOST] = self.0[at..].first_chunk().expect("a span holds a row");
        bytemuck::cast_ref(words)
    }

    /// The triangles' primitive ids.
    #[inline(always)]
    pub fn ids(self) -> &'a [i32; MOST] {
        let words: &[u32; MOST] = self.0[self.field(15, 7)..].first_chunk().expect("a span holds a row");
        bytemuck::cast_ref(words)
    }
}

/// The vertices of some triangles, each once: two are the same if they are to the bit.
#[derive(Default)]
pub struct Vertices(Vec<[f32; 3]>);

impl Vertices {
    /// Forgets all of them.
    pub fn clear(&mut self) {
        self.0.clear();
    }

    /// Takes in a triangle's corners if there is room for those that are new; the numbers of all three.
    pub fn take(&mut self, corners: &Corners) -> Option<[usize; 3]> {
        let before = self.0.len();
        let mut numbers = [0; 3];
        for (number, corner) in numbers.iter_mut().zip(corners) {
            let bits = corner.map(f32::to_bits);
            let known = self.0.iter().position(|vertex| vertex.map(f32::to_bits) == bits);
            *number = known.unwrap_or_else(|| {
                self.0.push(*corner);
                self.0.len() - 1
            });
        }
        if self.0.len() > MOST {
            self.0.truncate(before);
            return None;
        }
        Some(numbers)
    }
}

/// Takes in as many of a leaf's triangles as a chunk has room for, the first ones first; each one's numbers of its corners.
fn fill(
    ids: &[u32],
    triangles: &[Triangle],
    vertices: &mut Vertices,
    mut corners: impl FnMut([usize; 3]),
) -> usize {
    vertices.clear();
    let mut taken = 0;
    for &id in ids.iter().take(MOST) {
        let Some(numbers) = vertices.take(&triangles[id as usize].corners) else { break };
        corners(numbers);
        taken += 1;
    }
    taken
}

/// How many chunks some triangles take.
pub fn count(mut ids: &[u32], triangles: &[Triangle]) -> usize {
    let mut vertices = Vertices::default();
    let mut chunks = 0;
    while !ids.is_empty() {
        ids = &ids[fill(ids, triangles, &mut vertices, |_| ())..];
        chunks += 1;
    }
    chunks
}

/// Writes a leaf's chunks.
pub fn write(ids: &[u32], triangles: &[Triangle], words: &mut Vec<u32>) {
    let mut left = ids;
    let mut vertices = Vertices::default();
    let mut corners = Vec::with_capacity(MOST);
    while !left.is_empty() {
        corners.clear();
        let count =
            fill(left, triangles, &mut vertices, |[a, b, c]| corners.push((a | b << 4 | c << 8) as u32));
        let (these, others) = left.split_at(count);
        let vertex_count = vertices.0.len();
        let x = 1 + count.div_ceil(2);
        let ids = x + 3 * vertex_count;
        let next = if others.is_empty() { 0 } else { ids + count };
        words.push((count | vertex_count << 5 | x << 10 | ids << 15 | next << 22) as u32);
        words.extend(corners.chunks(2).map(|pair| pair[0] | pair.get(1).unwrap_or(&0) << 16));
        for axis in 0..3 {
            words.extend(vertices.0.iter().map(|vertex| vertex[axis].to_bits()));
        }
        words.extend_from_slice(these);
        left = others;
    }
}
