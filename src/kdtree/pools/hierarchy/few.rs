//! A handful of triangles.

/// How many there are at most.
pub const FEW: usize = 4;

/// Up to four ids in ascending order, each once.
#[derive(Clone, Copy, Debug)]
pub struct Few {
    ids: [u32; FEW],
    count: usize,
}

impl Few {
    /// Those of a list in ascending order, if they are few.
    pub fn of_ids(ids: &[u32]) -> Option<Self> {
        let mut few = Self { ids: [0; FEW], count: ids.len() };
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
        let mut both = Self { ids: [0; FEW], count: 0 };
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
        let both = few(&[1, 3]).with(&few(&[0, 3, 7]));
        assert_eq!(both.expect("four").ids(), [0, 1, 3, 7]);
        assert_eq!(few(&[0, 1, 2]).with(&few(&[1, 2, 3])).expect("four").ids(), [0, 1, 2, 3]);
        assert!(few(&[0, 1, 2]).with(&few(&[3, 4])).is_none());
        assert!(Few::of_ids(&(0..5).collect::<Vec<_>>()).is_none());
    }
}
