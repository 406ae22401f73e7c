//! Whether engines found the same.

use super::engine::Results;
use crate::geometry::Hit;
use crate::study::rays::RayKind;
use serde::Serialize;

/// Relative difference of `t` up to which two closest hits count as the same.
pub const TOLERANCE: f32 = 1e-4;

/// How two engines' answers to the same rays compare.
#[derive(Clone, Debug, Serialize)]
pub struct Agreement {
    /// The kind of ray.
    pub rays: RayKind,
    /// Engine and mode of the one.
    pub first: String,
    /// Engine and mode of the other.
    pub second: String,
    /// Rays compared.
    pub count: usize,
    /// Rays that one hits and the other misses, or that are hit at different `t`.
    pub disagreements: usize,
    /// The same for a million rays.
    pub per_million: f64,
}

impl Agreement {
    /// Compares results ray by ray. The primitive is not compared: where triangles touch or coincide, any
    /// of them is right.
    ///
    /// # Panics
    /// If the results are of different kinds or numbers of rays.
    pub fn new(rays: RayKind, first: (String, &Results), second: (String, &Results)) -> Self {
        let (count, disagreements) = match (first.1, second.1) {
            (Results::Closest(a), Results::Closest(b)) => {
                assert_eq!(a.len(), b.len());
                (a.len(), a.iter().zip(b).filter(|(a, b)| !same_hit(a, b)).count())
            }
            (Results::Any(a), Results::Any(b)) => {
                assert_eq!(a.len(), b.len());
                (a.len(), a.iter().zip(b).filter(|(a, b)| a != b).count())
            }
            _ => panic!("closest hits cannot be compared with any hits"),
        };
        let per_million = disagreements as f64 * 1e6 / count.max(1) as f64;
        Self { rays, first: first.0, second: second.0, count, disagreements, per_million }
    }
}

/// Both miss, or both hit at `t` within [`TOLERANCE`].
pub fn same_hit(a: &Hit, b: &Hit) -> bool {
    match (a.is_hit(), b.is_hit()) {
        (true, true) => (a.t - b.t).abs() <= TOLERANCE * a.t.abs().max(b.t.abs()),
        (false, false) => true,
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn disagreements_are_counted() {
        let hit = |t, primitive| Hit { t, primitive, ..Hit::MISS };
        let a = Results::Closest(vec![hit(1.0, 0), hit(1.0, 0), Hit::MISS, Hit::MISS, hit(0.0, 1)]);
        let b = Results::Closest(vec![hit(1.00005, 3), hit(1.001, 0), Hit::MISS, hit(2.0, 1), hit(0.0, 1)]);
        let agreement = |a, b| Agreement::new(RayKind::Camera, ("a".into(), a), ("b".into(), b));
        assert_eq!(agreement(&a, &b).disagreements, 2);
        assert_eq!(agreement(&a, &b).per_million, 400_000.0);
        assert_eq!(agreement(&a, &a).disagreements, 0);
        let any = |flags: &[bool]| Results::Any(flags.to_vec());
        assert_eq!(agreement(&any(&[true, false]), &any(&[true, true])).disagreements, 1);
    }
}
