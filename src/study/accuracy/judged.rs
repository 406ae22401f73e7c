//! Rays of one kind with the truth about them, found once, to judge any number of engines by.

use super::Errors;
use crate::geometry::Ray;
use crate::study::bench::Results;
use crate::study::rays::RayKind;
use crate::study::reference::{Reference, Truth};

/// Rays of one kind and what they hit in truth.
#[derive(Clone, Debug)]
pub struct Judged {
    kind: RayKind,
    rays: Vec<Ray>,
    truth: Truths,
}

#[derive(Clone, Debug)]
enum Truths {
    Closest(Vec<Truth>),
    Any(Vec<bool>),
}

impl Judged {
    /// Finds the truth about `rays`, with all threads: the closest hits, or for kinds that ask for
    /// any hit, whether there is one.
    pub fn new(reference: &Reference<'_>, kind: RayKind, rays: Vec<Ray>) -> Self {
        let truth = if kind.any_hit() {
            Truths::Any(reference.any_of(&rays))
        } else {
            Truths::Closest(reference.closest_of(&rays))
        };
        Self { kind, rays, truth }
    }

    /// The rays' kind.
    pub fn kind(&self) -> RayKind {
        self.kind
    }

    /// The rays.
    pub fn rays(&self) -> &[Ray] {
        &self.rays
    }

    /// Counts what is wrong with an engine's answers, which are in the rays' order.
    ///
    /// # Panics
    /// If the answers are not what the rays' kind asks for, or not as many as the rays.
    pub fn errors(&self, answers: &Results) -> Errors {
        match (&self.truth, answers) {
            (Truths::Closest(truths), Results::Closest(hits)) => Errors::of_closest(truths, hits),
            (Truths::Any(truths), Results::Any(occluded)) => Errors::of_any(truths, occluded),
            _ => panic!("closest hits cannot be judged as any hits"),
        }
    }
}
