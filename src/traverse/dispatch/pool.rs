//! What workers have learnt, kept from one piece of work to the next.

use super::Dispatch;
use std::sync::{Mutex, PoisonError};

/// [`Dispatch`]es, or [`SliceDispatch`](super::SliceDispatch)es, that nobody is using. Workers take one each when they begin and put it back when they end,
/// so that who comes next, mostly the same workers, need not learn anew which kernel is quickest.
///
/// It never holds more of them than were out at the same time.
#[derive(Debug, Default)]
pub struct DispatchPool<D = Dispatch> {
    idle: Mutex<Vec<D>>,
}

impl<D: Default> DispatchPool<D> {
    /// The one that was put back last; one that knows nothing yet if there is none.
    pub fn take(&self) -> D {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).pop().unwrap_or_default()
    }

    /// What those tell that nobody is using.
    pub fn look<T, I: IntoIterator<Item = T>>(&self, tell: impl FnMut(&D) -> I) -> Vec<T> {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).iter().flat_map(tell).collect()
    }

    /// Keeps what a worker has learnt.
    pub fn put(&self, dispatch: D) {
        self.idle.lock().unwrap_or_else(PoisonError::into_inner).push(dispatch);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn what_was_learnt_is_given_to_the_next_and_to_nobody_else() {
        let pool = DispatchPool::<Dispatch>::default();
        let said = |dispatch: Dispatch| format!("{dispatch:?}");
        let ignorant = said(Dispatch::default());
        assert_eq!(said(pool.take()), ignorant, "nobody has learnt anything");

        let mut learned = Dispatch::default();
        let squares = &mut learned.any.beams.squares;
        let way = squares.next();
        squares.record(way, 256, Duration::from_micros(20));
        assert_ne!(said(learned), ignorant);
        pool.put(learned);
        assert_eq!(pool.look(|&dispatch| [said(dispatch)]), [said(learned)]);
        assert_eq!(said(pool.take()), said(learned));
        assert_eq!(said(pool.take()), ignorant, "the other worker has what was learnt");
    }
}
