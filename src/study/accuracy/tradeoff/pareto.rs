//! Which points nobody beats on both counts.

/// For points of a time and an error, whether each is on the Pareto front: no other is at least as good on
/// both counts and better on one.
pub fn front(points: &[(f64, f64)]) -> Vec<bool> {
    let beats = |a: &(f64, f64), b: &(f64, f64)| a.0 <= b.0 && a.1 <= b.1 && a != b;
    points.iter().map(|point| !points.iter().any(|other| beats(other, point))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn nobody_beats_the_front() {
        let points = [(1.0, 9.0), (2.0, 3.0), (2.5, 3.0), (3.0, 0.0), (9.0, 0.0), (0.5, 9.5), (2.0, 4.0)];
        assert_eq!(front(&points), [true, true, false, true, false, true, false]);
    }

    #[test]
    fn equal_points_are_on_it_together() {
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0)]), [true, true]);
        assert!(front(&[]).is_empty());
    }
}
