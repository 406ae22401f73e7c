//! What is tuned: settings, and the values that each may take.

use crate::profile::Profile;
use crate::traverse::Kernel;

/// A setting of a profile, and a ladder of values for it.
#[derive(Clone, Copy, Debug)]
pub struct Setting {
    /// The key, as a profile has it.
    pub key: &'static str,
    /// Values worth trying, ascending.
    pub ladder: &'static [f64],
    get: fn(&Profile) -> f64,
    set: fn(&mut Profile, f64),
}

const fn of_build(
    key: &'static str,
    ladder: &'static [f64],
    get: fn(&Profile) -> f64,
    set: fn(&mut Profile, f64),
) -> Setting {
    Setting { key, ladder, get, set }
}

/// All settings, those that usually matter most first.
pub const SETTINGS: [Setting; 9] = [
    of_build(
        "build.traversal_cost",
        &[1.5, 2.0, 3.0, 4.0, 5.0, 6.5, 8.0, 11.0, 15.0],
        |p| f64::from(p.build.traversal_cost),
        |p, x| p.build.traversal_cost = x as f32,
    ),
    Setting {
        key: "render.packet",
        ladder: &[1.0, 4.0, 8.0, 16.0, 64.0, 256.0, 1024.0, 4096.0],
        get: |p| p.render.packet.width() as f64,
        set: |p, x| p.render.packet = Kernel::of_width(x as usize).unwrap_or(p.render.packet),
    },
    of_build(
        "build.page",
        &[24.0, 32.0, 48.0, 64.0, 96.0, 128.0, 192.0],
        |p| p.build.page as f64,
        |p, x| p.build.page = x as usize,
    ),
    Setting {
        key: "render.tile",
        ladder: &[16.0, 32.0, 64.0, 128.0],
        get: |p| f64::from(p.render.tile),
        set: |p, x| p.render.tile = x as u32,
    },
    of_build(
        "build.min_leaf",
        &[1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0],
        |p| p.build.min_leaf as f64,
        |p, x| p.build.min_leaf = x as usize,
    ),
    of_build(
        "build.empty_bonus",
        &[0.0, 0.1, 0.2, 0.3, 0.5],
        |p| f64::from(p.build.empty_bonus),
        |p, x| p.build.empty_bonus = x as f32,
    ),
    of_build(
        "build.bad_splits",
        &[0.0, 1.0, 2.0, 3.0],
        |p| f64::from(p.build.bad_splits),
        |p, x| p.build.bad_splits = x as u32,
    ),
    of_build(
        "build.exact_below",
        &[16.0, 32.0, 64.0, 128.0, 256.0],
        |p| p.build.exact_below as f64,
        |p, x| p.build.exact_below = x as usize,
    ),
    of_build(
        "build.bins",
        &[16.0, 32.0, 64.0, 128.0],
        |p| p.build.bins as f64,
        |p, x| p.build.bins = x as usize,
    ),
];

impl Setting {
    /// The value in a profile.
    pub fn value(&self, profile: &Profile) -> f64 {
        (self.get)(profile)
    }

    /// A profile with another value.
    pub fn with(&self, profile: &Profile, value: f64) -> Profile {
        let mut profile = profile.clone();
        (self.set)(&mut profile, value);
        profile
    }

    /// The ladder's next value above a value, or below it.
    pub fn next(&self, value: f64, up: bool) -> Option<f64> {
        let near = |x: f64| (x - value).abs() <= 1e-4 * value.abs();
        let mut others = self.ladder.iter().copied().filter(|&x| !near(x));
        if up { others.find(|&x| x > value) } else { others.rfind(|&x| x < value) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_value_can_be_set_and_makes_sense() {
        for setting in &SETTINGS {
            assert!(setting.ladder.is_sorted_by(|a, b| a < b), "{}", setting.key);
            let of_build = setting.key.starts_with("build.");
            for &value in setting.ladder {
                let profile = setting.with(&Profile::default(), value);
                profile.check().unwrap_or_else(|error| panic!("{} = {value}: {error}", setting.key));
                assert!((setting.value(&profile) - value).abs() < 1e-6, "{} = {value}", setting.key);
                let changed = profile.build != Profile::default().build;
                assert!(of_build || !changed, "{}", setting.key);
            }
        }
    }

    #[test]
    fn ladders_are_climbed_from_between_their_steps() {
        let setting = &SETTINGS[0];
        assert_eq!(setting.next(5.0, true), Some(6.5));
        assert_eq!(setting.next(5.0, false), Some(4.0));
        assert_eq!(setting.next(5.5, false), Some(5.0));
        assert_eq!(setting.next(15.0, true), None);
        assert_eq!(setting.next(1.0, false), None);
    }
}
