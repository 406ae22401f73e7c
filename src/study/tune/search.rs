//! Coordinate descent along ladders of values, and what each setting is worth around the best.
//!
//! A setting at a time is moved a step up or down its ladder for as long as that is better; when a whole
//! round over the settings has brought nothing, the best has been found as far as single steps lead. A point
//! that has lost once is not tried again: it lost against something that is no better than the best so far.

use super::space::Setting;
use crate::profile::Profile;

/// What a candidate turned out to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verdict {
    /// Better than the best so far, beyond what noise explains.
    Better,
    /// Not better.
    NotBetter,
    /// Nobody may measure any more.
    Over,
}

/// Who measures candidates against the best so far.
pub trait Judge {
    /// Measures a candidate that differs from the best by one setting. What is better becomes the best.
    fn judge(&mut self, setting: &'static Setting, candidate: &Profile) -> Verdict;
}

/// Looks for the best profile from `start` on.
pub fn descend(settings: &'static [Setting], start: Profile, judge: &mut impl Judge) -> Profile {
    let mut best = start;
    let mut tried = vec![best.clone()];
    loop {
        let mut found = false;
        for setting in settings {
            for up in [true, false] {
                match climb(setting, up, &mut best, &mut tried, judge) {
                    Climb::Over => return best,
                    Climb::Moved => {
                        found = true;
                        break;
                    }
                    Climb::Stayed => {}
                }
            }
        }
        if !found {
            return best;
        }
    }
}

enum Climb {
    Moved,
    Stayed,
    Over,
}

/// Moves one setting one way, for as long as that is better.
fn climb(
    setting: &'static Setting,
    up: bool,
    best: &mut Profile,
    tried: &mut Vec<Profile>,
    judge: &mut impl Judge,
) -> Climb {
    let mut moved = Climb::Stayed;
    while let Some(value) = setting.next(setting.value(best), up) {
        let candidate = setting.with(best, value);
        if tried.contains(&candidate) {
            break;
        }
        tried.push(candidate.clone());
        match judge.judge(setting, &candidate) {
            Verdict::Better => (*best, moved) = (candidate, Climb::Moved),
            Verdict::NotBetter => break,
            Verdict::Over => return Climb::Over,
        }
    }
    moved
}

/// The candidates that tell what each setting is worth around `best`: nearest values first, so that what
/// there is time for is worth the most.
pub fn around(settings: &'static [Setting], best: &Profile) -> Vec<(&'static Setting, Profile)> {
    let mut steps: Vec<(usize, &'static Setting, Profile)> = Vec::new();
    for setting in settings {
        for up in [true, false] {
            let mut value = setting.value(best);
            for step in 0.. {
                let Some(next) = setting.next(value, up) else { break };
                value = next;
                steps.push((step, setting, setting.with(best, value)));
            }
        }
    }
    steps.sort_by_key(|(step, ..)| *step);
    steps.into_iter().map(|(_, setting, profile)| (setting, profile)).collect()
}

#[cfg(test)]
mod tests {
    use super::super::space::SETTINGS;
    use super::*;

    /// Costs that are known, with noise that grows no better than `noise`.
    struct Known {
        best: f64,
        asked: usize,
        most: usize,
        cost: fn(&Profile) -> f64,
    }

    impl Judge for Known {
        fn judge(&mut self, _: &'static Setting, candidate: &Profile) -> Verdict {
            self.asked += 1;
            if self.asked > self.most {
                return Verdict::Over;
            }
            let cost = (self.cost)(candidate);
            if cost < self.best {
                self.best = cost;
                Verdict::Better
            } else {
                Verdict::NotBetter
            }
        }
    }

    /// Least at a traversal cost of 11, pages of 32 and tiles of 128.
    fn valley(p: &Profile) -> f64 {
        let away = |x: f64, best: f64| (x / best).ln().powi(2);
        away(f64::from(p.build.traversal_cost), 11.0)
            + away(p.build.page as f64, 32.0)
            + away(f64::from(p.render.tile), 128.0)
    }

    #[test]
    fn the_bottom_of_a_valley_is_found_without_a_full_grid() {
        let start = Profile::default();
        let mut judge = Known { best: valley(&start), asked: 0, most: usize::MAX, cost: valley };
        let best = descend(&SETTINGS, start, &mut judge);
        assert_eq!((best.build.traversal_cost, best.build.page, best.render.tile), (11.0, 32, 128));
        let grid: usize = SETTINGS.iter().map(|setting| setting.ladder.len()).product();
        assert!(judge.asked < 60 && judge.asked < grid / 1000, "{} of {grid}", judge.asked);
    }

    #[test]
    fn nothing_is_tried_once_it_is_over() {
        let start = Profile::default();
        let mut judge = Known { best: valley(&start), asked: 0, most: 2, cost: valley };
        let best = descend(&SETTINGS, start, &mut judge);
        assert_eq!((best.build.traversal_cost, judge.asked), (8.0, 3));
    }

    #[test]
    fn what_lies_around_differs_by_one_setting_nearest_first() {
        let best = Profile::default();
        let around = around(&SETTINGS, &best);
        let ladders: usize = SETTINGS.iter().map(|setting| setting.ladder.len() - 1).sum();
        assert_eq!(around.len(), ladders, "the defaults are on their ladders");
        let (first, _) = around.split_at(SETTINGS.len());
        for (setting, profile) in first {
            let value = setting.value(profile);
            let steps = [true, false].map(|up| setting.next(setting.value(&best), up));
            assert!(steps.contains(&Some(value)), "{} = {value}", setting.key);
        }
    }
}
