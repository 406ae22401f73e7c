//! An array that is owned, or lies in a mapped file or in other memory that several share.
//!
//! A tree that was built owns its arrays; a tree out of a scene file has them where the file is mapped, or where its blocks
//! are once all of them have come. Who reads them sees a slice either way, and pays for a pointer and a length: which it is
//! decides only who frees the memory.

use crate::mapped::Map;
use bytemuck::AnyBitPattern;
use std::fmt;
use std::marker::PhantomData;
use std::mem::ManuallyDrop;
use std::ops::{Deref, Range};
use std::ptr::NonNull;
use std::sync::Arc;

/// A slice with an owner. Immutable, so that a mapped file serves as well as memory.
pub struct Column<T> {
    /// Aligned; `len` values that live and do not change as long as `owner` does.
    start: NonNull<T>,
    len: usize,
    owner: Owner,
    values: PhantomData<T>,
}

/// Who keeps the values.
enum Owner {
    /// `start` is a vector's, and this is its capacity.
    Vector(usize),
    /// `start` points into what this keeps alive, as a map does its bytes.
    Shared(#[expect(dead_code, reason = "held, never read")] Arc<dyn Send + Sync>),
}

// SAFETY: a column is a shared slice and the duty to free it: a vector's values may go where `T` may, and those
// that are shared are only ever read.
unsafe impl<T: Send + Sync> Send for Column<T> {}
// SAFETY: as above; nothing changes behind a shared reference that `T` does not change itself.
unsafe impl<T: Sync> Sync for Column<T> {}

impl<T: AnyBitPattern> Column<T> {
    /// The values at a range of a map's bytes; `None` if the range is not inside the map, is no whole number of
    /// values, or begins where no value may.
    ///
    /// The values change if the file does: whoever mapped it has vouched that it does not.
    pub fn mapped(map: Arc<Map>, bytes: Range<usize>) -> Option<Self> {
        let values: &[T] = bytemuck::try_cast_slice(map.get(bytes)?).ok()?;
        let (start, len) = (NonNull::from(values).cast(), values.len());
        Some(Self { start, len, owner: Owner::Shared(map), values: PhantomData })
    }

    /// The values at a place in memory that `owner` keeps alive, and does not move.
    ///
    /// # Safety
    /// So many values lie there, aligned, whenever the column is looked at, and nobody writes to them meanwhile.
    pub unsafe fn in_memory(start: NonNull<T>, len: usize, owner: Arc<dyn Send + Sync>) -> Self {
        Self { start, len, owner: Owner::Shared(owner), values: PhantomData }
    }
}

impl<T: Send + Sync + 'static> From<Arc<Vec<T>>> for Column<T> {
    fn from(values: Arc<Vec<T>>) -> Self {
        let (start, len) = (NonNull::from(&values[..]).cast(), values.len());
        Self { start, len, owner: Owner::Shared(values), values: PhantomData }
    }
}

impl<T> From<Vec<T>> for Column<T> {
    fn from(values: Vec<T>) -> Self {
        let mut values = ManuallyDrop::new(values);
        let start = NonNull::new(values.as_mut_ptr()).expect("a vector's pointer is never null");
        Self { start, len: values.len(), owner: Owner::Vector(values.capacity()), values: PhantomData }
    }
}

impl<T> Default for Column<T> {
    fn default() -> Self {
        Vec::new().into()
    }
}

impl<T> Deref for Column<T> {
    type Target = [T];

    #[inline(always)]
    fn deref(&self) -> &[T] {
        // SAFETY: `start` and `len` are those of a vector's values, of a slice of a map, or of memory for which somebody
        // has vouched; they live as long as `self.owner`, at a place that does not move with it, and nobody changes them.
        unsafe { std::slice::from_raw_parts(self.start.as_ptr(), self.len) }
    }
}

impl<T> Drop for Column<T> {
    fn drop(&mut self) {
        if let Owner::Vector(capacity) = self.owner {
            // SAFETY: these are the parts of the vector that it was made from, which was never dropped.
            drop(unsafe { Vec::from_raw_parts(self.start.as_ptr(), self.len, capacity) });
        }
    }
}

impl<T: fmt::Debug> fmt::Debug for Column<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self[..].fmt(f)
    }
}

impl<T: PartialEq> PartialEq for Column<T> {
    fn eq(&self, other: &Self) -> bool {
        self[..] == other[..]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn map_of(bytes: &[u8]) -> Arc<Map> {
        let mut file = tempfile::NamedTempFile::new().expect("a file");
        file.write_all(bytes).expect("written");
        Arc::new(Map::open(file.path()).expect("mapped").1)
    }

    #[test]
    fn a_vectors_values_are_kept_and_freed_once() {
        let one = Arc::new(());
        let mut values = Vec::with_capacity(10);
        values.extend([Arc::clone(&one), Arc::clone(&one)]);
        let column = Column::from(values);
        let column = std::hint::black_box(column);
        assert_eq!((column.len(), Arc::strong_count(&one)), (2, 3));
        drop(column);
        assert_eq!(Arc::strong_count(&one), 1);
        assert!(Column::<Arc<()>>::default().is_empty());
        assert_eq!(Column::from(vec![(); 7]).len(), 7);
    }

    #[test]
    fn a_maps_values_outlive_every_other_name_of_the_map() {
        let values: Vec<u32> = (0..5000).map(|i| i * i).collect();
        let map = map_of(bytemuck::cast_slice(&values));
        let held = Arc::downgrade(&map);
        let all = Column::<u32>::mapped(Arc::clone(&map), 0..20_000).expect("in range");
        let some = Column::<[u32; 2]>::mapped(map, 8..24).expect("in range");
        assert_eq!(all[..], values);
        assert_eq!(all, Column::from(values));
        drop(all);
        assert_eq!(some[..], [[4, 9], [16, 25]]);
        assert!(held.upgrade().is_some());
        drop(some);
        assert!(held.upgrade().is_none());
    }

    #[test]
    fn shared_values_live_as_long_as_one_of_their_columns() {
        let values = Arc::new(vec![3_u32, 1, 4]);
        let held = Arc::downgrade(&values);
        let [one, other] = [Arc::clone(&values), values].map(Column::from);
        // SAFETY: the second and the third of these values, which nobody changes.
        let part = unsafe { Column::in_memory(NonNull::from(&one[1]), 2, held.upgrade().expect("held")) };
        drop((one, other));
        assert_eq!(part[..], [1, 4]);
        drop(part);
        assert!(held.upgrade().is_none());
    }

    #[test]
    fn what_is_no_slice_of_the_map_is_refused() {
        let map = map_of(&[7; 64]);
        let column = |bytes| Column::<u64>::mapped(Arc::clone(&map), bytes);
        assert_eq!(column(8..24).expect("fits").len(), 2);
        assert!(column(64..64).expect("fits").is_empty());
        for bytes in [0..72, 64..72, 72..72, 0..12, 4..12, 0..usize::MAX] {
            assert!(column(bytes.clone()).is_none(), "{bytes:?}");
        }
        #[expect(clippy::reversed_empty_ranges)]
        let backwards = column(16..8);
        assert!(backwards.is_none());
    }

    #[test]
    fn columns_are_read_by_many_threads() {
        let column = Column::<u8>::mapped(map_of(&[3; 4096]), 0..4096).expect("in range");
        let sums = std::thread::scope(|scope| {
            let sum = || column.iter().map(|&byte| u32::from(byte)).sum::<u32>();
            [scope.spawn(sum), scope.spawn(sum)].map(|thread| thread.join().expect("no panic"))
        });
        assert_eq!(sums, [3 * 4096; 2]);
    }
}
