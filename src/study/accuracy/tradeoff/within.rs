//! The most accurate setting that fits a frame time.
//!
//! Settings are ranked by the picture's RMSE in two significant digits; where these are equal, the stricter
//! mode is the more accurate one, and of one mode the quicker setting stands first.
//!
//! The first of the ranking whose median fits is tried again by itself, frame after frame, since a race
//! leaves the caches full of other modes' trees. If it does not fit there, the next one is tried.

use super::Options;
use super::frames::{Setting, Times, View, in_a_row};
use super::report::{Choice, FrameRow, Within};
use crate::error::Result;

/// Picks for a budget in seconds.
pub fn pick(
    budget: f64,
    frames: &[FrameRow],
    view: &View,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<Within> {
    choose(budget, frames, &mut |setting| {
        progress(&format!("trying {}, {} samples per pixel", setting.accuracy, setting.samples));
        in_a_row(setting, view, options)
    })
}

/// The same, with `measure` giving the frame times of a setting by itself.
fn choose(
    budget: f64,
    frames: &[FrameRow],
    measure: &mut dyn FnMut(Setting) -> Result<Times>,
) -> Result<Within> {
    let mut ranked: Vec<&FrameRow> = frames.iter().collect();
    ranked.sort_by(|a, b| {
        let by_error = a.error.two_digits().total_cmp(&b.error.two_digits());
        by_error.then(b.accuracy.cmp(&a.accuracy)).then(a.ms.total_cmp(&b.ms))
    });
    let budget_ms = budget * 1e3;
    let mut next = None;
    for row in &ranked {
        if row.ms <= budget_ms {
            let picked = Choice::measured(row, measure(row.setting())?);
            if picked.ms <= budget_ms {
                return Ok(Within { budget_ms, fits: true, picked, next: next.map(Choice::raced) });
            }
        }
        next = Some(row);
    }
    let quickest = ranked.iter().min_by(|a, b| a.ms.total_cmp(&b.ms)).expect("there is a setting");
    let picked = Choice::measured(quickest, measure(quickest.setting())?);
    Ok(Within { budget_ms, fits: false, picked, next: None })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Accuracy::{self, Exact, Fast, Watertight};
    use crate::render::{FrameStats, RayCount, Size};
    use crate::simd::Isa;
    use crate::study::accuracy::tradeoff::PictureError;

    /// Settings with their milliseconds and RMSE.
    fn frames(rows: &[(Accuracy, u32, f64, f64)]) -> Vec<FrameRow> {
        let none = RayCount::default();
        let stats = FrameStats {
            camera: none,
            shadow: none,
            total: none,
            seconds: 0.0,
            tiles: 1,
            tile_p50: 0.0,
            tile_p99: 0.0,
            threads: 1,
            pinned: 0,
            samples: 1.0,
            costs: crate::render::EffectCosts::default(),
        };
        let row = |&(accuracy, samples, ms, rmse): &(Accuracy, u32, f64, f64)| {
            let times = Times::of(vec![ms * 1e-3]);
            let error = PictureError { rmse, psnr: None, ssimulacra2: 50.0 };
            let size = Size { width: 8, height: 8 };
            FrameRow::new(
                Setting { accuracy, samples, limits: None },
                Isa::Portable,
                size,
                &stats,
                times,
                error,
            )
        };
        rows.iter().map(row).collect()
    }

    fn rows() -> Vec<FrameRow> {
        frames(&[
            (Fast, 1, 8.0, 0.0401),
            (Watertight, 1, 10.0, 0.0400),
            (Exact, 1, 20.0, 0.0402),
            (Fast, 4, 32.0, 0.01001),
            (Watertight, 4, 40.0, 0.01004),
            (Exact, 4, 80.0, 0.01002),
        ])
    }

    /// Picks, with frames by themselves taking `factor` times as long as in the race.
    fn pick(budget_ms: f64, factor: f64) -> (bool, Setting, Option<Setting>) {
        let rows = rows();
        let mut measure = |setting: Setting| {
            let row = rows.iter().find(|row| row.setting() == setting).expect("a setting of the race");
            Ok(Times::of(vec![row.ms * 1e-3 * factor; 3]))
        };
        let within = choose(budget_ms * 1e-3, &rows, &mut measure).expect("measured");
        let setting = |choice: &Choice| Setting {
            accuracy: choice.accuracy,
            samples: choice.samples,
            limits: choice.limits,
        };
        assert!((within.budget_ms - budget_ms).abs() < 1e-9);
        (within.fits, setting(&within.picked), within.next.as_ref().map(setting))
    }

    fn setting(accuracy: Accuracy, samples: u32) -> Setting {
        Setting { accuracy, samples, limits: None }
    }

    #[test]
    fn the_most_accurate_that_fits_is_picked() {
        assert_eq!(pick(100.0, 1.0), (true, setting(Exact, 4), None));
        assert_eq!(pick(50.0, 1.0), (true, setting(Watertight, 4), Some(setting(Exact, 4))));
        assert_eq!(pick(33.0, 1.0), (true, setting(Fast, 4), Some(setting(Watertight, 4))));
        assert_eq!(pick(25.0, 1.0), (true, setting(Exact, 1), Some(setting(Fast, 4))));
        assert_eq!(pick(9.0, 1.0), (true, setting(Fast, 1), Some(setting(Watertight, 1))));
    }

    #[test]
    fn what_fits_only_in_the_race_is_not_picked() {
        // By itself, watertight takes 48 ms and fast 38.4.
        assert_eq!(pick(45.0, 1.2), (true, setting(Fast, 4), Some(setting(Watertight, 4))));
    }

    #[test]
    fn where_nothing_fits_the_quickest_is_named() {
        assert_eq!(pick(5.0, 1.0), (false, setting(Fast, 1), None));
    }
}
