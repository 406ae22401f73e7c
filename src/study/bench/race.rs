//! A race: all modes of all engines over one set of rays, round after round.

use super::engine::Contender;
use super::schedule::{Crew, with_crew};
use std::time::Instant;

/// The shortest run worth timing, in seconds: smaller sets are traced several times in one run.
const SHORTEST_RUN: f64 = 0.01;
/// How much slower than its engine's best a mode may be in the qualifying round.
const QUALIFYING: f64 = 1.25;
/// Rounds that are run however long they take: fewer have no spread.
const LEAST_ROUNDS: usize = 3;

/// How long to race.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pace {
    /// Rounds at most.
    pub rounds: usize,
    /// Seconds after which no further round begins (three are always run).
    pub seconds: f64,
    /// Keep the modes that fail to qualify.
    pub all_modes: bool,
    /// Pin each worker to a core.
    pub pin: bool,
}

/// A mode as the race sees it.
pub struct Entry {
    /// Modes of the same engine have the same number.
    pub engine: usize,
    /// Whether it may be dropped.
    pub qualifies: bool,
}

/// What a mode reached, in million rays a second.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Speed {
    /// The middle round.
    pub median: f64,
    /// The slowest round.
    pub low: f64,
    /// The fastest round.
    pub high: f64,
    /// How many rounds.
    pub rounds: usize,
}

/// Races `contenders` (each with its entry) over `rays` rays in `chunks` chunks with `threads` workers.
///
/// Every mode runs once to warm up and once to qualify; one that may be dropped and is more than 25 %
/// slower than its engine's best gets `None`. The others then run in turn, A B C A B C, so that whatever
/// disturbs the machine disturbs all of them alike.
pub fn race(
    contenders: &[Box<dyn Contender + '_>],
    entries: &[Entry],
    rays: usize,
    chunks: usize,
    threads: usize,
    pace: &Pace,
) -> Vec<Option<Speed>> {
    with_crew(contenders, chunks, threads, pace.pin, |crew| {
        let trials: Vec<Trial> = (0..contenders.len()).map(|i| Trial::new(crew, i)).collect();
        let seconds: Vec<f64> = trials.iter().map(|t| t.seconds).collect();
        let runs = if pace.all_modes { vec![true; seconds.len()] } else { qualified(&seconds, entries) };
        let mut times = vec![Vec::new(); contenders.len()];
        let start = Instant::now();
        for round in 0..pace.rounds.max(LEAST_ROUNDS) {
            if round >= LEAST_ROUNDS && start.elapsed().as_secs_f64() > pace.seconds {
                break;
            }
            for (i, trial) in trials.iter().enumerate().filter(|&(i, _)| runs[i]) {
                times[i].push(crew.run(i, trial.repeats) / trial.repeats as f64);
            }
        }
        times.into_iter().map(|seconds| Speed::of(rays, seconds)).collect()
    })
}

/// Which modes run on, by their seconds in the qualifying round.
fn qualified(seconds: &[f64], entries: &[Entry]) -> Vec<bool> {
    let best = |engine| {
        let of_engine = seconds.iter().zip(entries).filter(|(_, e)| e.engine == engine);
        of_engine.map(|(&s, _)| s).fold(f64::INFINITY, f64::min)
    };
    let passes = |(&s, e): (&f64, &Entry)| !e.qualifies || s <= QUALIFYING * best(e.engine);
    seconds.iter().zip(entries).map(passes).collect()
}

/// The qualifying run of a mode.
struct Trial {
    /// How often the set is traced in one run.
    repeats: usize,
    /// For the set, once.
    seconds: f64,
}

impl Trial {
    fn new(crew: &Crew, contender: usize) -> Self {
        let cold = crew.run(contender, 1).max(1e-6);
        let repeats = (SHORTEST_RUN / cold).ceil().max(1.0) as usize;
        Self { repeats, seconds: crew.run(contender, repeats) / repeats as f64 }
    }
}

impl Speed {
    /// From the seconds of each round; `None` for none.
    fn of(rays: usize, mut seconds: Vec<f64>) -> Option<Self> {
        seconds.sort_by(f64::total_cmp);
        let (&fastest, &slowest) = (seconds.first()?, seconds.last()?);
        let n = seconds.len();
        let middle = 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]);
        let rate = |s: f64| rays as f64 / s * 1e-6;
        Some(Self { median: rate(middle), low: rate(slowest), high: rate(fastest), rounds: n })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::study::bench::engine::Results;

    #[test]
    fn speeds_are_medians_with_their_extremes() {
        let speed = Speed::of(1_000_000, vec![0.5, 0.1, 0.25]).unwrap();
        assert_eq!(speed, Speed { median: 4.0, low: 2.0, high: 10.0, rounds: 3 });
        assert_eq!(Speed::of(1_000_000, vec![0.1, 0.3]).unwrap().median, 5.0);
        assert_eq!(Speed::of(1, vec![]), None);
    }

    #[test]
    fn modes_far_behind_their_own_engine_are_dropped_if_they_may_be() {
        let entry = |engine, qualifies| Entry { engine, qualifies };
        let seconds = [1.0, 1.25, 1.26, 9.0, 9.5, 0.1, 5.0];
        let entries = [
            entry(0, true),
            entry(0, true),
            entry(0, true),
            entry(1, true),
            entry(1, true),
            entry(2, false),
            entry(2, false),
        ];
        assert_eq!(qualified(&seconds, &entries), [true, true, false, true, true, true, true]);
    }

    struct Idle;

    impl Contender for Idle {
        fn mode(&self) -> String {
            "idle".into()
        }
        fn build_seconds(&self) -> f64 {
            0.0
        }
        fn bytes(&self) -> u64 {
            0
        }
        fn trace(&self, _chunk: usize) {}
        fn results(&self) -> Results {
            Results::Any(Vec::new())
        }
    }

    #[test]
    fn every_mode_gets_its_rounds_and_at_least_three() {
        let contenders: Vec<Box<dyn Contender>> = vec![Box::new(Idle), Box::new(Idle)];
        let entries = [0, 1].map(|engine| Entry { engine, qualifies: true });
        let rounds = |rounds, seconds| {
            let pace = Pace { rounds, seconds, all_modes: false, pin: false };
            let speeds = race(&contenders, &entries, 1000, 1, 1, &pace);
            speeds.into_iter().map(|s| s.unwrap().rounds).collect::<Vec<_>>()
        };
        assert_eq!(rounds(5, f64::INFINITY), [5, 5]);
        assert_eq!(rounds(9, 0.0), [3, 3]);
    }
}
