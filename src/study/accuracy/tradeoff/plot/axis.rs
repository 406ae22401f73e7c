//! Axes: values to places from 0 to 1, and where the ticks stand.

/// An axis of times.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Axis {
    low: f64,
    high: f64,
    is_logarithmic: bool,
}

impl Axis {
    /// From 0 to a little more than the greatest value.
    pub fn linear(values: impl Iterator<Item = f64>) -> Self {
        let high = values.fold(0.0, f64::max);
        Self { low: 0.0, high: if high > 0.0 { high * 1.12 } else { 1.0 }, is_logarithmic: false }
    }

    /// From somewhat less than the least value to somewhat more than the greatest.
    pub fn logarithmic(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values
            .filter(|&v| v > 0.0)
            .fold((f64::INFINITY, 0.0f64), |(low, high), v| (low.min(v), high.max(v)));
        let (low, high) = if high > 0.0 { (low, high) } else { (1.0, 1.0) };
        Self { low: low / 1.5, high: high * 1.8, is_logarithmic: true }
    }

    /// Where a value stands: 0 at the low end, 1 at the high one.
    pub fn place(&self, value: f64) -> f64 {
        if self.is_logarithmic {
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        }
    }

    /// Round values on the axis, four to ten of them.
    pub fn ticks(&self) -> Vec<f64> {
        if self.is_logarithmic {
            return self.round_logarithms();
        }
        let step = round_up(self.high / 6.0);
        (0..).map(|i| f64::from(i) * step).take_while(|&v| v <= self.high).collect()
    }

    fn round_logarithms(&self) -> Vec<f64> {
        let decades = (self.low.log10().floor() as i32)..=(self.high.log10().ceil() as i32);
        let within = |steps: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|d| steps.iter().map(move |step| step * 10f64.powi(d)));
            all.filter(|&v| v >= self.low && v <= self.high).collect()
        };
        let all = [&[1.0, 2.0, 5.0][..], &[1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0]].map(within);
        let [coarse, fine] = all;
        if coarse.len() >= 4 { coarse } else { fine }
    }
}

/// 1, 2 or 5 times a power of ten, at least `x`.
fn round_up(x: f64) -> f64 {
    let decade = 10f64.powf(x.log10().floor());
    let steps = [1.0, 2.0, 5.0, 10.0].map(|step| step * decade);
    // A hair less will do, so that rounding does not double a step.
    steps.into_iter().find(|&step| step >= x * (1.0 - 1e-9)).unwrap_or(10.0 * decade)
}

/// A logarithmic axis of errors, with a place of its own for none.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ErrorAxis {
    /// Powers of ten at the ends.
    low: i32,
    high: i32,
    /// Whether there is a place for none below them.
    has_zero: bool,
}

/// The part of the axis that belongs to the place for none.
const ZERO_BAND: f64 = 0.36;

impl ErrorAxis {
    /// An axis for errors of which `least` is the smallest that can be told from none; infinite where any
    /// can.
    pub fn new(errors: impl Iterator<Item = f64>, least: f64) -> Self {
        let (mut low, mut high, mut has_zero) = (least, 0.0f64, least.is_finite());
        for error in errors {
            if error > 0.0 {
                (low, high) = (low.min(error), high.max(error));
            } else {
                has_zero = true;
            }
        }
        let low = if low.is_finite() { low.log10().floor() as i32 } else { 0 };
        let high = if high > 0.0 { high.log10().ceil() as i32 } else { low };
        Self { low, high: high.max(low + 1), has_zero }
    }

    /// Where an error stands: 0 at the low end, 1 at the high one.
    pub fn place(&self, error: f64) -> f64 {
        if error <= 0.0 {
            return ZERO_BAND / 2.0;
        }
        let start = self.zero_band();
        let part = (error.log10() - f64::from(self.low)) / f64::from(self.high - self.low);
        start + part * (0.96 - start)
    }

    /// How much of the axis, from its low end, stands for none.
    pub fn zero_band(&self) -> f64 {
        if self.has_zero { ZERO_BAND } else { 0.0 }
    }

    /// Powers of ten, and 0 where it has a place.
    pub fn ticks(&self) -> Vec<f64> {
        let zero = self.has_zero.then_some(0.0);
        zero.into_iter().chain((self.low..=self.high).map(|power| 10f64.powi(power))).collect()
    }

    /// The values between the powers of ten.
    pub fn minor_ticks(&self) -> Vec<f64> {
        (self.low..self.high)
            .flat_map(|power| (2..10).map(move |i| f64::from(i) * 10f64.powi(power)))
            .collect()
    }
}

/// A tick's value as text.
pub fn tick(value: f64) -> String {
    if value == 0.0 {
        return "0".into();
    }
    if (1e-4..1e6).contains(&value) {
        // Ticks have two digits at most; what division left beyond is cut off.
        let digits = (1 - value.log10().floor() as i32).max(0) as usize;
        let text = format!("{value:.digits$}");
        return if text.contains('.') {
            text.trim_end_matches('0').trim_end_matches('.').into()
        } else {
            text
        };
    }
    format!("{value:.0e}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn linear_axes_begin_at_zero_with_round_ticks() {
        let axis = Axis::linear([90.0, 250.0].into_iter());
        assert_eq!((axis.place(0.0), axis.place(280.0)), (0.0, 1.0));
        assert_eq!(axis.ticks(), [0.0, 50.0, 100.0, 150.0, 200.0, 250.0]);
        assert_eq!(Axis::linear(std::iter::empty()).place(0.5), 0.5);
    }

    #[test]
    fn logarithmic_axes_have_enough_ticks() {
        for (low, high) in [(3.0, 4.0), (2.0, 90.0), (0.5, 2000.0), (7.0, 7.0)] {
            let axis = Axis::logarithmic([low, high].into_iter());
            let ticks = axis.ticks();
            assert!((3..=14).contains(&ticks.len()), "{low} to {high}: {ticks:?}");
            assert!(ticks.iter().all(|&v| (0.0..=1.0).contains(&axis.place(v))));
            assert!(axis.place(low) > 0.0 && axis.place(high) < 1.0);
        }
    }

    #[test]
    fn no_error_has_a_place_below_every_error() {
        let axis = ErrorAxis::new([0.0, 12.0, 950.0].into_iter(), 15.3);
        assert_eq!(axis.ticks(), [0.0, 10.0, 100.0, 1000.0]);
        assert!(axis.place(0.0) < axis.zero_band() && axis.zero_band() <= axis.place(10.0));
        assert!(axis.place(12.0) < axis.place(950.0) && axis.place(1000.0) < 1.0);
        let only_none = ErrorAxis::new([0.0, 0.0].into_iter(), 15.3);
        assert_eq!(only_none.ticks(), [0.0, 10.0, 100.0]);
    }

    #[test]
    fn without_zeros_there_is_no_place_for_them() {
        let axis = ErrorAxis::new([0.004, 0.03].into_iter(), f64::INFINITY);
        assert_eq!((axis.zero_band(), axis.ticks().len()), (0.0, 3));
    }

    #[test]
    fn ticks_read_well() {
        assert_eq!(
            [0.0, 0.001, 0.25, 1.0, 1.5, 20.0, 150.0, 100_000.0, 1e7, 1e-5].map(tick),
            ["0", "0.001", "0.25", "1", "1.5", "20", "150", "100000", "1e7", "1e-5"]
        );
    }
}
