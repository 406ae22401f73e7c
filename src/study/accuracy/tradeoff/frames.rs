//! Frames: how long each mode takes with each number of samples, and how far its picture is off.

use super::Options;
use super::pareto;
use super::picture::Judge;
use super::report::{FrameRow, ReferencePicture};
use crate::error::Result;
use crate::geometry::Accuracy;
use crate::mesh::Mesh;
use crate::render::{Appearance, Limits, Renderer};
use crate::scene::{Camera, Lighting};
use crate::study::bench::Pace;
use crate::traverse::Accel;
use std::time::Instant;

/// Rounds that are run however long they take.
const LEAST_ROUNDS: usize = 3;

/// What is rendered.
pub struct View<'a> {
    /// The tree; its accuracy does not matter.
    pub accel: &'a Accel,
    /// What it was built from.
    pub mesh: &'a Mesh,
    /// The camera.
    pub camera: &'a Camera,
    /// The light, the same for every mode.
    pub lighting: &'a Lighting,
    /// The effects that the scene calls for, if any.
    pub appearance: Option<&'a Appearance>,
}

/// What can be chosen of a picture's accuracy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setting {
    /// The mode.
    pub accuracy: Accuracy,
    /// Samples per pixel.
    pub samples: u32,
    /// How far light is followed; `None` where no effect asks for it.
    pub limits: Option<Limits>,
}

impl Setting {
    /// What `raypack render` does unless told otherwise.
    pub fn is_default(self) -> bool {
        self.accuracy == Accuracy::default()
            && self.samples == 1
            && self.limits.is_none_or(|limits| limits == Limits::default())
    }
}

/// Seconds of some frames.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Times {
    /// The middle one.
    pub median: f64,
    /// The quickest.
    pub low: f64,
    /// The slowest.
    pub high: f64,
    /// How many.
    pub frames: usize,
}

impl Times {
    /// # Panics
    /// If there are none.
    pub fn of(mut seconds: Vec<f64>) -> Self {
        seconds.sort_by(f64::total_cmp);
        let n = seconds.len();
        let median = 0.5 * (seconds[(n - 1) / 2] + seconds[n / 2]);
        Self { median, low: seconds[0], high: seconds[n - 1], frames: n }
    }
}

/// Renders the reference, then races all settings: every one renders a frame to warm up, whose picture is
/// compared with the reference; then they take turns, a frame each, round after round.
pub fn race(
    view: &View,
    options: &Options,
    progress: &mut dyn FnMut(&str),
) -> Result<(ReferencePicture, Vec<FrameRow>)> {
    let accels = Accuracy::ALL.map(|accuracy| view.accel.clone().with_accuracy(accuracy));
    let accel = |accuracy: Accuracy| &accels[accuracy as usize];

    let samples = options.reference_samples;
    progress(&format!("rendering the reference picture, exact, {samples} samples per pixel"));
    let start = Instant::now();
    let limits = view.appearance.map(|_| options.most());
    let setting = Setting { accuracy: Accuracy::Exact, samples, limits };
    let renderer = renderer_of(&setting, accel(Accuracy::Exact), view, options)?;
    let judge = Judge::new(renderer.frame(view.camera, view.lighting).0);
    let seconds = start.elapsed().as_secs_f64();
    let reference = ReferencePicture { accuracy: Accuracy::Exact, samples, limits, seconds };

    progress("rendering frames in every mode");
    let limits: Vec<Option<Limits>> = match view.appearance {
        Some(_) => options.limits.iter().copied().map(Some).collect(),
        None => vec![None],
    };
    let settings: Vec<Setting> = options
        .samples
        .iter()
        .flat_map(|&samples| limits.iter().map(move |&limits| (samples, limits)))
        .flat_map(|(samples, limits)| {
            Accuracy::ALL.into_iter().map(move |accuracy| Setting { accuracy, samples, limits })
        })
        .collect();
    let renderers: Vec<Renderer> = settings
        .iter()
        .map(|setting| renderer_of(setting, accel(setting.accuracy), view, options))
        .collect::<Result<_>>()?;
    let warm: Vec<_> = renderers
        .iter()
        .map(|renderer| {
            let (frame, stats) = renderer.frame(view.camera, view.lighting);
            (judge.error(&frame), stats)
        })
        .collect();
    let seconds = take_turns(&renderers, view, &options.pace);

    let mut rows: Vec<FrameRow> = settings
        .into_iter()
        .zip(warm)
        .zip(seconds)
        .map(|((setting, (error, stats)), seconds)| {
            FrameRow::new(setting, view.accel.isa(), options.size, &stats, Times::of(seconds), error)
        })
        .collect();
    let points: Vec<(f64, f64)> = rows.iter().map(|row| (row.ms, row.error.two_digits())).collect();
    for (row, pareto) in rows.iter_mut().zip(pareto::front(&points)) {
        row.pareto = pareto;
    }
    Ok((reference, rows))
}

/// What renders in a setting; `accel` has its accuracy.
fn renderer_of<'a>(
    setting: &Setting,
    accel: &'a Accel,
    view: &View<'a>,
    options: &Options,
) -> Result<Renderer<'a>> {
    let renderer = Renderer::new(accel, view.mesh, options.settings(setting.samples))?;
    match (view.appearance, setting.limits) {
        (Some(appearance), Some(limits)) => renderer.with_appearance(appearance)?.with_limits(limits),
        _ => Ok(renderer),
    }
}

/// The seconds of every renderer's frames, at least three each.
fn take_turns(renderers: &[Renderer], view: &View, pace: &Pace) -> Vec<Vec<f64>> {
    let mut seconds = vec![Vec::new(); renderers.len()];
    let start = Instant::now();
    for round in 0..pace.rounds.max(LEAST_ROUNDS) {
        if round >= LEAST_ROUNDS && start.elapsed().as_secs_f64() > pace.seconds {
            break;
        }
        for (renderer, seconds) in renderers.iter().zip(&mut seconds) {
            seconds.push(renderer.frame(view.camera, view.lighting).1.seconds);
        }
    }
    seconds
}

/// Frames of one setting, one after the other as `raypack render` makes them.
pub fn in_a_row(setting: Setting, view: &View, options: &Options) -> Result<Times> {
    let accel = view.accel.clone().with_accuracy(setting.accuracy);
    let renderer = renderer_of(&setting, &accel, view, options)?;
    renderer.frame(view.camera, view.lighting);
    let [seconds] = <[_; 1]>::try_from(take_turns(&[renderer], view, &options.pace)).expect("one renderer");
    Ok(Times::of(seconds))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_medians_with_their_extremes() {
        let times = Times::of(vec![0.5, 0.1, 0.25]);
        assert_eq!(times, Times { median: 0.25, low: 0.1, high: 0.5, frames: 3 });
        assert_eq!(Times::of(vec![1.0, 2.0]).median, 1.5);
    }

    #[test]
    fn modes_stand_in_their_order() {
        // `race` finds a mode's tree by its number.
        for (number, accuracy) in Accuracy::ALL.into_iter().enumerate() {
            assert_eq!(accuracy as usize, number);
        }
    }
}
