//! A handful of triangles.

use crate::kdtree::pools::chunk::MOST;

/// Up to sixteen ids in ascending order, each once.
#[derive(Clone, Copy, Debug)]
pub struct Few {
    ids: [u32; MOST],
    count: usize,
}

impl Few {
    /// Those of a list in ascending order, if they are few.
    pub fn of_ids(ids: &[u32]) -> Option<Self> {
        let mut few = Self { ids: [0; MOST], count: ids.len() };
        few.ids.get_mut(..ids.len())?.copy_from_slice(ids);
        Some(few)
    }

    /// Which they are.
    pub fn ids(&self) -> &[u32] {
        &self.ids[..self.count]
    }

    /// Those of both, each once, if they are few.
    pub fn with(&self, other: &Self) -> Option<Self> {
        let (mut a, mut b) = (self.ids(), other.ids());
        let mut both = Self { ids: [0; MOST], count: 0 };
        while let Some(&id) = a.first().into_iter().chain(b.first()).min() {
            a = a.strip_prefix(&[id]).unwrap_or(a);
            b = b.strip_prefix(&[id]).unwrap_or(b);
            *both.ids.get_mut(both.count)? = id;
            both.count += 1;
        }
        Some(both)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_of_both_are_named_once_if_they_are_few() {
        let few = |ids: &[u32]| Few::of_ids(ids).expect("they are few");
        let both = few(&[1, 3, 5]).with(&few(&[0, 3, 7]));
        assert_eq!(both.expect("five").ids(), [0, 1, 3, 5, 7]);
        let (ten, more): (Vec<u32>, Vec<u32>) = ((0..10).collect(), (6..16).collect());
        assert_eq!(few(&ten).with(&few(&more)).expect("sixteen").ids(), (0..16).collect::<Vec<_>>());
        assert!(few(&ten).with(&few(&[10, 11, 12, 13, 14, 15, 16])).is_none());
        assert!(Few::of_ids(&(0..17).collect::<Vec<_>>()).is_none());
    }
}
