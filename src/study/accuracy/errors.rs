//! Errors of an engine's answers against the truth: counted, one by one, never averaged away.
//!
//! | error | truth | engine |
//! |---|---|---|
//! | missed | a hit | a miss |
//! | false hit | a miss | a hit |
//! | wrong primitive | a hit | a hit of a triangle that is neither the nearest nor [tied](Truth::ties) with it |
//!
//! So triangles whose exact `t` rounds to the same float are interchangeable; naming another than
//! the one of the lowest id among them, as every kernel here should, is counted apart and no error. A ray that passes an edge at
//! a rounding's distance and is given to the neighbour across it has the wrong primitive but nearly
//! the right place; a ray that slips through a surface onto what lies behind has the wrong
//! primitive *elsewhere*. How far `t` and the weights are off is said of right primitives only.

use crate::geometry::Hit;
use crate::study::bench::agreement::TOLERANCE;
use crate::study::reference::Truth;
use serde::Serialize;

/// Errors of one engine on one set of rays.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Errors {
    /// Rays asked for.
    pub count: u64,
    /// Rays that hit something in truth.
    pub hits: u64,
    /// Hits that were missed.
    pub missed: u64,
    /// Misses that were given as hits.
    pub false_hits: u64,
    /// Hits given for a triangle that is not the nearest.
    pub wrong_primitive: u64,
    /// Those of them whose `t` is off by more than [`TOLERANCE`], relative to the greater of the two:
    /// another place, not a neighbour at the same place.
    pub elsewhere: u64,
    /// Right primitives that tie with one of a lower id. No errors.
    pub not_lowest: u64,
    /// How far right hits are off; `None` for occlusion, and where no hit is right.
    pub deviation: Option<Deviation>,
}

/// How far hits of right primitives are off.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Deviation {
    /// Hits with a right primitive.
    pub hits: u64,
    /// Floats between the engine's `t` and the nearest float to the true one: the most.
    pub max_ulps: u32,
    /// The same: the least that 99.9 % do not exceed.
    pub p999_ulps: u32,
    /// The same: the mean.
    pub mean_ulps: f64,
    /// Greatest error of `t` relative to the true one, where that is not zero.
    pub max_relative: f64,
    /// Greatest error of a barycentric weight, where the engine names the truth's own primitive.
    pub max_weight: f64,
}

impl Errors {
    /// Counts the errors of closest hits.
    ///
    /// # Panics
    /// If there are not as many hits as truths.
    pub fn of_closest(truths: &[Truth], hits: &[Hit]) -> Self {
        assert_eq!(truths.len(), hits.len(), "as many hits as truths");
        let mut errors = Self { count: hits.len() as u64, ..Self::default() };
        let mut tally = Tally::default();
        for (truth, hit) in truths.iter().zip(hits) {
            errors.hits += u64::from(truth.is_hit());
            match (truth.is_hit(), hit.is_hit()) {
                (false, false) => {}
                (true, false) => errors.missed += 1,
                (false, true) => errors.false_hits += 1,
                (true, true) if truth.names(hit.primitive) => {
                    errors.not_lowest += u64::from(hit.primitive != truth.lowest());
                    tally.add(truth, hit);
                }
                (true, true) => {
                    errors.wrong_primitive += 1;
                    errors.elsewhere += u64::from(!same_place(truth.t, hit.t));
                }
            }
        }
        errors.deviation = tally.sum_up();
        errors
    }

    /// Counts the errors of occlusion.
    ///
    /// # Panics
    /// If there are not as many answers as truths.
    pub fn of_any(truths: &[bool], occluded: &[bool]) -> Self {
        assert_eq!(truths.len(), occluded.len(), "as many answers as truths");
        let count = |truth, answer| {
            truths.iter().zip(occluded).filter(|&pair| pair == (&truth, &answer)).count() as u64
        };
        let (missed, false_hits) = (count(true, false), count(false, true));
        let hits = missed + count(true, true);
        Self { count: truths.len() as u64, hits, missed, false_hits, ..Self::default() }
    }

    /// Missed hits, false hits and wrong primitives together.
    pub fn total(&self) -> u64 {
        self.missed + self.false_hits + self.wrong_primitive
    }

    /// A count for a million rays; 0 where there are no rays.
    pub fn per_million(&self, count: u64) -> f64 {
        count as f64 * 1e6 / self.count.max(1) as f64
    }
}

/// Deviations as they come in.
#[derive(Default)]
struct Tally {
    ulps: Vec<u32>,
    max_relative: f64,
    max_weight: f64,
}

impl Tally {
    fn add(&mut self, truth: &Truth, hit: &Hit) {
        self.ulps.push(ulps_between(hit.t, truth.t));
        if truth.t_f64 != 0.0 {
            let relative = (f64::from(hit.t) - truth.t_f64).abs() / truth.t_f64.abs();
            self.max_relative = self.max_relative.max(relative);
        }
        if hit.primitive == truth.primitive {
            let off = |weight: f32, truth: f64| (f64::from(weight) - truth).abs();
            self.max_weight = self.max_weight.max(off(hit.u, truth.u)).max(off(hit.v, truth.v));
        }
    }

    fn sum_up(mut self) -> Option<Deviation> {
        let hits = self.ulps.len();
        if hits == 0 {
            return None;
        }
        self.ulps.sort_unstable();
        Some(Deviation {
            hits: hits as u64,
            max_ulps: self.ulps[hits - 1],
            p999_ulps: self.ulps[(hits * 999).div_ceil(1000) - 1],
            mean_ulps: self.ulps.iter().map(|&n| f64::from(n)).sum::<f64>() / hits as f64,
            max_relative: self.max_relative,
            max_weight: self.max_weight,
        })
    }
}

/// Steps from one float to the next between two floats that are not NaN; zeros count as one.
pub fn ulps_between(a: f32, b: f32) -> u32 {
    // Places on a line: magnitudes in the order of their bits, the negative ones turned round.
    let place = |x: f32| {
        let magnitude = i64::from(x.abs().to_bits());
        if x.is_sign_negative() { -magnitude } else { magnitude }
    };
    place(a).abs_diff(place(b)) as u32
}

fn same_place(a: f32, b: f32) -> bool {
    (a - b).abs() <= TOLERANCE * a.abs().max(b.abs())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn truth(t: f64, primitive: u32, ties: &[u32]) -> Truth {
        Truth { t: t as f32, t_f64: t, u: 0.25, v: 0.5, primitive, ties: ties.to_vec() }
    }

    fn hit(t: f32, primitive: u32) -> Hit {
        Hit { t, u: 0.25, v: 0.5, primitive, ..Hit::MISS }
    }

    #[test]
    fn every_error_is_counted_once() {
        let (one, next) = (1f32, 1f32.next_up());
        let cases = [
            (Truth::MISS, Hit::MISS),
            (truth(1.0, 7, &[]), hit(one, 7)),
            (truth(1.0, 7, &[6, 9]), hit(next, 9)), // A tie, an ulp off.
            (truth(1.0, 7, &[6, 9]), hit(one, 6)),  // The lowest of the ties.
            (truth(1.0, 7, &[]), Hit::MISS),        // Missed.
            (Truth::MISS, hit(one, 7)),             // A false hit.
            (truth(1.0, 7, &[8]), hit(one, 6)),     // The neighbour.
            (truth(1.0, 7, &[8]), hit(2.0, 6)),     // What lies behind.
            (truth(1.0, 7, &[8]), hit(f32::NAN, 6)), // Nowhere at all.
        ];
        let (truths, hits): (Vec<_>, Vec<_>) = cases.into_iter().unzip();
        let errors = Errors::of_closest(&truths, &hits);
        let deviation = errors.deviation.clone().expect("three are right");
        assert_eq!((errors.count, errors.hits), (9, 7));
        assert_eq!((errors.missed, errors.false_hits), (1, 1));
        assert_eq!((errors.wrong_primitive, errors.elsewhere, errors.not_lowest), (3, 2, 1));
        assert_eq!(errors.total(), 5);
        assert!((errors.per_million(errors.missed) - 111_111.1).abs() < 0.1);
        assert_eq!((deviation.hits, deviation.max_ulps, deviation.p999_ulps), (3, 1, 1));
        assert_eq!((deviation.mean_ulps, deviation.max_weight), (1.0 / 3.0, 0.0));
        assert!((deviation.max_relative - f64::from(f32::EPSILON)).abs() < 1e-15);
    }

    #[test]
    fn occlusion_is_right_or_wrong() {
        let errors = Errors::of_any(&[true, true, true, false, false], &[true, false, false, true, false]);
        assert_eq!((errors.count, errors.hits, errors.missed, errors.false_hits), (5, 3, 2, 1));
        assert_eq!((errors.wrong_primitive, errors.deviation), (0, None));
    }

    #[test]
    fn deviations_are_those_of_right_hits_alone() {
        let mut truths = vec![truth(1.0, 3, &[]); 1000];
        let mut hits = vec![hit(1.0, 3); 1000];
        (hits[17].t, hits[17].u) = (1.5, 0.75);
        truths.push(truth(1.0, 4, &[3]));
        hits.push(Hit { v: 0.0, ..hit(1.0, 3) }); // The weights of another triangle say nothing.
        truths.push(truth(1.0, 5, &[]));
        hits.push(hit(100.0, 3));
        let deviation = Errors::of_closest(&truths, &hits).deviation.expect("most are right");
        assert_eq!((deviation.hits, deviation.max_ulps, deviation.p999_ulps), (1001, 1 << 22, 0));
        assert_eq!((deviation.max_relative, deviation.max_weight), (0.5, 0.5));
        hits.fill(Hit::MISS);
        assert_eq!(Errors::of_closest(&truths, &hits).deviation, None);
    }

    #[test]
    fn ulps_are_steps_from_float_to_float() {
        let tiny = f32::from_bits(1);
        for (a, b, steps) in [
            (1.0, 1.0, 0),
            (1.0, 1f32.next_down(), 1),
            (0.0, -0.0, 0),
            (tiny, -tiny, 2),
            (1.0, 2.0, 1 << 23),
            (f32::MAX, f32::INFINITY, 1),
            (f32::NEG_INFINITY, f32::INFINITY, 2 * 0x7f80_0000),
        ] {
            assert_eq!((ulps_between(a, b), ulps_between(b, a)), (steps, steps), "{a} {b}");
        }
    }
}
