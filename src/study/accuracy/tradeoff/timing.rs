//! Rays: how long each mode takes for a kind of them, and what it answers.

use super::participants::Participant;
use crate::geometry::Ray;
use crate::study::bench::engine::{CHUNK, Contender, Results, chunk_of};
use crate::study::bench::race::{Entry, Pace, Speed, race};

/// Chunks that the heats are run on.
const HEAT_CHUNKS: usize = 16;

/// A mode's time with its best kernel, and its answers.
pub struct Timed {
    /// The kernel's name.
    pub kernel: String,
    /// How fast.
    pub speed: Speed,
    /// The answers, in the rays' order.
    pub results: Results,
}

/// Races the modes on one set of rays, each with its quickest kernel: heats on a small part of the set
/// find that kernel, then all modes run in turn on the whole set.
pub fn race_modes(
    participants: &[Participant],
    rays: &[Ray],
    any_hit: bool,
    threads: usize,
    pace: &Pace,
) -> Vec<Timed> {
    let quickest = heats(participants, rays, any_hit, threads, pace.pin);
    // Of each, the copies of the rays that its other kernels have go at once.
    let contenders: Vec<Box<dyn Contender + '_>> = participants
        .iter()
        .zip(&quickest)
        .map(|(p, &kernel)| p.engine.contenders(rays, any_hit).swap_remove(kernel))
        .collect();
    let entries: Vec<Entry> =
        (0..contenders.len()).map(|engine| Entry { engine, qualifies: false }).collect();
    let chunks = rays.len().div_ceil(chunk_of(rays.len()));
    let speeds = race(&contenders, &entries, rays.len(), chunks, threads, pace);
    let results = |contender: &dyn Contender| {
        (0..chunks).for_each(|chunk| contender.trace(chunk));
        contender.results()
    };
    contenders
        .iter()
        .zip(speeds)
        .map(|(contender, speed)| Timed {
            kernel: contender.mode(),
            speed: speed.expect("nobody had to qualify"),
            results: results(&**contender),
        })
        .collect()
}

/// The number of each participant's quickest contender.
fn heats(participants: &[Participant], rays: &[Ray], any_hit: bool, threads: usize, pin: bool) -> Vec<usize> {
    // Whole chunks from all over the set, so that rays that go together stay together.
    let step = rays.len().div_ceil(CHUNK).div_ceil(HEAT_CHUNKS);
    let part: Vec<Ray> = rays.chunks(CHUNK).step_by(step).flatten().copied().collect();
    let (mut contenders, mut entries) = (Vec::new(), Vec::new());
    for (engine, participant) in participants.iter().enumerate() {
        for contender in participant.engine.contenders(&part, any_hit) {
            contenders.push(contender);
            entries.push(Entry { engine, qualifies: true });
        }
    }
    let pace = Pace { rounds: 3, seconds: 0.0, all_modes: false, pin };
    let speeds =
        race(&contenders, &entries, part.len(), part.len().div_ceil(chunk_of(part.len())), threads, &pace);
    let quickest = |engine| {
        let of_engine = entries.iter().zip(&speeds).filter(|(entry, _)| entry.engine == engine);
        let medians = of_engine.map(|(_, speed)| speed.map_or(0.0, |speed| speed.median)).enumerate();
        medians.max_by(|a, b| a.1.total_cmp(&b.1)).map_or(0, |(number, _)| number)
    };
    (0..participants.len()).map(quickest).collect()
}

/// At most `most` of `count` places, evenly spread, in ascending order.
pub fn evenly(count: usize, most: usize) -> Vec<usize> {
    let chosen = count.min(most);
    (0..chosen).map(|i| (i as u128 * count as u128 / chosen as u128) as usize).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kdtree::BuildParams;
    use crate::mesh::generate::shapes;
    use crate::study::accuracy::Judged;
    use crate::study::accuracy::tradeoff::participants;
    use crate::study::rays::RayKind;
    use crate::study::reference::Reference;
    use crate::traverse::Accel;
    use glam::Vec3;

    #[test]
    fn a_choice_is_even() {
        assert_eq!(evenly(10, 4), [0, 2, 5, 7]);
        assert_eq!(evenly(3, 100), [0, 1, 2]);
        assert_eq!(evenly(0, 5), [0; 0]);
        let million = evenly(1 << 20, 1 << 16);
        assert!(million.windows(2).all(|w| w[1] - w[0] == 16));
    }

    #[test]
    fn every_mode_answers_in_the_rays_order() {
        let mesh = shapes::sphere(3);
        let accel = Accel::build(&mesh, &BuildParams::default()).expect("builds");
        let modes = participants::ours(&accel, 0.0);
        // Rays from the left, every third of which passes by. More than a chunk, and not a whole number.
        let rays: Vec<Ray> = (0..CHUNK + 100)
            .map(|i| {
                let y = if i % 3 == 0 { 1.5 } else { 0.001 * (i % 700) as f32 };
                Ray::new(Vec3::new(-3.0, y, 0.01), Vec3::X)
            })
            .collect();
        let pace = Pace { rounds: 3, seconds: 0.0, all_modes: true, pin: false };
        let reference = Reference::new(&mesh);
        for kind in [RayKind::Random, RayKind::Shadow] {
            let judged = Judged::new(&reference, kind, rays.clone());
            let timed = race_modes(&modes, &rays, kind.any_hit(), 2, &pace);
            assert_eq!(timed.len(), 3);
            for timed in &timed {
                let errors = judged.errors(&timed.results);
                assert_eq!((errors.count, errors.missed, errors.false_hits), (rays.len() as u64, 0, 0));
                assert_eq!(errors.hits, rays.len() as u64 - rays.len().div_ceil(3) as u64);
                assert!(timed.speed.median > 0.0 && !timed.kernel.is_empty());
            }
        }
    }
}
