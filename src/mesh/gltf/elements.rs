//! What accessors give access to: numbers in buffers, each read when it is asked for.
//!
//! The crate has iterators for this. They panic if a range overflows or sparse values run out, and they take a vector
//! for what the caller expects, whatever the document says that it is. So ranges and types are checked here first,
//! and as single elements are wanted, not all in a row, the crate's iterators are left out.

use super::buffers::Buffers;
use super::view::View;
use gltf::accessor::{DataType, Dimensions};
use gltf::json::accessor::sparse::Sparse;
use gltf::{Accessor, Document};
use std::cmp::Ordering;
use std::ops::Range;

/// An accessor's elements, all of which lie in their buffers.
#[derive(Clone)]
pub(super) struct Elements<'a> {
    /// How many there are.
    pub count: usize,
    kind: DataType,
    normalized: bool,
    /// Bytes of one.
    size: usize,
    /// Where they are, and bytes from one to the next; without, they are zeros.
    base: Option<(View<'a>, usize)>,
    /// Those that are others.
    changed: Option<Changed<'a>>,
}

/// Elements that a sparse accessor changes.
#[derive(Clone)]
struct Changed<'a> {
    /// Which ones, rising, in little-endian numbers of `step` bytes. They stay bytes: many primitives may name the
    /// same accessor.
    numbers: View<'a>,
    step: usize,
    /// What they are, without gaps.
    values: View<'a>,
}

impl Changed<'_> {
    fn count(&self) -> usize {
        self.numbers.len() / self.step
    }

    fn number(&self, at: usize) -> u32 {
        unsigned(self.numbers.look(at * self.step, self.step))
    }

    /// Where an element is among those that are changed.
    fn find(&self, index: u32) -> Option<usize> {
        let (mut low, mut high) = (0, self.count());
        while low < high {
            let middle = low.midpoint(high);
            match self.number(middle).cmp(&index) {
                Ordering::Equal => return Some(middle),
                Ordering::Less => low = middle + 1,
                Ordering::Greater => high = middle,
            }
        }
        None
    }
}

impl<'a> Elements<'a> {
    /// The elements of an accessor of one of the `kinds`, with one of the `dimensions`.
    ///
    /// # Errors
    /// It is of another kind, or not all of its elements lie in their buffers; `what` says what they are for.
    pub fn new(
        accessor: &Accessor<'_>,
        document: &Document,
        buffers: &'a Buffers<'a>,
        (dimensions, kinds): (&[Dimensions], &[DataType]),
        what: &str,
    ) -> Result<Self, String> {
        let number = accessor.index();
        let fault = |fault: String| format!("accessor {number} ({what}): {fault}");
        let json = &document.as_json().accessors[number];
        if !dimensions.contains(&accessor.dimensions()) || !kinds.contains(&accessor.data_type()) {
            let (found, kind) = (accessor.dimensions(), accessor.data_type());
            return Err(fault(format!("{found:?} of {kind:?} is not what {what} are made of")));
        }
        let size = accessor.data_type().size() * accessor.dimensions().multiplicity();
        let count = accessor.count();
        let base = match json.buffer_view {
            None => None,
            Some(view) => {
                let stride = document.as_json().buffer_views[view.value()].byte_stride.map_or(size, |s| s.0);
                if stride < size {
                    return Err(fault(format!("elements of {size} bytes every {stride} bytes")));
                }
                let view = buffers.view(view.value()).map_err(fault)?;
                let range = range(json.byte_offset.unwrap_or_default().0, count, stride, size);
                let view = range.and_then(|range| view.part(range));
                Some((
                    view.ok_or_else(|| fault(format!("{count} elements are more than its view holds")))?,
                    stride,
                ))
            }
        };
        let changed =
            json.sparse.as_ref().map(|s| changed(s, buffers, count, size)).transpose().map_err(fault)?;
        // Zeros take no bytes: a file of a hundred bytes could ask for memory without end.
        if base.is_none() && count as u64 > buffers.size() {
            return Err(fault(format!("{count} elements, of which almost none has a value")));
        }
        let (kind, normalized) = (accessor.data_type(), accessor.normalized());
        Ok(Self { count, kind, normalized, size, base, changed })
    }

    /// The bytes of an element; `None` are zeros. Panics if `index` is out of range.
    #[inline]
    fn bytes(&self, index: u32) -> Option<&'a [u8]> {
        assert!((index as usize) < self.count, "an element out of range");
        if let Some(changed) = &self.changed
            && let Some(at) = changed.find(index)
        {
            return Some(changed.values.look(at * self.size, self.size));
        }
        self.base.as_ref().map(|(view, stride)| view.look(index as usize * stride, self.size))
    }

    /// An element's first `N` numbers. Panics if `index` is out of range, or there are fewer.
    #[inline]
    pub fn numbers<const N: usize>(&self, index: u32) -> [f32; N] {
        let Some(bytes) = self.bytes(index) else { return [0.0; N] };
        let step = self.kind.size();
        std::array::from_fn(|i| number(self.kind, self.normalized, &bytes[i * step..][..step]))
    }

    /// An element as an index. Panics if `index` is out of range.
    #[inline]
    pub fn index(&self, index: u32) -> u32 {
        self.bytes(index).map_or(0, |bytes| unsigned(&bytes[..self.size]))
    }
}

/// Where the bytes from the first to the last of `count` elements are; `None` if no file has so many.
fn range(offset: u64, count: usize, stride: usize, size: usize) -> Option<Range<usize>> {
    let Some(before_last) = count.checked_sub(1) else { return Some(0..0) };
    let start = usize::try_from(offset).ok()?;
    let end = before_last.checked_mul(stride)?.checked_add(size)?.checked_add(start)?;
    Some(start..end)
}

/// The elements that a sparse accessor changes.
fn changed<'a>(
    sparse: &Sparse,
    buffers: &'a Buffers<'a>,
    count: usize,
    size: usize,
) -> Result<Changed<'a>, String> {
    let changes = usize::try_from(sparse.count.0).map_err(|e| e.to_string())?;
    let short = || format!("{changes} sparse elements are more than their views hold");
    let step = match sparse.indices.component_type {
        gltf::json::validation::Checked::Valid(kind) => kind.0.size(),
        gltf::json::validation::Checked::Invalid => return Err("sparse indices of no known type".into()),
    };
    let numbers = buffers.view(sparse.indices.buffer_view.value())?;
    let numbers = range(sparse.indices.byte_offset.0, changes, step, step)
        .and_then(|range| numbers.part(range))
        .ok_or_else(short)?;
    let values = buffers.view(sparse.values.buffer_view.value())?;
    let values = range(sparse.values.byte_offset.0, changes, size, size)
        .and_then(|range| values.part(range))
        .ok_or_else(short)?;
    let changed = Changed { numbers, step, values };
    let in_range = changes == 0 || (changed.number(changes - 1) as usize) < count;
    if !in_range || !(0..changes).is_sorted_by(|&a, &b| changed.number(a) < changed.number(b)) {
        return Err("sparse indices that do not rise, or are out of range".into());
    }
    Ok(changed)
}

/// One, two or four little-endian bytes as a number.
fn unsigned(bytes: &[u8]) -> u32 {
    let mut word = [0; 4];
    word[..bytes.len()].copy_from_slice(bytes);
    u32::from_le_bytes(word)
}

/// A component, by the conversions of the specification (section 3.11 for the normalised ones).
#[inline]
fn number(kind: DataType, normalized: bool, bytes: &[u8]) -> f32 {
    let word = unsigned(bytes);
    let (value, greatest) = match kind {
        DataType::F32 => return f32::from_bits(word),
        DataType::I8 => (f32::from(word as u8 as i8), 127.0),
        DataType::U8 => (f32::from(word as u8), 255.0),
        DataType::I16 => (f32::from(word as u16 as i16), 32767.0),
        DataType::U16 => (f32::from(word as u16), 65535.0),
        DataType::U32 => (word as f32, 4_294_967_295.0),
    };
    if normalized { (value / greatest).max(-1.0) } else { value }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn integers_become_numbers_as_specified() {
        let shown = |kind, bytes: &[u8]| [false, true].map(|normalized| number(kind, normalized, bytes));
        assert_eq!(shown(DataType::I8, &[0x80]), [-128.0, -1.0]);
        assert_eq!(shown(DataType::I8, &[127]), [127.0, 1.0]);
        assert_eq!(shown(DataType::U8, &[51]), [51.0, 0.2]);
        assert_eq!(shown(DataType::I16, &(-32768_i16).to_le_bytes()), [-32768.0, -1.0]);
        assert_eq!(shown(DataType::U16, &[0xff, 0xff]), [65535.0, 1.0]);
        assert_eq!(shown(DataType::F32, &2.5_f32.to_le_bytes()), [2.5, 2.5]);
    }

    #[test]
    fn ranges_do_not_overflow() {
        assert_eq!(range(0, 2, 12, 12), Some(0..24));
        assert_eq!(range(4, 2, 12, 8), Some(4..24));
        assert_eq!(range(7, 0, 12, 12), Some(0..0));
        for (offset, count) in [(0, usize::MAX), (u64::MAX, 1), (1 << 63, usize::MAX / 12)] {
            assert_eq!(range(offset, count, 12, 12), None, "{offset} {count}");
        }
    }
}
