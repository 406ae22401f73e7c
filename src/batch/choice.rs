//! Which kernel suits a batch: the one that is quickest with a sample of its rays.
//!
//! Measured, not derived from the rays: how far packets pay depends on the model and on the
//! instruction set as much as on the rays' coherence, and a wrong guess costs a factor of two to five.

use crate::geometry::Ray;
use crate::traverse::Kernel;
use std::time::Duration;

/// The sample: so many runs of rays that follow one another, evenly spread.
const RUNS: usize = 8;

/// Rays in a run: the largest lot that a kernel takes.
const RUN: usize = 256;

/// Batches below this are traced by [`FOR_FEW`]: the sample would cost more than it saves.
const FEW: usize = 32 * RUNS * RUN;

/// What is good with any rays.
const FOR_FEW: Kernel = Kernel::Packet8;

/// How often each kernel traces the sample. The quicker time counts: the first also fetches the
/// model's data.
const ROUNDS: usize = 2;

/// The kernel whose `call` takes the least time for a sample of `rays`, by what it says that it took.
pub(super) fn quickest<A: Copy>(
    rays: &[Ray],
    none: A,
    call: &impl Fn(Kernel, &[Ray], &mut [A]) -> Duration,
) -> Kernel {
    if rays.len() < FEW {
        return FOR_FEW;
    }
    let mut answers = [none; RUN];
    let mut times = Kernel::ALL.map(|kernel| (Duration::MAX, kernel));
    for _ in 0..ROUNDS {
        for (best, kernel) in &mut times {
            // From the beginning of a lot, as the whole is traced.
            let first = |run: usize| rays.len() / RUNS * run / RUN * RUN;
            let time = (0..RUNS).map(|run| call(*kernel, &rays[first(run)..][..RUN], &mut answers)).sum();
            *best = (*best).min(time);
        }
    }
    let (_, kernel) = times.into_iter().min_by_key(|(time, _)| *time).expect("there are kernels");
    kernel
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_quickest_is_chosen() {
        let rays = vec![Ray::new(glam::Vec3::ZERO, glam::Vec3::X); FEW];
        for quick in Kernel::ALL {
            let call = |kernel, rays: &[Ray], answers: &mut [bool]| {
                assert_eq!((rays.len(), answers.len()), (RUN, RUN));
                Duration::from_millis(if kernel == quick { 1 } else { 2 })
            };
            assert_eq!(quickest(&rays, false, &call), quick);
        }
        let never = |_, _: &[Ray], _: &mut [bool]| panic!("few rays are not sampled");
        assert_eq!(quickest(&rays[1..], false, &never), FOR_FEW);
    }
}
